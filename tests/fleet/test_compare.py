"""What campaigns share and what changed: invariants of the whole comparison, its models, predictions and result."""

import json
import re
from dataclasses import FrozenInstanceError, replace

import jsonschema
import numpy as np
import pytest
from compared import FRAMES, NOISE, campaign, diagnosed, lagging_days, moved
from helpers import some

import thermal_robot as tr
from thermal_robot.fleet.compare_sums import is_model
from thermal_robot.observations import Frames
from thermal_robot.report import comparison_html, comparison_schema

STEP = 4e-4  # rad: some eight deviations of the difference


@pytest.fixture(scope="module")
def before():
    return diagnosed(1)


@pytest.fixture(scope="module")
def after():
    return diagnosed(3, moved(STEP))


@pytest.fixture(scope="module")
def found(before, after):
    return tr.compare(before, after, names=["before", "after"])


def places(found):
    return [(change.effect, change.place, change.since) for change in found.changes]


def test_the_same_robot_in_other_frames_with_other_noise_has_not_changed():
    found = tr.compare(diagnosed(1), diagnosed(2, frame="there", noise=2 * NOISE), names=["here", "there"])
    assert found.changes == ()
    assert found.effect("joint_offset").status == "shared"
    assert found.verdict == ("joint_offset",)
    assert found.lost == ()
    # what the frames take up is no parameter of anybody's
    assert set(found.not_told) >= {"joint_offset: zero offset, joint_1", "joint_offset: zero offset, joint_5"}
    (both,) = found.predicted
    assert both.agrees
    assert both.rms < 2.0 * both.stated


def test_a_campaign_is_the_same_as_itself():
    found = tr.compare(diagnosed(1), diagnosed(1))
    assert found.changes == ()
    assert found.campaigns == ("simulated (1)", "simulated (2)")
    for effect in found.effects:
        assert effect.chi2 == pytest.approx(0.0, abs=1e-6)
        assert [p.difference for p in effect.parameters if p.difference] == []
    assert found.predicted[0].rms == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("frame", some(["there", "here"], 2))
def test_a_changed_parameter_is_found_and_nothing_else(before, frame):
    found = tr.compare(before, diagnosed(3, moved(STEP), frame=frame), names=["before", "after"])
    assert places(found) == [("joint_offset", "joint_3", "after")]
    (change,) = found.changes
    assert change.groups == (("before",), ("after",))
    # the step is eight deviations
    assert np.diff(change.values)[0] == pytest.approx(STEP, rel=0.25)
    assert change.p_value < 1e-6
    assert change.probability > 0.99
    assert found.effect("joint_offset").status == "changed"
    assert found.effect("joint_offset").p_value < 1e-6


@pytest.mark.slow
def test_the_order_of_campaigns_does_not_matter_but_for_since():
    days = diagnosed(1), diagnosed(2, frame="there"), diagnosed(3, moved(STEP))
    names = ["a", "b", "c"]
    first = tr.compare(*days, names=names)
    assert places(first) == [("joint_offset", "joint_3", "c")]
    assert first.changes[0].groups == (("a", "b"), ("c",))
    for order in ([2, 1, 0], [1, 2, 0]):
        other = tr.compare(*(days[k] for k in order), names=[names[k] for k in order])
        (change,) = other.changes
        assert {frozenset(group) for group in change.groups} == {frozenset("ab"), frozenset("c")}
        assert change.chi2 == pytest.approx(first.changes[0].chi2, rel=1e-6)
        compared = dict(zip(other.campaigns, change.values, strict=True))
        assert [compared[name] for name in names] == pytest.approx(first.changes[0].values, rel=1e-5)
        assert other.verdict == first.verdict
        assert other.effect("joint_offset").chi2 == pytest.approx(first.effect("joint_offset").chi2, rel=1e-6)
    assert places(tr.compare(days[2], *days[:2], names=["c", "a", "b"])) == [("joint_offset", "joint_3", "a")]
    assert places(tr.compare(days[0], days[2], days[1], names=["a", "c", "b"])) == [("joint_offset", "joint_3", "")]


@pytest.mark.slow
def test_an_effect_of_another_size_in_each_campaign_loses_its_name():
    days = [diagnosed(seed, gains=gain) for seed, gain in ((4, 2e-4), (5, 8e-4), (6, 3.2e-3))]
    found = tr.compare(*days, names=["a", "b", "c"])
    assert "joint_gain" in found.lost
    assert found.effect("joint_gain").status == "contradicts"
    assert "size" in found.effect("joint_gain").reason
    assert found.effect("joint_offset").status == "shared"


def test_campaigns_and_paths_are_diagnosed_on_the_way(tmp_path):
    tr.write_campaign(campaign(1), tmp_path / "monday")
    statistics = []
    found = tr.compare(tmp_path / "monday", campaign(2), only=["joint_offset"], progress=statistics.append)
    assert found.changes == ()
    assert found.samples == (50, 50)
    assert any(line.startswith("campaign 2 of 2: ") for line in statistics)


