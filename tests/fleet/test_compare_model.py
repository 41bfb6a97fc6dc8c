"""Model files in the place of campaigns: what they know, what they do not, and which are refused."""

from dataclasses import replace

import numpy as np
import pytest
from compared import NOISE, OFFSETS, campaign, diagnosed, moved

import thermal_robot as tr
from thermal_robot.fleet.compare_sums import is_model, known, poses
from thermal_robot.report import comparison_html, comparison_schema

STEP = 4e-4  # rad: some eight deviations of the difference


@pytest.fixture(scope="module")
def before():
    return diagnosed(1)


@pytest.fixture(scope="module")
def after():
    return diagnosed(3, moved(STEP))


def told(found):
    return [(change.effect, change.place, change.since) for change in found.changes]


def test_a_model_says_what_its_campaign_said(before, after, tmp_path):
    before.model.save(tmp_path / "before.json")
    rows = tr.compare(before, after, names=["before", "after"])
    alone = tr.compare(tmp_path / "before.json", after, names=["before", "after"])
    files = tr.compare(before.model, after.model, names=["before", "after"])
    for found in (alone, files):
        assert told(found) == told(rows) == [("joint_offset", "joint_3", "after")]
        assert found.changes[0].chi2 == pytest.approx(rows.changes[0].chi2, rel=1e-3)
        assert found.changes[0].values == pytest.approx(rows.changes[0].values, rel=1e-3)
        one, other = (f.effect("joint_offset").parameters for f in (found, rows))
        assert [p.values for p in one] == [pytest.approx(p.values, rel=1e-3) for p in other]
        assert [p.stds for p in one] == [pytest.approx(p.stds, rel=1e-3) for p in other]
        assert found.not_told == rows.not_told
    assert (alone.samples, files.samples) == ((0, 50), (0, 0))


def test_a_robot_that_did_not_change_has_not(before):
    found = tr.compare(before.model, diagnosed(2, frame="there"))
    assert found.changes == ()
    assert found.effect("joint_offset").status == "shared"
    assert found.predicted[0].agrees


def test_predictions_need_no_rows(before, after):
    (same,) = tr.compare(before.model, before.model).predicted
    assert same.rms == pytest.approx(0.0, abs=1e-12)
    assert same.poses == 400
    (apart,) = tr.compare(before.model, after.model).predicted
    assert apart.rms > 5e-5
    # where joint ranges have nothing in common, nothing is said
    spread = before.model.spread
    away = {name: (high + 1.0, high + 2.0) for name, (_, high) in spread.ranges.items()}
    other = replace(before.model, spread=replace(spread, ranges=away))
    (none,) = tr.compare(before.model, other).predicted
    assert (none.poses, none.agrees) == (0, True)
    assert "common part" in none.note


def test_of_what_a_model_does_not_hold_no_change_is_told(before):
    """A gain began; the model of before has none, and could not say how well it knows that."""
    later = diagnosed(8, gains=3e-3)
    assert "joint_gain" in later.verdict
    found = tr.compare(before.model, later, names=["before", "later"])
    assert "joint_gain" not in {change.effect for change in found.changes}
    gain = found.effect("joint_gain")
    assert (gain.status, gain.reason) == ("not_compared", "later alone can tell it")
    # the predictions see it
    assert found.predicted[0].beyond > 0.5
    assert not found.predicted[0].agrees


def test_a_model_is_told_as_one(before, after):
    found = tr.compare(before.model, after, names=["before", "after"])
    plain = found.to_dict()
    assert plain["campaigns"][0]["samples"] == 0
    assert "before: A model file; it holds joint zero offsets." in str(found)
    assert " 0 samples" not in str(found)
    assert "before: A model file" in comparison_html(plain)
    jsonschema = pytest.importorskip("jsonschema")
    jsonschema.validate(plain, comparison_schema())


def test_what_is_a_model_and_what_is_none(before, tmp_path):
    before.model.save(tmp_path / "m.json")
    tr.write_campaign(campaign(1), tmp_path / "folder.json")
    assert is_model(tmp_path / "m.json")
    assert is_model(str(tmp_path / "m.json"))
    assert not is_model(tmp_path / "folder.json")  # a folder with a campaign
    assert not is_model(tmp_path / "none.json")
    assert not is_model(before)
    (tmp_path / "m.json").write_text("{}")
    with pytest.raises(tr.CampaignError, match="not a model"):
        tr.compare(tmp_path / "m.json", before)


def test_a_model_that_cannot_say_how_sure_it_is_is_refused(before):
    spread = before.model.spread
    for less in (None, replace(spread, prior=None), replace(spread, ranges={})):
        with pytest.raises(tr.CampaignError, match="does not say how sure it is"):
            tr.compare(replace(before.model, spread=less), before)
    with pytest.raises(tr.CampaignError, match="simulator"):
        tr.compare(replace(before.model, simulated=True), before)
    arm = tr.load_robot("example-robot-data:ur5", "tool0")
    other = tr.diagnose(tr.simulate(arm, rows=40, noise=NOISE), only="joint_offset")
    with pytest.raises(tr.CampaignError, match="joints differ"):
        tr.compare(before.model, other.model)


def test_poses_fill_the_ranges_that_were_measured(before):
    ranges = before.model.spread.ranges
    q = poses(before.model.robot, ranges)
    low, high = np.array([ranges[name] for name in before.model.robot.joint_names]).T
    assert (q >= low).all()
    assert (q <= high).all()
    assert (np.ptp(q, axis=0) > 0.95 * (high - low)).all()
    assert len(OFFSETS) == q.shape[1]
    assert np.isfinite(known(before.model, "m").corrected.predicted_position).all()
