"""Links that grow with temperature, at once or with a lag."""

from dataclasses import replace

import numpy as np
import pytest
from conftest import load_arm
from helpers import SAMPLES, commanded, tool_at, tool_with
from simulate import simulate

from thermal_robot.effects import ThermalElongation
from thermal_robot.effects.apply import by_place
from thermal_robot.effects.thermal_elongation import History
from thermal_robot.observations import observe

on_arms = pytest.mark.parametrize("arm", ["rv_m2", "ur10", "panda"], indirect=True)


@on_arms
@pytest.mark.parametrize("reference", [20.0, 25.0])
def test_an_arm_that_expands_evenly_keeps_its_shape(arm, reference):
    temperature = np.linspace(15.0, 60.0, SAMPLES)
    campaign = commanded(arm, {"temperature": temperature}, reference_temperature=reference)
    alpha = 2e-5
    expected = (1.0 + alpha * (temperature - reference))[:, None] * tool_at(arm, campaign.q)
    for effect in (ThermalElongation(), ThermalElongation(common=True)):
        grown = tool_with(campaign, effect, np.full(len(effect.parameters(observe(campaign))), alpha))
        np.testing.assert_allclose(grown, expected, atol=1e-14)


@on_arms
def test_each_segment_follows_its_parent_links_own_temperature(arm):
    general = np.linspace(21.0, 30.0, SAMPLES)
    link = arm.segments[2].parent_link
    own = general + 7.0
    effect = ThermalElongation()
    uniform = commanded(arm, {"temperature": general})
    one = commanded(arm, {"temperature": general, f"temperature.{link}": own})
    for parameter, plain in zip(effect.parameters(observe(one)), effect.parameters(observe(uniform)), strict=True):
        ratio = parameter.responses[0].values[:, :3] @ plain.responses[0].values[0, :3]
        ratio /= plain.responses[0].values[:, :3] @ plain.responses[0].values[0, :3]
        expected = (own - 20.0) / (general - 20.0) if parameter.place == link else np.ones(SAMPLES)
        np.testing.assert_allclose(ratio, expected, rtol=1e-12)


def test_links_lag_only_behind_a_general_temperature_with_a_time():
    data = simulate(load_arm("rv_m2"), samples=20, links=True)[0]
    links = {k: v for k, v in data.covariates.items() if not k.startswith("temperature.")}
    for covariates, lags in (
        (data.covariates, {0.0}),
        (links, {0.0, 600.0, 1500.0, 3600.0}),
        ({k: v for k, v in links.items() if k != "time"}, {0.0}),
    ):
        settings = ThermalElongation().variants(observe(replace(data, covariates=covariates)))
        # with every lag as without: a coefficient a link, one for all, and one with deviations
        shared = {(False, 0.0), (True, 0.0), (True, 0.3)}
        assert {(s.lag, s.common, s.spread) for s in settings} == {(lag, *own) for lag in lags for own in shared}
        assert len(settings) == len(set(settings))
        assert {s.reads(observe(replace(data, covariates=links))) for s in settings if s.lag} <= {
            ("temperature", "time")
        }


def test_only_a_lag_may_be_refined():
    assert ThermalElongation().nearby(1.6) == (ThermalElongation(),)
    lagging = ThermalElongation(common=True, lag=1500.0, times=(0.0, 1.0), temperatures=(20.0, 21.0))
    assert {(s.lag, s.common, s.spread) for s in lagging.nearby(2.0)} == {
        (1500.0, True, 0.0),
        (3000.0, True, 0.0),
        (750.0, True, 0.0),
        (1500.0, False, 0.0),
        (1500.0, True, 0.3),
    }
    started = replace(lagging, starts=(0.0,))
    assert set(started.nearby(2.0)) - {replace(n, starts=(0.0,)) for n in lagging.nearby(2.0)} == {
        replace(started, balanced=False)
    }
    alone = replace(lagging, common=False, places=("forearm",))
    assert {(s.lag, s.common, s.places) for s in alone.nearby(2.0)} == {
        (lag, False, ("forearm",)) for lag in (750.0, 1500.0, 3000.0)
    }


def one_lag(campaign):
    """The setting with one coefficient for all and a lag of 1500 s."""
    settings = ThermalElongation().variants(observe(campaign))
    return next(s for s in settings if s.lag == 1500.0 and s.common and not s.spread)


