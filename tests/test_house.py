"""The house as a newcomer meets it: short bodies, effects known by their own files alone."""

import ast
from pathlib import Path

import thermal_robot
from thermal_robot.effects import RANDOM, library

ROOT = Path(thermal_robot.__file__).parent
MODULES = sorted(p for p in ROOT.rglob("*.py") if p.name != "__init__.py")
LONGEST_BODY = 40
KNOWING = {"effects", "blind", "paper"}
"""Rooms that may know an effect by name: its own, the trial that withholds it, the paper's."""
FRAMES = {"campaign", "model_file.py", "robot.py", "cli.py"}
"""Rooms for which ``tool_frame`` and ``base_frame`` are frames, not effects."""


def test_no_body_is_long():
    for path in MODULES:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
                body = node.body[1:] if ast.get_docstring(node) else node.body
                lines = body[-1].end_lineno - body[0].lineno + 1 if body else 0
                assert lines <= LONGEST_BODY, f"{path}: {node.name} has {lines} lines"


def test_an_effect_is_known_by_its_own_file_alone():
    for path in MODULES:
        room = path.relative_to(ROOT).parts[0]
        if room in KNOWING:
            continue
        names = {*library(), *RANDOM} - ({"base_frame", "tool_frame"} if room in FRAMES else set())
        nodes = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        said = {n.value for n in nodes if isinstance(n, ast.Constant) and isinstance(n.value, str)}
        assert not said & names, path
