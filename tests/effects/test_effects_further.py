"""Effects of motion, bending, lagging temperature and hanging play: they explain what they made, and are kept whole."""

from dataclasses import replace

import numpy as np
import pytest
from conftest import load_arm
from helpers import commanded, tool_at, tool_with, without_masses
from simulate import simulate

from thermal_robot import CorrectedModel, diagnose
from thermal_robot.effects import Backlash, JointCompliance, ThermalBending, ThermalElongation, TrackingLag
from thermal_robot.effects.apply import displacement
from thermal_robot.effects.lagging import History
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


@pytest.mark.parametrize("arm", ["ur10", "panda"], indirect=True)
@pytest.mark.parametrize("made", list(MADE))
def test_an_effect_explains_what_it_made_and_is_saved_whole(arm, made, tmp_path):
    effects, options = MADE[made]
    campaign, _, (fresh, place) = simulate(arm, effects, seed=12, noise=NOISE, ratio=(4.0, 6.0), fresh=60, **options)
    found = diagnose(campaign)
    assert list(found.verdict) == effects
    assert not found.unexplained.flagged
    assert found.gap.held_out.rms_after < 1.15 * np.sqrt(3.0) * NOISE
    predicted, _ = found.model.predict(fresh)
    assert np.sqrt(((predicted - place) ** 2).mean()) < 0.5 * NOISE
    found.model.save(tmp_path / "model.json")
    again = CorrectedModel.load(tmp_path / "model.json")
    assert again.effects[0][0] == found.model.effects[0][0]
    np.testing.assert_array_equal(again.predict(fresh)[0], predicted)
    # a row knows nothing of the rows beside it
    np.testing.assert_allclose(again.predict(fresh.take([7]))[0][0], predicted[7], rtol=0, atol=1e-13)


def test_servo_and_friction_hold_a_joint_back():
    arm = load_arm("rv_m2")
    rng = np.random.default_rng(1)
    moved, pushed = rng.normal(size=(2, 10, arm.n))
    recorded = {f"velocity.{n}": v for n, v in zip(arm.joint_names, moved.T, strict=True)}
    recorded |= {f"acceleration.{n}": a for n, a in zip(arm.joint_names[1:], pushed.T[1:], strict=True)}
    recorded["velocity.joint_3"] = np.zeros(10)
    moved[:, 2] = 0.0
    campaign = commanded(arm, recorded)
    effect = TrackingLag().variants(observe(campaign))[0]
    parameters = effect.parameters(observe(campaign))
    assert {p.place for p in parameters} == set(arm.joint_names) - {"joint_3"}
    assert [p.label for p in parameters if p.place == "joint_1"] == ["delay", "friction"]
    values = np.array([p.size for p in parameters]) * rng.uniform(1, 5, len(parameters))
    q = campaign.q.copy()
    for parameter, value in zip(parameters, values, strict=True):
        j = arm.joint_names.index(parameter.place)
        q[:, j] += value * {"delay": -moved, "friction": -np.sign(moved)}.get(parameter.label, pushed)[:, j]
    np.testing.assert_allclose(tool_with(campaign, effect, values), tool_at(arm, q), atol=1e-14)
    still = replace(campaign, covariates={name: 0.0 * v for name, v in recorded.items()})
    np.testing.assert_allclose(tool_with(still, effect, values), tool_at(arm, campaign.q), atol=1e-14)


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


@pytest.mark.parametrize("lag", [30.0, 600.0, 5000.0])
def test_a_lag_obeys_its_differential_equation(lag):
    rng = np.random.default_rng(2)
    times = rng.permutation(np.append(np.sort(rng.uniform(0.0, 7200.0, 80)), [0.0, 3000.0, 3000.0]))
    recorded = 20.0 + 4.0 * np.sin(times / 900.0) + times / 2000.0
    history = History.of(times, recorded)
    fine = np.arange(0.0, times.max(), 0.25)
    driven = np.interp(fine, history.times, history.temperatures)
    link = np.empty_like(fine)
    link[0] = driven[0]
    for i in range(1, len(fine)):
        link[i] = link[i - 1] + 0.25 / lag * ((driven[i] + driven[i - 1]) / 2 - link[i - 1])
    followed = history.followed(lag, times, recorded)
    np.testing.assert_allclose(followed, np.interp(times, fine, link), atol=2e-3 * max(1.0, 300.0 / lag))
    # after the record: it settles to what the row itself says
    after = history.followed(lag, np.array([times.max(), times.max() + 50 * lag]), np.array([0.0, 31.0]))
    np.testing.assert_allclose(after, [followed[times.argmax()], 31.0], atol=1e-6)
    assert history.followed(lag, np.array([-10.0]), np.array([19.0]))[0] == 19.0


