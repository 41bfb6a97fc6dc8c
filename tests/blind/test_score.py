"""The score of a blind trial, from records made by hand whose answers are known."""

import json

import numpy as np
import pytest
from blind_records import J1, J2, L2, NOISE, crash, effect, record, said, trial, trial_of_several

from thermal_robot.blind.report.page import html
from thermal_robot.blind.report.text import markdown, text
from thermal_robot.blind.score import fresh_ratio, logistic, rate, reliability, score, shares

SCALE = "scale error, instrument"
CABLE = {"unlisted": "cable", "places": [J1], "near": [J1, L2], "quantities": ["time", "order"]}


def of(rate_):
    return rate_["successes"], rate_["trials"]


# ---- rates


@pytest.mark.parametrize(
    ("successes", "trials", "low", "high"),
    # Newcombe 1998, Statistics in Medicine 17, 857, table I: method 3
    [(81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0, 0.1611), (1, 29, 0.0061, 0.1718)],
)
def test_wilsons_interval_is_that_of_the_textbook(successes, trials, low, high):
    found = rate(successes, trials)
    assert found["value"] == successes / trials
    assert found["interval"] == pytest.approx((low, high), abs=5e-5)
    mirrored = rate(trials - successes, trials)["interval"]
    assert (1.0 - mirrored[1], 1.0 - mirrored[0]) == pytest.approx(found["interval"], abs=1e-12)
    assert rate(0, 0) == {"successes": 0, "trials": 0, "value": None, "interval": None}


# ---- the whole


def test_the_score_holds_each_kind():
    found = score(trial())
    kinds = {kind["kind"]: kind for kind in found["kinds"]}
    assert (found["cases"], found["failed"]) == (12, 1)
    assert list(kinds) == "single pair null hard removed hidden unlisted real".split()
    single = kinds["single"]
    assert (single["cases"], single["failed"], single["headline"]) == (4, 1, "exact")
    assert {q: of(single["rates"][q]) for q in ("exact", "first_named", "false_alarm", "located")} == {
        "exact": (1, 4), "first_named": (1, 4), "false_alarm": (2, 4), "located": (2, 2),
    }  # fmt: skip
    assert of(found["by_effect"]["backlash"]["found"]) == (0, 3)
    assert of(found["by_effect"]["drift"]["first_named"]) == (3, 4)
    assert of(found["by_robot"]["ur10"]["exact"]) == (0, 1)
    assert of(found["unlisted"]["cable"]["place"]) == (1, 1)
    [real] = found["real"]
    assert (real["asked"], real["answer"], real["right"]) == ("arm: untouched", "<geometric>", True)
    assert found["seconds"]["longest"] == 0.5
    assert of(found["laws"]) == (1, 1)
    assert of(found["worse"]) == (0, 11)
    assert single["fresh"] == {"count": 3, "median": pytest.approx(3**-0.5), "q90": pytest.approx(3**-0.5)}


def test_misses_can_be_looked_up():
    misses = {m["id"]: m for m in score(trial())["misses"]}
    assert list(misses) == ["a2", "a3", "a4", "n2", "t1", "p1"]
    assert misses["a4"]["error"] == "the diagnosis failed: late"
    told = {name: misses["a2"][name] for name in ("truth", "said", "probability", "wrong")}
    assert told == {
        "truth": ["drift"], "said": ["backlash", "drift"], "probability": 0.9,
        "wrong": ["exact", "first_named", "false_alarm"],
    }  # fmt: skip
    assert misses["a3"]["unexplained"] == "none"


def test_several_campaigns_are_scored_beside_and_change_no_figure_of_single_ones():
    alone, whole = score(trial()), score([*trial(), *trial_of_several()])
    assert [k["kind"] for k in whole["kinds"]][-5:] == ["same", "changed", "steady", "series", "fleet"]
    assert whole["kinds"][: len(alone["kinds"])] == alone["kinds"]
    counted = {"kinds", "cases", "failed", "misses", "changes"}
    assert {name for name in alone if alone[name] != whole[name]} == counted
    assert (whole["cases"], whole["failed"]) == (alone["cases"] + 7, alone["failed"] + 1)
    misses = {m["id"]: m for m in whole["misses"] if m["id"].startswith("k")}
    assert set(misses) == {"k3", "k5", "k7"}
    assert (misses["k5"]["truth"], misses["k5"]["wrong"]) == (["backlash grows, j1"], ["exact", "way"])
    assert misses["k5"]["said"] == ["backlash, j1: jump after campaign 5"]
    assert misses["k7"]["error"] == "the diagnosis failed: late"
    by_change = {name: rates["exact"]["successes"] for name, rates in whole["changes"].items()}
    assert by_change == {"backlash grows": 0, "backlash jumps": 1, "joint_offset changes": 1}


