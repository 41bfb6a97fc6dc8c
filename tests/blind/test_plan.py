"""Which cases a trial has: what is asked in each kind, in turn or by chance, and nothing that nobody could answer."""

import json
import math
import pickle
import re
from collections import Counter
from dataclasses import asdict, replace
from itertools import islice
from typing import get_args

import numpy as np
import pytest

pytest.importorskip("mujoco", reason='the blind trial needs "thermal-robot[blind]"')

from benchmarks import bench_blind
from blind_records import trial, trial_of_several
from scipy.stats import binom

from thermal_robot.blind import cases as cases_module
from thermal_robot.blind.cases import ASKS, SEVERAL, Case, Kind
from thermal_robot.blind.judged import HEADLINE
from thermal_robot.blind.plan import (
    BESIDE,
    CONDITION,
    CONTAINS,
    FULL,
    IMITATES,
    LOCAL,
    RANDOM,
    SHORT,
    STRANGE,
    plan,
    robots,
    turns,
)
from thermal_robot.blind.reality import FAULTS, UNLISTED, make
from thermal_robot.campaign import read_campaign
from thermal_robot.errors import EffectError, RobotError

CAUSES = tuple(UNLISTED)


@pytest.fixture(scope="module")
def arms():
    return robots([("rv_m2", "builtin:rv_m2", "tool0")])


def listed(cases, kind):
    return [case for case in cases if case.kind == kind]


def asked(kind, count, effects=tuple(FAULTS)):
    return list(islice(turns(kind, effects, CAUSES, np.random.default_rng(3)), count))


def expected(trials, chance):
    """Counts that chance leaves 1e-5 below and above."""
    return binom.ppf([1e-5, 1 - 1e-5], trials, chance)


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


def test_each_effect_cause_and_change_is_asked_as_often_as_any_other(arms):
    cases = plan(3, {"single": 3 * len(FAULTS), "unlisted": 2 * len(UNLISTED)}, arms)
    assert Counter(name for case in listed(cases, "single") for name in case.effects) == dict.fromkeys(FAULTS, 3)
    assert Counter(case.unlisted for case in listed(cases, "unlisted")) == dict.fromkeys(UNLISTED, 2)
    chosen = plan(3, {"single": 8, "null": 2}, arms, only_effects=("drift", "backlash"))
    assert Counter(e for case in chosen for e in case.effects) == {"drift": 4, "backlash": 4}
    both = asked("both", 2 * len(CAUSES))
    assert Counter(case["unlisted"] for case in both) == dict.fromkeys(CAUSES, 2)
    assert {len(case["effects"]) for case in both} == {1, 2}
    ways = Counter((case["several"].moves, case["several"].how) for case in asked("series", 24))
    assert ways == {(name, how): 2 for name in LOCAL for how in ("begins", "jumps", "grows")}
    assert Counter(case["several"].moves for case in asked("changed", 12)) == dict.fromkeys(LOCAL, 3)
    fleets = Counter((case["several"].how, case["several"].moves) for case in asked("fleet", 24))
    # a third of the fleets shares nothing
    assert fleets == {**{(how, name): 2 for how in ("all", "hall") for name in LOCAL}, ("", ""): 8}


def test_no_case_asks_what_nobody_could_answer(arms):
    cases = plan(5, {"pair": 300, "many": 300, "removed": 60, "hidden": 20, "hard": 60}, arms)
    for case in (*listed(cases, "pair"), *listed(cases, "many")):
        assert len(set(case.effects)) in ((2,) if case.kind == "pair" else (3, 4, 5))
        # base, tool and scatter are the business of other cases; of two that do the same only one is asked
        assert not {*RANDOM, "base_frame", "tool_frame"} & set(case.effects)
        for outer, inner in (*CONTAINS.items(), *IMITATES.items()):
            assert not (outer in case.effects and inner & set(case.effects))
    counts = Counter(len(case.effects) for case in listed(cases, "many"))
    low, high = expected(300, 1 / 3)
    assert all(low <= count <= high for count in counts.values())
    for case in listed(cases, "removed"):
        assert case.without == case.effects
        assert case.effects[0] not in ("joint_offset", "instrument_scale", "joint_gain")
    for case in listed(cases, "hidden"):
        assert case.hidden == CONDITION[case.effects[0]]
    for case in listed(cases, "hard"):
        assert case.background > 0.0
        assert case.heavy
        assert case.ratio[0] < 1.0


def test_large_ones_are_as_large_as_on_real_robots_and_lags_follow_the_air():
    assert {case["effects"][0] for case in asked("large", len(FAULTS))} == set(FAULTS)
    assert all(case["ratio"] == (10.0, 60.0) for case in asked("large", 5))
    lags = asked("lags", 30)
    names = ("tracking_lag", "drift", "thermal_elongation")
    assert Counter(case["effects"][0] for case in lags) == dict.fromkeys(names, 10)
    assert all(case["wants"] == ("sensor:air",) for case in lags if case["effects"] == ("thermal_elongation",))


