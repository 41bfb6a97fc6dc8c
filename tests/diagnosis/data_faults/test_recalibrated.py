"""A free calibration finds where joints sit, and leaves alone what the commands do not determine."""

from dataclasses import replace

import numpy as np
import pytest
from other_robots import lengthened, measured, read_with

from thermal_robot.diagnosis.data_faults.faults import Readings
from thermal_robot.diagnosis.data_faults.misfit import Recalibrated, arm_length
from thermal_robot.robot import load_robot


def calibrated(campaign, parts=1):
    readings = replace(Readings.of(campaign), base_known=False, tool_known=False)
    return Recalibrated.of(readings, np.arange(campaign.samples) * parts // campaign.samples, campaign.robot)


@pytest.mark.parametrize("measures", ["position", "pose"])
@pytest.mark.parametrize("parts", [1, 3])
def test_a_joint_that_sits_elsewhere_is_found(rv_m2, measures, parts):
    campaign = read_with(measured(lengthened(rv_m2, {"joint_3": 1.5}), 1, rows=90, measures=measures), rv_m2)
    found = calibrated(campaign, parts)
    joint, far, times = found.farthest()
    length = next(s.length for s in rv_m2.segments if s.name == "joint_3")
    assert joint == "joint_3"
    assert far == pytest.approx(0.5 * length, rel=0.02)
    assert times > 10
    assert found.left()[0] < 2e-4  # noise of 30 µm per axis


def test_what_parallel_axes_share_is_told_of_one_joint():
    pytest.importorskip("example_robot_data")
    ur10 = load_robot("example-robot-data:ur10", "tool0")
    moved = read_with(measured(lengthened(ur10, {"wrist_2_joint": 1.5}), 2), ur10)
    shift = np.linalg.norm(calibrated(moved).moved[0], axis=1)
    length = next(s.length for s in ur10.segments if s.name == "wrist_2_joint")
    assert shift.max() == pytest.approx(0.5 * length, rel=0.05)
    assert np.sort(shift)[-2] < 0.05 * shift.max()


def test_zeros_are_no_lengths(rv_m2):
    found = calibrated(measured(rv_m2, 3, joint_offset=0.05))
    assert found.farthest()[1] < 2e-3
    assert np.abs(found.moved[1]).max() > 0.02


def test_gross_errors_do_not_count(rv_m2):
    campaign = measured(rv_m2, 4, rows=80)
    spoilt = campaign.position.copy()
    spoilt[::8] += 0.4
    found = calibrated(replace(campaign, position=spoilt))
    assert found.farthest()[1] < 1e-3
    assert found.left()[0] < 3e-4


def test_a_base_that_moved_is_told_by_its_part(rv_m2):
    campaign = measured(rv_m2, 5, rows=60)
    moved = campaign.position.copy()
    moved[30:] += (0.3, -0.1, 0.2)
    found = calibrated(replace(campaign, position=moved), parts=2)
    np.testing.assert_allclose(found.bases[1, :3, 3] - found.bases[0, :3, 3], (0.3, -0.1, 0.2), atol=2e-3)


def test_an_arm_is_as_long_as_its_links(rv_m2):
    assert arm_length(rv_m2) == pytest.approx(sum(s.length for s in rv_m2.segments))
    doubled = lengthened(rv_m2, dict.fromkeys((s.name for s in rv_m2.segments), 2.0))
    assert arm_length(doubled) == pytest.approx(2.0 * arm_length(rv_m2))
