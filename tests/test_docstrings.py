"""Examples in the docstrings of public names are true, and every public name has one."""

import doctest
import inspect
from types import FunctionType

import pytest

import thermal_robot
from thermal_robot import correction, effects, iso9283, planning

ROOMS = (thermal_robot, planning, correction)
"""Packages whose names are public, and all have an example."""
ALSO = [(effects, name) for name in effects.__all__ if name.islower()]
ALSO += [(iso9283, "Performance"), (iso9283, "performance")]
"""Names of other packages that have one, too: what makes effects and chooses among them, and what a standard says."""
IN_FULL = (
    thermal_robot.Campaign,
    thermal_robot.CorrectedModel,
    thermal_robot.Diagnosis,
    thermal_robot.Robot,
    planning.Plan,
    iso9283.Performance,
)
"""Classes of which each method has one of its own."""
PUBLIC = {name: getattr(room, name) for room in ROOMS for name in room.__all__}
PUBLIC |= {name: getattr(room, name) for room, name in ALSO}


def examples():
    """Every example of a public name and of what it has, as doctest finds them; all begin with the package at hand."""
    finder = doctest.DocTestFinder(recurse=True)
    for name, thing in PUBLIC.items():
        for test in finder.find(thing, name, module=inspect.getmodule(thing), globs={"tr": thermal_robot}):
            if test.examples:
                yield test


EXAMPLES = list(examples())
HAVING = {test.name for test in EXAMPLES}


@pytest.fixture(scope="module")
def answers():
    """Diagnoses that were already made, by what was asked."""
    return {}


@pytest.fixture(autouse=True)
def diagnosed_once(answers, monkeypatch):
    """Let examples that ask the same of the same campaign share the answer, which is frozen."""
    diagnose = thermal_robot.diagnose

    def once(campaign, **asked):
        what = (campaign.name, campaign.position.tobytes(), repr(sorted(asked.items())))
        if what not in answers:
            answers[what] = diagnose(campaign, **asked)
        return answers[what]

    monkeypatch.setattr(thermal_robot, "diagnose", once)


@pytest.mark.parametrize("name", PUBLIC)
def test_every_public_name_has_an_example(name):
    assert name in HAVING


@pytest.mark.parametrize("kind", IN_FULL, ids=lambda kind: kind.__name__)
def test_every_method_has_an_example_and_every_property_is_in_one(kind):
    members = {name: member for name, member in vars(kind).items() if not name.startswith("_")}
    methods = [
        name for name, member in members.items() if isinstance(member, (FunctionType, classmethod, staticmethod))
    ]
    assert methods
    assert [name for name in methods if f"{kind.__name__}.{name}" not in HAVING] == []
    shown = "".join(example.source for test in EXAMPLES for example in test.examples)
    properties = [name for name, member in members.items() if hasattr(type(member), "__get__") and name not in methods]
    assert [name for name in properties if f".{name}" not in shown] == []


@pytest.mark.parametrize("test", EXAMPLES, ids=lambda test: test.name)
def test_example_shows_what_it_prints(test, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    told = []
    result = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS).run(
        test, out=told.append, clear_globs=False
    )
    assert result.failed == 0, "".join(told)
