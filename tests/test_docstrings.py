"""Examples in the docstrings of public names are true, and every public name has one."""

import doctest
import inspect
from types import FunctionType

import pytest

import thermal_robot
from thermal_robot import correction, effects, iso9283, planning

PUBLIC = {name: getattr(room, name) for room in (thermal_robot, planning, correction) for name in room.__all__}
PUBLIC |= {name: getattr(effects, name) for name in effects.__all__ if name.islower()}
PUBLIC |= {name: getattr(iso9283, name) for name in ("Performance", "performance")}
"""What has an example: the names of packages for users, what makes effects and chooses among them, a standard's."""
IN_FULL = (
    thermal_robot.Campaign,
    thermal_robot.CorrectedModel,
    thermal_robot.Diagnosis,
    thermal_robot.Robot,
    planning.Plan,
    iso9283.Performance,
)
"""Classes of which each method has one of its own."""


def examples():
    """Every example of a public name and of what it has, as doctest finds them; all begin with the package at hand."""
    finder = doctest.DocTestFinder(recurse=True)
    for name, thing in PUBLIC.items():
        for test in finder.find(thing, name, module=inspect.getmodule(thing), globs={"tr": thermal_robot}):
            if test.examples:
                yield test


EXAMPLES = list(examples())
DEAR = ("compare", "Comparison", "diagnose_many", "zero_offsets", "Diagnosis.update", "wear", "after_crash")
"""Examples that diagnose several campaigns: they run at night."""
HAVING = {test.name for test in EXAMPLES}


def test_every_public_name_and_method_has_an_example_and_every_property_is_in_one():
    missing = [name for name in PUBLIC if name not in HAVING]
    shown = "".join(example.source for test in EXAMPLES for example in test.examples)
    for kind in IN_FULL:
        for name, member in vars(kind).items():
            if name.startswith("_"):
                continue
            if isinstance(member, (FunctionType, classmethod, staticmethod)):
                missing += [f"{kind.__name__}.{name}"] if f"{kind.__name__}.{name}" not in HAVING else []
            elif hasattr(type(member), "__get__") and f".{name}" not in shown:
                missing.append(f"{kind.__name__}.{name}")
    assert missing == []


@pytest.mark.parametrize(
    "test", [pytest.param(t, id=t.name, marks=[pytest.mark.slow] * (t.name in DEAR)) for t in EXAMPLES]
)
def test_an_example_shows_what_it_prints(monkeypatch, tmp_path, diagnosed_once, test):
    monkeypatch.setattr(thermal_robot, "diagnose", diagnosed_once)
    runner, told = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS), []
    monkeypatch.chdir(tmp_path)
    runner.run(test, out=told.append, clear_globs=False)
    assert runner.summarize(verbose=False).failed == 0, "".join(told)
