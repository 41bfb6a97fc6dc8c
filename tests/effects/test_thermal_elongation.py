"""Links that grow with temperature, at once or behind a lag that obeys its differential equation."""

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
GENERAL = np.linspace(21.0, 30.0, SAMPLES)


@on_arms
@pytest.mark.parametrize("reference", [20.0, 25.0])
def test_an_arm_that_expands_evenly_keeps_its_shape(arm, reference):
    temperature = np.linspace(15.0, 60.0, SAMPLES)
    campaign = commanded(arm, {"temperature": temperature}, reference_temperature=reference)
    expected = (1.0 + 2e-5 * (temperature - reference))[:, None] * tool_at(arm, campaign.q)
    for effect in (ThermalElongation(), ThermalElongation(common=True)):
        grown = tool_with(campaign, effect, np.full(len(effect.parameters(observe(campaign))), 2e-5))
        np.testing.assert_allclose(grown, expected, atol=1e-14)


@on_arms
def test_each_segment_follows_its_parent_links_own_temperature_and_is_drawn_against_it(arm):
    link, effect = arm.segments[2].parent_link, ThermalElongation()
    uniform = observe(commanded(arm, {"temperature": GENERAL}))
    one = observe(commanded(arm, {"temperature": GENERAL, f"temperature.{link}": GENERAL + 7.0}))
    for parameter, plain in zip(effect.parameters(one), effect.parameters(uniform), strict=True):
        ratio = parameter.responses[0].values[:, :3] @ plain.responses[0].values[0, :3]
        ratio /= plain.responses[0].values[:, :3] @ plain.responses[0].values[0, :3]
        expected = (GENERAL - 13.0) / (GENERAL - 20.0) if parameter.place == link else np.ones(SAMPLES)
        np.testing.assert_allclose(ratio, expected, rtol=1e-12)
    for kind in (effect, ThermalElongation(common=True)):
        parts = [part for p in kind.parameters(one) for part in by_place(arm, p)]
        assert link in {part.place for part in parts}
        for part in parts:
            name, unit, values = kind.driver(one, [part], np.zeros(SAMPLES))
            own = part.place == link
            assert (name, unit) == (f"temperature.{link}" if own else "temperature", "°C")
            np.testing.assert_array_equal(values, GENERAL + 7.0 * own)


def test_links_lag_only_behind_a_general_temperature_with_a_time():
    data = simulate(load_arm("rv_m2"), samples=20, links=True)[0]
    links = {k: v for k, v in data.covariates.items() if not k.startswith("temperature.")}
    untimed = {k: v for k, v in links.items() if k != "time"}
    every = {0.0, 600.0, 1500.0, 3600.0}
    for covariates, lags in ((data.covariates, {0.0}), (links, every), (untimed, {0.0})):
        settings = ThermalElongation().variants(observe(replace(data, covariates=covariates)))
        # with every lag as without: a coefficient a link, one for all, and one with deviations
        shared = {(False, 0.0), (True, 0.0), (True, 0.3)}
        assert {(s.lag, s.common, s.spread) for s in settings} == {(lag, *own) for lag in lags for own in shared}
        assert len(settings) == len(set(settings))
        read = {s.reads(observe(replace(data, covariates=links))) for s in settings if s.lag}
        assert read <= {("temperature", "time")}


def test_only_a_lag_may_be_refined():
    assert ThermalElongation().nearby(1.6) == (ThermalElongation(),)
    lagging = ThermalElongation(common=True, lag=1500.0, times=(0.0, 1.0), temperatures=(20.0, 21.0))
    lags = {(lag, True, 0.0) for lag in (750.0, 1500.0, 3000.0)}
    assert {(s.lag, s.common, s.spread) for s in lagging.nearby(2.0)} == {
        *lags,
        (1500.0, False, 0.0),
        (1500.0, True, 0.3),
    }
    started = replace(lagging, starts=(0.0,))
    free = set(started.nearby(2.0)) - {replace(n, starts=(0.0,)) for n in lagging.nearby(2.0)}
    assert free == {replace(started, balanced=False)}
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
    known = tool_with(whole, lagging, [alpha])[cut:]
    assert np.abs(known - tool_with(late, cut_short, [alpha])).max() > 1e-5
    free = tool_with(late, replace(cut_short, balanced=False), [alpha, alpha * (link[0] - air[cut])])
    np.testing.assert_allclose(free, known, atol=1e-14)