@pytest.mark.parametrize(
    "records", [[], trial(), trial_of_several(), [crash("single", "drift")], [record("null", said())]]
)
def test_whatever_was_asked_can_be_written(records):
    plain = score(records)
    assert json.loads(json.dumps(plain, allow_nan=False)) == plain
    assert plain["schema"] == "thermal-robot/blind/1"
    assert html(plain, "today").count("<html") == 1
    assert max(map(len, text(plain).splitlines())) <= 100
    assert markdown(plain).startswith("| case |")


def test_the_order_of_the_records_changes_no_figure():
    one, other = score(trial()), score(trial()[::-1])
    for name in ("cases", "failed", "kinds", "by_effect", "by_robot", "removed", "unlisted", "confusion"):
        assert one[name] == other[name], name
    for name in ("by_effect", "by_robot", "removed", "unlisted"):
        assert list(one[name]) == sorted(one[name])
    assert one["detection"]["table"] == other["detection"]["table"]
    assert {m["id"] for m in one["misses"]} == {m["id"] for m in other["misses"]}


# ---- confusion


def test_confusion_counts_every_case_once():
    tables = score(trial())["confusion"]
    table = tables["single"]
    assert table["rows"] == ["backlash", "drift", "nothing", "unlisted"]
    assert table["columns"] == ["backlash", "drift", "joint_gain", "nothing", "unexplained", "failed"]
    assert table["counts"] == [[0, 0, 0, 0, 1, 1], [1, 1, 0, 0, 0, 0], [0, 0, 1, 1, 0, 0], [0, 0, 0, 0, 1, 0]]
    assert np.sum(table["counts"]) == sum(r["kind"] in ("single", "null", "unlisted") for r in trial())
    assert tables["removed"]["counts"] == [[0, 1]]  # a column of its own, though nobody can name it


def test_the_first_effect_at_work_is_the_row_and_a_law_names_no_cause():
    cases = [
        record("hard", said(effect("backlash"), effect("drift")), ["drift", "backlash"]),
        record("hard", said(effect("discovered.1", quantity="time", shape="step")), ["drift", "backlash"]),
        record("hard", said(flagged=True), ["drift", "backlash"], unlisted="cable"),
    ]
    assert score(cases)["confusion"] == {
        "hard": {
            "rows": ["drift", "unlisted"],
            "columns": ["drift", "backlash", "unexplained"],
            "counts": [[0, 1, 1], [0, 0, 1]],
        }
    }


# ---- probabilities


def test_the_calibration_error_is_as_computed_by_hand():
    p = np.array([0.02, 0.04, 0.62, 0.68, 0.64, 1.0])
    found = reliability(p, np.array([False, False, True, False, True, True]))
    # bin 0: mean .03, 0 of 2; bin 6: mean .6467, 2 of 3; bin 9: mean 1, 1 of 1
    assert [b["present"]["trials"] for b in found["bins"]] == [2, 0, 0, 0, 0, 0, 3, 0, 0, 1]
    assert found["bins"][6]["mean"] == pytest.approx(1.94 / 3)
    assert found["error"] == pytest.approx((2 * 0.03 + abs(1.94 - 2.0) + 0.0) / 6)


