"""A calibration as text: every figure with its deviation, and what is not told."""

import numpy as np

import thermal_robot as tr
from thermal_robot.report import calibration_text

OFF = {"joint_offset": {"joint_2": 1e-3, "joint_3": -7e-4}}


def simulated(effects=OFF, **further):
    return tr.simulate(
        "builtin:rv_m2", effects, rows=60, noise=3e-5, base=np.eye(4), tool_frame="tool0", seed=6, **further
    )


def test_all_parts_are_told():
    found = tr.calibrate(simulated())
    said = calibration_text(found)
    assert str(found) == said
    assert "60 samples of position, 0 set aside. Fitted as asked, not chosen" in said
    assert "joint zero offsets (joint_offset, a part of geometric), ± one standard deviation" in said
    assert "not seen apart from the others or the frames: zero offset, joint_1" in said
    assert "gap, rms" in said
    assert "turn, rms" not in said
    assert "not noise" not in said
    assert max(map(len, said.splitlines())) <= 96
    assert "turn, rms" in str(tr.calibrate(simulated(measures="pose", noise_orientation=1e-4)))


def test_a_remainder_that_is_no_noise_is_told():
    worn = simulated({**OFF, "backlash": {"joint_3": 8e-4}})
    assert "What is left is not noise: something else is at work" in str(tr.calibrate(worn, "joint_offset"))
