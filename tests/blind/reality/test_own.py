"""A fault of the user's own, from a file."""

import pytest

pytest.importorskip("mujoco", reason='the blind trial needs "thermal-robot[blind]"')

from thermal_robot.blind.reality import FAULTS, UNLISTED, Fault
from thermal_robot.blind.reality.unlisted import known, load
from thermal_robot.errors import EffectError

FILE = """
import numpy as np
from thermal_robot.blind.reality import Fault
from thermal_robot.blind.reality.fault import joints

MINE = Fault("mine", lambda s, rng: np.ones((s.world.n, 1)), lambda body, s, values: None, joints)

def made():
    return MINE

def broken():
    raise RuntimeError("no such gear")

NUMBER = 3
"""


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "mine.py"
    path.write_text(FILE)
    return path


@pytest.mark.parametrize("name", ["MINE", "made"])
def test_a_fault_or_what_makes_one_is_loaded(file, name):
    fault = load(f"{file}:{name}")
    assert isinstance(fault, Fault)
    assert fault.name == "mine"


@pytest.mark.parametrize(
    ("where", "words"),
    [
        ("{}:NUMBER", "is a int, not a Fault"),
        ("{}:ABSENT", "AttributeError.*ABSENT"),
        ("{}:broken", "RuntimeError: no such gear"),
        ("nowhere.py:MINE", "there is no file 'nowhere.py'; expected file.py:NAME"),
        ("MINE", "there is no file ''"),
    ],
)
def test_what_is_no_fault_is_refused_with_its_name_and_reason(file, where, words):
    with pytest.raises(EffectError, match=words):
        load(where.format(file))


def test_a_file_that_does_not_run_is_refused(tmp_path):
    (tmp_path / "bad.py").write_text("import nothing_of_this_name\n")
    with pytest.raises(EffectError, match="ModuleNotFoundError"):
        load(f"{tmp_path / 'bad.py'}:MINE")
    (tmp_path / "bad.txt").write_text("MINE = 1")
    with pytest.raises(EffectError, match="not a Python file"):
        load(f"{tmp_path / 'bad.txt'}:MINE")


def test_a_name_means_the_trials_own_fault_unless_a_file_is_given(file):
    assert known("drift") is FAULTS["drift"]
    assert known("slip") is UNLISTED["slip"]
    assert known("drift", f"{file}:MINE").name == "mine"
