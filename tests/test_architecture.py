"""Who may import whom, what a light import must not load, what a public name must have."""

import ast
import importlib
import inspect
import pkgutil
import subprocess
import sys
from pathlib import Path

import pytest

import thermal_robot

ROOT = Path(thermal_robot.__file__).parent
PACKAGE = "thermal_robot"
ORDER = (
    "arrays",
    "errors",
    "files",
    "percents",
    "compiling",
    "schema",
    "tables",
    "kinematics",
    "urdf_text",
    "robot",
    "shapes",
    "assembly",
    "maps",
    "paper",
    "campaign",
    "observations",
    "effects",
    "inference",
    "iso9283",
    "prediction",
    "model_file",
    "correction",
    "simulation",
    "teller",
    "diagnosis",
    "planning",
    "fleet",
    "datasets",
    "report",
    "console",
    "streams",
    "parser",
    "blind",
    "viewer",
    "commands",
    "cli",
    "__main__",
)
"""Rooms from the ground up: each may import those before it."""
FREE = {
    "report": {"arrays", "errors", "files", "percents", "report"},
    "assembly": {"arrays", "errors", "compiling", "kinematics", "robot", "tables", "assembly"},
    "maps": {"arrays", "errors", "kinematics", "robot", "assembly", "maps"},
    "paper": {"arrays", "errors", "kinematics", "robot", "assembly", "paper"},
}
"""Rooms that may import less than what stands before them: one draws what it is given, three need no campaign."""
TYPES = {"report": {f"thermal_robot.diagnosis.{n}" for n in ("result", "values", "calibration")}}
TYPES["report"] |= {"thermal_robot.fleet.wear_result", "thermal_robot.shapes"}
"""What a room may know beyond that by type alone: the report sees values, and nothing that computes them."""

MODULES = sorted(ROOT.rglob("*.py"))


def room(module):
    """``thermal_robot.campaign.read`` stands in ``campaign``."""
    parts = module.split(".")
    return parts[1] if len(parts) > 1 else ""


def dotted(path):
    parts = [PACKAGE, *path.relative_to(ROOT).with_suffix("").parts]
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imports(path):
    """Yield (module, how): ``checked`` under TYPE_CHECKING, ``lazy`` inside a function, else ``top``."""

    def walk(node, how):
        for child in ast.iter_child_nodes(node):
            here = how
            if isinstance(child, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)) and how == "top":
                here = "lazy"
            if isinstance(child, ast.If) and "TYPE_CHECKING" in ast.unparse(child.test):
                for line in child.body:
                    yield from walk(ast.Module([line], []), "checked")
                for line in child.orelse:
                    yield from walk(ast.Module([line], []), how)
                continue
            if isinstance(child, ast.Import):
                yield from ((alias.name, here) for alias in child.names)
            elif isinstance(child, ast.ImportFrom):
                assert child.level == 0, f"{path.name} imports relatively"
                yield child.module, here
                for alias in child.names:  # a module may be imported from its package
                    if is_module(f"{child.module}.{alias.name}"):
                        yield f"{child.module}.{alias.name}", here
            yield from walk(child, here)

    yield from walk(ast.parse(path.read_text(encoding="utf-8")), "top")


def is_module(name):
    top, *rest = name.split(".")
    path = ROOT.joinpath(*rest)
    return top == PACKAGE and (path.with_suffix(".py").is_file() or (path / "__init__.py").is_file())


def test_the_walk_sees_every_kind_of_import(tmp_path):
    file = tmp_path / "module.py"
    file.write_text(
        "import a\nfrom typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from b import c\nelse:\n    import d\n"
        "def f():\n    import e.g\nclass K:\n    def m(self):\n        from h import i\n    import j\n"
    )
    found = set(imports(file))
    assert found == {
        ("a", "top"), ("typing", "top"), ("b", "checked"), ("d", "top"), ("e.g", "lazy"), ("h", "lazy"), ("j", "top"),
    }  # fmt: skip


def test_imports_go_one_way():
    for path in MODULES:
        _imports_go_one_way(path)


def _imports_go_one_way(path):
    own = dotted(path)
    here = room(own)
    if not here:  # the package itself names what is public
        return
    assert here in ORDER, f"{here} has no place in the order of rooms"
    for target, how in imports(path):
        if target.split(".")[0] != PACKAGE:
            continue
        if how == "checked" and room(target) not in FREE.get(here, {room(target)}):
            assert target in TYPES.get(here, {target}), f"{own} knows {target}"
        if how == "checked":
            continue
        there = room(target)
        if not there:  # the package itself: its version, and only once it is loaded
            assert how == "lazy", f"{own} imports the package that imports it"
            continue
        assert ORDER.index(there) <= ORDER.index(here), f"{own} imports {target}"
        assert there in FREE.get(here, {there}), f"{own} imports {target}"