def test_every_session_starts_anew(rv_m2):
    time, half = np.arange(SAMPLES) * 600.0, SAMPLES // 2
    campaign = commanded(rv_m2, {"time": time, "temperature": np.linspace(20.0, 25.0, SAMPLES)})
    campaign = replace(campaign, labels={"session": np.repeat(["b", "a"], half)})
    lagging = one_lag(campaign)
    assert lagging.starts == (0.0, 600.0 * half)
    free = replace(lagging, balanced=False)
    names = [p.name for p in free.parameters(observe(campaign))]
    assert names == ["strain per kelvin", "strain at start 1", "strain at start 2"]
    second = tool_with(campaign, free, [0.0, 0.0, 1e-4]) - tool_with(campaign, free, [0.0, 0.0, 0.0])
    assert not second[:half].any()
    size = np.linalg.norm(second[half:], axis=1) / np.linalg.norm(tool_at(rv_m2, campaign.q), axis=1)[half:]
    np.testing.assert_allclose(np.log(size / 1e-4), -(time[half:] - 3000.0) / 1500.0, atol=1e-9)


def test_between_one_for_all_and_one_each_are_small_deviations(rv_m2):
    campaign = commanded(rv_m2, {"temperature": np.linspace(15.0, 60.0, SAMPLES)})
    seen = observe(campaign)
    settings = ThermalElongation().variants(seen)
    each, one, pooled = (e.parameters(seen) for e in settings)
    assert (pooled[0].name, pooled[0].size) == (one[0].name, one[0].size)
    assert all(0.0 < p.size < 0.5 * one[0].size for p in pooled[1:])
    assert [p.place for p in pooled[1:]] == [p.place for p in each]
    # the common coefficient and a deviation are, link by link, a coefficient each
    apart = np.linspace(-4e-6, 4e-6, len(each))
    pooled = tool_with(campaign, settings[2], [1.5e-5, *apart])
    np.testing.assert_allclose(pooled, tool_with(campaign, ThermalElongation(), 1.5e-5 + apart), atol=1e-14)
    assert settings[2].variants(seen) == settings  # from any setting the same ones are compared


def test_in_another_campaign_links_follow_that_ones_record(rv_m2):
    time = np.linspace(0.0, 5400.0, SAMPLES)
    first = commanded(rv_m2, {"time": time, "temperature": 20.0 + 9.0 * np.sin(time / 900.0)})
    second = commanded(rv_m2, {"time": 2.0 * time, "temperature": 15.0 + time / 600.0})
    for there in (first, second):
        assert one_lag(first).elsewhere(observe(there)) == one_lag(there)
    untimed = observe(commanded(rv_m2, {"temperature": second.covariates["temperature"]}))
    at_once = one_lag(first).elsewhere(untimed)
    assert at_once == ThermalElongation(common=True)
    assert at_once.reads(untimed) == ("temperature",)
    assert at_once.elsewhere(untimed) == at_once


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
    # after the record: it settles to what the row itself says; before it the body is in balance
    after = history.followed(lag, np.array([times.max(), times.max() + 50 * lag]), np.array([0.0, 31.0]))
    np.testing.assert_allclose(after, [followed[times.argmax()], 31.0], atol=1e-6)
    assert history.followed(lag, np.array([-10.0]), np.array([19.0]))[0] == 19.0


def test_a_record_is_thinned_and_rows_of_one_instant_count_as_their_mean():
    # a long record is thinned a short lag is none and a long one stays where it began
    times = np.linspace(0.0, 20000.0, 5000)
    recorded = 20.0 + 3.0 * np.sin(times / 3000.0)
    short, whole = History.of(times, recorded), History(tuple(times.tolist()), tuple(recorded.tolist()))
    assert len(short.times) <= 500
    for lag, expected in ((900.0, whole.followed(900.0, times, recorded)), (1e-3, recorded), (1e9, recorded[0])):
        np.testing.assert_allclose(short.followed(lag, times, recorded), expected, atol=1e-3)
    # rows of one instant count as their mean in any order
    history = History.of(np.array([5.0, 0.0, 5.0]), np.array([30.0, 20.0, 20.0]))
    assert history == History((0.0, 5.0), (20.0, 25.0))