@on_arms
def test_what_came_before_the_record_is_a_strain_that_the_lag_forgets(arm):
    """A record that begins late differs from the whole one by what the link was warmer then, exp(−t / lag) of it."""
    time, alpha, cut = np.linspace(0.0, 5400.0, SAMPLES), 2e-5, 3
    air = 20.0 + 9.0 * np.sin(time / 900.0)
    whole = commanded(arm, {"time": time, "temperature": air})
    late = whole.take(np.arange(cut, SAMPLES))
    lagging, cut_short = one_lag(whole), one_lag(late)
    assert cut_short.starts == (time[cut],)
    link = History(lagging.times, lagging.temperatures).followed(1500.0, time[cut : cut + 1], air[cut : cut + 1])
    apart = tool_with(whole, lagging, [alpha])[cut:] - tool_with(late, cut_short, [alpha])
    assert np.abs(apart).max() > 1e-5
    free = replace(cut_short, balanced=False)
    np.testing.assert_allclose(
        tool_with(late, free, [alpha, alpha * (link[0] - air[cut])]),
        tool_with(whole, lagging, [alpha])[cut:],
        atol=1e-14,
    )


def test_every_session_starts_anew(rv_m2):
    time, session = np.arange(SAMPLES) * 600.0, np.repeat(["b", "a"], SAMPLES // 2)
    campaign = commanded(rv_m2, {"time": time, "temperature": np.linspace(20.0, 25.0, SAMPLES)})
    campaign = replace(campaign, labels={"session": session})
    lagging = one_lag(campaign)
    assert lagging.starts == (0.0, 600.0 * (SAMPLES // 2))
    free = replace(lagging, balanced=False)
    names = [p.name for p in free.parameters(observe(campaign))]
    assert len(names) == 3
    assert names[0] == lagging.parameters(observe(campaign))[0].name
    second = tool_with(campaign, free, [0.0, 0.0, 1e-4]) - tool_with(campaign, free, [0.0, 0.0, 0.0])
    assert not second[: SAMPLES // 2].any()
    size = np.linalg.norm(second[SAMPLES // 2 :], axis=1) / np.linalg.norm(tool_at(rv_m2, campaign.q), axis=1)[5:]
    np.testing.assert_allclose(np.log(size / 1e-4), -(time[SAMPLES // 2 :] - 3000.0) / 1500.0, atol=1e-9)


def test_it_is_drawn_against_the_links_own_temperature_or_the_robots(rv_m2):
    general = np.linspace(21.0, 30.0, SAMPLES)
    link = rv_m2.segments[2].parent_link
    observations = observe(commanded(rv_m2, {"temperature": general, f"temperature.{link}": general + 7.0}))
    for effect in (ThermalElongation(), ThermalElongation(common=True)):
        parts = [part for p in effect.parameters(observations) for part in by_place(rv_m2, p)]
        assert link in {part.place for part in parts}
        for part in parts:
            name, unit, values = effect.driver(observations, [part], np.zeros(SAMPLES))
            own = part.place == link
            assert (name, unit) == (f"temperature.{link}" if own else "temperature", "°C")
            np.testing.assert_array_equal(values, general + 7.0 * own)


def test_between_one_for_all_and_one_each_are_small_deviations(rv_m2):
    temperature = np.linspace(15.0, 60.0, SAMPLES)
    campaign = commanded(rv_m2, {"temperature": temperature})
    seen = observe(campaign)
    each, one, pooled = (e.parameters(seen) for e in ThermalElongation().variants(seen))
    assert len(pooled) == 1 + len(each)
    assert (pooled[0].name, pooled[0].size) == (one[0].name, one[0].size)
    assert all(0.0 < p.size < 0.5 * one[0].size for p in pooled[1:])
    assert [p.place for p in pooled[1:]] == [p.place for p in each]
    # the common coefficient and a deviation are, link by link, a coefficient each
    setting = ThermalElongation().variants(seen)[2]
    apart = np.linspace(-4e-6, 4e-6, len(each))
    np.testing.assert_allclose(
        tool_with(campaign, setting, [1.5e-5, *apart]),
        tool_with(campaign, ThermalElongation(), 1.5e-5 + apart),
        atol=1e-14,
    )
    # from any setting the same ones are compared
    assert setting.variants(seen) == ThermalElongation().variants(seen)


def test_in_another_campaign_links_follow_that_ones_record(rv_m2):
    time = np.linspace(0.0, 5400.0, SAMPLES)
    first = commanded(rv_m2, {"time": time, "temperature": 20.0 + 9.0 * np.sin(time / 900.0)})
    second = commanded(rv_m2, {"time": 2.0 * time, "temperature": 15.0 + time / 600.0})
    assert one_lag(first).elsewhere(observe(second)) == one_lag(second)
    assert one_lag(first).elsewhere(observe(first)) == one_lag(first)
    untimed = observe(commanded(rv_m2, {"temperature": second.covariates["temperature"]}))
    at_once = one_lag(first).elsewhere(untimed)
    assert at_once == ThermalElongation(common=True)
    assert at_once.reads(untimed) == ("temperature",)
