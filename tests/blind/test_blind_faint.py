"""Faint cases of the blind trial: every effect by chance, all columns recorded, nothing else to be named."""

import pytest
from blind_records import effect, record, said

pytest.importorskip("mujoco", reason='the blind trial needs "thermal-robot[blind]"')

from scipy.stats import binom

from thermal_robot.blind.cases import Case
from thermal_robot.blind.judged import is_miss, marks
from thermal_robot.blind.plan import CHANCE, plan, robots
from thermal_robot.blind.reality import UNLISTED, make
from thermal_robot.campaign import read_campaign


@pytest.fixture(scope="module")
def arms():
    return robots([("rv_m2", "builtin:rv_m2", "tool0")])


def test_every_effect_and_an_unlisted_cause_have_the_same_chance(arms):
    cases = plan(3, {"faint": 3000}, arms)
    names = {name for case in cases for name in case.effects}
    assert {"drift", "geometric", "encoder_resolution"} <= names
    assert not names & {"base_frame", "tool_frame", "excess_repeatability"}
    low, high = binom.ppf([1e-5, 1 - 1e-5], 3000, CHANCE)
    counts = {name: sum(name in case.effects for case in cases) for name in names}
    # geometric contains two of the others: sets that hold both are drawn again
    contained = {"geometric", "joint_offset", "instrument_scale"}
    assert all(low <= counts[name] <= high for name in names - contained), counts
    assert low <= sum(case.unlisted is not None for case in cases) <= high
    assert {case.unlisted for case in cases} == {None, *UNLISTED}
    assert not any("geometric" in case.effects and "joint_offset" in case.effects for case in cases)
    assert all(case.ratio == (0.5, 1.5) and case.samples == (30, 90) for case in cases)


@pytest.mark.parametrize("seed", range(3))
def test_a_column_does_not_tell_that_its_effect_is_at_work(arms, seed, tmp_path):
    case = Case("c1", seed, "faint", arms[0], effects=("drift",), ratio=(0.5, 1.5), samples=(30, 90))
    truth = make(case, tmp_path)["truth"]
    campaign = read_campaign(tmp_path)
    columns = {name.split(".")[0] for name in campaign.covariates}
    assert {"time", "temperature", "velocity", "acceleration", "approach", "payload"} <= columns
    assert sum(name.startswith("temperature.") for name in campaign.covariates) > 1
    assert 30 <= campaign.samples <= 90
    assert truth["effects"] == ["drift"]
    assert 0.5 <= truth["parts"]["drift"]["ratio"] <= 1.5


@pytest.mark.parametrize(
    ("answer", "unlisted", "sound", "alarm"),
    [
        (said(), None, True, False),  # too small to be seen
        (said(effect("drift")), None, True, False),
        (said(effect("drift"), effect("backlash")), None, False, True),
        (said(effect("drift"), flagged=True), None, False, False),
        (said(effect("drift"), flagged=True), "slip", True, False),
        (said(effect("drift"), effect("discovered.1"), flagged=True), "slip", False, True),
    ],
)
def test_sound_is_what_names_nothing_false(answer, unlisted, sound, alarm):
    case = record("faint", answer, ["drift"], unlisted=unlisted)
    assert marks(case) == {"sound": (sound,), "false_alarm": (alarm,)}
    assert is_miss(case) is not sound
