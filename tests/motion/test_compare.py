"""Two logs of one robot compared: what is three deviations apart changed, and nothing else."""

import json
from dataclasses import replace

import numpy as np
import pytest
from motion.found import TRUE, found

import thermal_robot as tr
from thermal_robot.errors import CampaignError
from thermal_robot.motion.compare import compare_motions


def named(name, **how):
    d = found(**how)
    return replace(d, log=replace(d.log, name=name))


def test_equal_logs_have_not_changed():
    told = compare_motions(named("monday"), named("friday", seed=5))
    assert told.changes == ()
    assert told.summary == "Nothing changed between monday and friday beyond three standard deviations."
    assert {(one.effect, one.joint) for one in told.parameters} == {key for key in TRUE if key[0] != "gain"}
    assert all(one.z == 0.0 for one in told.parameters)


def test_what_grew_is_told_with_its_values_and_z():
    told = compare_motions(named("monday"), named("friday", scale=1.5))
    assert {one.effect for one in told.changes} == {"lag", "coulomb", "droop"}
    for one in told.parameters:
        before, after = one.values
        assert one.difference == pytest.approx(0.5 * before)
        assert one.std == pytest.approx(0.05 * np.hypot(before, after))
        assert one.z == pytest.approx(0.5 / (0.05 * np.hypot(1.0, 1.5)))
        assert one.p_value == pytest.approx(2.9e-8, rel=0.1)
    assert "joint_2 (60.0 ms → 90.0 ms, z = 5.5)" in told.summary
    assert "12.00 ± 0.60 mrad" in str(told)
    assert "± is weak" in str(told)


def test_a_difference_turns_its_sign_with_the_order():
    one, other = named("a"), named("b", scale=1.2)
    pairs = zip(compare_motions(one, other).parameters, compare_motions(other, one).parameters, strict=True)
    for forth, back in pairs:
        assert (forth.effect, forth.z, forth.p_value) == (back.effect, pytest.approx(-back.z), back.p_value)


def test_what_one_log_alone_tells_is_listed_without_a_difference():
    d = named("friday")
    less = replace(d, verdict=tuple(name for name in d.verdict if name != "coulomb"))
    (alone,) = [one for one in compare_motions(named("monday"), less).parameters if one.effect == "coulomb"]
    assert alone.values == (0.012, None)
    assert (alone.difference, alone.z, alone.changed) == (None, None, False)


def test_it_is_written_as_json_and_as_a_table(tmp_path):
    told = compare_motions(named("monday"), named("friday", scale=1.5), names=["before", "after"])
    told.to_json(tmp_path / "c.json")
    plain = json.loads((tmp_path / "c.json").read_text(encoding="utf-8"))
    assert plain["schema"] == "thermal-robot/motion-comparison/1"
    assert plain["summary"] == told.summary
    assert [one["z"] for one in plain["parameters"]] == list(told.table["z"])
    assert told.table.loc[("coulomb", "joint_2"), "value of before"] == 0.012


def test_the_one_verb_compares_motions_in_pairs():
    one, other = named("a"), named("b", scale=1.5)
    assert len(tr.compare(one, other, names=["a", "b"]).changes) == 4
    for given in ((one, other, other), (one, tr.demo_campaign())):
        with pytest.raises(CampaignError, match="motion is compared in pairs"):
            tr.compare(*given)
    elsewhere = replace(other, log=replace(other.log, joints=("joint_5",)))
    with pytest.raises(CampaignError, match="no joint in common"):
        tr.compare(one, elsewhere)
