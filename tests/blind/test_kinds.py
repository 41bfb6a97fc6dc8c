"""What is asked in each kind: in turn, or each by a chance of its own."""

from collections import Counter
from itertools import islice

import numpy as np
import pytest

pytest.importorskip("mujoco", reason='the blind trial needs "thermal-robot[blind]"')

from scipy.stats import binom

from thermal_robot.blind.cases import Case
from thermal_robot.blind.plan import STRANGE, robots, turns
from thermal_robot.blind.reality import FAULTS, UNLISTED, make
from thermal_robot.campaign import read_campaign
from thermal_robot.errors import EffectError

CAUSES = tuple(UNLISTED)


def asked(kind, count, effects=tuple(FAULTS)):
    return list(islice(turns(kind, effects, CAUSES, np.random.default_rng(3)), count))


@pytest.fixture(scope="module")
def arm():
    return robots([("rv_m2", "builtin:rv_m2", "tool0")])[0]


def test_in_a_mixture_every_effect_has_its_own_chance_and_a_cause_has_one():
    cases = asked("mixed", 4000)
    counts = Counter(name for case in cases for name in case["effects"])
    contained = {"geometric", "joint_offset", "instrument_scale"}  # sets that hold both are drawn again
    assert set(counts) == set(FAULTS) - {"base_frame", "tool_frame"}
    # a chance drawn evenly from 0 to 30 % anew in each case is 15 % of them
    low, high = binom.ppf([1e-5, 1 - 1e-5], 4000, 0.15)
    others = set(counts) - contained - {"excess_repeatability"}
    assert all(low <= counts[name] <= high for name in others), counts
    low, high = binom.ppf([1e-5, 1 - 1e-5], 4000, STRANGE)
    assert low <= sum(case["unlisted"] is not None for case in cases) <= high
    assert {case["unlisted"] for case in cases} == {None, *UNLISTED}
    assert not any({"geometric", "joint_offset"} <= set(case["effects"]) for case in cases)
    # nobody sees scatter between visits without visits
    scattering = [case for case in cases if "excess_repeatability" in case["effects"]]
    assert scattering
    assert all("repeats" in case["wants"] for case in scattering)


def test_how_many_are_at_work_together_is_even():
    counts = Counter(len(case["effects"]) for case in asked("many", 1500))
    low, high = binom.ppf([1e-5, 1 - 1e-5], 1500, 1 / 3)
    assert set(counts) == {3, 4, 5}
    assert all(low <= count <= high for count in counts.values())


def test_large_ones_are_as_large_as_on_real_robots_and_lags_follow_the_air():
    assert {case["effects"][0] for case in asked("large", len(FAULTS))} == set(FAULTS)
    assert all(case["ratio"] == (10.0, 60.0) for case in asked("large", 5))
    lags = asked("lags", 30)
    assert Counter(case["effects"][0] for case in lags) == dict.fromkeys(
        ("tracking_lag", "drift", "thermal_elongation"), 10
    )
    assert all(case["wants"] == ("sensor:air",) for case in lags if case["effects"] == ("thermal_elongation",))


def test_causes_come_with_one_or_two_effects_that_are_listed():
    cases = asked("both", 2 * len(CAUSES))
    assert Counter(case["unlisted"] for case in cases) == dict.fromkeys(CAUSES, 2)
    assert {len(case["effects"]) for case in cases} == {1, 2}


@pytest.mark.parametrize(("kind", "effects"), [("pair", ("drift",)), ("many", ("drift", "backlash")), ("both", ())])
def test_a_kind_that_cannot_be_made_of_so_few_is_refused(kind, effects):
    with pytest.raises(EffectError, match=kind):
        turns(kind, effects, CAUSES, np.random.default_rng(0)).__next__()


@pytest.mark.parametrize("seed", range(3))
def test_a_column_does_not_tell_that_its_effect_is_at_work(arm, seed, tmp_path):
    fields = {**asked("mixed", 1)[0], "effects": ("drift",), "unlisted": None}
    truth = make(Case("c1", seed, "mixed", arm, **fields), tmp_path)["truth"]
    campaign = read_campaign(tmp_path)
    columns = {name.split(".")[0] for name in campaign.covariates}
    assert {"time", "temperature", "velocity", "acceleration", "approach", "payload", "humidity", "speed"} <= columns
    assert sum(name.startswith("temperature.") for name in campaign.covariates) > 1
    assert 40 <= campaign.samples <= 140
    assert truth["effects"] == ["drift"]
    assert 0.3 <= truth["parts"]["drift"]["ratio"] <= 10.0


@pytest.mark.parametrize("seed", range(3))
def test_visits_are_two_to_five_of_a_pose_in_mixed_order(arm, seed, tmp_path):
    make(Case("c1", seed, "visits", arm, **asked("visits", 1)[0]), tmp_path)
    labels = read_campaign(tmp_path).labels["pose"]
    visits = sorted(Counter(labels).values())
    assert set(visits[1:]) <= {2, 3, 4, 5}  # the last row ends one pose early
    assert len(set(visits)) > 1
    assert any(a != b for a, b in zip(labels, sorted(labels), strict=True))
