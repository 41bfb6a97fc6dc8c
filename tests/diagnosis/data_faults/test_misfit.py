"""Where the table is at fault nothing is said of the robot, and the fault comes first."""

import json
from dataclasses import replace

import jsonschema
import numpy as np
import pytest
from other_robots import lengthened, measured, read_with
from simulate import simulate
from spoilt_tables import SPOILT, measured_at

from thermal_robot import diagnose, load_robot
from thermal_robot.diagnosis.data_faults.misfit import unfit
from thermal_robot.effects import RANDOM
from thermal_robot.report import schema


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


def test_what_nothing_mends_is_unusable_too(sound):
    found = diagnose(measured_at(sound, np.random.default_rng(0).permutation(sound.samples)))
    assert not found.usable
    assert found.misfit.fault is None
    assert found.misfit.away > 0.02 * found.reach
    assert found.verdict == ()
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
    found = unfit(read_with(measured(rv_m2, 1), scaled))
    assert found.fault is None
    assert found.model.factor == 1e-3


def test_a_fault_that_mends_the_table_comes_before_another_robot(sound):
    fault = unfit(SPOILT["reversed joint"](sound)).fault
    # turned half round about its column this arm is its own image, so that the joints in turn do the same
    assert fault.kinds == ("reversed joint", "reversed joints")
    assert fault.what.startswith("joint_3 is reversed")
    assert unfit(sound) is None


def test_another_robot_that_leaves_less_comes_before_a_unit_that_is_nearly_the_ratio_of_the_arms():
    large, small = (load_robot(f"example-robot-data:{name}", "tool0") for name in ("ur10", "ur3"))
    found = unfit(read_with(measured(large, 1, measures="pose"), small))
    assert found.fault is None
    assert found.model.fits == "example-robot-data:ur10"


def test_a_sound_table_is_usable(sound):
    found = diagnose(sound)
    assert found.usable
    assert found.reason == ""
    assert found.verdict == ("joint_offset",)
    assert found.to_dict()["verdict"]["usable"] is True


def test_orientations_alone_can_be_a_misfit(rv_m2):
    poses = simulate(rv_m2, samples=40, seed=2, turning=3e-5)[0]
    rng = np.random.default_rng(1)
    wrong = rng.normal(size=(40, 4))
    found = diagnose(replace(poses, orientation=wrong / np.linalg.norm(wrong, axis=1, keepdims=True)))
    assert found.misfit.away is None
    assert found.misfit.turned > 0.2
