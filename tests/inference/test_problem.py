"""What the normal equations hold: the frames projected out, what the data cannot see or tell apart left out."""

from dataclasses import replace

import numpy as np
import pytest
from inference.problems import WIDTHS, FirstJoint, problem_of, small_problem
from simulate import simulate

from thermal_robot import diagnose
from thermal_robot.effects import choose
from thermal_robot.inference.evidence import Search
from thermal_robot.inference.problem import (
    Linear,
    contained,
    gram,
    parameter_values,
)


def test_values_are_the_posterior_mean_and_covariance():
    linear, whitening = small_problem(3, present=(0, 2))
    problem = gram(linear, whitening)
    found = Search(problem, (0, 0, 0)).evaluate((0, 2))
    used = whitening.weights > 0
    root = np.sqrt(whitening.weights[used])[:, None, None]
    columns = [(linear.blocks[b].columns[used] * root).reshape(-1, WIDTHS[b]) for b in (0, 2)]
    frames = (linear.frames[used] * root).reshape(len(columns[0]), -1)
    # all unknowns at once: frames with a flat prior, parameters with theirs
    design = np.hstack([frames, *columns])
    sizes = np.repeat([2.0 * found.scales[0], 2.0 * found.scales[2]], [1, 3])
    precision = design.T @ design / found.noise**2 + np.diag([0.0, 0.0, *(1.0 / sizes**2)])
    covariance = np.linalg.inv(precision)
    mean = covariance @ design.T @ (linear.gap[used] * root[:, :, 0]).ravel() / found.noise**2
    values = parameter_values(linear, problem, found)
    np.testing.assert_allclose(np.concatenate([values[0][0], values[2][0]]), mean[2:], rtol=1e-9)
    np.testing.assert_allclose(values[0][1], covariance[2:3, 2:3], rtol=1e-9)
    np.testing.assert_allclose(values[2][1], covariance[3:, 3:], rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize("unit", [1e-3, 1e3])
def test_units_do_not_matter(unit):
    """Metres or millimetres for the gap; parameters in any unit whose expected size is stated in it."""
    linear, whitening = small_problem(2, present=(0, 2))
    plain = gram(linear, whitening)
    blocks = tuple(replace(b, columns=b.columns * unit) for b in linear.blocks)
    longer = Linear(linear.gap * unit, linear.frames * 7.0, blocks)
    longer = gram(longer, replace(whitening, noise=whitening.noise * unit))
    blocks = tuple(replace(b, columns=b.columns * unit, sizes=b.sizes / unit) for b in linear.blocks)
    other = gram(replace(linear, blocks=blocks), whitening)
    for again in (longer, other):
        assert again.equations == plain.equations == 11 * 3 - 2
        assert again.total == pytest.approx(plain.total, rel=1e-12)
        np.testing.assert_allclose(again.matrix, plain.matrix, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(np.abs(again.vector), np.abs(plain.vector), rtol=1e-9)


on_arms = pytest.mark.parametrize("arm", ["rv_m2", "ur10", "panda"], indirect=True)


@on_arms
@pytest.mark.parametrize("turning", [None, 3e-5], ids=["positions", "poses"])
def test_an_offset_of_the_first_joint_is_a_turn_of_an_unknown_base(arm, turning):
    offset = choose(["joint_offset"])[0]
    _, seen = problem_of(arm, [FirstJoint(), offset], turning)
    assert seen.bases[0].shape == (1, 0)
    assert seen.slices[0] == slice(0, 0)
    assert np.abs(seen.bases[1][0]).max() < 1e-6  # no visible direction holds the first joint
    # the last joint's is a turn of the unknown target, on an axis or in a pose
    assert np.abs(seen.bases[1][-1]).max() < 1e-6
    assert seen.bases[1].shape[1] == arm.n - 2
    _, seen = problem_of(arm, [FirstJoint(), offset], turning, base_known=True)
    assert seen.bases[0].shape == (1, 1)
    assert seen.bases[1].shape[1] == arm.n - 1


def test_what_lies_in_the_frames_is_confounded_with_them(rv_m2):
    campaign = simulate(rv_m2, seed=1, samples=60)[0]
    finding = diagnose(campaign, effects=[FirstJoint()]).finding("first_joint")
    assert finding.status == "confounded"
    assert finding.confounded_with == ("base_frame", "tool_frame")
    assert finding.parameters == ()


@on_arms
@pytest.mark.parametrize("turning", [None, 3e-5], ids=["positions", "poses"])
def test_geometric_contains_offsets_and_for_positions_scale_and_nothing_else(arm, turning):
    names = ["joint_offset", "joint_gain", "transmission_error", "backlash", "joint_compliance", "geometric"]
    names += ["thermal_elongation", "drift", "instrument_scale"]
    effects = choose(names)
    _, seen = problem_of(arm, effects, turning)
    pairs = {tuple(sorted(effects[b].name for b in pair)) for pair in contained(seen)}
    held = {("geometric", "joint_offset"), ("geometric", "instrument_scale")}
    assert held == {pair for pair in pairs if "geometric" in pair}
    search = Search(seen, (-2.2,) * len(effects), contained(seen))
    search.run()
    assert len(search.seen) > 10
    assert not any(pair <= set(blocks) for pair in contained(seen) for blocks in search.seen)


@pytest.mark.parametrize("arm", ["ur10"], indirect=True)
def test_two_effects_of_which_one_contains_the_other_are_never_named_together(arm):
    for seed, both in enumerate([["geometric", "joint_offset"], ["geometric", "instrument_scale"]]):
        campaign = simulate(arm, both, seed=seed)[0]
        found = diagnose(campaign)
        assert found.verdict == ("geometric",)
        assert found.finding(both[1]).status != "found"
