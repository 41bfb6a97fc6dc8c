"""House rules: who may import whom, what a light import must not load, what a public name must have."""

import ast
import importlib
import pkgutil
import subprocess
import sys

import house
import pytest

import thermal_robot


@pytest.mark.parametrize("rule", house.RULES, ids=lambda rule: rule.__name__)
def test_the_house_is_in_order(rule):
    assert list(rule()) == []


def test_the_walk_sees_every_kind_of_import():
    text = (
        "import a\nfrom typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from b import c\nelse:\n    import d\n"
        "def f():\n    import e.g\nclass K:\n    def m(self):\n        from h import i\n    import j\n"
        "from .k import l\n"
    )
    assert set(house.imports(ast.parse(text))) == {
        ("a", "top"), ("typing", "top"), ("b", "checked"), ("d", "top"), ("e.g", "lazy"), ("h", "lazy"), ("j", "top"),
        (".k", "top"),
    }  # fmt: skip


def printed(code):
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr == ""
    return done.stdout.strip()


def test_a_light_import_loads_nothing_heavy():
    heavy = ["pandas", "matplotlib", "scipy.stats", "yourdfpy", "rich", "jsonschema", "pyarrow", "tomli_w"]
    heavy += ["trimesh", "viser", "numpy", "scipy", "pinocchio"]
    assert printed(f"import sys, thermal_robot; print([m for m in {heavy!r} if m in sys.modules])") == "[]"


def test_what_is_loaded_late_is_found_listed_and_typed():
    code = "import thermal_robot as t; print(t.kinematics.__name__, t.diagnose is t.diagnosing.diagnose)"
    assert printed(code) == f"{house.PACKAGE}.kinematics True"
    assert set(thermal_robot.__all__) <= set(dir(thermal_robot))
    assert not any(house.is_module(f"{house.PACKAGE}.{n}") for n in thermal_robot.__all__)  # it would hide the name
    typed = {target for target, how in house.imported()[house.PACKAGE] if how == "checked"}
    homes = {house.room(f"{house.PACKAGE}.{home}") for home in thermal_robot._HOME.values()}
    assert {house.room(target) for target in typed} == homes
    assert set(thermal_robot._HOME) == set(thermal_robot.__all__)
    with pytest.raises(AttributeError, match="no attribute 'diagnos'"):
        _ = thermal_robot.diagnos


def test_every_name_that_a_module_promises_exists():
    promised = 0
    for info in pkgutil.walk_packages(thermal_robot.__path__, f"{house.PACKAGE}."):
        module = importlib.import_module(info.name)
        names = getattr(module, "__all__", ())
        promised += len(names)
        assert len(set(names)) == len(names), info.name
        assert [n for n in names if not hasattr(module, n)] == [], info.name
    assert promised > 50