def test_calibration_counts_what_is_clearly_there_or_clearly_not():
    effects = [effect("drift", 0.6), effect("backlash", 0.2), effect("joint_gain", 0.4), effect("geometric", 0.7)]
    effects += [effect("joint_offset", 0.03), effect("tracking_lag", None, "not_testable")]
    parts = {"joint_gain": 0.3, "geometric": 0.6, "joint_offset": 0.05}
    cases = [record("mixed", said(*effects), ["drift"], parts), record("removed", said(effect("drift", 0.5)))]
    cases.append(record("hard", said(effect("backlash", 0.5), effect("drift", 0.5)), ["drift"], {"backlash": 0.15}))
    cases.append(record("single", said(effect("drift", 0.5)), ["drift"]))
    found = score([*cases, crash("mixed", "drift")])["calibration"]
    # joint_gain is neither; the removed, the hard, the single and the failed case say nothing
    assert (found["all"]["trials"], found["doubtful"]["trials"]) == (4, 3)
    assert found["doubtful"]["error"] == pytest.approx((0.4 + 0.2 + 0.3) / 3)
    assert found["all"]["error"] == pytest.approx((0.4 + 0.2 + 0.3 + 0.03) / 4)
    assert score([record("null", said())])["calibration"]["all"]["error"] is None


def law(number, p, place=J1, quantity="time"):
    return effect(f"discovered.{number}", p, places=[place], quantity=quantity)


def test_a_law_is_right_at_its_place_or_beside_it_and_with_its_quantity():
    laws = [law(1, 0.8, L2), law(2, 0.6, quantity="payload")]
    bins = score([record("mixed", said(*laws, flagged=True), **CABLE)])["calibration"]["all"]["bins"]
    assert (of(bins[8]["present"]), of(bins[6]["present"])) == ((1, 1), (0, 1))
    # without a cause no law is right
    bins = score([record("mixed", said(laws[0], flagged=True))])["calibration"]["all"]["bins"]
    assert of(bins[8]["present"]) == (0, 1)


def test_laws_that_were_sure_are_counted():
    records = [
        record("unlisted", said(law(1, 0.9), law(2, 0.99, J2), law(3, None), flagged=True), **CABLE),
        record("both", said(effect("drift"), law(1, 0.95, L2, "order"), flagged=True), ["drift"], **CABLE),
        record("mixed", said(law(1, 0.99, J1, "payload"), flagged=True), **CABLE),
        record("unlisted", said(law(1, 0.89), flagged=True), **CABLE),
        crash("unlisted", **CABLE),
        record("real", said(law(1, 0.99), flagged=True), right=True),  # of which nobody knows
        record("single", said(effect("drift"), law(1, 0.99), flagged=True), ["drift"]),  # all is in the library
    ]
    assert of(score(records)["laws"]) == (2, 5)


# ---- intervals


def estimate(value, std, identified=True):
    return {"name": SCALE, "value": value, "std": std, "unit": "1", "identified": identified}


def measured(*estimates, true=0.0):
    answer = said(effect("instrument_scale", parameters=list(estimates)))
    known = {} if true is None else {SCALE: true}
    return record("single", answer, ["instrument_scale"], parameters={"instrument_scale": known})


def coverage(*records):
    for one in records:
        if one["said"]:
            one["said"]["gap"]["held_out"].setdefault("shrinkage_ci95", [0.0, 1.0])
    return score(records)["coverage"]


def test_an_interval_is_1_96_deviations_and_only_what_is_identified_and_known_of_a_right_answer_counts():
    right = measured(estimate(1.0, 1.0))
    flagged = {**right, "said": {**right["said"], "verdict": {**right["said"]["verdict"], "unexplained": True}}}
    more = {**right, "said": said(effect("instrument_scale", parameters=[estimate(1.0, 1.0)]), effect("drift"))}
    assert of(coverage(*(measured(estimate(off, 1.0)) for off in (1.95, -1.95, 1.97, -1.97)))["parameters"]) == (2, 4)
    for wrong in (
        measured(estimate(None, None, identified=False)),
        measured(estimate(1.0, 1.0), true=None),
        flagged,
        more,
        crash("single", "instrument_scale"),
    ):
        assert coverage(wrong)["parameters"]["trials"] == 0


def test_shrinkage_is_held_against_fresh_rows_with_the_noise_in_it():
    """Gap 10 σ, remainder 1 σ, rms distances; each with 3 σ² of noise: 1 − 4/103."""
    reached = 1.0 - 4.0 / 103.0
    for interval, inside in (((reached - 1e-9, reached + 1e-9), 1), ((0.98, 1.0), 0)):
        told = record("single", said(effect("drift", shrinkage=0.9)), ["drift"])
        told["said"]["gap"]["held_out"]["shrinkage_ci95"] = interval
        assert of(coverage(told)["shrinkage"]) == (inside, 1)
        # a verdict that names nothing claims nothing
        told["said"]["verdict"] = said()["verdict"]
        assert coverage(told)["shrinkage"]["trials"] == 0


