"""Data that are not what they seem: copies, another robot's table, a fault of the log."""

from dataclasses import replace

import numpy as np
import pytest
from simulate import simulate

from thermal_robot import diagnose
from thermal_robot.diagnosis.cautions import cautions, contradicted, usable
from thermal_robot.diagnosis.values import Refused, Sensitivity
from thermal_robot.effects import choose
from thermal_robot.inference.fit import fit


def test_a_table_pasted_twice_is_not_taken_for_repeats(clean):
    twice = clean.take(np.tile(np.arange(60), 2))
    found = diagnose(replace(twice, rows=np.arange(2, 122), noise_position=None))
    assert not found.unexplained.flagged
    assert any(warning.startswith("60 rows (62, 63, 64, 65, 66 …) repeat another") for warning in found.warnings)


@pytest.mark.parametrize(
    ("spoilt", "said"),
    [("mirrored", "The table is at fault, not the robot"), ("scrambled", "Robot and table do not describe the same")],
)
def test_another_robots_table_is_said_to_be_that(clean, spoilt, said):
    position = clean.position * [1, -1, 1] if spoilt == "mirrored" else clean.position[::-1]
    found = diagnose(replace(clean, position=position))
    assert found.summary.startswith(said)
    assert not found.usable
    assert found.unexplained.flagged


def test_noise_stated_ten_times_too_large_is_remarked(clean):
    found = diagnose(replace(clean, noise_position=200e-6))
    assert any("stated too large" in warning for warning in found.warnings)


def test_encoders_that_deny_the_commands_are_a_fault_of_the_log(rv_m2):
    clean = simulate(rv_m2, ["drift"], seed=1)[0]
    read = clean.q[:, 2] + 1e-4
    spoilt = np.array(read)
    spoilt[[10, 40, 41]] += 0.2
    agreeing = diagnose(replace(clean, covariates={**clean.covariates, "encoder.joint_3": read}))
    denying = diagnose(replace(clean, covariates={**clean.covariates, "encoder.joint_3": spoilt}))
    assert not any("encoder" in warning for warning in agreeing.warnings)
    told = next(warning for warning in denying.warnings if "encoder.joint_3" in warning)
    assert "3 of 120 rows" in told
    assert f"row {int(clean.rows[10])}" in told
    assert "fault of the log" in told
    assert denying.verdict == agreeing.verdict == ("drift",)


def test_an_orientation_that_the_simulator_does_not_predict_is_left_out(rv_m2):
    poses = simulate(rv_m2, samples=30, seed=2, turning=3e-5)[0]
    kept, notes = usable(replace(poses, simulated_position=np.asarray(poses.position)))
    assert (kept.orientation, kept.noise_orientation, kept.measures) == (None, None, "position")
    assert any("orientation is left out" in note for note in notes)
    assert usable(poses) == (poses, ())


def test_copies_are_left_out_and_repeats_are_not(rv_m2):
    once = simulate(rv_m2, samples=30, seed=2)[0]
    rows = np.array([*range(30), 4, 4, 9])
    kept, (note,) = usable(replace(once.take(rows), rows=np.arange(2, 35)))
    assert note.startswith("3 rows (32, 33, 34) repeat another one")
    np.testing.assert_array_equal(kept.rows, np.arange(2, 32))
    # the same command, measured again at another time: a repeat
    later = once.covariates["time"][rows] + np.arange(33)
    again = replace(once.take(rows), covariates={**once.take(rows).covariates, "time": later}, rows=np.arange(2, 35))
    assert usable(again)[0].samples == 33


@pytest.mark.parametrize(("away", "said"), [(0.0, []), (0.004, []), (0.3, ["another zero, or another unit"])])
def test_encoders_that_are_off_throughout_have_another_zero(rv_m2, away, said):
    plain = simulate(rv_m2, samples=30, seed=2)[0]
    notes = contradicted(replace(plain, covariates={**plain.covariates, "encoder.joint_2": plain.q[:, 1] + away}))
    assert [any(words in note for note in notes) for words in said] == [True] * len(said)
    assert bool(notes) == bool(said)


def test_what_was_refused_is_said(rv_m2):
    known = fit(simulate(rv_m2, seed=2)[0], choose(("drift",), (), ()))
    assert cautions(known) == ()
    (refused,) = cautions(known, {"joint_gain": Refused(0.01, -0.053)})
    assert refused == ("rows held out are predicted no better with joint_gain (share −5.3 %): not reported as found")


def test_a_verdict_that_hangs_on_the_stated_sizes_says_so(rv_m2):
    known = fit(simulate(rv_m2, seed=2)[0], choose(("drift",), (), ()))
    assert cautions(known, sensitivity=Sensitivity(0.9, 2e-3)) == ()
    (said,) = cautions(known, sensitivity=Sensitivity(4e-5, 0.9))
    assert said.startswith("with a third of the expected sizes")
    assert len(cautions(known, sensitivity=Sensitivity(4e-5, 1e-9))) == 2
