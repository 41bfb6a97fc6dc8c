"""One robot over time: campaigns as one problem, what moves as it is told, in words and as JSON."""

import json
import math
from dataclasses import replace
from datetime import date, datetime, timedelta, timezone

import numpy as np
import pytest
from compared import lagging_days
from helpers import some
from scipy.special import logsumexp
from scipy.stats import binom, multivariate_normal
from wear_cases import by_hand, columns, jumping, measured, series_of

from thermal_robot import CampaignError, EffectError, diagnose, load_robot, simulate, wear
from thermal_robot.effects import Parameter, choose
from thermal_robot.fleet import settings
from thermal_robot.fleet.wear import as_date, comparable, moment, results
from thermal_robot.fleet.wear_moves import (
    Beside,
    Move,
    State,
    chances,
    explanations,
    fieller,
    log_prior,
    moves_of,
    scatter,
)
from thermal_robot.fleet.wear_problem import Problem, problem, require_alike
from thermal_robot.fleet.wear_result import SCHEMA
from thermal_robot.inference.fit import fit
from thermal_robot.kinematics import exp6

ZEROS = (1e-3, 1e-3, 1.3e-3, 1.3e-3)
DATES = [date(2026, 1, 1) + timedelta(days=30 * k) for k in range(4)]


@pytest.fixture(scope="module")
def campaigns(rv_m2):
    known = dict(rows=40, noise=2e-5, base_known=False, tool_known=False)
    return [simulate(rv_m2, {"joint_offset": {"joint_3": z}}, seed=k, **known) for k, z in enumerate(ZEROS)]


@pytest.fixture(scope="module")
def found(campaigns):
    return wear(campaigns, dates=DATES, effects=["joint_offset"], limits={"joint_offset": 2e-3})


def test_the_jump_is_found(found):
    (rings,) = found.alarms
    assert (rings.place, rings.kind, rings.jump.after) == ("joint_3", "jump", 1)
    assert abs(rings.jump.size - 3e-4) < 4.0 * rings.jump.std
    assert {w.place for w in found.parameters if not w.comparable} == {"joint_1", "joint_5"}
    assert [visit.time for visit in found.campaigns] == [0.0, 30.0, 60.0, 90.0]


@pytest.mark.slow
def test_pairs_may_come_in_any_order_and_a_shift_of_all_dates_does_not_matter(campaigns, found):
    pairs = [(DATES[k].isoformat(), campaigns[k]) for k in (2, 0, 3, 1)]
    assert wear(pairs, effects="joint_offset", limits={"joint_offset": 2e-3}).to_dict() == found.to_dict()
    later = wear(campaigns, dates=[d + timedelta(days=1000) for d in DATES], effects=["joint_offset"])
    assert [(w.kinds, w.values) for w in later.parameters] == [(w.kinds, w.values) for w in found.parameters]


@pytest.mark.slow
def test_diagnoses_do_as_well(campaigns):
    diagnoses = [diagnose(campaign, only=["joint_offset"]) for campaign in campaigns]
    undated = wear(diagnoses)
    (rings,) = undated.alarms
    assert (rings.place, rings.kind, undated.dated) == ("joint_3", "jump", False)
    with pytest.raises(CampaignError, match="made without its fit"):
        wear([replace(diagnoses[0], fit=None), *diagnoses[1:]])


@pytest.mark.parametrize(
    ("members", "options", "said"),
    [
        (2, {}, "too few campaigns"),
        (4, {"dates": DATES[:3]}, "3 dates for 4 campaigns"),
        (4, {"dates": "2026-01-01"}, "one text"),
        (4, {"dates": ["soon"] * 4}, "is no date"),
        (4, {"limits": {"backlsh": 1e-3}}, "did you mean 'backlash'"),
        (4, {"limits": {"backlash": -1.0}}, "is no limit"),
        (4, {"effects": ["joint_ofset"]}, "joint_ofset"),
        (4, {"false_alarm": 1.0}, "no rate of false alarms"),
    ],
)
def test_wrong_arguments_are_told(campaigns, members, options, said):
    with pytest.raises((CampaignError, EffectError), match=said):
        wear(campaigns[:members], **options)


