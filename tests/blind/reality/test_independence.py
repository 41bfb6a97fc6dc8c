"""The reality takes nothing from the program that it puts to the test."""

import ast
from pathlib import Path

import pytest

import thermal_robot

PACKAGE = Path(thermal_robot.__file__).parent
REALITY = PACKAGE / "blind" / "reality"
SHARED = {
    "thermal_robot",
    "thermal_robot.blind",
    "thermal_robot.blind.cases",
    "thermal_robot.errors",
    "thermal_robot.files",
}
"""What is asked, and the exception for a user's file; the two packages hold no more than their names."""
FOREIGN = ("pinocchio", "yourdfpy")


def file_of(module):
    path = PACKAGE.parent.joinpath(*module.split("."))
    return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")


def imported(path):
    """Every module that a file names, wherever in it the import stands; of ``from a import b`` both a and a.b."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path.name}: a relative import"
            yield node.module
            inner = (f"{node.module}.{alias.name}" for alias in node.names)
            yield from (name for name in inner if name.startswith("thermal_robot") and file_of(name).exists())


def reached(start):
    """Every module that a file leads to, by way of this package's own modules."""
    found, waiting = set(), [start]
    while waiting:
        for name in imported(waiting.pop()):
            if name not in found:
                found.add(name)
                if name.startswith("thermal_robot.") and name not in SHARED:
                    waiting.append(file_of(name))
    return found


@pytest.mark.parametrize("path", sorted(REALITY.glob("*.py")), ids=lambda path: path.stem)
def test_a_module_of_the_reality_leads_to_nothing_that_it_judges(path):
    for name in reached(path):
        assert name.split(".")[0] not in FOREIGN, name
        own = name.startswith("thermal_robot.blind.reality")
        assert own or name in SHARED or not name.startswith("thermal_robot"), name


@pytest.mark.parametrize("module", ["thermal_robot.blind.cases", "thermal_robot.errors"])
def test_what_is_shared_leads_nowhere(module):
    names = [name for name in imported(file_of(module)) if name.startswith(("thermal_robot", *FOREIGN))]
    assert names == []


def test_the_walk_finds_a_way_round(tmp_path):
    """It would see an import inside a function, and one behind another module."""
    (tmp_path / "sly.py").write_text("def f():\n    from thermal_robot.blind import plan\n")
    names = reached(tmp_path / "sly.py")
    assert {"thermal_robot.blind.plan", "thermal_robot.effects", "thermal_robot.robot", "pinocchio"} <= names
