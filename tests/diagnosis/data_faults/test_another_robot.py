"""Another robot of a family is told by what a calibration must move; a coarse one is none, whatever it errs by."""

from dataclasses import replace

import numpy as np
import pytest
from other_robots import base_moved, lengthened, measured, read_with

from thermal_robot.diagnosis.data_faults.misfit import another_robot
from thermal_robot.robot import load_robot

EXAMPLES = ("ur3", "ur5", "ur10")
ENDS = {
    "panda": "panda_hand_tcp",
    "xarm7": "link_eef",
    "kinova": "j2s6s200_end_effector",
    "talos_arm": "wrist_left_ft_tool_link",
}


def example(name):
    pytest.importorskip("example_robot_data")
    return load_robot(f"example-robot-data:{name}", ENDS.get(name, "tool0"))


PAIRS = [(a, b) for a in EXAMPLES for b in EXAMPLES if a != b] + [("panda", "xarm7"), ("kinova", "ur5")]


@pytest.mark.parametrize(("own", "other"), PAIRS)
@pytest.mark.parametrize("measures", ["position", "pose"])
def test_another_robot_of_the_family_is_told(own, other, measures):
    campaign = measured(example(own), 1, measures=measures, geometric=5e-4, joint_offset=1e-3)
    found = another_robot(read_with(campaign, example(other)))
    assert found is not None
    if own in EXAMPLES and other in EXAMPLES:
        assert found.model.fits == f"example-robot-data:{own}"
        assert found.model.remains < 5e-3


@pytest.mark.parametrize("seed", range(6))
def test_one_link_that_is_longer_is_told_with_its_joint(rv_m2, seed):
    joint = ("joint_3", "joint_4")[seed % 2]
    longer = lengthened(rv_m2, {joint: 1.2 + 0.1 * seed})
    found = another_robot(read_with(measured(longer, seed, geometric=3e-4), rv_m2))
    length = next(s.length for s in rv_m2.segments if s.name == joint)
    assert found.model.joint == joint
    assert found.model.off == pytest.approx((0.2 + 0.1 * seed) * length, rel=0.05)


@pytest.mark.parametrize("factor", [0.6, 0.9, 1.3, 1.9])
def test_a_common_factor_of_the_links_is_told(rv_m2, factor):
    sister = lengthened(rv_m2, dict.fromkeys((s.name for s in rv_m2.segments), factor))
    found = another_robot(read_with(measured(sister, 3, geometric=2e-4), rv_m2))
    assert found.model.factor == pytest.approx(factor, rel=0.01)


COARSE = [
    {"joint_offset": 0.05},
    {"joint_offset": 0.03, "backlash": 0.015},
    {"geometric": 2e-3},
    {"geometric": 1e-3, "transmission_error": 5e-3},
    {"joint_gain": 5e-3, "joint_offset": 0.01},
]


@pytest.mark.parametrize("sizes", COARSE)
@pytest.mark.parametrize("seed", range(3))
def test_a_coarse_robot_is_no_other_robot(rv_m2, sizes, seed):
    share, lever = (1.0, 0.5, 1.0)[seed], (0.15, 0.15, 0.5)[seed]
    campaign = measured(rv_m2, seed, rows=(60, 40, 120)[seed], share=share, lever=lever, **sizes)
    assert another_robot(campaign) is None


@pytest.mark.parametrize("row", [20, 55])
def test_a_base_that_moved_is_no_other_robot(rv_m2, row):
    campaign = base_moved(measured(rv_m2, 2, rows=100, joint_offset=5e-3), row, seed=row)
    assert another_robot(campaign) is None


def test_rows_that_are_paired_at_random_are_another_motion(rv_m2):
    campaign = measured(rv_m2, 4)
    found = another_robot(replace(campaign, position=np.random.default_rng(0).permutation(campaign.position)))
    assert found.away > 0.02 * campaign.reach
    assert found.model is None


def test_a_sound_campaign_of_another_simulator_is_not_judged(rv_m2):
    longer = measured(lengthened(rv_m2, {"joint_3": 1.5}), 6)
    assert another_robot(replace(read_with(longer, rv_m2), simulated_position=longer.position)) is None
