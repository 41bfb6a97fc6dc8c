"""Which cases a trial has."""

from collections import Counter
from dataclasses import replace

import pytest

pytest.importorskip("mujoco", reason='the blind trial needs "thermal-robot[blind]"')

from scipy.stats import binom

from thermal_robot.blind.cases import SEVERAL
from thermal_robot.blind.plan import CONDITION, FULL, RANDOM, SHORT, plan, robots
from thermal_robot.blind.reality import FAULTS, UNLISTED
from thermal_robot.errors import EffectError, RobotError


@pytest.fixture(scope="module")
def arms():
    return robots([("rv_m2", "builtin:rv_m2", "tool0")])


def listed(cases, kind):
    return [case for case in cases if case.kind == kind]


def test_the_seed_settles_the_plan(arms):
    counts = {"single": 20, "null": 5, "pair": 6}
    cases = plan(1, counts, arms)
    assert cases == plan(1, counts, arms)
    assert cases != plan(2, counts, arms)
    assert {kind: len(listed(cases, kind)) for kind in counts} == counts
    assert len({case.seed for case in cases}) == len({case.id for case in cases}) == 31
    # a case's number tells nothing: kinds are mixed
    assert [case.id for case in cases] == sorted(case.id for case in cases)
    assert [case.kind for case in cases] != sorted((case.kind for case in cases), key=list(counts).index)


def test_each_effect_is_asked_as_often_as_any_other(arms):
    cases = plan(3, {"single": 3 * len(FAULTS), "unlisted": 2 * len(UNLISTED)}, arms)
    singles = Counter(name for case in listed(cases, "single") for name in case.effects)
    assert singles == dict.fromkeys(FAULTS, 3)
    assert Counter(case.unlisted for case in listed(cases, "unlisted")) == dict.fromkeys(UNLISTED, 2)
    chosen = plan(3, {"single": 8, "null": 2}, arms, only_effects=("drift", "backlash"))
    assert Counter(e for case in chosen for e in case.effects) == {"drift": 4, "backlash": 4}


def test_no_case_asks_what_nobody_could_answer(arms):
    cases = plan(5, {"pair": 300, "many": 300, "removed": 60, "hidden": 20, "hard": 60}, arms)
    for case in (*listed(cases, "pair"), *listed(cases, "many")):
        assert len(set(case.effects)) in ((2,) if case.kind == "pair" else (3, 4, 5))
        assert not {"transmission_error", "joint_gain"} <= set(case.effects)
        # base, tool and scatter are the business of other cases; of two that do the same only one is asked
        assert not {"base_frame", "tool_frame", *RANDOM} & set(case.effects)
        assert not {"geometric", "joint_offset"} <= set(case.effects)
        assert not {"geometric", "instrument_scale"} <= set(case.effects)
    for case in listed(cases, "removed"):
        assert case.without == case.effects
        assert case.effects[0] not in ("joint_offset", "instrument_scale", "joint_gain")
    for case in listed(cases, "hidden"):
        assert case.hidden == CONDITION[case.effects[0]]
    for case in listed(cases, "hard"):
        assert case.background > 0.0
        assert case.heavy
        assert case.ratio[0] < 1.0


def test_each_robot_is_as_probable_as_any_other(arms):
    two = (arms[0], replace(arms[0], name="other"))
    cases = plan(7, {"null": 400}, two)
    low, high = binom.ppf([1e-5, 1 - 1e-5], 400, 0.5)
    assert low <= sum(case.robot.name == "other" for case in cases) <= high


@pytest.mark.parametrize("size", [SHORT, FULL], ids=["short", "full"])
def test_whoever_asks_for_several_campaigns_has_the_same_single_ones(arms, size):
    alone = {kind: count for kind, count in size.items() if kind not in SEVERAL}
    cases = plan(9, size, arms)
    assert [case for case in cases if case.several is None] == list(plan(9, alone, arms))
    together = [case for case in cases if case.several is not None]
    assert Counter(case.kind for case in together) == {kind: size[kind] for kind in SEVERAL}
    assert {case.id[0] for case in together} == {"s"}
    # a stream of their own: single ones change nothing of them either
    assert together == list(plan(9, {kind: size[kind] for kind in SEVERAL}, arms))
    assert together != list(plan(10, {kind: size[kind] for kind in SEVERAL}, arms))


@pytest.mark.parametrize(
    ("counts", "effects", "words"),
    [
        ({"nul": 1}, (), "no kind of case 'nul'"),
        ({"real": 1}, (), "no kind of case 'real'"),
        ({"single": 1}, ("rust",), "cannot make 'rust'"),
        ({"pair": 1}, ("drift",), "no case of kind 'pair'"),
    ],
)
def test_what_cannot_be_asked_is_refused(arms, counts, effects, words):
    with pytest.raises(EffectError, match=words):
        plan(1, counts, arms, effects)


def test_a_robot_of_few_joints_is_refused():
    joints = "".join(
        f'<link name="l{k}"/><joint name="j{k}" type="revolute"><parent link="l{k}"/><child link="l{k + 1}"/>'
        '<axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
        for k in range(3)
    )
    with pytest.raises(RobotError, match="has 3 joints"):
        robots([("small", f'<robot name="small">{joints}<link name="l3"/></robot>', "l3")])
