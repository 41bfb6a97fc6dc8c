"""The score of a blind trial, from records made by hand whose answers are known."""

import json

import numpy as np
import pytest
from blind_records import J1, J2, L2, NOISE, crash, effect, record, said, trial

from thermal_robot.blind.calibration import reliability
from thermal_robot.blind.confusion import confusion
from thermal_robot.blind.detection import logistic
from thermal_robot.blind.judged import is_miss, marks
from thermal_robot.blind.rate import Rate
from thermal_robot.blind.report.markdown import blind_markdown
from thermal_robot.blind.report.page import blind_html
from thermal_robot.blind.report.text import blind_text
from thermal_robot.blind.score import score


def of(rates, name):
    return rates[name].successes, rates[name].trials


def kind(found, name):
    return next(k for k in found.kinds if k.kind == name)


# -- rates


@pytest.mark.parametrize(
    ("successes", "trials", "low", "high"),
    # Newcombe 1998, Statistics in Medicine 17, 857, table I: method 3
    [(81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0, 0.1611), (1, 29, 0.0061, 0.1718)],
)
def test_wilsons_interval_is_that_of_the_textbook(successes, trials, low, high):
    found = Rate(successes, trials)
    assert found.value == successes / trials
    assert found.interval == pytest.approx((low, high), abs=5e-5)


def test_nothing_asked_is_no_rate():
    assert (Rate(0, 0).value, Rate(0, 0).interval) == (None, None)


# -- one record


@pytest.mark.parametrize(
    ("answer", "exact", "alarm"),
    [
        (said(effect("drift")), True, False),
        (said(effect("drift"), effect("backlash", 0.3, "not_found")), True, False),
        (said(effect("drift"), effect("backlash")), False, True),
        (said(effect("backlash")), False, True),
        (said(), False, False),
        (said(effect("drift"), flagged=True), False, False),
        # at work in the background, not asked for
        (said(effect("drift"), effect("joint_gain")), True, False),
        (said(effect("joint_gain")), False, False),
        # less than a tenth of the noise is nothing
        (said(effect("drift"), effect("geometric")), False, True),
        (said(effect("drift"), effect("discovered.1")), False, True),
        # an escape: confounded, and yet named
        (said(effect("drift"), effect("joint_offset", 0.5, "confounded")), True, False),
        (
            said(effect("drift"), effect("joint_offset", 0.5, "confounded"), verdict=["drift", "joint_offset"]),
            False,
            False,
        ),
    ],
)
def test_exact_is_what_is_at_work_and_nothing_else(answer, exact, alarm):
    found = marks(record("single", answer, ["drift"], {"joint_gain": 0.3, "geometric": 0.09}))
    assert found["exact"] == (exact,)
    assert found["false_alarm"] == (alarm,)
    assert is_miss(record("single", answer, ["drift"], {"joint_gain": 0.3, "geometric": 0.09})) is not exact


def test_where_nothing_is_at_work_the_unexplained_is_a_false_alarm_too():
    assert marks(record("null", said())) == {"exact": (True,), "false_alarm": (False,)}
    assert marks(record("null", said(flagged=True))) == {"exact": (False,), "false_alarm": (True,)}
    assert marks(record("null", said(effect("drift")))) == {"exact": (False,), "false_alarm": (True,)}


def test_places_are_asked_of_what_was_found_rightly():
    answer = said(effect("backlash", places=[J1, J2]), effect("drift", places=[J2]), effect("geometric", places=[J2]))
    case = record("triple", answer, ["backlash", "drift", "joint_gain"])
    case["truth"]["parts"]["drift"]["places"] = [J1, J2]
    found = marks(case)
    assert found["located"] == (True, False)
    assert found["among_places"] == (True, True)
    case["truth"]["parts"]["drift"]["places"] = []  # it sits everywhere
    assert marks(case)["located"] == (True,)
    # a link is not the joint of that name
    case["truth"]["parts"]["backlash"]["places"] = [{"kind": "link", "name": "j1"}]
    assert marks(case)["among_places"] == (False,)


@pytest.mark.parametrize("of_kind", ["removed", "unlisted"])
def test_what_is_withheld_is_to_be_flagged_and_nobody_blamed(of_kind):
    true = {"places": [J1, L2], "quantities": ["time", "order"]}
    if of_kind == "unlisted":
        true["unlisted"] = "cable"

    def judged(*effects, **more):
        answers = marks(record(of_kind, said(*effects, **more), ["drift"] if of_kind == "removed" else [], **true))
        return {name: given for name, (given,) in answers.items()}

    told = {"flagged": True, "where": [J1, J2], "follows": ["order"]}
    assert set(judged(**told).values()) == {True}
    assert judged()["flagged"] is False
    blamed = judged(effect("backlash", 0.9), **told)
    assert (blamed["not_blamed"], blamed["right"], blamed["place"]) == (False, False, True)
    assert judged(effect("backlash", 0.89), **told)["not_blamed"]
    # only the first counts, and what a discovered law says before the rest
    assert not judged(flagged=True, where=[J2, J1], follows=["j2", "time"])["place"]
    law = effect("discovered.1", places=[L2], quantity="time", shape="step")
    found = judged(law, flagged=True, where=[J2], follows=["j2"])
    assert (found["place"], found["quantity"], found["not_blamed"]) == (True, True, True)
    law = effect("discovered.1", places=[J2], quantity="j2", shape="step")
    found = judged(law, **told)
    assert (found["place"], found["quantity"]) == (False, False)


