"""Zeros inside geometry: a change of coordinates whose intervals hold the truth; nothing said of what is not seen."""

from dataclasses import replace

import numpy as np
import pytest
from conftest import load_arm
from denavit import off
from simulate import simulate

from thermal_robot.effects import JointOffset, choose
from thermal_robot.inference.columns import moved_by
from thermal_robot.inference.fit import fit
from thermal_robot.inference.inside import divided
from thermal_robot.inference.registration import register

GEOMETRY = ("joint_offset", "geometric")
SIGMAS = 1.96


@pytest.fixture(scope="module")
def arm_off():
    """An arm with three parallel axes, and its zeros."""
    campaign, zeros = off(load_arm("ur10"), 1)
    return fit(campaign, choose(GEOMETRY)), zeros


def within_frames(known, moved):
    """Rms distance (m) of a displacement (N, m) from what the unknown frames can do."""
    flat = known.explanation.linear.frames.reshape(moved.size, -1)
    left = moved.ravel() - flat @ np.linalg.lstsq(flat, moved.ravel(), rcond=1e-12)[0]
    return float(np.sqrt((left**2).sum() / len(moved)))


def test_parts_move_the_target_as_the_whole_and_are_no_more_than_the_data_determine(arm_off):
    # all parts together move the target as the effect does
    known, _ = arm_off
    ((_, values),) = known.effects
    whole = known.explanation.linear.contribution(known.explanation.best.blocks[0], values)
    parts = divided(known, "geometric")
    moved = sum(moved_by(known.corrected, part.parameters) @ part.values for part in parts)
    assert within_frames(known, whole) > 1e-4
    # the zeros are freed of their prior: what that moves is far below the noise of 25 µm
    assert within_frames(known, moved - whole) < 2e-6
    # there are no more parameters than the data determine
    known, _ = arm_off
    zeros, rest = divided(known, "geometric")
    assert (zeros.effect, rest.effect) == ("joint_offset", "geometric")
    columns = moved_by(known.corrected, known.explanation.linear.blocks[known.explanation.best.blocks[0]].parameters)
    flat = known.explanation.linear.frames.reshape(columns.shape[0] * columns.shape[1], -1)
    stack = np.hstack([flat, columns.reshape(len(flat), -1)])

    def rank(matrix):
        return np.linalg.matrix_rank(matrix / np.linalg.norm(matrix, axis=0), tol=1e-6)

    assert len(zeros.parameters) + len(rest.parameters) == rank(stack) - rank(flat)
    # zeros that were found beside geometry are not told inside it
    known, _ = arm_off
    whole = sum(len(part.parameters) for part in divided(known, "geometric"))
    beside = replace(known, effects=(*known.effects, (JointOffset(), np.zeros(6))))
    (rest,) = divided(beside, "geometric")
    assert rest.effect == "geometric"
    assert len(rest.parameters) == whole


def test_zeros_that_turn_the_base_or_the_tool_are_not_seen(arm_off, rv_m2):
    known, _ = arm_off
    joints = known.corrected.robot.joint_names
    zeros, rest = divided(known, "geometric")
    assert [p.place for p in zeros.parameters] == list(joints[1:-1])
    assert [p.place for p in zeros.unseen] == [joints[0], joints[-1]]
    # of axes that are parallel only the sum of the shifts along them is seen, and told once
    shifts = [p.name for p in rest.parameters if p.name.startswith("shift")]
    assert any("shoulder_lift" in name for name in shifts)
    assert {name for p in rest.unseen if "shift" in (name := p.label)} >= {f"shift d of {j}" for j in joints[2:4]}
    assert not any("elbow" in name for name in shifts)


def test_with_known_frames_every_zero_is_seen(rv_m2):
    campaign, zeros = off(rv_m2, 3, turning=3e-5)
    frames = register(campaign)
    back = np.linalg.inv(frames.base)
    known = replace(
        campaign,
        position=campaign.position @ back[:3, :3].T + back[:3, 3],
        orientation=None,
        noise_orientation=None,
        base_known=True,
    )
    told = divided(fit(known, choose(GEOMETRY)), "geometric")[0]
    assert told.parameters[0].place == rv_m2.joint_names[0]
    # what registration took for the base is its own choice; the other joints' zeros do not hang on it
    assert np.abs((told.values - zeros[: len(told.values)]) / told.spread)[1:4].max() < 4.0


def test_an_effect_that_stands_for_itself_is_not_divided(rv_m2):
    known = fit(simulate(rv_m2, ["joint_offset"], seed=2)[0], choose(("joint_offset", "drift")))
    assert [effect.name for effect, _ in known.effects] == ["joint_offset"]
    assert divided(known, "joint_offset") == ()


def missed(name, seeds):
    """Errors of the zeros told inside geometry, in their standard deviations."""
    found = []
    for seed in seeds:
        campaign, zeros = off(load_arm(name), seed, turning=3e-5 if seed % 4 == 3 else None)
        known = fit(campaign, choose(GEOMETRY))
        if "geometric" not in {effect.name for effect, _ in known.effects}:
            continue
        told, joints = divided(known, "geometric")[0], campaign.robot.joint_names
        true = zeros[[joints.index(p.place) for p in told.parameters]]
        found += ((told.values - true) / told.spread)[told.spread < 0.5 * told.prior].tolist()
    return np.array(found)


def test_the_zeros_are_those_that_are_off():
    errors = missed("ur10", range(1, 4))
    assert len(errors) >= 10
    assert np.abs(errors).max() < 4.0


@pytest.mark.slow
def test_intervals_of_zeros_inside_geometry_hold_the_truth():
    arms = ("ur10", "ur5", "rv_m2", "panda", "z1", "so101", "xarm7", "kinova", "tiago")
    errors = np.concatenate([missed(name, range(16)) for name in arms])
    assert len(errors) > 500
    assert 0.93 <= (np.abs(errors) < SIGMAS).mean() <= 0.97
