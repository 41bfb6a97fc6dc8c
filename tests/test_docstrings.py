"""Examples in the docstrings of public names are true."""

import doctest
import inspect

import pytest

import thermal_robot


def examples():
    """Every example of a public name and of what it has, as doctest finds them."""
    finder = doctest.DocTestFinder(recurse=True)
    for name in thermal_robot.__all__:
        thing = getattr(thermal_robot, name)
        for test in finder.find(thing, name, module=inspect.getmodule(thing), globs={}):
            if test.examples:
                yield test


EXAMPLES = list(examples())


def test_there_are_examples():
    assert {"Campaign.to_frame", "Robot.forward"} <= {test.name for test in EXAMPLES}


@pytest.mark.parametrize("test", EXAMPLES, ids=lambda test: test.name)
def test_example_shows_what_it_prints(test, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    told = []
    result = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS).run(
        test, out=told.append, clear_globs=False
    )
    assert result.failed == 0, "".join(told)