def test_shares_are_held_against_those_of_fresh_rows():
    answer = said(effect("drift", shrinkage_ci95=[0.5, 0.7]), effect("backlash", shrinkage_ci95=[0.2, 0.3]))
    one = record("pair", answer, ["drift", "backlash"])
    one["fresh"] = {"rms_before": 10 * NOISE, "rms_after": NOISE, "shares": {"drift": 0.6, "backlash": 0.31}}
    assert of(coverage(one)["shares"]) == (1, 2)


# ---- shrinkage


def test_claims_are_compared_with_the_noise_taken_off():
    case = record("single", said(effect("drift")), ["drift"])
    found = score([case])["shrinkage"]
    assert found["pairs"] == [
        {"id": "c1", "kind": "single", "claimed": pytest.approx(1 - (4 - 3) / (100 - 3)), "real": pytest.approx(0.99)}
    ]
    assert found["median_absolute_difference"] == pytest.approx(1 / 97 - 0.01)
    # real campaigns hold the noise in both
    assert score([{**case, "kind": "real"}])["shrinkage"]["pairs"][0]["claimed"] == pytest.approx(0.96)
    case["said"]["gap"]["held_out"] = {"rms_before": 10 * NOISE, "rms_after": NOISE}
    assert score([case])["shrinkage"]["pairs"][0]["claimed"] == 1.0
    # 3 σ² + 3 (σ/2)²: below that there is no gap to shrink
    case["said"]["gap"]["held_out"]["rms_before"] = np.sqrt(3.74) * NOISE
    flat = {**case, "fresh": {"rms_before": 0.0, "rms_after": 0.0}}
    for none in (case, flat, crash("single", "drift"), {**case, "fresh": None}):
        assert score([none])["shrinkage"] == {"pairs": [], "median_absolute_difference": None}


def test_what_a_model_leaves_is_told_in_noise_and_one_that_errs_more_than_none_is_worse():
    good = record("single", said(effect("drift", shrinkage=0.9)), ["drift"])
    for rms, ratio in ((0.0, 0.0), (NOISE * 3.0**0.5, 1.0), (NOISE, 3.0**-0.5)):
        assert fresh_ratio({**good, "fresh": {"rms_before": 1.0, "rms_after": rms}}) == pytest.approx(ratio)
    assert fresh_ratio({**good, "fresh": None}) is fresh_ratio(crash("single", "drift")) is None
    bad = {**good, "fresh": {"rms_before": NOISE, "rms_after": 1.1 * NOISE}}
    silent = {**bad, "said": said()}  # names nothing: it is the frames alone
    scattering = {**bad, "said": said(effect("encoder_resolution", shrinkage=0.0))}
    for one in (good, bad):
        one["said"]["gap"]["held_out"]["shrinkage_ci95"] = [0.0, 1.0]
    cases = [good, bad, silent, scattering, crash("single", "drift"), {**good, "fresh": None}]
    assert of(score(cases)["worse"]) == (1, 4)


TRUE = np.zeros((50, 3))


def at(rms, seed=0):
    """Predictions that err by this rms distance."""
    drawn = np.random.default_rng(seed).normal(size=TRUE.shape)
    return TRUE + drawn * rms / np.sqrt((drawn**2).sum(axis=1).mean())


def test_shapley_values_sum_to_what_all_take_away_and_twins_have_the_same():
    # 10 → 2 with noise of variance 3 σ² = 12 in the gap: (100 − 4) / 112
    assert shares({"": at(10.0), "drift": at(2.0)}, TRUE, 2.0) == {"drift": pytest.approx(96.0 / 112.0)}
    left = {"": at(10.0), "a": at(6.0), "b": at(6.0, 1), "c": at(10.0), "a+b": at(2.0), "a+c": at(6.0), "b+c": at(6.0)}
    found = shares({**left, "a+b+c": at(2.0)}, TRUE, 0.0)
    assert sum(found.values()) == pytest.approx(0.96)
    assert found["a"] == pytest.approx(found["b"])
    assert found["c"] == pytest.approx(0.0, abs=1e-12)
    # what does harm has a share below nothing
    assert shares({"": at(1.0), "a": at(2.0)}, TRUE, 0.0)["a"] == pytest.approx(-3.0)
    assert shares({}, TRUE, 1.0) == {}