def test_what_one_campaign_cannot_tell_is_not_compared(rv_m2):
    warm = tr.simulate(rv_m2, {"thermal_elongation": 2e-5}, rows=50, noise=2e-5, seed=1)
    cold = tr.simulate(rv_m2, rows=50, noise=2e-5, seed=2, conditions={"temperature": None})
    found = tr.compare(warm, cold, only="thermal_elongation", names=["warm", "cold"])
    own = found.effect("thermal_elongation")
    assert (own.status, own.reason) == ("not_compared", "warm alone can tell it")


@pytest.mark.slow
def test_links_that_lag_are_compared_with_the_record_of_each_campaign():
    """The setting of one campaign would read a clock that another does not have, or follow the wrong day's air."""
    days = [tr.diagnose(day, only="thermal_elongation") for day in lagging_days()]
    assert [bool(d.fit.effects[0][0].lag) for d in days] == [True, True, False]
    found = tr.compare(*days, names=["jump", "fall", "no clock"])
    assert found.effect("thermal_elongation").status == "shared"
    assert found.changes == ()


def test_what_cannot_be_compared_is_refused(before):
    with pytest.raises(tr.CampaignError, match="two campaigns or more"):
        tr.compare(before)
    with pytest.raises(tr.CampaignError, match="one is needed for each campaign"):
        tr.compare(before, before, names=["one"])
    with pytest.raises(tr.CampaignError, match="campaigns, their diagnoses, models, or paths"):
        tr.compare(before, 3)
    with pytest.raises(tr.CampaignError, match="made without its fit"):
        tr.compare(before, replace(before, fit=None))


def test_another_robot_is_refused_in_words(rv_m2, before):
    ur5 = tr.load_robot("example-robot-data:ur5", "tool0")
    own = re.search(r"<joint name=\"joint_3\".*?</joint>", rv_m2.urdf, flags=re.DOTALL).group(0)
    x, *rest = re.search(r'xyz="([^"]*)"', own).group(1).split()
    moved = re.sub(r'xyz="[^"]*"', f'xyz="{float(x) + 0.001} {" ".join(rest)}"', own, count=1)
    longer = tr.load_robot(rv_m2.urdf.replace(own, moved), "tool0")
    for robot, statistics in (
        (ur5, r"is of another robot than .*: their joints differ.*shoulder_pan_joint.*joint_1"),
        (longer, r"described by another nominal model than .*up to (1|0\.99\d*) mm away"),
    ):
        other = tr.diagnose(tr.simulate(robot, rows=40, noise=NOISE), only="joint_offset")
        for pair in ((before, other), (before.model, other.model)):
            with pytest.raises(tr.CampaignError, match=statistics):
                tr.compare(*pair)


def test_a_model_says_what_its_campaign_said(before, after, found, tmp_path):
    before.model.save(tmp_path / "before.json")
    alone = tr.compare(tmp_path / "before.json", after, names=["before", "after"])
    files = tr.compare(before.model, after.model, names=["before", "after"])
    for other in (alone, files):
        assert places(other) == places(found) == [("joint_offset", "joint_3", "after")]
        assert other.changes[0].chi2 == pytest.approx(found.changes[0].chi2, rel=1e-3)
        assert other.changes[0].values == pytest.approx(found.changes[0].values, rel=1e-3)
        for p, q in zip(other.effect("joint_offset").parameters, found.effect("joint_offset").parameters, strict=True):
            assert p.values == pytest.approx(q.values, rel=1e-3)
            assert p.stds == pytest.approx(q.stds, rel=1e-3)
        assert other.not_told == found.not_told
    assert (alone.samples, files.samples) == ((0, 50), (0, 0))
    plain = alone.to_dict()
    jsonschema.validate(plain, comparison_schema())
    assert plain["campaigns"][0]["samples"] == 0
    assert "before: A model file; it holds joint zero offsets." in str(alone)
    assert " 0 samples" not in str(alone)
    assert "before: A model file" in comparison_html(plain)


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


def test_what_is_a_model_and_which_are_refused(before, tmp_path):
    before.model.save(tmp_path / "m.json")
    tr.write_campaign(campaign(1), tmp_path / "folder.json")
    assert is_model(tmp_path / "m.json")
    assert is_model(str(tmp_path / "m.json"))
    assert not any(map(is_model, (tmp_path / "folder.json", tmp_path / "none.json", before)))
    (tmp_path / "m.json").write_text("{}")
    with pytest.raises(tr.CampaignError, match="not a model"):
        tr.compare(tmp_path / "m.json", before)
    spread = before.model.spread
    for less in (None, replace(spread, prior=None), replace(spread, ranges={})):
        with pytest.raises(tr.CampaignError, match="does not say how sure it is"):
            tr.compare(replace(before.model, spread=less), before)
    with pytest.raises(tr.CampaignError, match="simulator"):
        tr.compare(replace(before.model, simulated=True), before)