def test_nobody_imports_the_command_line():
    users = [dotted(p) for p in MODULES if any(room(t) == "cli" for t, _ in imports(p)) and room(dotted(p)) != "cli"]
    assert users == [f"{PACKAGE}.__main__"]


def test_only_kinematics_knows_pinocchio():
    users = {room(dotted(p)) for p in MODULES if any(t.split(".")[0] == "pinocchio" for t, _ in imports(p))}
    assert users == {"kinematics"}


def test_an_effect_knows_observations_by_type_only():
    for path in MODULES:
        if room(dotted(path)) == "effects":
            seen = {how for target, how in imports(path) if room(target) == "observations"}
            assert seen <= {"checked"}, path.name


def test_probability_knows_neither_robots_nor_files():
    own = "thermal_robot.assembly.probability"
    for path in MODULES:
        if dotted(path).startswith(own):
            known = {t for t, _ in imports(path) if t.split(".")[0] == PACKAGE}
            assert all(t.startswith(own) or room(t) in {"arrays", "errors", "compiling"} for t in known), path.name


@pytest.mark.parametrize("kinds", [{"top"}, {"top", "lazy", "checked"}], ids=["at import", "whenever, types too"])
def test_no_module_imports_in_a_circle(kinds):
    """What a module loads never leads back to it; what it loads late, or knows by type, neither."""
    tops = {dotted(p): {t for t, how in imports(p) if how in kinds and is_module(t) and t != PACKAGE} for p in MODULES}
    done, open_ = set(), []

    def visit(name):
        assert name not in open_, " → ".join([*open_[open_.index(name) :], name])
        if name in done:
            return
        open_.append(name)
        for other in sorted(tops.get(name, ())):
            # a package stands for its public names: its own modules are loaded while it is
            if not name.startswith(other + "."):
                visit(other)
        open_.pop()
        done.add(name)

    for name in sorted(tops):
        visit(name)
    assert len(done) == len(MODULES)


def test_every_module_says_what_it_is_for():
    assert [p for p in MODULES if not ast.get_docstring(ast.parse(p.read_text(encoding="utf-8")))] == []


def test_a_light_import_loads_nothing_heavy():
    heavy = ["pandas", "matplotlib", "scipy.stats", "yourdfpy", "rich", "jsonschema", "pyarrow", "tomli_w"]
    heavy += ["trimesh", "viser", "numpy", "scipy", "pinocchio"]
    code = f"import sys, thermal_robot; print([m for m in {heavy!r} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
    assert done.stderr == ""


def test_what_is_loaded_late_is_found_listed_and_typed():
    code = "import thermal_robot as t; print(t.kinematics.__name__, t.diagnose is t.diagnosis.diagnose, len(dir(t)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split()[:2] == [f"{PACKAGE}.kinematics", "True"]
    assert set(thermal_robot.__all__) <= set(dir(thermal_robot))
    assert [n for n in thermal_robot.__all__ if is_module(f"{PACKAGE}.{n}")] == []  # a module would hide the name
    typed = {target for target, how in imports(ROOT / "__init__.py") if how == "checked"}
    assert {room(target) for target in typed} == {room(f"{PACKAGE}.{home}") for home in thermal_robot._HOME.values()}
    assert set(thermal_robot._HOME) == set(thermal_robot.__all__)
    with pytest.raises(AttributeError, match="no attribute 'diagnos'"):
        _ = thermal_robot.diagnos


@pytest.mark.parametrize("name", thermal_robot.__all__)
def test_what_is_public_is_there_and_documented(name):
    thing = getattr(thermal_robot, name)
    if inspect.isclass(thing) or inspect.isfunction(thing):
        assert (inspect.getdoc(thing) or "").strip()
        if inspect.isclass(thing):
            members = [m for m in vars(thing).values() if inspect.isfunction(m) and not m.__name__.startswith("_")]
            assert all((m.__doc__ or "").strip() for m in members), name


def test_every_name_that_a_module_promises_exists():
    promised = 0
    for info in pkgutil.walk_packages(thermal_robot.__path__, f"{PACKAGE}."):
        module = importlib.import_module(info.name)
        names = getattr(module, "__all__", ())
        promised += len(names)
        assert len(set(names)) == len(names), info.name
        assert [n for n in names if not hasattr(module, n)] == [], info.name
    assert promised > 50
