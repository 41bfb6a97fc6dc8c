"""What an explanation leaves, whitened, and what repeats say of it."""

from dataclasses import replace

import numpy as np
import pytest
from simulate import simulate

from thermal_robot import EstimationError, diagnose
from thermal_robot.diagnosis.examine import nearest, remainder, repeats
from thermal_robot.effects import choose
from thermal_robot.inference.fit import fit
from thermal_robot.inference.frames import register
from thermal_robot.observations import observe


def repeated(campaign, times, seed, noise=20e-6):
    """Each command measured several times, in turn."""
    rows = np.tile(np.arange(campaign.samples), times)
    again = replace(campaign.take(rows), rows=np.arange(2, len(rows) + 2), covariates={})
    exact = simulate_exact(campaign)
    noisy = exact[rows] + noise * np.random.default_rng(seed).normal(size=(len(rows), 3))
    return replace(again, position=noisy)


def simulate_exact(campaign):
    """Where the nominal robot has the target, with the frames of the campaign."""

    return observe(campaign, register(campaign)).predicted_position


def _noise(campaign, stated):
    return campaign if stated else replace(campaign, noise_position=None)


@pytest.mark.parametrize("stated", [True, False], ids=["noise stated", "noise from repeats"])
def test_repeated_commands_without_a_fault_leave_nothing_unexplained(clean, stated):
    found = [diagnose(_noise(repeated(clean, 2, seed), stated)) for seed in range(4)]
    assert sum(d.verdict == () and not d.unexplained.flagged for d in found) >= 3
    if not stated:
        floors = [d.gap.noise_floor / np.sqrt(3.0) for d in found]
        assert np.median(floors) == pytest.approx(20e-6, rel=0.15)
        assert {d.gap.noise_source for d in found} == {"repeats"}


@pytest.mark.parametrize("rows", [3, 4, 6])
def test_too_few_poses_are_refused_and_the_need_is_named(clean, rows):
    with pytest.raises(EstimationError, match=f"{rows} different poses are too few: 9 unknowns .* at least 7"):
        diagnose(clean.take(np.arange(rows)))


def test_three_poses_repeated_are_three_poses(clean):
    with pytest.raises(EstimationError, match="3 different poses"):
        diagnose(repeated(clean.take(np.arange(3)), 20, 0))


@pytest.fixture(scope="module")
def left(rv_m2):
    """A fit with an effect, some rows spoilt, and what it leaves."""
    known = fit(simulate(rv_m2, ["backlash"], seed=2, outliers=0.05)[0], choose(("backlash",), (), ()))
    return known, remainder(known)


def test_nothing_that_was_fitted_is_left(left):
    known, rest = left
    e = known.explanation
    assert e.outliers.any()
    np.testing.assert_array_equal(rest.rows, np.flatnonzero(~e.outliers))
    assert rest.white.shape == (len(rest.rows), 3)
    columns = np.concatenate([e.linear.frames, *(e.linear.blocks[b].columns for b in e.best.blocks)], axis=2)
    design = columns[rest.rows].reshape(rest.white.size, -1)
    along = design.T @ rest.white.ravel() / np.linalg.norm(design, axis=0)
    assert np.abs(along).max() < 1e-9 * np.linalg.norm(rest.white)


def test_noise_leaves_one_square_an_equation(left):
    known, rest = left
    assert rest.freedom == rest.white.size - rest.target.basis.shape[1]
    assert rest.scale2 == pytest.approx((known.explanation.best.noise) ** 2, rel=0.2)


def test_some_rows_stand_for_all(left):
    _, rest = left
    assert rest.some(1000) is rest
    few = rest.some(50)
    assert len(few.rows) == 50
    assert set(few.rows) < set(rest.rows)
    assert few.scale2 == pytest.approx(rest.scale2, rel=0.5)
    np.testing.assert_array_equal(few.rows, rest.some(50).rows)


def test_repeats_tell_the_noise_and_not_the_error(clean):
    """What both visits have in common cancels: an error of 40 noises is none of the repeats' business."""
    twice = repeated(clean, 2, 3)
    wave = 8e-4 * np.sin(5.0 * twice.q[:, :3])
    known = fit(replace(twice, position=twice.position + wave), ())
    rest = remainder(known)
    said = repeats(known, rest)
    assert said.pairs == 60
    assert said.position == pytest.approx(20e-6, rel=0.15)
    assert rest.scale2 > 100.0 * said.scale2


def test_too_few_repeats_say_nothing(clean):
    known = fit(clean, ())
    assert repeats(known, remainder(known)) is None


def test_nobody_is_his_own_neighbour():
    rng = np.random.default_rng(0)
    points = np.vstack([rng.normal(size=(30, 2)), np.tile([5.0, 5.0], (6, 1))])
    distance, number = nearest(points, 3)
    assert distance.shape == number.shape == (36, 3)
    assert not (number == np.arange(36)[:, None]).any()
    assert (np.diff(distance, axis=1) >= 0.0).all()
    np.testing.assert_allclose(np.linalg.norm(points[:, None] - points[number], axis=2), distance)
    assert (distance[30:] == 0.0).all()
    apart = np.linalg.norm(points[:30, None] - points[None], axis=2)
    np.testing.assert_allclose(distance[:30], np.sort(apart, axis=1)[:, 1:4])