def test_what_are_no_campaigns_is_told(campaigns):
    with pytest.raises(CampaignError, match="some campaigns have dates"):
        wear([(DATES[0], campaigns[0]), *campaigns[1:]])
    with pytest.raises(CampaignError, match="found int"):
        wear([1, 2, 3])
    with pytest.raises(CampaignError, match="cannot take this"):
        wear(3)
    with pytest.raises(CampaignError, match="nothing was measured"):
        wear([replace(campaigns[0], position=None), *campaigns[1:]])


@pytest.mark.parametrize(
    ("given", "meant"),
    [
        ("2026-03-01", datetime(2026, 3, 1)),
        (" 2026-03-01T14:30 ", datetime(2026, 3, 1, 14, 30)),
        (date(2026, 3, 1), datetime(2026, 3, 1)),
        (datetime(2026, 3, 1, 6), datetime(2026, 3, 1, 6)),
        (datetime(2026, 3, 1, 6, tzinfo=timezone(timedelta(hours=2))), datetime(2026, 3, 1, 4)),
        *((no, None) for no in ("first of March", "2026-13-01", 20260301, None, "")),
    ],
)
def test_a_date_is_a_moment_and_what_is_none_is_told_with_an_example(given, meant):
    if meant is None:
        with pytest.raises(CampaignError, match=r"is no date.*2026-03-01"):
            moment(given)
    else:
        assert moment(given) == meant


def test_a_day_after_the_first_is_told_as_a_date_through_a_leap_day():
    assert as_date(datetime(2028, 2, 28), 2.0) == "2028-03-01"
    assert as_date(datetime(2028, 2, 28), 1e12) == "later than 9999"


def campaign(robot, seed, place=0, **effects):
    """A campaign whose instrument and target stand in one of several places; noise along its own axes alike."""
    rng = np.random.default_rng(place)
    base, tool = (exp6(rng.uniform(-0.5, 0.5, 6)), np.eye(4)) if place else (np.eye(4), np.eye(4))
    tool[:3, 3] = [0.05, 0.02, 0.1] if not place else [-0.03, 0.06, 0.04]
    known = dict(rows=40, seed=seed, noise=0.0, base=base, tool=tool, base_known=False, tool_known=False)
    made = simulate(robot, {"joint_offset": {robot.joint_names[2]: 1e-3}, **effects}, **known)
    turned = 2e-5 * np.random.default_rng([seed, 1]).normal(size=made.position.shape) @ base[:3, :3].T
    return replace(made, position=made.position + turned, noise_position=2e-5)


def sizes(found):
    return np.array([parameter.size for parameter in found.parameters])


def of_elongation(found):
    return [k for k, (effect, _) in enumerate(found.keys) if effect == "thermal_elongation"]


def fitted(*campaigns):
    return [fit(one, choose(("joint_offset",), (), ())) for one in campaigns]


@pytest.fixture(scope="module")
def three(rv_m2):
    return problem(fitted(*(campaign(rv_m2, seed) for seed in (1, 2, 3))))


@pytest.mark.slow
def test_where_instrument_and_target_stand_means_nothing(rv_m2, three):
    here, there = three, problem(fitted(*(campaign(rv_m2, seed, place=seed) for seed in (1, 2, 3))))
    assert here.keys == there.keys
    values = []
    for one in (here, there):
        total = one.matrices.sum(axis=0) + 1e-3 * np.eye(len(one.keys))
        values.append(sizes(one) * np.linalg.solve(total, one.vectors.sum(axis=0)))
    assert abs(values[0][2] - 1e-3) < 5e-5
    # targets at other places have other lever arms: the noise enters in another way, the value does not
    np.testing.assert_allclose(values[0], values[1], atol=3e-5)
    turn = exp6(np.array([0.0, 0.0, 0.0, 1.0, 2.0, 3.0]))[:3, :3]
    others = [replace(c, position=c.position @ turn.T + 1.0) for c in (campaign(rv_m2, 2), campaign(rv_m2, 3))]
    moved = problem(fitted(campaign(rv_m2, 1), *others))
    np.testing.assert_allclose(moved.matrices, here.matrices, rtol=2e-3, atol=1e-3 * here.matrices.max())


