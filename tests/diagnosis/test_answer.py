"""The parts of an answer, put together from the last explanation."""

import numpy as np
import pytest
from simulate import simulate

from thermal_robot import diagnose
from thermal_robot.diagnosis.values import FoldScheme
from thermal_robot.effects import RANDOM, library


def test_the_parts_agree_with_each_other(hall):
    assert set(hall.verdict) == {"thermal_elongation", "backlash"}
    assert hall.verdict == tuple(f.name for f in hall.effects if f.status == "found")
    assert sum(hall.where.axes.values()) == pytest.approx(1.0)
    # exactly these: each of them, and none of the others
    inside = [hall.finding(name).probability for name in hall.verdict]
    outside = [f.probability for f in hall.effects if f.status == "not_found" and not f.random]
    assert 1.0 - sum(1.0 - p for p in inside) - sum(outside) <= hall.probability + 1e-9
    assert hall.probability <= min(*inside, 1.0 - max(outside)) + 1e-9
    assert hall.outliers == tuple(hall.rows.rows[hall.rows.outliers])
    assert set(hall.model.needs) == {"temperature", *(f"approach.{j}" for j in hall.joint_names)}
    assert {s.name for s in hall.gap.schemes} >= {"time", "region", "reach", "range"}
    assert hall.remaining is hall.unexplained or hall.remaining == hall.unexplained
    assert hall.reach == pytest.approx(np.linalg.norm(np.ptp(hall.fit.campaign.position, axis=0)))


def test_every_quantity_and_joint_has_its_unit(hall):
    assert set(hall.rows.units) == {*hall.rows.covariates, *hall.joint_names}
    assert hall.rows.units["temperature"] == "°C"
    assert hall.rows.units["joint_1"] == "rad"
    assert hall.rows.units["time"] == "s"


def test_rows_were_held_out_once_unless_set_aside(hall):
    rows = hall.rows
    assert (np.isnan(rows.held_out_after) <= rows.outliers).all()
    kept = ~np.isnan(rows.held_out_after)
    assert np.sqrt((rows.held_out_after[kept] ** 2).mean()) == pytest.approx(hall.gap.held_out.rms_after)
    inside = ~rows.outliers
    assert np.sqrt((rows.gap[inside] ** 2).sum(axis=1).mean()) == pytest.approx(hall.gap.rms_before)
    assert np.sqrt((rows.remainder[inside] ** 2).sum(axis=1).mean()) == pytest.approx(hall.gap.rms_after)


def test_orientation_has_figures_where_it_was_measured(rv_m2, hall):
    poses = diagnose(simulate(rv_m2, ["joint_offset"], seed=2, turning=3e-5)[0])
    assert poses.measures == "pose"
    assert poses.gap.orientation_after < poses.gap.orientation_before
    assert poses.gap.orientation_after == pytest.approx(np.sqrt(3.0) * 3e-5, rel=0.2)
    assert (hall.measures, hall.gap.orientation_before, hall.gap.orientation_after) == ("position", None, None)


def test_what_was_not_asked_for_is_not_said(rv_m2):
    campaign = simulate(rv_m2, seed=2)[0]
    narrow = diagnose(campaign, only=["drift", "encoder_resolution"])
    assert {f.name for f in narrow.effects} == {"drift", "encoder_resolution"}
    assert narrow.narrowed
    assert set(narrow.left_out) == {*library(), *RANDOM} - {"drift", "encoder_resolution"}
    assert narrow.to_dict()["verdict"]["left_out"] == list(narrow.left_out)
    without = diagnose(campaign, without=["drift", "encoder_resolution"])
    assert not {"drift", "encoder_resolution"} & {f.name for f in without.effects}
    assert without.left_out == ("drift", "encoder_resolution")
    assert "by request (--without drift encoder_resolution)" in str(without)


@pytest.mark.parametrize(("name", "capped"), [("session", True), ("region", True), ("temperature", False)])
def test_nothing_above_nine_in_ten_is_told_of_what_harms_other_sessions(rv_m2, monkeypatch, name, capped):
    harmful = FoldScheme(name, "one after the other", 4, 60, 1e-4, 2e-4, -3.0, 1e-6)
    monkeypatch.setattr("thermal_robot.diagnosis.answer.worst_folds", lambda fit: (harmful,))
    told = diagnose(simulate(rv_m2, ["backlash"], seed=1, ratio=(5.0, 6.0))[0], only=["backlash"])
    assert told.verdict == ("backlash",)
    assert (told.probability <= 0.9) == capped
    assert all(f.probability is None or f.probability <= 0.9 for f in told.effects) == capped
    assert told.summary.startswith(f"Correcting harms rows held out by {name}") == capped
    assert any("no probability above 90%" in warning for warning in told.warnings) == capped
