"""``Diagnosis.update``: what a fresh diagnosis says, to a millionth, by tables and campaigns, in one batch or many."""

import json
from dataclasses import replace

import numpy as np
import pytest
from updating_cases import ALL, EFFECTS, OLD, in_full, measured

import thermal_robot as tr
from thermal_robot.diagnosis.updated import beyond, chosen, fixed_point, log_odds
from thermal_robot.errors import CampaignError, EstimationError


@pytest.fixture(scope="module")
def updated(found, whole):
    return found.update(whole.take(np.arange(OLD, ALL)))


def test_it_is_what_a_fresh_diagnosis_says(updated, fresh, whole):
    own, told = updated.parameters, fresh.parameters
    assert sorted(own.index) == sorted(told.index)
    told = told.loc[own.index]
    assert np.allclose(own["value"], told["value"], rtol=1e-6, atol=0.0)
    assert np.allclose(own["std"], told["std"], rtol=1e-5)
    assert (own["unit"] == told["unit"]).all()
    assert own["identified"].all()
    e = fresh.fit.explanation
    assert updated.noise == pytest.approx(e.whitening.noise[0] * e.best.noise, rel=1e-6)
    assert updated.rms_after == pytest.approx(fresh.gap.rms_after, rel=1e-6)
    assert np.abs(updated.model.prediction(whole)[0] - fresh.model.prediction(whole)[0]).max() < 1e-9
    assert (updated.samples, updated.choice_stands, updated.reason) == (ALL, True, "")
    assert set(updated.outliers) == {row for row in fresh.outliers if row in whole.rows[OLD:]}
    # predictions are as sure
    assert np.allclose(updated.model.spread.covariance, fresh.model.spread.covariance, rtol=1e-3, atol=1e-16)
    for name, ends in fresh.model.spread.ranges.items():
        assert updated.model.spread.ranges[name] == pytest.approx(ends)


def test_tables_and_batches_are_the_same_as_one_campaign(found, whole, updated):
    parts = np.array_split(np.arange(OLD, ALL), 3)
    last = found
    for part in parts:
        last = last.update(whole.take(part).to_frame())
    assert np.allclose(last.parameters["value"], updated.parameters["value"], rtol=1e-6, atol=0.0)
    assert last.samples == updated.samples
    assert last.diagnosis is found


def test_the_diagnosis_stays_and_the_update_is_saved_and_printed(found, whole, updated, tmp_path):
    # the diagnosis itself stays
    before = found.parameters
    found.update(whole.take(np.arange(OLD, OLD + 10)))
    assert found.parameters.equals(before)
    assert found.samples == OLD
    assert updated.diagnosis is found
    # the model is saved and loaded
    updated.model.save(tmp_path / "model.json")
    again = tr.CorrectedModel.load(tmp_path / "model.json")
    assert np.allclose(again.prediction(whole)[0], updated.model.prediction(whole)[0], atol=1e-12)
    # it is plain values and prints whether the choice stands
    assert "the choice stands" in str(updated)
    fallen = replace(updated, fallen=("The new rows leave 3 times as much.",))
    assert "to be diagnosed anew" in repr(fallen)
    assert "3 times" in str(fallen)
    plain = json.loads(json.dumps(updated.to_dict()))
    assert plain["schema"] == "thermal-robot/updated/1"
    assert plain["samples"] == ALL
    assert [p["value"] for p in plain["parameters"]] == updated.parameters["value"].tolist()


def test_deviations_that_were_widened_stay_wider(found, whole):
    e = found.fit.explanation
    wide = {b: (values, 4.0 * covariance) for b, (values, covariance) in e.values.items()}
    flagged = replace(found.unexplained, flagged=True)
    doubtful = replace(found, fit=replace(found.fit, explanation=replace(e, values=wide)), remaining=flagged)
    rows = whole.take(np.arange(OLD, ALL))
    assert np.allclose(doubtful.update(rows).parameters["std"], 2.0 * found.update(rows).parameters["std"], rtol=1e-3)


def test_what_cannot_be_updated_says_why(found, whole):
    rows = whole.take(np.arange(OLD, ALL))
    with pytest.raises(EstimationError, match="without its fit"):
        replace(found, fit=None).update(rows)
    with pytest.raises(CampaignError, match="another noise"):
        found.update(replace(rows, noise_position=1e-3))


ASKED = ["joint_offset", "backlash"]


@pytest.fixture(scope="module")
def known():
    return tr.diagnose(measured(200, seed=50), only=ASKED)


def with_spread(found, spread):
    """The same diagnosis or update, measured elsewhere."""
    return replace(found, model=replace(found.model, spread=spread))


def test_more_of_the_same_or_nothing_lets_the_choice_stand(known):
    # more of the same lets the choice stand
    for seed in range(5):
        assert known.update(measured(40, seed=60 + seed)).fallen == ()
    # no rows say nothing
    assert known.update(measured(40).take([])).fallen == ()