def test_a_hidden_condition_is_to_be_asked_for():
    missing = effect("thermal_elongation", None, "not_testable", needs=["temperature.forearm"])
    true = {"effects": ["thermal_elongation"], "needs": ["temperature"], "hidden": ["temperature"]}
    advice = "Record temperature: thermal elongation could not be tested."
    found = marks(record("hidden", said(missing, flagged=True, advice=advice), **true))
    assert set(found.values()) == {(True,)}
    found = marks(record("hidden", said(missing, flagged=True), **true))
    assert (found["named"], found["asks"], found["right"]) == ((True,), (False,), (False,))
    found = marks(record("hidden", said(flagged=True, advice=advice), **true))
    assert (found["named"], found["asks"]) == ((False,), (False,))


def test_a_failure_is_wrong_everywhere():
    known = {"exact": (False,), "first_named": (False,), "false_alarm": (True,), "located": (), "among_places": ()}
    assert marks(crash("single", "drift")) == known
    assert marks(crash("null")) == {"exact": (False,), "false_alarm": (True,)}
    for case in (crash("removed", "drift", places=[J1]), crash("hidden", "drift"), crash("unlisted", unlisted="cable")):
        assert set(marks(case).values()) == {(False,)}
    assert is_miss(record("real", None, ["geometric"], right=True, asked="untouched", answer="-"))


# -- probabilities


def test_calibration_is_as_computed_by_hand():
    p = np.array([0.02, 0.04, 0.62, 0.68, 0.64, 1.0])
    found = reliability(p, np.array([False, False, True, False, True, True]))
    # bin 0: mean .03, 0 of 2; bin 6: mean .6467, 2 of 3; bin 9: mean 1, 1 of 1
    assert [b.present.trials for b in found.bins] == [2, 0, 0, 0, 0, 0, 3, 0, 0, 1]
    assert found.bins[6].mean == pytest.approx(1.94 / 3)
    assert found.error == pytest.approx((2 * 0.03 + abs(1.94 - 2.0) + 0.0) / 6)


def test_calibration_counts_what_is_clearly_there_or_clearly_not():
    effects = [effect("drift", 0.6), effect("backlash", 0.2), effect("joint_gain", 0.4), effect("geometric", 0.7)]
    effects += [effect("joint_offset", 0.03), effect("tracking_lag", None, "not_testable")]
    parts = {"joint_gain": 0.3, "geometric": 0.6, "joint_offset": 0.05}
    cases = [record("faint", said(*effects), ["drift"], parts), record("removed", said(effect("drift", 0.5)))]
    cases.append(record("hard", said(effect("backlash", 0.5), effect("drift", 0.5)), ["drift"], {"backlash": 0.15}))
    cases.append(record("faint", said(effect("discovered.1", 0.8), flagged=True), unlisted="cable"))
    found = score([*cases, crash("single", "drift")]).calibration
    # joint_gain is neither; the removed, the hard and the failed case say nothing, nor does a law of what is unlisted
    assert found.all.trials == 4
    assert found.doubtful.trials == 3
    assert found.doubtful.error == pytest.approx((0.4 + 0.2 + 0.3) / 3)
    assert found.all.error == pytest.approx((0.4 + 0.2 + 0.3 + 0.03) / 4)


# -- what was named


def test_confusion_counts_every_case_once():
    table = confusion(trial(), ("single", "null", "unlisted"))
    assert table.rows == ("backlash", "drift", "nothing", "unlisted")
    assert table.columns == ("backlash", "drift", "joint_gain", "nothing", "unexplained", "failed")
    assert table.counts == ((0, 0, 0, 0, 1, 1), (1, 1, 0, 0, 0, 0), (0, 0, 1, 1, 0, 0), (0, 0, 0, 0, 1, 0))
    assert sum(map(sum, table.counts)) == sum(r["kind"] in ("single", "null", "unlisted") for r in trial())
    assert confusion(trial(), ("removed",)).counts == ((0, 1),)  # a column of its own, though nobody can name it


# -- what it takes