def test_in_a_mixture_every_effect_has_its_own_chance_and_a_cause_has_one():
    cases = asked("mixed", 4000)
    counts = Counter(name for case in cases for name in case["effects"])
    contained = {"geometric", "joint_offset", "instrument_scale"}  # sets that hold both are drawn again
    assert set(counts) == set(FAULTS) - {"base_frame", "tool_frame"}
    # a chance drawn evenly from 0 to 30 % anew in each case is 15 % of them
    low, high = expected(4000, 0.15)
    assert all(low <= counts[name] <= high for name in set(counts) - contained - {"excess_repeatability"}), counts
    low, high = expected(4000, STRANGE)
    assert low <= sum(case["unlisted"] is not None for case in cases) <= high
    assert {case["unlisted"] for case in cases} == {None, *UNLISTED}
    assert not any({"geometric", "joint_offset"} <= set(case["effects"]) for case in cases)
    # nobody sees scatter between visits without visits
    scattering = [case for case in cases if "excess_repeatability" in case["effects"]]
    assert scattering
    assert all("repeats" in case["wants"] for case in scattering)


@pytest.mark.parametrize("kind", SEVERAL)
def test_what_changes_is_at_work_and_nothing_beside_it_does_the_same(kind):
    for case in asked(kind, 200):
        several, effects = case["several"], case["effects"]
        assert not several.moves or several.moves in effects
        assert len(set(effects)) == len(effects) <= 2
        assert set(effects) <= set(BESIDE)
        assert bool(several.how) == bool(several.moves) or kind == "fleet"
        for outer, inner in (*CONTAINS.items(), *IMITATES.items()):
            assert not (outer in effects and inner & set(effects))


def test_nothing_changes_where_nothing_is_to():
    for kind, count in (("same", 2), ("steady", 12)):
        cases = asked(kind, 60)
        assert {(c["several"].how, c["several"].moves, c["several"].campaigns) for c in cases} == {
            ("", "", (count,) * 2)
        }
        assert {len(c["effects"]) for c in cases} == {1, 2}


def test_two_to_four_robots_of_a_fleet_have_a_fault_of_their_own():
    cases = asked("fleet", 300)
    counts = Counter(len(case["several"].apart) for case in cases)
    assert set(counts) == {2, 3, 4}
    assert min(counts.values()) > 60
    assert set(name for case in cases for name in case["several"].apart) == set(LOCAL)
    # an arm of four joints has two between the first and the last
    assert all(max(Counter((*case["effects"], *case["several"].apart)).values()) <= 2 for case in cases)


def test_each_robot_is_as_probable_as_any_other(arms):
    cases = plan(7, {"null": 400}, (arms[0], replace(arms[0], name="other")))
    low, high = expected(400, 0.5)
    assert low <= sum(case.robot.name == "other" for case in cases) <= high


@pytest.mark.slow
@pytest.mark.parametrize("size", [SHORT, FULL], ids=["short", "full"])
def test_whoever_asks_for_several_campaigns_has_the_same_single_ones(arms, size):
    alone, together = ({k: n for k, n in size.items() if (k in SEVERAL) is several} for several in (False, True))
    cases = plan(9, size, arms)
    assert [case for case in cases if case.several is None] == list(plan(9, alone, arms))
    # a stream of their own: single ones change nothing of them either
    several = [case for case in cases if case.several is not None]
    assert several == list(plan(9, together, arms))
    assert several != list(plan(10, together, arms))
    assert Counter(case.kind for case in several) == together
    assert {case.id[0] for case in several} == {"s"}


@pytest.mark.parametrize(
    ("kind", "effects", "words"),
    [
        ("nul", (), "no kind of case 'nul'"),
        ("real", (), "no kind of case 'real'"),
        ("single", ("rust",), "cannot make 'rust'"),
        ("pair", ("drift",), "no case of kind 'pair'"),
        ("many", ("drift", "backlash"), "many effects together are up to 5, of drift, backlash"),
        ("both", ("joint_offset", "geometric"), "2 effects together: of joint_offset, geometric any"),
        ("both", ("base_frame",), "no case of kind 'both'"),
        *((kind, ("drift",), f"no case of kind '{kind}' can be made of drift; it takes") for kind in SEVERAL),
        ("series", ("link_compliance",), "no case of kind 'series'"),
    ],
)
def test_what_cannot_be_asked_is_refused(arms, kind, effects, words):
    with pytest.raises(EffectError, match=words):
        plan(1, {kind: 1}, arms, effects)


