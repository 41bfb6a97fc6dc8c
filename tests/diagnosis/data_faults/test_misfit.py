"""Where the table or the URDF is at fault nothing is said of the robot, and the fault comes first."""

import json
from dataclasses import replace

import jsonschema
import numpy as np
import pytest
from conftest import load_arm
from helpers import some
from other_robots import base_moved, lengthened, measured, read_with
from simulate import simulate
from spoilt_tables import SPOILT, measured_at

from thermal_robot import diagnose
from thermal_robot.diagnosis.data_faults.faults import Readings
from thermal_robot.diagnosis.data_faults.misfit import another_robot, arm_length, fitting, mismatch
from thermal_robot.effects import RANDOM
from thermal_robot.report import schema
from thermal_robot.robot import load_robot


@pytest.fixture(scope="module")
def sound(rv_m2):
    return simulate(rv_m2, ["joint_offset"], samples=50, seed=3)[0]


def test_the_fault_comes_first_and_no_effect_is_claimed(sound):
    found = diagnose(SPOILT["reversed joint"](sound))
    assert not found.usable
    assert found.verdict == ()
    assert {f.status for f in found.effects if f.name not in RANDOM} == {"not_testable"}
    assert str(found).startswith("The table is at fault, not the robot: joint_3 is reversed")
    plain = json.loads(json.dumps(found.to_dict()))
    jsonschema.validate(plain, schema())
    assert plain["verdict"]["usable"] is False
    assert "joint_3 is reversed" in plain["verdict"]["reason"]
    assert "Change the sign of its column" in plain["verdict"]["reason"]
    assert plain["next"]["samples"] == []
    # what nothing mends is unusable, too
    found = diagnose(measured_at(sound, np.random.default_rng(0).permutation(sound.samples)))
    assert (found.usable, found.verdict, found.misfit.fault) == (False, (), None)
    assert found.misfit.away > 0.02 * found.reach
    assert found.reason.startswith("Robot and table do not describe the same motion")


def test_the_urdf_of_another_model_is_refused_and_nothing_is_claimed(rv_m2):
    sister = lengthened(rv_m2, {"joint_3": 1.7, "joint_4": 1.4})
    found = diagnose(read_with(measured(sister, 1, geometric=3e-4), rv_m2))
    assert not found.usable
    assert found.verdict == ()
    assert found.misfit.model.joint in {"joint_3", "joint_4"}
    assert "Is it another model of the family?" in found.reason
    assert "Take the URDF of the robot that was measured" in found.reason


def test_the_urdfs_unit_comes_before_faults_of_the_table(rv_m2):
    scaled = lengthened(rv_m2, dict.fromkeys((s.name for s in rv_m2.segments), 1000.0))
    found = mismatch(read_with(measured(rv_m2, 1), scaled))
    assert found.fault is None
    assert found.model.factor == 1e-3


def test_a_fault_that_mends_the_table_comes_before_another_robot(sound):
    fault = mismatch(SPOILT["reversed joint"](sound)).fault
    # turned half round about its column this arm is its own image, so that the joints in turn do the same
    assert fault.kinds == ("reversed joint", "reversed joints")
    assert fault.what.startswith("joint_3 is reversed")
    assert mismatch(sound) is None


@pytest.mark.slow
def test_another_robot_that_leaves_less_comes_before_a_unit_that_is_nearly_the_ratio_of_the_arms():
    large, small = (load_robot(f"example-robot-data:{name}", "tool0") for name in ("ur10", "ur3"))
    found = mismatch(read_with(measured(large, 1, measures="pose"), small))
    assert found.fault is None
    assert found.model.fits == "example-robot-data:ur10"


def test_a_sound_table_is_usable(hall):
    assert hall.usable
    assert hall.reason == ""
    assert set(hall.verdict) == {"thermal_elongation", "backlash"}
    assert hall.to_dict()["verdict"]["usable"] is True


@pytest.mark.slow
def test_orientations_alone_can_be_a_misfit(rv_m2):
    poses = simulate(rv_m2, samples=40, seed=2, turning=3e-5)[0]
    rng = np.random.default_rng(1)
    wrong = rng.normal(size=(40, 4))
    found = diagnose(replace(poses, orientation=wrong / np.linalg.norm(wrong, axis=1, keepdims=True)))
    assert found.misfit.away is None
    assert found.misfit.turned > 0.2


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


