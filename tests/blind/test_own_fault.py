"""A fault of the user's own: loaded from his file, put into the trial, refused in plain words."""

import pytest

pytest.importorskip("mujoco", reason='the blind trial needs "thermal-robot[blind]"')

from thermal_robot.blind.command import OWN_CASES, _with_faults
from thermal_robot.blind.plan import ROBOTS, plan, robots
from thermal_robot.blind.reality import make
from thermal_robot.blind.reality.unlisted import load
from thermal_robot.errors import EffectError

FAULT = """
import numpy as np
from thermal_robot.blind.reality import Fault
from thermal_robot.blind.reality.fault import joints

def draw(setting, rng):
    values = np.zeros((setting.world.n, 1))
    values[2] = 1e-3
    return values

def act(body, setting, values):
    body.joints += values[:, 0] * np.sign(setting.q - setting.q.mean(axis=0))

MINE = Fault("two_positions", draw, act, joints, few=True)
WRONG = 3
"""


@pytest.fixture
def file(tmp_path):
    (tmp_path / "mine.py").write_text(FAULT)
    return tmp_path / "mine.py"


def test_a_fault_of_ones_own_is_put_into_campaigns(file, tmp_path):
    arms = robots(ROBOTS[:2])
    cases = _with_faults(plan(1, {"null": 2}, arms), [f"{file}:MINE"], 1, arms)
    mine = cases[2:]
    assert len(mine) == OWN_CASES
    assert {case.robot.name for case in mine} == {arm.name for arm in arms}
    assert all(case.kind == "unlisted" and case.unlisted == "two_positions" for case in mine)
    truth = make(mine[0], tmp_path / "campaign")["truth"]
    assert truth["unlisted"] == "two_positions"
    assert truth["places"] == [{"kind": "joint", "name": "joint_3"}]
    assert truth["parts"]["two_positions"]["ratio"] > 2.0


@pytest.mark.parametrize(
    ("where", "words"),
    [("nowhere.py:MINE", "no file"), ("{}:NONE", "NONE"), ("{}:WRONG", "int, not a Fault")],
)
def test_what_is_no_fault_is_refused(file, where, words):
    with pytest.raises(EffectError, match=words):
        load(where.format(file))