def test_what_may_not_be_asked_is_not():
    assert {case["effects"] for case in asked("changed", 10, ("backlash", "drift"))} == {("backlash",)}
    # of an effect with many numbers a joint nobody asks which changed, but a robot may have it on all days
    assert asked("steady", 1, ("link_compliance",))[0]["effects"] == ("link_compliance",)


def test_a_robot_of_few_joints_is_refused():
    joints = "".join(
        f'<link name="l{k}"/><joint name="j{k}" type="revolute"><parent link="l{k}"/><child link="l{k + 1}"/>'
        '<axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
        for k in range(3)
    )
    with pytest.raises(RobotError, match="has 3 joints"):
        robots([("small", f'<robot name="small">{joints}<link name="l3"/></robot>', "l3")])


def test_a_column_does_not_tell_that_its_effect_is_at_work(arms, tmp_path):
    fields = {**asked("mixed", 1)[0], "effects": ("drift",), "unlisted": None}
    truth = make(Case("c1", 1, "mixed", arms[0], **fields), tmp_path)["truth"]
    columns = {name.split(".")[0] for name in read_campaign(tmp_path).covariates}
    assert {"time", "temperature", "velocity", "acceleration", "approach", "payload", "humidity", "speed"} <= columns
    assert {"motor_temperature"} <= columns
    assert truth["effects"] == ["drift"]
    assert 0.3 <= truth["parts"]["drift"]["ratio"] <= 10.0


def test_visits_are_two_to_five_of_a_pose_in_mixed_order(arms, tmp_path):
    make(Case("c1", 1, "visits", arms[0], **asked("visits", 1)[0]), tmp_path)
    labels = read_campaign(tmp_path).labels["pose"]
    visits = sorted(Counter(labels).values())
    assert set(visits[1:]) <= {2, 3, 4, 5}  # the last row ends one pose early
    assert len(set(visits)) > 1
    assert any(a != b for a, b in zip(labels, sorted(labels), strict=True))


# ---- cases and their records


def test_a_case_travels_to_another_process_and_into_a_file(arms):
    for case in plan(2, {"hidden": 1, "series": 1}, arms):
        assert pickle.loads(pickle.dumps(case)) == case
        assert hash(case) == hash(pickle.loads(pickle.dumps(case)))
        plain = json.loads(json.dumps(asdict(case)))
        assert (plain["seed"], plain["effects"]) == (case.seed, list(case.effects))
    case = Case("c1", 0, "null", arms[0])
    assert (case.effects, case.without, case.hidden, case.unlisted, case.own) == ((), (), (), None, "")
    # an effect is larger than the noise, and a campaign a possible one
    assert 1.0 < case.ratio[0] < case.ratio[1]
    assert 10 < case.samples[0] < case.samples[1]
    assert set(SEVERAL) == set(ASKS) < set(get_args(Kind))


def test_records_have_the_fields_that_are_listed():
    listed_ = set(re.findall(r'"(\w+)":', cases_module.__doc__))
    real = {"right", "asked", "answer"}  # which a real case adds when it judges
    for record in (*trial(), *trial_of_several()):
        assert set(record) - real <= listed_
        assert set(record["truth"]) <= listed_


# ---- floors of the drawn trial


def passes(floor, trials, chance):
    """P(X ≥ floor), summed term by term."""
    return sum(math.comb(trials, k) * chance**k * (1 - chance) ** (trials - k) for k in range(floor, trials + 1))


@pytest.mark.parametrize(("kind", "question"), bench_blind.TARGETS)
def test_floors_let_a_good_program_pass_and_one_right_in_four_of_five_hardly_ever(kind, question):
    target, count = bench_blind.TARGETS[kind, question], bench_blind.COUNTS[kind]
    trials = math.ceil(0.9 * count)  # a tenth of the cases may be withdrawn
    assert passes(bench_blind.floor(target, trials), trials, bench_blind.POOR) < 1e-3
    share = 0.01 / len(bench_blind.TARGETS)
    floor = bench_blind.floor(target, count)
    assert 1.0 - passes(floor, count, target) <= share < 1.0 - passes(floor + 1, count, target)
    assert question == HEADLINE[kind] or kind == "unlisted"


def test_right_everywhere_passes_and_80_percent_or_too_few_cases_fail():
    def judged(chance, trials=None):
        found = {}
        for kind, question in bench_blind.TARGETS:
            n = trials or bench_blind.COUNTS[kind]
            found.setdefault(kind, {})[question] = {"successes": math.floor(chance * n), "trials": n}
        return bench_blind.judged(found)

    assert all(told for _, told in judged(1.0))
    assert not any(told for _, told in judged(0.8))
    assert not any(told for _, told in judged(1.0, 20))
    assert all("too few" in line for line, _ in judged(1.0, 20))
    assert not any(told for _, told in bench_blind.judged({}))
