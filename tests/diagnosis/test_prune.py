"""An effect that is at work helps on rows held out; what was picked from noise does not, or even harms."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis.simulated import forced
from simulate import simulate

from thermal_robot.diagnosis.prune import earned
from thermal_robot.effects import choose
from thermal_robot.effects.quantities import quantities
from thermal_robot.inference.columns import Block, block
from thermal_robot.inference.fit import fit
from thermal_robot.inference.screening import Target, smooth_columns

NOISE = 25e-6
SINGLE = ("joint_offset", "joint_gain", "transmission_error", "backlash", "joint_compliance", "thermal_elongation")


class Law:
    """What a block of columns is called."""

    name = "law"


def best_by_chance(known):
    """Of the smooth laws of all quantities in all joints the one that fits the remainder best."""
    seen, tried = known.corrected, []
    for joint in range(seen.robot.n):
        for values in quantities(seen).values():
            law = smooth_columns(values)
            for some in (law, *(law[:, k, None] for k in range(law.shape[1]))):
                if some.shape[1]:
                    tried.append(seen.joint_sensitivity[:, :3, joint, None] * some[:, None, :])
    target = Target.of(seen.gap, known.explanation.linear.frames)
    assert len(tried) > 200
    columns = max(tried, key=lambda c: target.worth(c).gain)
    return Block(Law(), (), columns, NOISE / np.sqrt((columns**2).mean(axis=(0, 1))))


@pytest.mark.parametrize("name", SINGLE)
def test_an_effect_of_twice_the_noise_helps(rv_m2, name):
    for seed in range(4):
        campaign = simulate(rv_m2, [name], seed=seed, samples=75, ratio=(2.0, 2.0))[0]
        known = fit(campaign, choose((name,), (), ()))
        assert [effect.name for effect, _ in known.effects] == [name]
        said = earned(known)[name]
        assert said.helps
        assert not said.harms
        assert said.blocked.scheme == "time"
        low, high = said.blocked.interval
        assert 0.0 < low < said.blocked.nats < high
        assert 0.0 < said.blocked.share < 1.0
        assert said.hardest.interval[1] <= high


@pytest.mark.slow
def test_a_law_picked_from_hundreds_in_noise_does_not_help(rv_m2):
    helps = []
    for seed in range(24):
        known = fit(simulate(rv_m2, seed=seed, samples=75)[0], ())
        helps.append(earned(forced(known, best_by_chance(known)))["law"].helps)
    assert np.mean(helps) < 0.1


def test_what_fits_noise_alone_harms(rv_m2):
    """Thirty-six parameters of no use make the predictions of thirty rows worse."""
    harms = []
    for seed in range(6):
        known = fit(simulate(rv_m2, seed=seed, samples=30)[0], ())
        geometry = block(known.corrected, choose(("geometric",), (), ())[0])
        said = earned(forced(known, replace(geometry, sizes=10.0 * geometry.sizes)))["geometric"]
        harms.append(said.harms)
        assert not said.helps
    assert np.mean(harms) > 0.8


def test_of_two_effects_each_is_asked_beside_the_other(rv_m2):
    campaign = simulate(rv_m2, ["thermal_elongation", "backlash"], seed=1, samples=75)[0]
    both = earned(fit(campaign, choose((), (), ())))
    assert set(both) == {"thermal_elongation", "backlash"}
    assert all(said.helps for said in both.values())
    small = replace(campaign, covariates={k: v for k, v in campaign.covariates.items() if k != "temperature"})
    schemes = {said.hardest.scheme for said in earned(fit(small, choose(("backlash",), (), ()))).values()}
    assert "temperature" not in schemes


def test_nothing_found_earns_nothing(rv_m2):
    assert earned(fit(simulate(rv_m2, seed=2)[0], ())) == {}