def test_a_long_record_is_thinned_and_still_followed():
    times = np.linspace(0.0, 20000.0, 5000)
    recorded = 20.0 + 3.0 * np.sin(times / 3000.0)
    short = History.of(times, recorded)
    assert len(short.times) <= 500
    whole = History(tuple(times.tolist()), tuple(recorded.tolist()))
    np.testing.assert_allclose(
        short.followed(900.0, times, recorded), whole.followed(900.0, times, recorded), atol=1e-3
    )


def test_links_lag_only_behind_a_general_temperature_with_a_time():
    data = simulate(load_arm("rv_m2"), samples=20, links=True)[0]
    links = {k: v for k, v in data.covariates.items() if not k.startswith("temperature.")}
    for covariates, lags in (
        (data.covariates, {0.0}),
        (links, {0.0, 600.0, 1500.0, 3600.0}),
        ({k: v for k, v in links.items() if k != "time"}, {0.0}),
    ):
        settings = ThermalElongation().variants(observe(replace(data, covariates=covariates)))
        assert {s.lag for s in settings} == lags
        assert {s.reads(observe(replace(data, covariates=links))) for s in settings if s.lag} <= {
            ("temperature", "time")
        }


def test_bending_by_heat_is_of_the_difference_to_the_robot():
    arm = load_arm("ur10")
    rng = np.random.default_rng(3)
    own = {f"temperature.{s.parent_link}": 20.0 + rng.uniform(0, 9, 10) for s in arm.segments}
    mean = np.mean([own[c] for c in ThermalBending().reads(observe(commanded(arm, own)))], axis=0)
    values = 1e-3 * rng.normal(size=len(ThermalBending().parameters(observe(commanded(arm, own)))))
    stated = commanded(arm, {**own, "temperature": mean})
    expected = tool_with(stated, ThermalBending(), values)
    np.testing.assert_allclose(tool_with(commanded(arm, own), ThermalBending(), values), expected, atol=1e-14)
    even = commanded(arm, {name: mean for name in own})
    assert ThermalBending().missing(observe(even))
    np.testing.assert_allclose(tool_with(even, ThermalBending(), values), tool_at(arm, even.q), atol=1e-14)


@pytest.mark.parametrize("name", ["ur10", "panda"])
def test_weights_that_nobody_wrote_down_are_free(name, tmp_path):
    arm = load_arm(name)
    campaign, _, (fresh, place) = simulate(arm, ["joint_compliance"], seed=8, ratio=(5.0, 6.0), samples=150, fresh=60)
    bare = without_masses(arm)
    found = diagnose(replace(campaign, robot=bare))
    assert found.verdict == ("joint_compliance",)
    effect = found.model.effects[0][0]
    assert effect.joints
    fresh = replace(fresh, robot=bare)
    predicted = found.model.predict(fresh)[0]
    assert np.sqrt(((predicted - place) ** 2).mean()) < 1.0 * NOISE
    found.model.save(tmp_path / "model.json")
    np.testing.assert_array_equal(CorrectedModel.load(tmp_path / "model.json").predict(fresh)[0], predicted)


def test_torques_that_are_known_leave_no_weight_free(rv_m2):
    campaign = commanded(without_masses(rv_m2), {"torque.joint_2": np.linspace(1.0, 9.0, 10)})
    assert JointCompliance().variants(observe(campaign)) == (JointCompliance(),)
    assert JointCompliance().variants(observe(commanded(rv_m2))) == (JointCompliance(),)
    free = JointCompliance().variants(observe(commanded(without_masses(rv_m2))))[0]
    assert {p.unit for p in free.parameters(observe(commanded(without_masses(rv_m2))))} == {"rad"}
    assert "joint_1" not in {p.place for p in free.parameters(observe(commanded(without_masses(rv_m2))))}
