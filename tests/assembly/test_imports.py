"""The paper's chain needs no data: its only doors are the robot, its kinematics and the errors."""

import ast
from pathlib import Path

import pytest

import thermal_robot

PACKAGE = Path(thermal_robot.__file__).parent
ROOM = PACKAGE / "assembly"
MODULES = sorted(ROOM.rglob("*.py"))
DOORS = {"arrays", "errors", "compiling", "robot", "kinematics", "assembly"}
FILES = {"pathlib", "os", "io", "csv", "json", "tomllib", "tomli_w", "xml", "pandas", "pyarrow", "shutil", "tempfile"}


def imports(path):
    """Every module that a file imports, also inside functions and for types."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def calls(path):
    """Names that a file calls as functions."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return {node.func.id for node in ast.walk(tree) if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)}


def own(path):
    """What a file imports of this package, as parts of the dotted name after the package's."""
    return [name.split(".")[1:] for name in imports(path) if name.split(".")[0] == "thermal_robot"]


named = pytest.mark.parametrize("path", MODULES, ids=[str(path.relative_to(ROOM)) for path in MODULES])


def test_the_walk_sees_imports_in_functions():
    assert ["assembly", "probability", "planes"] in own(ROOM / "workspace.py")
    assert any(part[:1] == ["kinematics"] for part in own(ROOM / "repeatability.py"))
    assert len(MODULES) > 10


@named
def test_the_room_has_few_doors(path):
    assert {part[0] for part in own(path)} <= DOORS


@named
def test_the_room_knows_no_files(path):
    assert {name.split(".")[0] for name in imports(path)} & FILES == set()
    assert "open" not in calls(path)


@pytest.mark.parametrize("path", sorted((ROOM / "probability").glob("*.py")), ids=lambda path: path.name)
def test_probability_knows_no_robot(path):
    for part in own(path):
        assert part[0] in ("arrays", "errors", "compiling") or part[:2] == ["assembly", "probability"], ".".join(part)