def test_predictions_need_no_rows(before, after):
    (same,) = tr.compare(before.model, before.model).predicted
    assert same.rms == pytest.approx(0.0, abs=1e-12)
    assert same.poses == 400
    (apart,) = tr.compare(before.model, after.model).predicted
    assert apart.rms > 5e-5
    # where joint ranges have nothing in common, nothing is said
    spread = before.model.spread
    away = {name: (high + 1.0, high + 2.0) for name, (_, high) in spread.ranges.items()}
    (none,) = tr.compare(before.model, replace(before.model, spread=replace(spread, ranges=away))).predicted
    assert (none.poses, none.agrees) == (0, True)
    assert "common part" in none.note


def with_model(diagnosis, **changed):
    return replace(diagnosis, model=replace(diagnosis.model, **changed))


def predicted(*days):
    return tr.compare(*days).predicted


def test_another_place_of_base_and_target_is_no_difference(before):
    shifted = np.eye(4)
    shifted[:3, 3] = [1e-3, -2e-3, 5e-4]
    frames = Frames(FRAMES["there"][0] @ before.model.frames.base, shifted @ before.model.frames.tool)
    spread = replace(before.model.spread, beyond=np.full(3, before.model.spread.beyond.mean()))
    (found,) = predicted(with_model(before, spread=spread), with_model(before, spread=spread, frames=frames))
    assert found.rms < 2e-8
    assert found.agrees
    assert found.beyond == 0.0
    assert found.stated > 1e-6


def test_a_changed_zero_shows_as_the_arm_would_move(before):
    """The difference is that of the nominal robot's own poses, aligned by a fit that knows nothing of the program."""
    step, robot, q = 2e-3, before.model.robot, before.rows.q
    (effect, values), *rest = before.model.effects
    changed = values.copy()
    changed[(effect.places or robot.joint_names).index(robot.joint_names[2])] += step
    (found,) = predicted(before, with_model(before, effects=((effect, changed), *rest)))
    assert not found.agrees
    assert found.beyond > 0.9

    def points(q):
        pose = robot.forward(q)
        return pose[:, :3, 3] + pose[:, :3, :3] @ before.model.frames.tool[:3, 3], pose[:, :3, :3]

    (here, turns), (there, _) = points(q), points(q + step * np.eye(5)[2])
    gap, width = (there - here).ravel(), len(q)
    cross = np.stack([np.cross(axis, here) for axis in np.eye(3)], axis=2)
    columns = np.concatenate([np.tile(np.eye(3), (width, 1, 1)), cross, turns], axis=2).reshape(3 * width, 9)
    left = gap - columns @ np.linalg.lstsq(columns, gap)[0]
    assert found.rms == pytest.approx(np.sqrt((left**2).sum() / width), rel=0.03)


def test_a_joint_that_is_held_is_the_same_to_the_jitter_of_its_encoder(before):
    """Ranges of a held joint that miss each other by a microradian are one; by more, nothing is common."""
    joint, rows, spread = before.model.robot.joint_names[4], before.rows, before.model.spread

    def held(at):
        q = rows.q.copy()
        q[:, 4] = at
        model = replace(before.model, spread=replace(spread, ranges={**spread.ranges, joint: (at, at)}))
        return replace(before, model=model, rows=replace(rows, q=q))

    for apart, common in ((0.0, True), (2e-6, True), (-2e-6, True), (0.1, False)):
        (found,) = predicted(held(0.3), held(0.3 + apart))
        assert bool(found.note) != common


def test_every_pair_is_predicted_and_without_deviations_nothing(before, after):
    found = tr.compare(before, diagnosed(2, frame="there"), after, names=["a", "b", "c"]).predicted
    assert [p.campaigns for p in found] == [("a", "b"), ("a", "c"), ("b", "c")]
    assert found[1].rms > 2.0 * found[0].rms
    (bare,) = predicted(before, with_model(before, spread=None))
    assert bare.poses == 0
    assert "does not state" in bare.note
    (simulated,) = predicted(before, with_model(before, simulated=True))
    assert "simulator" in simulated.note


def test_the_result_is_frozen_short_in_a_list_and_asked_by_name(found):
    with pytest.raises(FrozenInstanceError):
        found.changes = ()
    assert repr(found) == "Comparison(before, after: joint_offset changed)"
    assert found.effect("joint_offset").title == "joint zero offsets"
    with pytest.raises(KeyError, match="was not compared"):
        found.effect("joint_ofset")
    assert str(found).splitlines()[0] == found.summary
    assert found._repr_html_().startswith('<div class="thermal-robot">')


def test_its_json_and_its_table_say_the_same(found, tmp_path):
    found.to_json(tmp_path / "c.json")
    plain = json.loads((tmp_path / "c.json").read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator.check_schema(comparison_schema())
    jsonschema.Draft202012Validator(comparison_schema()).validate(plain)
    assert plain == json.loads(json.dumps(found.to_dict()))
    assert plain["changes"][0]["place"] == "joint_3"
    assert plain["summary"] == found.summary
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.Draft202012Validator(comparison_schema()).validate({**plain, "more": 1})
    row = found.parameters.loc["joint_offset", "zero offset, joint_3"]
    assert row["after"] - row["before"] == pytest.approx(row["difference"])
    assert row["unit"] == "rad"
