"""The calibration alone: named effects come back as they were, with deviations that are true."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

import thermal_robot as tr
from thermal_robot.effects import KINEMATIC, Effect, Geometric, Parameter, at_joint
from thermal_robot.errors import CampaignError, EffectError

NOISE = 5e-5
ROBOT = tr.load_robot("builtin:rv_m2", "tool0")


def off(seed):
    """Errors of the placements: half a millimetre and half a milliradian."""
    count = len(Geometric().parameters(tr.observe(tr.simulate(ROBOT, rows=2))))
    return np.random.default_rng(seed).normal(0.0, 5e-4, count)


def measured(seed, rows=50, noise=NOISE, **further):
    """A tracker metres away, a target beside the tool."""
    base, tool = np.eye(4), np.eye(4)
    base[:3, 3], tool[:3, 3] = [1.0, 2.0, 0.3], [0.05, 0.02, 0.1]
    effects = {"geometric": off(seed)}
    return tr.simulate(ROBOT, effects, rows=rows, noise=noise, base=base, tool=tool, seed=seed, **further)


@pytest.fixture(scope="module")
def found():
    return tr.calibrate(measured(1))


def test_what_is_left_is_the_noise(found):
    equations = 3 * found.samples
    lost = found.fit.explanation.best.effective + 9
    assert found.rms_after == pytest.approx(np.sqrt(3.0 * (1.0 - lost / equations)) * NOISE, rel=0.15)
    assert found.noise == pytest.approx(NOISE, rel=0.2)
    assert found.rms_before > 10.0 * found.rms_after
    assert not found.unexplained


def test_fresh_poses_are_predicted(found):
    drawn = tr.simulate(ROBOT, rows=300, seed=99).q
    true = measured(1, commands=drawn, rows=None, noise=0.0)
    away = found.model.predict(true)[0] - true.position
    assert np.sqrt((away**2).sum(axis=1).mean()) < 1.5 * NOISE * np.sqrt(3.0)


def test_deviations_are_true():
    """Of parameters told without a prior, the squares of their errors over their variances are one on average."""
    squares = []
    for seed in range(12):
        campaign = measured(seed)
        told = tr.calibrate(campaign).parameters
        own = told.loc["joint_offset"]
        noisy = tr.simulate(ROBOT, {"geometric": off(seed)}, commands=campaign, noise=NOISE, seed=1000 + seed)
        other = tr.calibrate(noisy).parameters.loc["joint_offset"]
        both = own.identified & other.identified
        difference = own.value[both] - other.value[both]
        squares += list(difference**2 / (own["std"][both] ** 2 + other["std"][both] ** 2))
    assert 0.5 < np.mean(squares) < 1.6
    assert len(squares) >= 20


def test_one_effect_may_be_named_and_ones_own_too():
    @dataclass(frozen=True)
    class Elbow(Effect):
        name = "elbow"

        def parameters(self, observations):
            return (Parameter("slip", "rad", 1e-3, "joint", "joint_3", (at_joint(2, 1.0),)),)

    campaign = tr.simulate(ROBOT, {Elbow(): 2e-3}, rows=40, noise=2e-5, seed=3)
    for effects in (Elbow(), [Elbow()], (Elbow(), "backlash")):
        told = tr.calibrate(campaign, effects).parameters.loc[("elbow", "slip, joint_3")]
        assert told.value == pytest.approx(2e-3, abs=4.0 * told["std"])


def test_names_that_cannot_be_calibrated_are_refused():
    campaign = measured(0)
    with pytest.raises(EffectError, match="'joint_ofset'; did you mean 'joint_offset'"):
        tr.calibrate(campaign, "joint_ofset")
    with pytest.raises(EffectError, match="'geometric' is named twice"):
        tr.calibrate(campaign, ["geometric", Geometric()])
    with pytest.raises(EffectError, match="'excess_repeatability' scatters: no calibration removes it"):
        tr.calibrate(campaign, "excess_repeatability")
    with pytest.raises(EffectError, match="names no effect, expected at least one"):
        tr.calibrate(campaign, [])
    with pytest.raises(EffectError, match="which lacks velocity"):
        tr.calibrate(campaign, "tracking_lag")
    with pytest.raises(CampaignError, match=r"calibrate\(\), effects"):
        tr.calibrate(campaign, 3)
    with pytest.raises(CampaignError, match="nothing was measured"):
        tr.calibrate(tr.read_samples(campaign.to_frame().drop(columns=["x", "y", "z"]), campaign))


def test_the_kinematic_effects_are_the_default(found):
    assert found.names == KINEMATIC
    stages = []
    tr.calibrate(measured(1), progress=stages.append)
    assert stages[0] == "unknown frames"
    assert "exact fit" in stages[-1]


@pytest.mark.parametrize("times", [10.0, 40.0])
def test_an_arm_far_off_with_gross_errors_is_calibrated_as_well(times):
    base, tool = np.eye(4), np.eye(4)
    base[:3, 3], tool[:3, 3] = [1.0, 2.0, 0.3], [0.05, 0.02, 0.1]
    far = tr.simulate(ROBOT, {"geometric": times * off(5)}, rows=60, noise=NOISE, base=base, tool=tool, seed=5)
    position, struck = far.position.copy(), [3, 30, 50]
    position[struck] += 0.02
    found = tr.calibrate(replace(far, position=position))
    assert found.outliers == tuple(far.rows[struck])
    assert found.rms_before > 10.0 * times * found.rms_after
    assert found.rms_after < np.sqrt(3.0) * NOISE * 1.2
