"""The fit of named effects: all of them, exact, robust, and by the whole fit where that would choose the same."""

from dataclasses import replace

import numpy as np
import pytest

import thermal_robot as tr
from thermal_robot.effects import JointOffset, choose, gate, named
from thermal_robot.errors import EffectError, EstimationError
from thermal_robot.inference.fit import fit, fit_named

ARM, NOISE = "builtin:rv_m2", 20e-6
OFF = {"joint_2": 1.2e-3, "joint_3": -8e-4, "joint_4": 5e-4}


def simulated(effects, rows=60, seed=1, **further):
    return tr.simulate(
        ARM, effects, rows=rows, noise=NOISE, base=np.eye(4), tool=np.eye(4), tool_frame="tool0", seed=seed, **further
    )


@pytest.fixture(scope="module")
def campaign():
    return simulated({"joint_offset": OFF})


def test_it_is_the_whole_fit_where_that_would_choose_the_same(campaign):
    whole = fit(campaign, choose(only=["joint_offset"]))
    own = fit_named(campaign, [JointOffset()])
    assert [effect for effect, _ in whole.effects] == [effect for effect, _ in own.effects]
    std = np.sqrt(np.diag(own.explanation.values[0][1]))
    assert (np.abs(whole.effects[0][1] - own.effects[0][1]) < 0.05 * std).all()
    np.testing.assert_allclose(own.nominal.gap, whole.nominal.gap, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(own.corrected.gap, whole.corrected.gap, rtol=0.0, atol=0.05 * NOISE)


def test_an_effect_that_is_not_there_is_fitted_all_the_same(campaign):
    found = fit_named(campaign, [named("joint_offset"), named("backlash")])
    assert [effect.name for effect, _ in found.effects] == ["joint_offset", "backlash"]
    values, covariance = found.effects[1][1], found.explanation.values[1][1]
    assert (np.abs(values) < 4.0 * np.sqrt(np.diag(covariance))).all()


def test_without_noise_the_exact_model_is_found():
    campaign = tr.simulate(ARM, {"joint_offset": {"joint_3": 0.03}}, base=np.eye(4), tool_frame="tool0", seed=2)
    found = fit_named(campaign, [JointOffset()])
    assert np.abs(found.nominal.gap).max() > 1e-3
    assert np.abs(found.corrected.gap).max() < 1e-7


def test_another_step_would_move_nothing_that_is_measured(campaign):
    found = fit_named(campaign, [named("geometric")])
    again = tr.observe(campaign, found.corrected.frames, displacement=found.corrected.displacement)
    np.testing.assert_array_equal(again.gap, found.corrected.gap)
    e = found.explanation
    (linear, covariance), (_, exact) = e.values[0], found.effects[0]
    away = np.linalg.lstsq(covariance, linear - exact, rcond=1e-12)[0] @ (linear - exact)
    assert away < 0.1**2 * len(exact)


def test_gross_errors_are_set_aside_and_change_little(campaign):
    position, struck = campaign.position.copy(), [4, 17, 40]
    position[struck] += [[0.01, 0.0, 0.0], [0.0, -0.02, 0.0], [0.0, 0.0, 0.005]]
    spoilt = fit_named(replace(campaign, position=position), [JointOffset()])
    clean = fit_named(campaign, [JointOffset()])
    assert np.flatnonzero(spoilt.explanation.outliers).tolist() == struck
    std = np.sqrt(np.diag(clean.explanation.values[0][1]))
    assert (np.abs(spoilt.effects[0][1] - clean.effects[0][1]) < 2.0 * std).all()


def test_what_is_told_inside_another_is_not_fitted_beside_it(campaign):
    both = fit_named(campaign, [named("joint_offset"), named("geometric")])
    assert [effect.name for effect, _ in both.effects] == ["geometric"]
    assert set(both.variants) == {"joint_offset", "geometric"}


def test_constants_of_another_kind_are_fitted_too():
    seen = tr.observe(simulated({}, rows=80))
    slow = max(gate.variants(named("thermal_elongation"), seen), key=lambda e: e.lag)
    found = fit_named(simulated({slow: 2e-5}, rows=80), [named("thermal_elongation")])
    assert found.effects[0][0].lag == pytest.approx(slow.lag, rel=0.5)


def test_what_a_campaign_lacks_is_said(campaign):
    bare = campaign.drop_covariate("temperature")
    with pytest.raises(EffectError, match="'thermal_elongation' cannot be fitted to simulated, which lacks temp"):
        fit_named(bare, [named("thermal_elongation")])
    with pytest.raises(EstimationError, match="different poses are too few"):
        fit_named(campaign.take(np.arange(4)), [JointOffset()])
    two = np.arange(campaign.samples) % 2
    held = replace(campaign, q=campaign.q[two] + 1e-4 * np.sin(campaign.q), labels={"pose": two.astype(str)})
    read = replace(campaign, q=campaign.q[two].round(3) + 1e-5 * np.sin(campaign.q))
    for again in (held, read):  # by its label; by what an encoder adds
        with pytest.raises(EstimationError, match=r"^2 different poses are too few"):
            fit_named(again, [JointOffset()])