@pytest.mark.slow
def test_zeros_are_followed_whatever_was_named_and_nil_where_unknown_frames_take_them_up(rv_m2, three):
    assert [name for _, name in three.keys][:5] == [f"zero offset, joint_{k}" for k in range(1, 6)]
    assert not three.matrices[:, 0].any()
    assert three.matrices[:, 2, 2].min() > 100.0
    found = problem([fit(campaign(rv_m2, seed), ()) for seed in (1, 2, 3)])
    assert [effect for effect, _ in found.keys] == ["joint_offset"] * 5


@pytest.mark.slow
def test_an_effect_that_one_campaign_cannot_show_is_nil_there(rv_m2):
    days = [campaign(rv_m2, seed, thermal_elongation=2e-5 * (seed < 3)) for seed in (1, 2, 3)]
    days[2] = replace(days[2], covariates={k: v for k, v in days[2].covariates.items() if k != "temperature"})
    found = problem([fit(one, choose(("thermal_elongation",), (), ())) for one in days])
    own = of_elongation(found)
    assert own
    assert found.has[:2][:, own].all()
    assert not found.has[2, own].any()
    assert not found.matrices[2][own].any()


def test_another_robot_is_refused(rv_m2):
    ur10 = load_robot("example-robot-data:ur10", "tool0")
    fits = fitted(campaign(rv_m2, 1), campaign(ur10, 2))
    with pytest.raises(CampaignError, match="is of another robot"):
        require_alike(fits)
    other = load_robot(rv_m2.urdf.replace("<robot", "<!-- calibrated --><robot", 1), rv_m2.tool_frame)
    with pytest.raises(CampaignError, match="another URDF"):
        require_alike(fitted(campaign(rv_m2, 1), campaign(other, 2)))


@pytest.mark.slow
def test_links_that_lag_follow_the_record_of_each_campaign():
    """Each campaign by itself says what was at work, whichever one has the setting that all are followed by."""
    for days in (lagging_days(), lagging_days()[:2][::-1]):
        found = problem([fit(day, choose(("thermal_elongation",), (), ())) for day in days])
        own = of_elongation(found)
        assert found.has[:, own].all()
        for matrix, vector in zip(found.matrices, found.vectors, strict=True):
            values = np.linalg.solve(matrix + 1e-6 * np.eye(len(matrix)), vector) * sizes(found)
            np.testing.assert_allclose(values[own], 2e-5, rtol=0.15)


SIZE = 1e-3
FIRST = datetime(2026, 1, 1)


def problem_of(series, has=None):
    count = len(series.followed)
    parameters = tuple(Parameter("zero", "rad", SIZE, "joint", f"j{k}", ()) for k in range(count))
    keys = tuple(("joint_offset", p.name) for p in parameters)
    has = np.ones((series.count, count), dtype=bool) if has is None else has
    return Problem(keys, parameters, ("joint zeros",) * count, series.matrices, series.vectors, has)


def followed(series, first=FIRST, limits=None):
    found = results(problem_of(series), series, explanations(series), first, limits or {}, 0.01)
    return {worn.place: worn for worn in found}


def growing(rate=0.02, start=0.3, seed=5):
    design, rng = columns(8, 3, seed)
    days = np.array([0.0, 20, 41, 60, 85, 100, 120, 140])
    states = np.tile(rng.normal(size=3), (8, 1))
    states[:, 1] = start + rate * days
    return series_of(design, measured(design, states, rng), days)