def test_the_curve_of_detection_is_recovered():
    rng = np.random.default_rng(3)
    size, rows = np.exp(rng.uniform(-1.0, 2.0, 6000)), np.exp(rng.uniform(3.0, 5.3, 6000))
    chance = 1.0 / (1.0 + np.exp(-(-8.0 + 3.0 * np.log(size) + 2.0 * np.log(rows))))
    curve = logistic(size, rows, rng.random(6000) < chance)
    fitted = np.array([curve.intercept, curve.ratio, curve.samples])
    assert np.all(np.abs(fitted - [-8.0, 3.0, 2.0]) < 3.0 * np.array(curve.std))
    assert np.array(curve.std) == pytest.approx([0.3, 0.1, 0.08], rel=0.5)
    # 8 + ln 9 = 2 ln n where the effect is as large as the noise
    assert curve.needed[0].samples == pytest.approx(np.exp(5.0986), rel=0.1)
    assert curve.needed[1].samples == pytest.approx(np.exp(5.0986 - 1.5 * np.log(2.0)), rel=0.1)


def test_separable_cases_do_not_diverge():
    size, rows = np.array([0.5, 0.6, 2.0, 3.0]), np.array([40.0, 90.0, 50.0, 80.0])
    curve = logistic(size, rows, size > 1.0)
    assert 0.0 < curve.ratio < 30.0
    assert all(np.isfinite(curve.std))
    assert curve.over_ratio[0].chance[0] < 0.1 < 0.9 < curve.over_ratio[0].chance[-1]


def test_detection_is_counted_by_size_and_by_rows():
    found = score(trial()).detection
    rates = {s.low: (s.found.successes, s.found.trials) for s in found.ratio}
    # a3 of 0.8; a2 and h1 of 1.2 and 1.4; a1 and the failed a4 of 3
    assert {low: r for low, r in rates.items() if r[1]} == {0.7: (0, 1), 1.0: (2, 2), 3.0: (1, 2)}
    rates = {s.low: (s.found.successes, s.found.trials) for s in found.samples}
    assert {low: r for low, r in rates.items() if r[1]} == {30: (1, 2), 100: (2, 3)}
    assert found.table[3][1] == Rate(1, 1)
    assert sum(r.trials for row in found.table for r in row) == 5
    assert score([trial()[0]]).detection.curve is None  # all found: nothing to fit


# -- all together


def test_the_score_holds_each_kind():
    found = score(trial())
    assert (found.cases, found.failed) == (12, 1)
    assert [k.kind for k in found.kinds] == "single pair null hard removed hidden unlisted real".split()
    single = kind(found, "single")
    assert (single.cases, single.failed) == (4, 1)
    assert {q: of(single.rates, q) for q in ("exact", "first_named", "false_alarm", "located")} == {
        "exact": (1, 4), "first_named": (1, 4), "false_alarm": (2, 4), "located": (2, 2),
    }  # fmt: skip
    assert of(found.by_effect["backlash"], "found") == (0, 3)
    assert of(found.by_effect["drift"], "first_named") == (3, 4)
    assert of(found.by_robot["ur10"], "exact") == (0, 1)
    assert of(found.unlisted["cable"], "place") == (1, 1)
    assert [(r.asked, r.answer, r.right) for r in found.real] == [("arm: untouched", "<geometric>", True)]
    assert found.seconds.longest == 0.5
    assert single.fresh.count == 3
    assert single.fresh.median == pytest.approx(3**-0.5)


def test_misses_can_be_looked_up():
    misses = {m.id: m for m in score(trial()).misses}
    assert list(misses) == ["a2", "a3", "a4", "n2", "t1", "p1"]
    assert misses["a4"].error == "the diagnosis failed: late"
    assert (misses["a2"].truth, misses["a2"].said, misses["a2"].probability) == (("drift",), ("backlash", "drift"), 0.9)
    assert misses["a2"].wrong == ("exact", "first_named", "false_alarm")
    assert misses["a3"].unexplained == "somewhere"


def test_claims_are_compared_with_the_noise_taken_off():
    case = record("single", said(effect("drift")), ["drift"])
    found = score([case]).shrinkage
    assert found.pairs[0].claimed == pytest.approx(1 - (4 - 3) / (100 - 3))
    assert found.pairs[0].real == pytest.approx(0.99)
    assert found.median_absolute_difference == pytest.approx(1 / 97 - 0.01)
    # real campaigns hold the noise in both
    assert score([{**case, "kind": "real"}]).shrinkage.pairs[0].claimed == pytest.approx(0.96)
    case["said"]["gap"]["held_out"] = {"rms_before": 10 * NOISE, "rms_after": NOISE}
    assert score([case]).shrinkage.pairs[0].claimed == 1.0
    # 3 σ² + 3 (σ/2)²: below that there is no gap to shrink
    case["said"]["gap"]["held_out"]["rms_before"] = np.sqrt(3.74) * NOISE
    assert score([case]).shrinkage.pairs == ()


@pytest.mark.parametrize("records", [[], trial(), [crash("single", "drift")], [record("null", said())]])
def test_whatever_was_asked_can_be_written(records):
    plain = score(records).to_dict()
    assert json.loads(json.dumps(plain, allow_nan=False)) == plain
    assert plain["schema"] == "thermal-robot/blind/1"
    assert blind_html(plain, "today").count("<html") == 1
    assert max(map(len, blind_text(plain).splitlines())) <= 100
    assert blind_markdown(plain).startswith("| case |")
