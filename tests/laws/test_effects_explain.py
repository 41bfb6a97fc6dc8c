"""Effects explain what they made, alone and with their own name, and are kept whole in the model that is saved."""

from dataclasses import replace

import numpy as np
import pytest
from conftest import load_arm
from helpers import without_masses
from simulate import simulate

from thermal_robot import CorrectedModel, diagnose
from thermal_robot.effects import Backlash
from thermal_robot.effects.apply import displacement
from thermal_robot.observations import observe

NOISE = 25e-6
MADE = {
    "lag of the servo": (["tracking_lag"], {"moving": True}),
    "bent links": (["link_compliance"], {}),
    "bowed links": (["thermal_bending"], {"links": True}),
    "one coefficient": (["thermal_elongation"], {"variant": 1}),
    "links that lag": (["thermal_elongation"], {"variant": 3}),
    "play that hangs": (["backlash"], {"variant": 2}),
}


PAIRS = [(made, arm) for made in MADE for arm in ("ur10", "panda")]


@pytest.mark.parametrize(
    ("made", "arm"),
    [pytest.param(*pair, marks=() if k in (4, 7) else pytest.mark.slow) for k, pair in enumerate(PAIRS)],
    indirect=["arm"],
)
def test_an_effect_explains_what_it_made_and_is_saved_whole(arm, made, tmp_path):
    effects, options = MADE[made]
    campaign, _, (fresh, place) = simulate(arm, effects, seed=12, noise=NOISE, ratio=(4.0, 6.0), fresh=60, **options)
    found = diagnose(campaign)
    assert list(found.verdict) == effects
    assert not found.unexplained.flagged
    assert found.gap.held_out.rms_after < 1.15 * np.sqrt(3.0) * NOISE
    predicted, _ = found.model.prediction(fresh)[:2]
    assert np.sqrt(((predicted - place) ** 2).mean()) < 0.5 * NOISE
    found.model.save(tmp_path / "model.json")
    again = CorrectedModel.load(tmp_path / "model.json")
    assert again.effects[0][0] == found.model.effects[0][0]
    np.testing.assert_array_equal(again.prediction(fresh)[0], predicted)
    # a row knows nothing of the rows beside it
    np.testing.assert_allclose(again.prediction(fresh.take([7]))[0][0], predicted[7], rtol=0, atol=1e-13)


@pytest.mark.slow
def test_backlash_is_named_where_only_the_side_counts():
    """Poses passed in the direction of approach: the friction of a lag is then exactly lost motion."""
    campaign = simulate(load_arm("ur10"), [], seed=5, moving=True)[0]
    names = campaign.robot.joint_names
    sides = {f"approach.{n}": np.sign(campaign.covariates[f"velocity.{n}"]) for n in names}
    campaign = replace(campaign, covariates={**campaign.covariates, **sides})
    lost = Backlash()
    values = 2e-4 * (np.arange(len(names)) == 1)
    moved = observe(campaign, displacement=displacement(observe(campaign), [(lost, values)])[0])
    noise = 2e-5 * np.random.default_rng(0).normal(size=(campaign.samples, 3))
    found = diagnose(replace(campaign, position=moved.predicted_position + noise, noise_position=2e-5))
    assert found.verdict == ("backlash",)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ur10", "panda"])
def test_weights_that_nobody_wrote_down_are_free(name, tmp_path):
    arm = load_arm(name)
    campaign, truth, (fresh, place) = simulate(
        arm, ["joint_compliance"], seed=8, ratio=(5.0, 6.0), samples=150, fresh=60
    )
    bare = without_masses(arm)
    found = diagnose(replace(campaign, robot=bare))
    assert found.verdict == ("joint_compliance",)
    effect = found.model.effects[0][0]
    assert effect.joints
    # no weight means anything by itself; a joint's wind-up over the campaign is that of its compliance and torque
    turned = {part.place: (part.value, part.std) for part in found.effects[0].size}
    torque, stated = np.ptp(observe(campaign).torque, axis=0), truth["parts"]["joint_compliance"]["values"]
    really = {joint: stated[f"compliance, {joint}"] * t for joint, t in zip(arm.joint_names, torque, strict=True)}
    assert set(turned) == {joint for joint, t in zip(arm.joint_names, torque, strict=True) if t > 0.1}
    assert all(abs(value - really[joint]) < 4.0 * std for joint, (value, std) in turned.items())
    largest = max(turned, key=lambda joint: turned[joint])
    assert turned[largest][0] == pytest.approx(max(really.values()), rel=0.1)
    fresh = replace(fresh, robot=bare)
    predicted = found.model.prediction(fresh)[0]
    assert np.sqrt(((predicted - place) ** 2).mean()) < 1.0 * NOISE
    found.model.save(tmp_path / "model.json")
    np.testing.assert_array_equal(CorrectedModel.load(tmp_path / "model.json").prediction(fresh)[0], predicted)