def test_what_is_new_in_the_rows_makes_the_choice_fall(known):
    # play that begins makes it fall and it stays so
    worn = {**EFFECTS, "backlash": {**EFFECTS["backlash"], "joint_4": 3e-4}}
    fallen = known.update(measured(60, seed=7, effects=worn))
    assert any("backlash" in reason and "joint_4" in reason for reason in fallen.fallen)
    assert fallen.update(measured(40, seed=61)).fallen[: len(fallen.fallen)] == fallen.fallen
    # more noise makes it fall
    rows = measured(60, seed=8)
    louder = replace(rows, position=rows.position + 2e-5 * np.random.default_rng(0).normal(size=(60, 3)))
    assert any("times the mean square" in reason for reason in known.update(louder).fallen)
    # rows elsewhere make it fall
    rows = measured(40, seed=9)
    narrow = {name: (-0.5, 0.5) for name in known.model.spread.ranges if name == "joint_1"}
    said = with_spread(known, replace(known.model.spread, ranges=narrow)).update(rows).fallen
    assert any("outside of what was measured, in joint_1" in reason for reason in said)


@pytest.mark.slow
def test_an_effect_that_can_be_tested_now_makes_it_fall():
    campaign = measured(240, seed=51)
    hall = replace(
        campaign, covariates={**campaign.covariates, "temperature": np.where(np.arange(240) < 200, 22.0, 30.0)}
    )
    known = tr.diagnose(hall.take(np.arange(200)), only=[*ASKED, "thermal_elongation"])
    assert known.finding("thermal_elongation").status == "not_testable"
    said = with_spread(known, None).update(hall.take(np.arange(200, 240))).fallen
    assert any("thermal_elongation could not be tested" in reason for reason in said)


def test_what_is_drawn_anew_in_every_pose_is_left_to_a_fresh_diagnosis(known):
    fit = known.fit
    e = replace(fit.explanation, whitening=replace(fit.explanation.whitening, smooth=object()))
    with pytest.raises(EstimationError, match="diagnose old and new rows together"):
        replace(known, fit=replace(fit, explanation=e)).update(measured(40))


def test_rows_are_outside_by_chance_as_often_as_is_stated(known):
    """Outermost rows are new ones now and then; many of them hardly ever."""
    rng, said, spread = np.random.default_rng(0), 0, known.model.spread
    rows = measured(400, seed=70)
    for _ in range(200):
        order = rng.permutation(400)
        old, new = rows.q[order[:60]], rows.take(order[60:90])
        ends = zip(rows.robot.joint_names, old.min(axis=0), old.max(axis=0), strict=True)
        said += bool(list(beyond(replace(spread, ranges={n: (a, b) for n, a, b in ends}), new, 60)))
    assert said <= 2


def test_a_combination_that_is_ahead_makes_it_fall_as_long_as_it_is(known):
    ahead = replace(known.update(measured(40, seed=60)), rival=("joint_gain",), lead=1.5)
    assert "speak for joint_gain, rather than joint_offset and backlash (odds 4.5 : 1)" in ahead.reason
    assert not ahead.choice_stands
    assert (replace(ahead, lead=-0.1).reason, replace(ahead, lead=-0.1).choice_stands) == ("", True)


@pytest.fixture(scope="module")
def little():
    """A robot whose play in a joint is too small to be named by few rows."""
    return measured(400, seed=12, effects={"joint_offset": EFFECTS["joint_offset"], "backlash": {"joint_2": 2e-5}})


@pytest.fixture(scope="module")
def sparse(little):
    return tr.diagnose(little.take(np.arange(60)), only=["joint_offset", "backlash"])


def test_by_the_rows_of_the_diagnosis_the_order_is_its_own(found, grown):
    """Log odds against the chosen one are those of the diagnosis, to what its rounding of scales leaves."""
    e, listed = found.fit.explanation, chosen(found.fit)[1]
    chance = {c.blocks: 0.0 for c in e.combinations}
    for combination, probability in zip(e.combinations, e.probabilities, strict=True):
        chance[combination.blocks] += probability
    further = sorted({b for c in e.combinations for b in c.blocks} - {*e.best.blocks})
    assert further
    gain = log_odds(grown, listed)
    told = [np.log(p / chance[e.best.blocks]) for p in sorted(chance.values(), reverse=True)[1:4]]
    assert np.allclose(np.sort(gain)[::-1][:3], told, atol=0.05)


def test_rows_that_show_more_bring_a_runner_forward(sparse, little):
    listed = chosen(sparse.fit)[1]
    with_play = [k for k, runner in enumerate(listed) if "backlash" in runner.names]
    assert sparse.verdict == ("joint_offset",)
    assert with_play
    before = log_odds(fixed_point(sparse.fit), listed)[with_play].max()
    after = log_odds(fixed_point(sparse.fit).plus(in_full(little.take(np.arange(60, 400)))), listed)[with_play].max()
    assert before < 0.0 < after
