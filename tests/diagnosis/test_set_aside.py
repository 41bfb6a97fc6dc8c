"""Rows set aside: as many as an instrument spoils, and nothing in common, or else they are unexplained."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import hypergeom
from simulate import simulate

from thermal_robot.diagnosis.examine import alike, examine, remainder, together, too_many
from thermal_robot.inference import settings
from thermal_robot.inference.fit import fit
from thermal_robot.observations import Frames, observe

NOISE = 25e-6


def spoilt(robot, rows, seed=5, samples=100, size=40.0, heavy=False):
    """A fit of a sound robot of which some rows are spoilt, each by as much in a direction of its own."""
    campaign = simulate(robot, samples=samples, seed=seed, noise=NOISE, heavy=heavy)[0]
    rng = np.random.default_rng(seed)
    push = rng.normal(size=(samples, 3))
    push *= size * NOISE / np.linalg.norm(push, axis=1, keepdims=True)
    bad = np.isin(np.arange(samples), rows(campaign, rng) if callable(rows) else rows)
    return fit(replace(campaign, position=campaign.position + np.where(bad[:, None], push, 0.0)), ())


def at_random(count):
    return lambda campaign, rng: rng.permutation(campaign.samples)[:count]


@pytest.mark.parametrize("count", [0, 3, 5])
def test_a_few_rows_anywhere_are_gross_errors(rv_m2, count):
    for seed in range(6):
        known = spoilt(rv_m2, at_random(count), seed)
        assert known.explanation.outliers.sum() == count
        left = examine(known).unexplained
        assert not left.flagged
        assert too_many(known, remainder(known))[0] > settings.LEVEL


def test_more_rows_than_an_instrument_spoils_are_unexplained(rv_m2):
    known = spoilt(rv_m2, at_random(15))
    assert known.explanation.outliers.sum() == 15
    left = examine(known).unexplained
    assert left.flagged
    assert any("15 of 100 rows were set aside (15 %)" in reason for reason in left.reasons)
    # the rest is noise: it follows nothing, and what is unexplained is in the rows set aside
    assert left.locations == left.depends_on == ()
    assert left.rms == pytest.approx(np.sqrt(0.15) * 40.0 * NOISE, rel=0.1)


def test_heavy_tails_set_a_few_more_rows_aside(rv_m2):
    """Student's law of four degrees of freedom, the tails that are tried in this program."""
    shares, flagged = [], []
    for seed in range(3):
        known = spoilt(rv_m2, (), seed, samples=250, heavy=True)
        shares.append(known.explanation.outliers.mean())
        flagged.append(too_many(known, remainder(known))[0] < settings.LEVEL)
    assert np.mean(shares) > 0.001
    assert not any(flagged)


@pytest.mark.parametrize(
    ("name", "rows"),
    [
        ("joint_3", lambda c, _: np.argsort(c.q[:, 2])[-8:]),
        ("payload", lambda c, rng: rng.permutation(np.flatnonzero(c.covariates["payload"] == 3.0))[:20]),
        ("torque.joint_2", lambda c, _: np.argsort(torque(c)[:, 1])[:8]),
        ("approach.joint_2 × torque.joint_2", lambda c, _: np.argsort(pressed(c, 1))[-8:]),
    ],
)
def test_what_they_have_in_common_is_named(rv_m2, name, rows):
    known = spoilt(rv_m2, rows)
    assert known.explanation.outliers.sum() >= 7
    left = examine(known).unexplained
    assert left.flagged
    assert any(f"lie together in {name}" in reason for reason in left.reasons)


def torque(campaign):
    return observe(campaign, Frames.declared(campaign)).torque


def pressed(campaign, joint):
    """Load against the side from which a joint came."""
    return torque(campaign)[:, joint] * campaign.covariates[f"approach.joint_{joint + 1}"]


def test_chance_puts_them_together_as_often_as_it_is_said_to():
    rng = np.random.default_rng(0)
    for samples, count in ((60, 3), (100, 8), (300, 40)):
        said = []
        for _ in range(400):
            aside = np.isin(np.arange(samples), rng.permutation(samples)[:count])
            values = [rng.normal(size=samples), rng.choice([-1.0, 1.0], samples), rng.integers(0, 4, samples)]
            said += [together(np.asarray(v, dtype=float), aside) for v in values]
        assert np.mean(np.array(said) < 0.05) < 0.05
        assert np.mean(np.array(said) < 0.01) < 0.01


def test_rows_on_one_side_of_two_have_the_probability_of_a_draw_from_it():
    """All twelve rows set aside came from one side, as half of all rows did."""
    values = np.repeat([-1.0, 1.0], 50)
    aside = np.isin(np.arange(100), np.arange(12))
    alone = hypergeom.sf(11, 99, 49, 11) + hypergeom.pmf(11, 99, 49, 11)
    assert alone < together(values, aside) < 100.0 * alone
    assert together(values, np.isin(np.arange(100), np.arange(44, 56))) == 1.0


def test_a_narrow_band_in_the_middle_is_seen():
    values = np.random.default_rng(1).permutation(200).astype(float)
    assert together(values, (values > 95) & (values < 103)) < 1e-6
    assert together(values, values % 25 == 0) > 0.5


def test_two_rows_have_nothing_in_common(rv_m2):
    known = spoilt(rv_m2, lambda c, _: np.argsort(c.q[:, 2])[-2:])
    assert known.explanation.outliers.sum() == 2
    assert alike(known) == (1.0, "")
