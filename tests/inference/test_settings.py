"""Every number that was chosen has a name and a reason, once; none hides in a function."""

import ast
from collections import Counter
from importlib import import_module
from pathlib import Path

import numpy as np

import thermal_robot

ROOT = Path(thermal_robot.__file__).parent
PLAIN = {0.0, 1.0, 2.0, 3.0, 6.0, 0.5}
"""What arithmetic is made of: halves, squares, the three axes of a place, the six of a pose."""
ROUNDING = 1e-6
"""Below, a number only keeps rounding away."""
JUDGING = sorted([*(ROOT / "inference").glob("*.py"), *(ROOT / "diagnosis").glob("*.py")])


def constants(tree):
    """Yield (name, the statement after it) of each constant of a module."""
    for statement, after in zip(tree.body, [*tree.body[1:], None], strict=True):
        targets = statement.targets if isinstance(statement, ast.Assign) else []
        targets = [statement.target] if isinstance(statement, ast.AnnAssign) else targets
        for target in targets:
            for name in target.elts if isinstance(target, ast.Tuple) else [target]:
                if isinstance(name, ast.Name) and name.id.isupper():
                    yield name.id, after


def chosen(tree):
    """Yield (line, value) of each number with a fraction that a function of a module is written with."""
    for function in ast.walk(tree):
        if isinstance(function, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)):
            for node in ast.walk(function):
                if isinstance(node, ast.Constant) and isinstance(node.value, float):
                    size = abs(node.value)
                    if size not in PLAIN and size >= ROUNDING:
                        yield node.lineno, node.value


def of(path):
    return ast.parse(path.read_text(encoding="utf-8"))


FILES = {name: of(ROOT / name / "settings.py") for name in ("inference", "diagnosis")}


OWN = [(package, name, after) for package, tree in FILES.items() for name, after in constants(tree)]


def test_every_setting_is_defined_once_with_its_reason_behind_it():
    bare = []
    for _, name, after in OWN:
        told = isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant)
        if not (told and isinstance(after.value.value, str) and len(after.value.value.split()) >= 4):
            bare.append(name)
    assert bare == []
    assert len(OWN) > 100
    names = Counter(name for _, name, _ in OWN)
    assert [name for name, times in names.items() if times > 1] == []  # none is defined twice


def test_every_setting_is_used_and_is_a_number_an_array_of_numbers_or_words():
    text = "\n".join(path.read_text(encoding="utf-8") for path in ROOT.rglob("*.py") if path.name != "settings.py")
    assert [name for _, name, _ in OWN if f"settings.{name}" not in text] == []
    for package, name, _ in OWN:
        value = getattr(import_module(f"thermal_robot.{package}.settings"), name)
        words = isinstance(value, tuple) and all(isinstance(word, str) and word for word in value)
        assert words or np.isfinite(np.asarray(value, dtype=float)).all(), name


def test_no_chosen_number_hides_in_a_function():
    found = {path.name: list(chosen(of(path))) for path in JUDGING}
    assert {name: own for name, own in found.items() if own} == {}


def test_the_search_for_hidden_numbers_finds_one():
    tree = ast.parse("A = 0.3\ndef f(x):\n    g = lambda y: 0.7 * y\n    return 2.0 * x + 1.0e-9 > 0.25 + 0.5 * g(x)\n")
    assert {value for _, value in chosen(tree)} == {0.7, 0.25}
    assert [name for name, _ in constants(ast.parse("A, B = 1, 2\nc = 3\nD: int = 4\n"))] == ["A", "B", "D"]
