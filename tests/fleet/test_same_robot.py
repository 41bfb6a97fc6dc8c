"""Two descriptions of one robot, and of two."""

import re

import pytest

import thermal_robot as tr
from thermal_robot.fleet.compare import _require_same_robot


@pytest.fixture(scope="module")
def arm():
    return tr.load_robot("builtin:rv_m2", "tool0")


def test_one_robot_is_the_same_wherever_it_was_loaded(arm):
    _require_same_robot([arm, tr.load_robot(arm.urdf, "tool0")], ["a", "b"])


def test_other_joints_are_told_by_name(arm):
    other = tr.load_robot("example-robot-data:ur5", "tool0")
    with pytest.raises(tr.CampaignError, match=r"b: is of another robot than a.*shoulder_pan_joint.*joint_1"):
        _require_same_robot([arm, other], ["a", "b"])


def test_other_lengths_are_told_in_millimetres(arm):
    for number, longer in enumerate(re.finditer(r"<joint name=\"joint_3\".*?</joint>", arm.urdf, flags=re.DOTALL)):
        own = longer.group(0)
        x, *rest = re.search(r'xyz="([^"]*)"', own).group(1).split()
        moved = re.sub(r'xyz="[^"]*"', f'xyz="{float(x) + 0.001} {" ".join(rest)}"', own, count=1)
        other = tr.load_robot(arm.urdf.replace(own, moved), "tool0")
        assert number == 0
    with pytest.raises(tr.CampaignError, match=r"another nominal model than a.*up to (1|0\.99\d*) mm away"):
        _require_same_robot([arm, other], ["a", "b"])
