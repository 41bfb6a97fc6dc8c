"""Whether a residual is noise: by size, repeats, neighbours, laws, and what rows set aside have in common."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import NOISE
from scipy.stats import hypergeom
from simulate import simulate

from thermal_robot import EstimationError, diagnose
from thermal_robot.diagnosis.residual_tests import (
    analyse_residual,
    nearest,
    repeats,
    residual,
    scan_test,
    too_many,
)
from thermal_robot.effects import choose
from thermal_robot.inference import settings
from thermal_robot.inference.fit import fit
from thermal_robot.inference.registration import register
from thermal_robot.observations import Frames, observe


@pytest.mark.slow
def test_rows_set_aside_one_after_the_other_are_no_gross_errors(rv_m2):
    """A target that was knocked late leaves few rows, which look spoilt; spoilt rows do not follow each other."""
    plain = simulate(rv_m2, samples=100, seed=5)[0]
    rng = np.random.default_rng(5)
    late = np.arange(100) >= 85
    knocked = simulate(rv_m2, samples=100, seed=5)[0]
    order = {"time": np.arange(100.0)}
    target = np.array([0.0, 1e-3, 0.0])
    turned = observe(plain, Frames.declared(plain)).chain.tool_rotation @ target
    data = replace(knocked, position=knocked.position + np.where(late[:, None], turned, 0.0), covariates=order)
    found = diagnose(data)
    assert found.unexplained.flagged
    assert found.finding("discovered.1").quantity == "time"
    spoilt = np.where(np.isin(np.arange(100), rng.permutation(100)[:6])[:, None], 2e-3, 0.0)
    scattered = diagnose(replace(plain, position=plain.position + spoilt, covariates=order))
    assert not scattered.unexplained.flagged
    assert len(scattered.outliers) == 6


def known(robot, effects=(), only=("instrument_scale",), **how):
    """A campaign of a robot, diagnosed with few candidates."""
    return fit(simulate(robot, list(effects), **{"seed": 3, "noise": NOISE, **how})[0], choose(only, (), ()))


def test_noise_is_noise_whatever_its_size(rv_m2):
    for seed in range(2):
        said = analyse_residual(known(rv_m2, seed=seed))
        assert not said.unexplained.flagged
        assert (said.unexplained.rms, said.unexplained.reasons, said.unexplained.depends_on) == (0.0, (), ())
        assert said.unexplained.p_value > settings.LEVEL


def test_the_floor_is_stated_or_learnt_from_what_there_is(rv_m2):
    stated = simulate(rv_m2, seed=3, noise=NOISE)[0]
    none = replace(stated, noise_position=None)
    rows = np.tile(np.arange(60), 2)
    rng = np.random.default_rng(3)
    place = observe(stated, Frames.declared(stated)).predicted_position[rows]
    again = replace(none.take(rows), position=place + NOISE * rng.normal(size=place.shape), rows=np.arange(2, 122))
    for campaign, source in ((stated, "stated"), (none, "remainder"), (again, "repeats")):
        said = analyse_residual(fit(campaign, choose(("instrument_scale",), (), ())))
        assert said.source == source
        assert said.floor == pytest.approx(NOISE, rel=0.2)
    assert analyse_residual(fit(stated, ())).floor == NOISE


def test_play_of_a_joint_is_told_with_its_place_and_side(rv_m2):
    said = analyse_residual(known(rv_m2, ["backlash"], ratio=(5.0, 6.0), places=["joint_3"])).unexplained
    assert said.flagged
    assert said.p_value < 1e-10
    assert (said.locations[0].kind, said.locations[0].name) == ("joint", "joint_3")
    assert said.locations[0].share > 0.9
    assert said.depends_on[0].covariate == "approach.joint_3"
    assert any("times the stated noise" in reason for reason in said.reasons)
    # what is explained is not left, and a remark is made at each stage
    explained, stages = known(rv_m2, ["backlash"], only=("backlash",), ratio=(5.0, 6.0), places=["joint_3"]), []
    assert not analyse_residual(explained, stages.append).unexplained.flagged
    assert len(stages) == 2
    # noise subtracted, as it is stated; the frames take a little of an effect
    assert said.rms == pytest.approx(5.5 * np.sqrt(3.0) * NOISE, rel=0.2)


def test_places_share_one_probability(rv_m2):
    said = analyse_residual(known(rv_m2, ["backlash"], ratio=(1.5, 1.6), places=["joint_3"])).unexplained
    assert said.flagged
    shares = [place.share for place in said.locations]
    assert shares == sorted(shares, reverse=True)
    assert 0.9 < sum(shares) <= 1.0 + 1e-12
    # as large as the noise: not subtracted, it would be 1.8 of it
    assert said.rms == pytest.approx(1.5 * np.sqrt(3.0) * NOISE, rel=0.12)


def test_a_remainder_below_what_anybody_measures_is_no_question(rv_m2):
    plain = simulate(rv_m2, seed=3)[0]
    place = observe(plain, Frames.declared(plain)).predicted_position
    wave = 1e-10 * np.sin(3.0 * plain.q[:, :3])
    said = analyse_residual(fit(replace(plain, position=place + wave, noise_position=1e-12), ()))
    assert not said.unexplained.flagged
    assert said.unexplained.rms == 0.0


@pytest.mark.parametrize("stated", [1.0, pytest.param(2.0, marks=pytest.mark.slow)])
def test_structure_below_the_stated_noise_is_looked_at(rv_m2, stated):
    """What is smaller than the stated noise is not too large; neighbours and laws are asked all the same."""
    for seed in range(1):
        play = simulate(rv_m2, ["backlash"], seed=seed, noise=NOISE / 2.0, ratio=(1.2, 1.3), places=["joint_3"])[0]
        known = fit(replace(play, noise_position=stated * NOISE), ())
        said = analyse_residual(known).unexplained
        assert said.flagged
        assert not any("times the stated noise" in reason for reason in said.reasons)
        assert said.locations[0].name == "joint_3"
        assert said.depends_on[0].covariate == "approach.joint_3"
        assert said.rms == pytest.approx(1.25 * np.sqrt(3.0) * NOISE / 2.0, rel=0.2)


def repeated(campaign, times, seed, noise=20e-6):
    """Each command measured several times, in turn."""
    rows = np.tile(np.arange(campaign.samples), times)
    again = replace(campaign.take(rows), rows=np.arange(2, len(rows) + 2), covariates={})
    exact = observe(campaign, register(campaign)).predicted_position
    noisy = exact[rows] + noise * np.random.default_rng(seed).normal(size=(len(rows), 3))
    return replace(again, position=noisy)


@pytest.mark.slow
@pytest.mark.parametrize("stated", [False, True])
def test_repeated_commands_without_a_fault_leave_nothing_unexplained(clean, stated):
    campaigns = [repeated(clean, 2, seed) for seed in range(4)]
    found = [diagnose(c if stated else replace(c, noise_position=None)) for c in campaigns]
    assert sum(d.verdict == () and not d.unexplained.flagged for d in found) >= 3
    if not stated:
        floors = [d.gap.noise_floor / np.sqrt(3.0) for d in found]
        assert np.median(floors) == pytest.approx(20e-6, rel=0.15)
        assert {d.gap.noise_source for d in found} == {"repeats"}


def test_three_poses_repeated_are_three_poses(clean):
    with pytest.raises(EstimationError, match="3 different poses"):
        diagnose(repeated(clean.take(np.arange(3)), 20, 0))


@pytest.fixture(scope="module")
def left(rv_m2):
    """A fit with an effect, some rows spoilt, and what it leaves."""
    known = fit(simulate(rv_m2, ["backlash"], seed=2, outliers=0.05)[0], choose(("backlash",), (), ()))
    return known, residual(known)


def scale2(rest):
    """Sum of squares over the degrees of freedom, in squares of the noise."""
    return (rest.white**2).sum() / rest.target.freedom


def test_nothing_that_was_fitted_is_left_and_some_rows_stand_for_all(left):
    # nothing that was fitted is left
    known, rest = left
    e = known.explanation
    assert e.outliers.any()
    np.testing.assert_array_equal(rest.rows, np.flatnonzero(~e.outliers))
    assert rest.white.shape == (len(rest.rows), 3)
    columns = np.concatenate([e.linear.frames, *(e.linear.blocks[b].columns for b in e.best.blocks)], axis=2)
    design = columns[rest.rows].reshape(rest.white.size, -1)
    along = design.T @ rest.white.ravel() / np.linalg.norm(design, axis=0)
    assert np.abs(along).max() < 1e-9 * np.linalg.norm(rest.white)
    # some rows stand for all
    _, rest = left
    assert rest.some(1000) is rest
    few = rest.some(50)
    assert len(few.rows) == 50
    assert set(few.rows) < set(rest.rows)
    assert scale2(few) == pytest.approx(scale2(rest), rel=0.5)
    np.testing.assert_array_equal(few.rows, rest.some(50).rows)


def test_repeats_tell_the_noise_and_too_few_say_nothing(clean):
    # What both visits have in common cancels: an error of 40 noises is none of the repeats' business.
    twice = repeated(clean, 2, 3)
    wave = 8e-4 * np.sin(5.0 * twice.q[:, :3])
    known = fit(replace(twice, position=twice.position + wave), ())
    rest = residual(known)
    said = repeats(known, rest)
    assert said.pairs == 60
    assert said.position == pytest.approx(20e-6, rel=0.15)
    assert scale2(rest) > 100.0 * said.scale2
    # too few repeats say nothing
    known = fit(clean, ())
    assert repeats(known, residual(known)) is None


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


@pytest.mark.slow
@pytest.mark.parametrize("count", [0, 3, 5])
def test_a_few_rows_anywhere_are_gross_errors(rv_m2, count):
    for seed in range(6):
        known = spoilt(rv_m2, at_random(count), seed)
        assert known.explanation.outliers.sum() == count
        left = analyse_residual(known).unexplained
        assert not left.flagged
        assert too_many(known, residual(known)).p > settings.LEVEL


def test_more_rows_than_an_instrument_spoils_are_unexplained(rv_m2):
    known = spoilt(rv_m2, at_random(15))
    assert known.explanation.outliers.sum() == 15
    left = analyse_residual(known).unexplained
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
        flagged.append(too_many(known, residual(known)).p < settings.LEVEL)
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
    left = analyse_residual(known).unexplained
    assert left.flagged
    assert any(f"lie together in {name}" in reason for reason in left.reasons)


def torque(campaign):
    return observe(campaign, Frames.declared(campaign)).torque


def pressed(campaign, joint):
    """Load against the side from which a joint came."""
    return torque(campaign)[:, joint] * campaign.covariates[f"approach.joint_{joint + 1}"]


def test_the_scan_statistic_is_that_of_chance():
    # chance puts them together as often as it is said to
    rng = np.random.default_rng(0)
    for samples, count in ((60, 3), (100, 8), (300, 40)):
        said = []
        for _ in range(150):
            aside = np.isin(np.arange(samples), rng.permutation(samples)[:count])
            values = [rng.normal(size=samples), rng.choice([-1.0, 1.0], samples), rng.integers(0, 4, samples)]
            said += [scan_test(np.asarray(v, dtype=float), aside) for v in values]
        assert np.mean(np.array(said) < 0.05) < 0.05
        assert np.mean(np.array(said) < 0.01) < 0.01
    # All twelve rows set aside came from one side, as half of all rows did.
    values = np.repeat([-1.0, 1.0], 50)
    aside = np.isin(np.arange(100), np.arange(12))
    alone = hypergeom.sf(11, 99, 49, 11) + hypergeom.pmf(11, 99, 49, 11)
    assert alone < scan_test(values, aside) < 100.0 * alone
    assert scan_test(values, np.isin(np.arange(100), np.arange(44, 56))) == 1.0
    # a narrow band in the middle is seen
    values = np.random.default_rng(1).permutation(200).astype(float)
    assert scan_test(values, (values > 95) & (values < 103)) < 1e-6
    assert scan_test(values, values % 25 == 0) > 0.5
