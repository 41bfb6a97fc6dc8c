"""AP before the correction and after it, of poses that the model was not fitted to."""

import json
from dataclasses import replace

import jsonschema
import numpy as np
import pytest
from several import FLAT, table_of
from simulate import simulate

from thermal_robot import diagnose
from thermal_robot.campaign import campaign_from_table
from thermal_robot.iso9283 import performance
from thermal_robot.report import schema, text

NOISE = 12e-6


@pytest.fixture(scope="module", params=[None, pytest.param(3e-5, marks=pytest.mark.slow)], ids=["positions", "poses"])
def repeated(request, rv_m2):
    """A joint's zero is off; five of sixty poses are measured ten times."""
    once = simulate(rv_m2, ["joint_offset"], samples=60, seed=11, noise=NOISE, ratio=(8, 12), turning=request.param)[0]
    rows = np.r_[np.arange(60), np.repeat(np.arange(5), 9)]
    again, rng = once.take(rows), np.random.default_rng(0)
    noise = np.where(np.arange(105) < 60, 0.0, NOISE)[:, None] * rng.normal(size=(105, 3))
    label = {"pose": np.array([f"p{k}" for k in rows])}
    return replace(again, position=again.position + noise, labels=label, rows=np.arange(2, 107))


@pytest.fixture(scope="module")
def found(repeated):
    return diagnose(repeated, only=["joint_offset"])


def test_accuracy_before_is_that_of_the_campaign_and_after_of_poses_held_out(repeated, found):
    told, alone = found.performance, performance(repeated)
    fitted = performance(repeated, predicted=found.model.prediction(repeated))
    assert told.accuracy == pytest.approx(alone.accuracy, rel=1e-6)
    assert told.repeatability == alone.repeatability
    assert told.corrected < 0.5 * told.accuracy
    # held out is a little worse than fitted, and no other world: the cycles are the same
    for one, other in zip(told.poses, fitted.poses, strict=True):
        assert one.corrected.position == pytest.approx(other.corrected.position, abs=NOISE)
        assert one.corrected.position != other.corrected.position
    assert "fitted without the poses" in told.notes[-1]
    if repeated.orientation is not None:
        before, after = (np.array([getattr(p, kind).angles for p in told.poses]) for kind in ("accuracy", "corrected"))
        assert np.abs(after).max() < 0.5 * np.abs(before).max()


def test_text_and_json_have_it(repeated, found):
    plain = json.loads(json.dumps(found.to_dict()))
    jsonschema.Draft202012Validator(schema()).validate(plain)
    assert [p["cycles"] for p in plain["performance"]["poses"]] == [10] * 5
    assert plain["performance"]["poses"][0]["corrected"]["position"] == found.performance.poses[0].corrected.position
    assert "\n\nISO 9283\n" in text(found)


@pytest.mark.slow
def test_a_table_that_does_not_fit_or_without_repeats_has_none(repeated):
    # a table that does not fit the robot has none
    spoilt = diagnose(replace(repeated, position=repeated.position[:, [1, 0, 2]]), only=["joint_offset"])
    assert not spoilt.usable
    assert spoilt.performance is None
    # without repeats there is none
    once = diagnose(repeated.take(np.arange(60)), only=["joint_offset"])
    assert once.performance is None
    assert "performance" not in once.to_dict()
    assert "ISO 9283" not in text(once)


@pytest.mark.slow
def test_what_several_targets_tell_is_turned_back_about_the_axes_of_the_frame(rv_m2):
    """The turn of a pose that is corrected is the same, whichever axes the gap has."""
    poses = simulate(rv_m2, ["joint_offset"], samples=30, seed=5, noise=25e-9, turning=1e-12, ratio=(3e4, 6e4))[0]
    table = table_of(poses.take(np.repeat(np.arange(30), 4)), FLAT, np.random.default_rng(0))
    several = campaign_from_table(rv_m2, table, noise_position=25e-6)
    told, plain = (diagnose(one, only=["joint_offset"]) for one in (several, replace(several, targets=None)))
    before, after, other = (
        np.array([getattr(pose, kind).angles for pose in each.performance.poses])
        for each, kind in ((told, "accuracy"), (told, "corrected"), (plain, "corrected"))
    )
    np.testing.assert_allclose(after, other, atol=0.02 * np.abs(before).max())
    assert np.abs(after).max() < 0.5 * np.abs(before).max()