@pytest.mark.parametrize("after", [0, 4, 6])
def test_a_jump_is_told_with_its_day_and_size(after):
    worn = followed(jumping(after=after))["j1"]
    assert worn.alarm
    assert worn.moved > 0.99
    assert (worn.kind, worn.jump.after, worn.jump.earliest, worn.jump.latest) == ("jump", after, after, after + 1)
    assert abs(worn.jump.size - SIZE) < 4.0 * worn.jump.std
    assert sum(worn.jump.probabilities) == pytest.approx(1.0)
    assert worn.rate is None
    assert sum(worn.kinds.values()) == pytest.approx(1.0)
    assert len(set(worn.fitted[: after + 1])) == len(set(worn.fitted[after + 1 :])) == 1
    assert worn.fitted[after + 1] - worn.fitted[after] == pytest.approx(worn.jump.size)


def test_a_trend_is_told_with_its_rate_and_the_day_of_its_limit_where_there_are_dates():
    worn = followed(growing(), limits={"joint_offset": 5.0 * SIZE})["j1"]
    assert worn.kind == "trend"
    assert abs(worn.rate.value - 0.02 * SIZE) < 4.0 * worn.rate.std
    crossing = worn.crossing
    assert crossing.state == "expected"
    assert crossing.low < (5.0 - 0.3) / 0.02 < crossing.high
    assert crossing.low > 140.0
    assert [day[:5] for day in crossing.dates] == ["2026-"] * 3
    worn = followed(growing(), first=None, limits={"joint_offset": 5.0 * SIZE})["j1"]
    assert (worn.kind, worn.rate, worn.crossing.state) == ("trend", None, "unknown")


def test_what_does_not_move_never_gets_there_and_what_is_beyond_has_passed():
    series = jumping(size=1.0)
    values = np.abs(followed(series)["j0"].fitted[-1])
    never = followed(series, limits={"joint_offset": 2.0 * values})["j0"].crossing
    passed = followed(series, limits={"joint_offset": 0.5 * values})["j0"].crossing
    assert (never.state, never.day, passed.state) == ("never", None, "passed")


def test_parameters_that_do_the_same_are_confounded():
    design, rng = columns(8, 3, 1)
    design[:, :, 2] = design[:, :, 1] + 0.02 * rng.normal(size=design.shape[:2])
    states = np.zeros((8, 3))
    states[4:, 1] = 1.0
    found = followed(series_of(design, measured(design, states, rng), np.arange(8.0)))
    assert found["j1"].confounded_with == ("zero, j2",)
    assert found["j0"].confounded_with == ()
    assert found["j1"].alarm or found["j2"].alarm


def test_what_is_hidden_or_rarely_seen_is_not_compared():
    design, rng = columns(6, 3, 2)
    design[:, :, 0] *= 1e-3
    has = np.ones((6, 3), dtype=bool)
    has[1:, 2] = False
    design[1:, :, 2] = 0.0
    series = series_of(design, measured(design, np.zeros((6, 3)), rng), np.arange(6.0))
    assert comparable(problem_of(series, has), series).tolist() == [False, True, False]


def test_json_holds_everything(tmp_path):
    wear = by_hand()
    wear.to_json(tmp_path / "wear.json")
    found = json.loads((tmp_path / "wear.json").read_text(encoding="utf-8"))
    assert found == wear.to_dict()
    assert found["schema"] == SCHEMA == "thermal-robot/wear/1"
    assert [p["parameter"] for p in found["parameters"]] == [w.parameter for w in wear.parameters]
    assert found["parameters"][0]["jump"]["after"] == 1
    assert found["parameters"][1]["values"][2] is None
    assert found["parameters"][1]["crossing"]["dates"] == ["2026-07-20", "2026-06-30", "2026-08-19"]


