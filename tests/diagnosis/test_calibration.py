"""A calibration: named effects come back as they were, with deviations that are true, in parts and as a model."""

from dataclasses import FrozenInstanceError, dataclass, replace

import numpy as np
import pytest

import thermal_robot as tr
from thermal_robot.effects import KINEMATIC, Effect, Geometric, Parameter, at_joint
from thermal_robot.errors import CampaignError, EffectError

NOISE = 3e-5
OFF = {"joint_2": 1e-3, "joint_3": -7e-4}


@pytest.fixture(scope="module")
def campaign():
    return tr.simulate(
        "builtin:rv_m2", {"joint_offset": OFF}, rows=60, noise=NOISE, base=np.eye(4), tool_frame="tool0", seed=6,
        measures="pose", noise_orientation=1e-4,
    )  # fmt: skip


@pytest.fixture(scope="module")
def poses(campaign):
    return tr.calibrate(campaign)


def test_zeros_are_told_inside_the_geometry_as_they_are_and_known_better_alone(campaign, poses):
    told = [(effect.name, effect.inside) for effect in poses.effects]
    assert told == [("joint_offset", "geometric"), ("geometric", "geometric")]
    own, alone = (found.parameters.loc["joint_offset"] for found in (poses, tr.calibrate(campaign, "joint_offset")))
    for joint, true in OFF.items():
        one = own.loc[f"zero offset, {joint}"]
        assert one.value == pytest.approx(true, abs=4.0 * one["std"])
    assert "zero offset, joint_1" in poses.effects[0].unseen  # the base does the same
    shared = own.index.intersection(alone.index)
    assert len(shared) >= 2
    assert (alone.loc[shared, "std"] <= own.loc[shared, "std"]).all()


def test_turns_shrink_as_places_do_and_its_model_leaves_what_it_says(campaign, poses):
    assert poses.turned_after < poses.turned_before
    assert poses.turned_after == pytest.approx(np.sqrt(3.0) * 1e-4, rel=0.2)
    assert poses.rms_after == pytest.approx(np.sqrt(3.0) * NOISE, rel=0.2)
    positions = tr.calibrate(tr.simulate("builtin:rv_m2", rows=40, noise=NOISE, tool_frame="tool0"), "backlash")
    assert positions.turned_before is positions.turned_after is None
    left = poses.model.prediction(campaign)[0] - campaign.position
    assert np.sqrt((left**2).sum(axis=1).mean()) == pytest.approx(poses.rms_after, rel=1e-6)
    assert poses.model.frames is poses.fit.corrected.frames
    assert list(poses.frames.index) == ["base", "tool"]
    assert repr(poses) == "Calibration('simulated': joint_offset, geometric)"
    with pytest.raises(FrozenInstanceError):
        poses.noise = 1.0


def test_a_remainder_that_is_no_noise_is_said_and_widens_deviations():
    worn = {"joint_offset": OFF, "backlash": {"joint_3": 8e-4}}
    campaign = tr.simulate("builtin:rv_m2", worn, rows=80, noise=2e-5, tool_frame="tool0", seed=2)
    without, whole = (tr.calibrate(campaign, names) for names in ("joint_offset", ["joint_offset", "backlash"]))
    assert without.unexplained
    assert not whole.unexplained
    narrow = np.sqrt(np.diag(without.fit.explanation.values[0][1]))
    told = without.parameters["std"].dropna()
    assert (told.to_numpy() >= narrow[: len(told)] * (1.0 - 1e-9)).all()
    assert (told.to_numpy() > 1.05 * narrow[: len(told)]).any()


TRACKER = 5e-5
ROBOT = tr.load_robot("builtin:rv_m2", "tool0")


def off(seed):
    """Errors of the placements: half a millimetre and half a milliradian."""
    count = len(Geometric().parameters(tr.observe(tr.simulate(ROBOT, rows=2))))
    return np.random.default_rng(seed).normal(0.0, 5e-4, count)


def measured(seed, rows=50, noise=TRACKER, times=1.0, **further):
    """A tracker metres away, a target beside the tool."""
    base, tool = np.eye(4), np.eye(4)
    base[:3, 3], tool[:3, 3] = [1.0, 2.0, 0.3], [0.05, 0.02, 0.1]
    effects = {"geometric": times * off(seed)}
    return tr.simulate(ROBOT, effects, rows=rows, noise=noise, base=base, tool=tool, seed=seed, **further)


@pytest.fixture(scope="module")
def found():
    return tr.calibrate(measured(1))


def test_what_is_left_is_the_noise(found):
    equations = 3 * found.samples
    lost = found.fit.explanation.best.effective + 9
    assert found.rms_after == pytest.approx(np.sqrt(3.0 * (1.0 - lost / equations)) * TRACKER, rel=0.15)
    assert found.noise == pytest.approx(TRACKER, rel=0.2)
    assert found.rms_before > 10.0 * found.rms_after
    assert not found.unexplained


def test_fresh_poses_are_predicted(found):
    drawn = tr.simulate(ROBOT, rows=300, seed=99).q
    true = measured(1, commands=drawn, rows=None, noise=0.0)
    away = found.model.prediction(true)[0] - true.position
    assert np.sqrt((away**2).sum(axis=1).mean()) < 1.5 * TRACKER * np.sqrt(3.0)


@pytest.mark.slow
def test_deviations_are_true():
    """Of parameters told without a prior, the squares of their errors over their variances are one on average."""
    squares = []
    for seed in range(12):
        campaign = measured(seed)
        told = tr.calibrate(campaign).parameters
        own = told.loc["joint_offset"]
        noisy = tr.simulate(ROBOT, {"geometric": off(seed)}, commands=campaign, noise=TRACKER, seed=1000 + seed)
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


@pytest.mark.parametrize(
    ("effects", "error", "says"),
    [
        ("joint_ofset", EffectError, "'joint_ofset'; did you mean 'joint_offset'"),
        (["geometric", Geometric()], EffectError, "'geometric' is named twice"),
        ("excess_repeatability", EffectError, "'excess_repeatability' scatters: no calibration removes it"),
        ([], EffectError, "names no effect, expected at least one"),
        ("tracking_lag", EffectError, "which lacks velocity"),
        (3, CampaignError, r"calibrate\(\), effects"),
    ],
)
def test_names_that_cannot_be_calibrated_are_refused(effects, error, says):
    with pytest.raises(error, match=says):
        tr.calibrate(measured(0), effects)


def test_nothing_is_calibrated_where_nothing_was_measured():
    campaign = measured(0)
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
    far = measured(5, rows=60, times=times)
    position, struck = far.position.copy(), [3, 30, 50]
    position[struck] += 0.02
    found = tr.calibrate(replace(far, position=position))
    assert found.outliers == tuple(far.rows[struck])
    assert found.rms_before > 10.0 * times * found.rms_after
    assert found.rms_after < np.sqrt(3.0) * TRACKER * 1.2
