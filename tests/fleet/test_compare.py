"""What campaigns share and what changed: invariants of the whole comparison."""

import numpy as np
import pytest
from compared import NOISE, campaign, diagnosed, moved

import thermal_robot as tr

STEP = 4e-4  # rad: some eight deviations of the difference


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


@pytest.mark.parametrize("frame", ["here", "there"])
def test_a_changed_parameter_is_found_and_nothing_else(frame):
    found = tr.compare(diagnosed(1), diagnosed(3, moved(STEP), frame=frame), names=["before", "after"])
    assert places(found) == [("joint_offset", "joint_3", "after")]
    (change,) = found.changes
    assert change.groups == (("before",), ("after",))
    assert np.diff(change.values)[0] == pytest.approx(STEP, rel=0.25)
    assert change.p_value < 1e-6
    assert change.probability > 0.99
    assert found.effect("joint_offset").status == "changed"
    assert found.effect("joint_offset").p_value < 1e-6


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
        told = dict(zip(other.campaigns, change.values, strict=True))
        assert [told[name] for name in names] == pytest.approx(first.changes[0].values, rel=1e-5)
        assert other.verdict == first.verdict
        assert other.effect("joint_offset").chi2 == pytest.approx(first.effect("joint_offset").chi2, rel=1e-6)
    assert places(tr.compare(days[2], *days[:2], names=["c", "a", "b"])) == [("joint_offset", "joint_3", "a")]
    assert places(tr.compare(days[0], days[2], days[1], names=["a", "c", "b"])) == [("joint_offset", "joint_3", "")]


def test_an_effect_of_another_size_in_each_campaign_loses_its_name():
    days = [diagnosed(seed, gains=gain) for seed, gain in ((4, 2e-4), (5, 8e-4), (6, 3.2e-3))]
    found = tr.compare(*days, names=["a", "b", "c"])
    assert "joint_gain" in found.lost
    assert found.effect("joint_gain").status == "contradicts"
    assert "size" in found.effect("joint_gain").reason
    assert found.effect("joint_offset").status == "shared"


def test_campaigns_and_paths_are_diagnosed_on_the_way(tmp_path):
    tr.write_campaign(campaign(1), tmp_path / "monday")
    said = []
    found = tr.compare(tmp_path / "monday", campaign(2), only=["joint_offset"], progress=said.append)
    assert found.changes == ()
    assert found.samples == (50, 50)
    assert any(line.startswith("campaign 2 of 2: ") for line in said)


def test_what_cannot_be_compared_is_refused():
    with pytest.raises(tr.CampaignError, match="two campaigns or more"):
        tr.compare(diagnosed(1))
    with pytest.raises(tr.CampaignError, match="one is needed for each campaign"):
        tr.compare(diagnosed(1), diagnosed(2), names=["one"])
    with pytest.raises(tr.CampaignError, match="campaigns, their diagnoses, models, or paths"):
        tr.compare(diagnosed(1), 3)
    arm = tr.load_robot("example-robot-data:ur5", "tool0")
    other = tr.diagnose(tr.simulate(arm, rows=40, noise=NOISE), only="joint_offset")
    with pytest.raises(tr.CampaignError, match="joints differ"):
        tr.compare(diagnosed(1), other)