SAID = [
    "zero offset, elbow jumped by +0.200 ± 0.020 mrad between run_1 (2026-02-01) and run_2 (2026-03-01)",
    "lost motion, wrist moves by +1.00 ± 0.10 µrad a day",
    "at most 1 % of series",
    "chance of such an alarm without a change: at most 1e-06",
    "cannot be told from a change of zero offset, wrist",
    "limit 0.500 mrad: about 2026-07-20 (95 %: 2026-06-30 to 2026-08-19)",
    "not compared zero offset, pan: unknown frames hide its changes",
    "note         a <note> to know",
]


def test_the_text_says_what_moved_when_how_fast_and_what_cannot_be_compared():
    wear = by_hand()
    assert [w.place for w in wear.alarms] == ["elbow", "wrist"]
    assert repr(wear) == "Wear('arm', 4 campaigns: zero offset, elbow (jump), lost motion, wrist (trend))"
    assert [words for words in SAID if words not in str(wear)] == []
    assert all(words in wear.summary for words in SAID[:2])
    undated = str(by_hand(dated=False))
    for words in ("no dates, so no rates", "moves steadily, by +90.0 ± 9.0 µrad", "not foreseen, for lack of a rate"):
        assert words in undated
    quiet = replace(wear, parameters=tuple(replace(w, alarm=False) for w in wear.parameters))
    assert "nothing moves that would not by chance in 1 % of such series" in quiet.summary
    assert "perhaps" in str(quiet)


# ---- moves


DAYS = np.array([0.0, 3.0, 10.0, 11.0, 30.0])
MODELS = [
    (Move(0, "jump", 2),),
    (Move(2, "trend"),),
    (Move(1, "walk"),),
    (Move(0, "trend"), Move(1, "jump", 0)),
    (Move(2, "walk"), Move(0, "jump", 3)),
]


@pytest.fixture(scope="module")
def case():
    design, rng = columns(len(DAYS), 3, 0)
    states = np.tile(rng.normal(size=3), (len(DAYS), 1))
    states[3:, 0] += 0.4
    values = measured(design, states, rng)
    return design, values, series_of(design, values, DAYS)


def of_states(states, times, seed):
    design, rng = columns(len(states), states.shape[1], seed)
    return series_of(design, measured(design, states, rng), times)


def best(series):
    return next(iter(explanations(series)))


def over_time(move, scale):
    """(K, K) prior covariance of what a move adds to its parameter, as it is defined."""
    if move.kind == "walk":
        return scale**2 * np.minimum.outer(DAYS, DAYS) / (DAYS[-1] - DAYS[0])
    step, line = (np.arange(len(DAYS)) > move.after).astype(float), (DAYS - DAYS.mean()) / (DAYS[-1] - DAYS[0])
    shape = step if move.kind == "jump" else line
    return scale**2 * np.outer(shape, shape)


def density(design, values, moves, scale, factor):
    """Log density of all measurements of all campaigns under some moves."""
    states = np.kron(np.ones((len(DAYS), len(DAYS))), settings.WIDE**2 * np.eye(3))
    for move in moves:
        states += np.kron(over_time(move, scale), np.diag(np.arange(3) == move.parameter).astype(float))
    rows = design.shape[1]
    whole = np.zeros((len(DAYS) * rows, 3 * len(DAYS)))
    for k in range(len(DAYS)):
        whole[k * rows : (k + 1) * rows, 3 * k : 3 * k + 3] = design[k]
    covariance = whole @ states @ whole.T + factor**2 * np.eye(len(whole))
    return multivariate_normal(cov=covariance).logpdf(values.ravel())


