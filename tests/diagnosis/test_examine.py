"""Whether a remainder is noise: by size, repeats, neighbours, laws, and rows set aside in a row."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import NOISE
from simulate import simulate

from thermal_robot import diagnose
from thermal_robot.diagnosis.examine import examine
from thermal_robot.effects import choose
from thermal_robot.inference import settings
from thermal_robot.inference.fit import fit
from thermal_robot.observations import Frames, observe


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
    for seed in range(4):
        said = examine(known(rv_m2, seed=seed))
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
        said = examine(fit(campaign, choose(("instrument_scale",), (), ())))
        assert said.source == source
        assert said.floor == pytest.approx(NOISE, rel=0.2)
    assert examine(fit(stated, ())).floor == NOISE


def test_play_of_a_joint_is_told_with_its_place_and_side(rv_m2):
    said = examine(known(rv_m2, ["backlash"], ratio=(5.0, 6.0), places=["joint_3"])).unexplained
    assert said.flagged
    assert said.p_value < 1e-10
    assert (said.locations[0].kind, said.locations[0].name) == ("joint", "joint_3")
    assert said.locations[0].share > 0.9
    assert said.depends_on[0].covariate == "approach.joint_3"
    assert any("times the stated noise" in reason for reason in said.reasons)
    # noise subtracted, as it is stated; the frames take a little of an effect
    assert said.rms == pytest.approx(5.5 * np.sqrt(3.0) * NOISE, rel=0.2)


def test_places_share_one_probability(rv_m2):
    said = examine(known(rv_m2, ["backlash"], ratio=(1.5, 1.6), places=["joint_3"])).unexplained
    assert said.flagged
    shares = [place.share for place in said.locations]
    assert shares == sorted(shares, reverse=True)
    assert 0.9 < sum(shares) <= 1.0 + 1e-12
    # as large as the noise: not subtracted, it would be 1.8 of it
    assert said.rms == pytest.approx(1.5 * np.sqrt(3.0) * NOISE, rel=0.12)


def test_what_is_explained_is_not_left(rv_m2):
    explained = known(rv_m2, ["backlash"], only=("backlash",), ratio=(5.0, 6.0), places=["joint_3"])
    assert not examine(explained).unexplained.flagged


def test_a_remainder_below_what_anybody_measures_is_no_question(rv_m2):
    plain = simulate(rv_m2, seed=3)[0]
    place = observe(plain, Frames.declared(plain)).predicted_position
    wave = 1e-10 * np.sin(3.0 * plain.q[:, :3])
    said = examine(fit(replace(plain, position=place + wave, noise_position=1e-12), ()))
    assert not said.unexplained.flagged
    assert said.unexplained.rms == 0.0


def test_a_remark_is_made_at_each_stage(rv_m2):
    heard = []
    examine(known(rv_m2), heard.append)
    assert len(heard) == 2


@pytest.mark.parametrize("stated", [1.0, 2.0])
def test_structure_below_the_stated_noise_is_looked_at(rv_m2, stated):
    """What is smaller than the stated noise is not too large; neighbours and laws are asked all the same."""
    for seed in range(3):
        play = simulate(rv_m2, ["backlash"], seed=seed, noise=NOISE / 2.0, ratio=(1.2, 1.3), places=["joint_3"])[0]
        known = fit(replace(play, noise_position=stated * NOISE), ())
        said = examine(known).unexplained
        assert said.flagged
        assert not any("times the stated noise" in reason for reason in said.reasons)
        assert said.locations[0].name == "joint_3"
        assert said.depends_on[0].covariate == "approach.joint_3"
        assert said.rms == pytest.approx(1.25 * np.sqrt(3.0) * NOISE / 2.0, rel=0.2)