@pytest.mark.parametrize(
    ("own", "other", "measures"), some(((*pair, kind) for pair in PAIRS for kind in ("position", "pose")), 7)
)
def test_another_robot_of_the_family_is_told(own, other, measures):
    campaign = measured(example(own), 1, measures=measures, geometric=5e-4, joint_offset=1e-3)
    found = another_robot(read_with(campaign, example(other)))
    assert found is not None
    if own in EXAMPLES and other in EXAMPLES:
        assert found.model.fits == f"example-robot-data:{own}"
        assert found.model.remains < 5e-3


@pytest.mark.parametrize(
    ("name", "joint", "times", "measures"),
    some(
        [
            *(("rv_m2", f"joint_{3 + k % 2}", 1.2 + 0.1 * k, ("position", "pose")[k // 5]) for k in range(6)),
            ("ur10", "wrist_2_joint", 1.5, "position"),  # told of any one of the joints with parallel axes
        ],
        3,
    ),
)
def test_one_link_that_is_longer_is_told_with_its_joint(name, joint, times, measures):
    arm = load_arm(name)
    longer = measured(lengthened(arm, {joint: times}), round(10 * times), measures=measures, geometric=3e-4)
    found = another_robot(read_with(longer, arm))
    length = next(s.length for s in arm.segments if s.name == joint)
    assert name == "ur10" or found.model.joint == joint
    assert found.model.off == pytest.approx((times - 1.0) * length, rel=0.05)


@pytest.mark.parametrize("factor", some([0.6, 0.9, 1.3, 1.9], 2))
def test_a_common_factor_of_the_links_is_told(rv_m2, factor):
    sister = lengthened(rv_m2, dict.fromkeys((s.name for s in rv_m2.segments), factor))
    found = another_robot(read_with(measured(sister, 3, geometric=2e-4), rv_m2))
    assert found.model.factor == pytest.approx(factor, rel=0.01)
    assert arm_length(sister) == pytest.approx(factor * sum(s.length for s in rv_m2.segments))


COARSE = [
    {"joint_offset": 0.05},
    {"joint_offset": 0.03, "backlash": 0.015},
    {"geometric": 2e-3},
    {"geometric": 1e-3, "transmission_error": 5e-3},
    {"joint_gain": 5e-3, "joint_offset": 0.01},
]


@pytest.mark.parametrize(("sizes", "seed"), some(((sizes, seed) for seed in range(3) for sizes in COARSE), 4))
def test_a_coarse_robot_is_no_other_robot(rv_m2, sizes, seed):
    share, lever = (1.0, 0.5, 1.0)[seed], (0.15, 0.15, 0.5)[seed]
    campaign = measured(rv_m2, seed, rows=(60, 40, 120)[seed], share=share, lever=lever, **sizes)
    assert another_robot(campaign) is None


@pytest.mark.parametrize("seed", [2, 5])
def test_places_that_few_poses_do_not_determine_make_no_other_robot(rv_m2, seed):
    coarse = {"geometric": 4e-3, "joint_offset": 0.02, "backlash": 0.004}
    assert another_robot(measured(rv_m2, seed, rows=24, share=0.15, **coarse)) is None


@pytest.mark.parametrize("row", some([20, 55], 2))
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


def fitted(campaign, near=5e-3):
    return fitting(replace(Readings.of(campaign), base_known=False, tool_known=False), near)


def test_the_robot_that_was_measured_is_named(rv_m2):
    own, other = (example(name) for name in ("ur5", "ur10"))
    name, remains = fitted(read_with(measured(own, 1, geometric=2e-4), other))
    assert name == "example-robot-data:ur5"
    assert remains < 2e-3
    assert fitted(measured(rv_m2, 4, geometric=2e-4))[0] == "builtin:rv_m2"
    # columns go to the joints of their names, and no robot is named where none fits
    campaign = measured(own, 2)
    turned = load_robot(own.urdf.replace("shoulder_pan_joint", "a_joint"), "tool0")
    assert fitted(read_with(campaign, turned))[0] == name
    assert fitted(replace(campaign, position=0.5 * campaign.position)) is None