@pytest.mark.parametrize("moves", MODELS, ids=str)
@pytest.mark.parametrize(("scale", "factor"), [(1.0, 1.0), (0.1, 1.0), (0.3, 1.6)])
def test_evidence_is_that_of_the_density_of_all_measurements(case, moves, scale, factor):
    design, values, series = case
    grid = series.grid
    point = int(np.flatnonzero((grid.variance == scale**2) & (grid.inflation == factor**2))[0])
    found, nothing = (Beside.of(series, some, grid).log_likelihood[point] for some in (moves, ()))
    wanted = density(design, values, moves, scale, factor) - density(design, values, (), scale, factor)
    # the constants' prior is wide, not endless, and not widened by the scatter
    assert found - nothing == pytest.approx(wanted, abs=0.01 if factor == 1.0 else 0.05)


def test_priors_are_what_is_stated(case):
    series = case[2]
    for count in (1, 3):
        some = replace(series, followed=np.arange(3) < count)
        odds = [np.exp(log_prior(Move(0, "jump", j), some)) for j in range(4)]
        one = sum(odds) + np.exp(log_prior(Move(0, "trend"), some)) + np.exp(log_prior(Move(0, "walk"), some))
        assert (1.0 + one) ** -count == pytest.approx(1.0 - settings.ANY_CHANGE)
    distance, degrees = series.scattered
    grid = series.grid
    prior = grid.log_base + 0.5 * distance / grid.inflation + 0.5 * degrees * np.log(grid.inflation)
    assert logsumexp(prior) == pytest.approx(0.0)
    assert math.fsum(settings.KINDS.values()) == pytest.approx(1.0)
    assert min(settings.KINDS.values()) > 0.0
    assert settings.SCATTER[0] == 1.0  # deviations are never made smaller
    assert list(settings.SCATTER) == sorted(settings.SCATTER)
    assert settings.SCALES[-1] < settings.WIDE


def test_a_trend_and_a_jump_of_two_parameters_are_found_together_and_what_wanders_is_neither():
    times, states = np.array([0.0, 1, 2, 4, 5, 7, 8, 10]), np.zeros((8, 5))
    states[:, 3] = times / 10.0
    states[5:, 0] -= 0.6
    assert best(of_states(states, times, 1)) == (Move(0, "jump", 4), Move(3, "trend"))
    states = np.zeros((16, 3))
    states[:, 2] = np.cumsum(np.random.default_rng(2).normal(size=16))
    ways = moves_of(explanations(of_states(states, np.arange(16.0), 3)), 2)
    assert max(ways, key=ways.get) == Move(2, "walk")


def test_nothing_is_found_where_nothing_moves_or_may():
    found = explanations(jumping(size=0.0))
    assert next(iter(found)) == ()
    assert sum(found.values()) == pytest.approx(1.0)
    assert explanations(replace(jumping(), followed=np.zeros(4, dtype=bool))) == {(): 1.0}


def test_the_order_of_time_matters_and_its_origin_and_unit_do_not():
    series = jumping(size=0.3)
    one, other = explanations(series), explanations(replace(series, times=7.0 * series.times + 1e4))
    assert list(one) == list(other)
    np.testing.assert_allclose([*one.values()], [*other.values()], rtol=1e-6)
    series = jumping(after=1)
    back = replace(series, matrices=series.matrices[::-1], vectors=series.vectors[::-1])
    assert best(back) == (Move(1, "jump", 5),)  # days are as far apart from behind
    series, turned = jumping(size=0.8), np.array([0, 5, 1, 6, 2, 7, 3, 4])
    mixed = replace(series, matrices=series.matrices[turned], vectors=series.vectors[turned])
    assert best(mixed) != best(series)


def test_a_parameter_that_is_not_followed_is_constant_however_it_is_scaled():
    series, scale = jumping(), np.array([1.0, 1.0, 10.0, 1.0])
    still = replace(series, followed=np.array([True, True, False, True]))
    other = replace(still, matrices=series.matrices * np.outer(scale, scale), vectors=series.vectors * scale)
    (one, chance), (two, same) = (next(iter(explanations(s).items())) for s in (still, other))
    assert one == two
    assert chance == pytest.approx(same, abs=1e-3)