# ---- detection


def drawn(count, seed):
    rng = np.random.default_rng(seed)
    return np.exp(rng.uniform(-1.0, 2.0, count)), np.exp(rng.uniform(3.0, 5.3, count)), rng


def test_the_curve_of_detection_is_recovered():
    size, rows, rng = drawn(6000, 3)
    chance = 1.0 / (1.0 + np.exp(-(-8.0 + 3.0 * np.log(size) + 2.0 * np.log(rows))))
    curve = logistic(size, rows, rng.random(6000) < chance)
    fitted, std = np.array([curve[name] for name in ("intercept", "ratio", "samples")]), np.array(curve["std"])
    assert np.all(np.abs(fitted - [-8.0, 3.0, 2.0]) < 3.0 * std)
    columns = np.column_stack([np.ones(6000), np.log(size), np.log(rows)])
    fisher = columns.T @ (columns * (chance * (1.0 - chance))[:, None])
    assert std == pytest.approx(np.sqrt(np.diag(np.linalg.inv(fisher))), rel=0.05)
    # 8 + ln 9 = 2 ln n where the effect is as large as the noise
    assert curve["needed"][0]["samples"] == pytest.approx(np.exp(5.0986), rel=0.1)
    assert curve["needed"][1]["samples"] == pytest.approx(np.exp(5.0986 - 1.5 * np.log(2.0)), rel=0.1)


def test_separable_cases_do_not_diverge():
    size, rows = np.array([0.5, 0.6, 2.0, 3.0]), np.array([40.0, 90.0, 50.0, 80.0])
    curve = logistic(size, rows, size > 1.0)
    assert 0.0 < curve["ratio"] < 30.0
    assert all(np.isfinite(curve["std"]))
    assert curve["over_ratio"][0]["chance"][0] < 0.1 < 0.9 < curve["over_ratio"][0]["chance"][-1]


def test_no_number_of_rows_is_told_where_more_rows_find_less():
    size, rows, rng = drawn(400, 5)
    curve = logistic(size, rows, np.log(size) - np.log(rows) + rng.logistic(0.0, 0.5, 400) > -3.5)
    assert curve["samples"] < 0.0 < curve["ratio"]
    assert [needed["samples"] for needed in curve["needed"]] == [None, None]


def steps(found, name):
    return {s["low"]: of(s["found"]) for s in found[name] if s["found"]["trials"]}


def test_detection_is_counted_by_size_and_by_rows():
    found = score(trial())["detection"]
    # a3 of 0.8; a2 and h1 of 1.2 and 1.4; a1 and the failed a4 of 3
    assert steps(found, "ratio") == {0.7: (0, 1), 1.0: (2, 2), 3.0: (1, 2)}
    assert steps(found, "samples") == {30: (1, 2), 100: (2, 3)}
    assert of(found["table"][3][1]) == (1, 1)
    for axis, name in ((1, "ratio"), (0, "samples")):  # the table adds up to the steps
        sums = np.array([[of(r) for r in row] for row in found["table"]]).sum(axis=axis)
        assert [of(s["found"]) for s in found[name]] == [tuple(pair) for pair in sums.tolist()]
    assert score(trial()[:1])["detection"]["curve"] is None  # all found: nothing to fit


def test_a_size_on_an_edge_belongs_to_the_larger_step_and_an_unknown_one_to_none():
    sizes = ((1.0, 45), (None, 45), (100.0, 10_000))
    cases = [record("single", said(effect("drift")), ["drift"], {"drift": s}, samples=n) for s, n in sizes]
    found = score(cases)["detection"]
    assert steps(found, "ratio") == {1.0: (1, 1), 6.0: (1, 1)}
    assert steps(found, "samples") == {45: (1, 1), 200: (1, 1)}
    assert found["ratio"][-1]["high"] is found["samples"][-1]["high"] is None
