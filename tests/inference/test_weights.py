"""Noise and gross errors."""

import numpy as np
import pytest

from thermal_robot.inference.weights import (
    Noise,
    distance_limit,
    noise_estimate,
    reweigh,
    robust_noise,
)

SIGMA = np.repeat([2e-5, 3e-5], 3)  # m, rad
STATED = Noise(2e-5, 3e-5)
measured = pytest.mark.parametrize("measures", [3, 6], ids=["positions", "poses"])


def noise_of(rng, rows, measures=3):
    """Rows that hold nothing but the instrument's noise."""
    return SIGMA[:measures] * rng.normal(size=(rows, measures))


@measured
@pytest.mark.parametrize("rows", [20, 500])
def test_noise_alone_sets_a_row_aside_in_hardly_any_campaign(measures, rows):
    """Without the slack for heavier tails in one of a hundred, as the level says; with it more rarely."""
    rng = np.random.default_rng(0)
    farthest = rng.chisquare(measures, (4000, rows)).max(axis=1)
    limit = distance_limit(measures, rows)
    assert np.mean(farthest > limit / 1.5) == pytest.approx(0.01, abs=0.006)
    assert np.mean(farthest > limit) < 0.002
    assert distance_limit(measures, 2 * rows) > limit


@measured
def test_noise_is_read_off_normal_rows_and_hardly_off_gross_ones(measures):
    rng = np.random.default_rng(1)
    rows = noise_of(rng, 40_000, measures)
    sound = robust_noise(rows)
    np.testing.assert_allclose(sound, SIGMA[:measures:3], rtol=0.01)
    for gross in (0.1, 10.0):  # however large they are
        spoilt = rows.copy()
        spoilt[::4] += gross
        # the median of all is the 2/3 quantile of the sound: a fifth more than their own
        np.testing.assert_allclose(robust_noise(spoilt), 1.2 * sound, rtol=0.02)
    spoilt[::2] += 10.0
    assert (robust_noise(spoilt) > 10.0 * sound).all()


def test_what_was_fitted_is_given_back_to_the_noise():
    rng = np.random.default_rng(2)
    ratios = []
    for _ in range(60):
        rows = noise_of(rng, 200)
        design = rng.normal(size=(600, 240))
        left = rows.ravel() - design @ np.linalg.lstsq(design, rows.ravel(), rcond=None)[0]
        ratios.append(robust_noise(left.reshape(200, 3), leverage=0.4)[0] / SIGMA[0])
    assert np.mean(ratios) == pytest.approx(1.0, abs=4.0 * np.std(ratios) / np.sqrt(60))


def test_a_stated_noise_counts_whatever_is_left():
    """What is more in the remainder is something else, and has a form of its own."""
    position, orientation = 2e-5, 3e-5
    for left in ([2.2e-5, 1e-5], [5e-5, 3e-5], [1e-3, 1e-3]):
        same, held = noise_estimate(np.array(left), STATED, 6)
        np.testing.assert_array_equal(same, SIGMA)
        assert held > 0.0
    half, free = noise_estimate(np.array([5e-5, 4e-5]), Noise(position), 6)
    np.testing.assert_array_equal(half, np.repeat([position, 4e-5], 3))
    assert free == 0.0
    own, free = noise_estimate(np.array([1e-5]), Noise(), 3)
    np.testing.assert_array_equal(own, [1e-5] * 3)
    assert free == 0.0
    assert STATED.parts(3) == (position,)
    assert STATED.parts(6) == (position, orientation)
    # no noise is less than rounding: somebody wrote 1e-12 mm
    assert Noise(1e-15, 0.5e-9).parts(6) == (1e-9, 1e-9)
    assert Noise(None, None).parts(6) == (None, None)
    assert (robust_noise(np.zeros((20, 6))) > 0.0).all()


def test_where_more_than_noise_is_left_rows_are_far_only_if_far_from_the_others_and_a_quarter_at_most():
    # where more than noise is left rows are far only if far from the others
    rng = np.random.default_rng(8)
    rows = 10.0 * noise_of(rng, 400)
    whitening, aside = reweigh(rows, STATED, 0.0, 3)
    assert not aside.any()
    np.testing.assert_array_equal(whitening.noise, SIGMA[:3])
    rows[:5] += 500.0 * SIGMA[:3]
    np.testing.assert_array_equal(np.flatnonzero(reweigh(rows, STATED, 0.0, 3)[1]), np.arange(5))
    # no more than a quarter is set aside and these are the worst
    rng = np.random.default_rng(4)
    rows = noise_of(rng, 100)
    rows[:40] += np.arange(100.0, 140.0)[:, None] * SIGMA[:3]
    whitening, aside = reweigh(rows, STATED, 0.0, 3)
    np.testing.assert_array_equal(aside, np.isin(np.arange(100), np.arange(15, 40)))
    assert 0.0 < whitening.weights[:15].max() < whitening.weights[40:].min()
    # What is left where two thirds of the equations were taken up is smaller: as much is then less likely noise.
    rng = np.random.default_rng(5)
    rows = noise_of(rng, 300) / np.sqrt(3.0)
    rows[0] = 3.0 * SIGMA[:3]
    assert not reweigh(rows, STATED, 0.0, 3)[1].any()
    np.testing.assert_array_equal(np.flatnonzero(reweigh(rows, STATED, 2.0 / 3.0, 3)[1]), [0])


@measured
def test_gross_errors_are_set_aside_and_sound_rows_weigh_fully(measures):
    rng = np.random.default_rng(3)
    rows = noise_of(rng, 5000, measures)
    gross = np.arange(5000) % 10 == 0
    rows[gross] += 50.0 * SIGMA[:measures]
    whitening, aside = reweigh(rows, STATED, 0.0, measures)
    np.testing.assert_array_equal(aside, gross)
    np.testing.assert_array_equal(whitening.weights > 0.0, ~gross)
    sound = whitening.weights[~gross]
    assert sound.max() == 1.0
    assert np.mean(sound < 1.0) == pytest.approx(0.01, abs=0.005)
    # the further out, the less: past the bend the pull of a row no longer grows
    distance = np.linalg.norm(rows[~gross] / SIGMA[:measures], axis=1)
    bent = sound < 1.0
    np.testing.assert_allclose(np.ptp((sound * distance)[bent]), 0.0, atol=1e-9)
    assert distance[bent].min() > distance[~bent].max()


@measured
def test_rows_with_a_noise_of_their_own_are_judged_by_it(measures):
    """However unlike the rows are, the noise is found, none is a gross error, and what is one to its own noise is."""
    rng = np.random.default_rng(8)
    relative = np.ones((900, measures))
    relative[:, :3] = np.repeat([0.2, 1.0, 30.0], 300)[:, None]
    noise = Noise(None, None, relative)
    rows = relative * noise_of(rng, 900, measures)
    rows[0] += 40.0 * relative[0] * SIGMA[:measures]  # less than the noise of the last ones
    white, aside = reweigh(rows, noise, 0.0, measures)
    np.testing.assert_allclose(white.noise, SIGMA[:measures], rtol=0.1)
    assert np.flatnonzero(aside).tolist() == [0]
    np.testing.assert_allclose((rows[1:] / white.sigma()[1:]).std(axis=0), 1.0, atol=0.1)