def test_values_of_each_campaign_are_those_of_least_squares_with_all_else_constant():
    design, rng = columns(5, 3, 4)
    states = np.tile(rng.normal(size=3), (5, 1))
    states[:, 1] += rng.normal(size=5)
    values = measured(design, states, rng)
    series = series_of(design, values, np.arange(5.0))
    state = State.of(series, (Move(1, "walk"),), free=1)
    found, covariance = state.combinations(state.path(1))
    rows = design.shape[1]
    whole = np.zeros((5 * rows, 2 + 5))
    whole[:, :2] = design[:, :, [0, 2]].reshape(-1, 2)
    for k in range(5):
        whole[k * rows : (k + 1) * rows, 2 + k] = design[k, :, 1]
    np.testing.assert_allclose(found, np.linalg.lstsq(whole, values.ravel(), rcond=None)[0][2:], atol=1e-4)
    deviation = np.sqrt(np.diag(np.linalg.inv(whole.T @ whole)))[2:]
    np.testing.assert_allclose(np.sqrt(np.diag(covariance)), deviation, rtol=1e-3)


COVARIANCE = np.array([[4e-4, 3e-6], [3e-6, 1e-7]])


@pytest.mark.parametrize("rate", [2e-3, -2e-3])
def test_on_the_ends_of_the_interval_the_line_is_two_deviations_from_the_limit(rate):
    value = np.array([0.1, rate])
    expected, low, high = fieller(value, COVARIANCE, 1.0)
    assert low < expected < high
    assert value[0] + rate * expected == pytest.approx(np.sign(rate))
    for end in (low, high):
        along = np.array([1.0, end])
        away = np.sign(rate) - along @ value
        assert abs(away) == pytest.approx(1.959964 * np.sqrt(along @ COVARIANCE @ along), rel=1e-6)


def test_a_rate_that_may_be_none_may_never_get_there():
    expected, low, high = fieller(np.array([0.1, 1e-3]), np.array([[4e-4, 0.0], [0.0, 1e-6]]), 1.0)
    assert high is None
    assert 0.0 < low < expected
    assert fieller(np.array([0.1, 0.0]), np.eye(2), 1.0) is None


def without_change(seed, campaigns=10, parameters=4, noise=1.0):
    design, rng = columns(campaigns, parameters, seed)
    states = np.tile(rng.normal(size=parameters), (campaigns, 1))
    return series_of(design, noise * measured(design, states, rng), np.arange(float(campaigns)))


@pytest.mark.parametrize("noise", some([1.0, 1.8], 2))
def test_series_without_a_change_ring_at_most_as_often_as_stated(noise):
    """Whether the deviations are right, or too small: then the scatter of the campaigns says so."""
    found = np.array([chances(without_change(seed, noise=noise), ()).min() for seed in range(500)])
    for stated in (0.2, 0.05):
        assert int((found <= stated).sum()) <= binom.ppf(0.999, len(found), stated)
    assert (found <= 0.2).mean() > 0.02  # the bound is no idle one


def test_a_clear_jump_is_no_chance_the_others_are_judged_beside_it_and_what_is_not_followed_never_rings():
    series = jumping(size=1.0)
    beside = chances(series, (Move(1, "jump", 4),))
    assert beside[1] < 1e-9
    assert np.delete(beside, 1).min() > 0.01
    assert chances(replace(series, followed=np.array([True, False, True, True])), ())[1] == 1.0


def test_scatter_is_what_it_was_made_with_and_never_below_one():
    grown = [scatter(without_change(seed, noise=2.0), ()) for seed in range(40)]
    assert np.mean(grown) == pytest.approx(4.0, rel=0.1)
    assert without_change(1).scattered[1] == (10 - 1) * 4  # degrees of freedom
    assert scatter(without_change(1, noise=0.1), ()) == 1.0
