"""``Diagnosis.update``: what a fresh diagnosis says, to a millionth, by tables and campaigns, in one batch or many."""

import json
from dataclasses import replace

import numpy as np
import pytest
from growing_cases import ALL, OLD

import thermal_robot as tr
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
    assert np.abs(updated.model.predict(whole)[0] - fresh.model.predict(whole)[0]).max() < 1e-9
    assert (updated.samples, updated.choice_stands, updated.reason) == (ALL, True, "")
    assert set(updated.outliers) == {row for row in fresh.outliers if row in whole.rows[OLD:]}


def test_predictions_are_as_sure_as_those_of_a_fresh_diagnosis(updated, fresh):
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


def test_the_diagnosis_itself_stays(found, whole, updated):
    before = found.parameters
    found.update(whole.take(np.arange(OLD, OLD + 10)))
    assert found.parameters.equals(before)
    assert found.samples == OLD
    assert updated.diagnosis is found


def test_the_model_is_saved_and_loaded(updated, whole, tmp_path):
    updated.model.save(tmp_path / "model.json")
    again = tr.CorrectedModel.load(tmp_path / "model.json")
    assert np.allclose(again.predict(whole)[0], updated.model.predict(whole)[0], atol=1e-12)


def test_it_is_plain_values(updated):
    plain = json.loads(json.dumps(updated.to_dict()))
    assert plain["schema"] == "thermal-robot/updated/1"
    assert plain["samples"] == ALL
    assert [p["value"] for p in plain["parameters"]] == updated.parameters["value"].tolist()


def test_it_prints_whether_the_choice_stands(updated):
    assert "the choice stands" in str(updated)
    fallen = replace(updated, choice_stands=False, reason="The new rows leave 3 times as much.")
    assert "to be diagnosed anew" in repr(fallen)
    assert "3 times" in str(fallen)


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
