"""The parts of an answer, put together from the last explanation."""

import numpy as np
import pytest
from helpers import disturbed, some, with_law
from simulate import simulate

from thermal_robot import diagnose
from thermal_robot.diagnosis import settings
from thermal_robot.diagnosis.answer import numbered, prior_sensitivity
from thermal_robot.diagnosis.cross_validation import held_out
from thermal_robot.diagnosis.values import FoldScheme
from thermal_robot.effects import RANDOM, choose, library
from thermal_robot.effects.law import Discovered
from thermal_robot.inference.fit import fit, refit
from thermal_robot.inference.generate import discovered


def test_the_parts_agree_with_each_other(hall):
    # the parts agree with each other
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
    # every quantity and joint has its unit
    assert set(hall.rows.units) == {*hall.rows.covariates, *hall.joint_names}
    assert hall.rows.units["temperature"] == "°C"
    assert hall.rows.units["joint_1"] == "rad"
    assert hall.rows.units["time"] == "s"
    # rows were held out once unless set aside
    rows = hall.rows
    assert (np.isnan(rows.held_out_after) <= rows.outliers).all()
    kept = ~np.isnan(rows.held_out_after)
    assert np.sqrt((rows.held_out_after[kept] ** 2).mean()) == pytest.approx(hall.gap.held_out.rms_after)
    inside = ~rows.outliers
    assert np.sqrt((rows.gap[inside] ** 2).sum(axis=1).mean()) == pytest.approx(hall.gap.rms_before)
    assert np.sqrt((rows.remainder[inside] ** 2).sum(axis=1).mean()) == pytest.approx(hall.gap.rms_after)


@pytest.mark.slow
def test_orientation_has_figures_where_it_was_measured(rv_m2, hall):
    poses = diagnose(simulate(rv_m2, ["joint_offset"], seed=2, turning=3e-5)[0])
    assert poses.measures == "pose"
    assert poses.gap.orientation_after < poses.gap.orientation_before
    assert poses.gap.orientation_after == pytest.approx(np.sqrt(3.0) * 3e-5, rel=0.2)
    assert (hall.measures, hall.gap.orientation_before, hall.gap.orientation_after) == ("position", None, None)


def test_what_was_not_asked_for_is_not_said(rv_m2):
    campaign = simulate(rv_m2, samples=40, seed=2)[0]
    narrow = diagnose(campaign, only=["drift", "encoder_resolution"])
    assert {f.name for f in narrow.effects} == {"drift", "encoder_resolution"}
    assert narrow.narrowed
    assert set(narrow.left_out) == {*library(), *RANDOM} - {"drift", "encoder_resolution"}
    assert narrow.to_dict()["verdict"]["left_out"] == list(narrow.left_out)
    without = diagnose(campaign, without=["drift", "encoder_resolution"])
    assert not {"drift", "encoder_resolution"} & {f.name for f in without.effects}
    assert without.left_out == ("drift", "encoder_resolution")
    assert "by request (--without drift encoder_resolution)" in str(without)


@pytest.mark.parametrize(("name", "capped"), some([("session", True), ("temperature", False), ("region", True)], 3))
def test_nothing_above_nine_in_ten_is_told_of_what_harms_other_sessions(rv_m2, monkeypatch, name, capped):
    harmful = FoldScheme(name, "one after the other", 4, 60, 1e-4, 2e-4, -3.0, 1e-6)
    monkeypatch.setattr("thermal_robot.diagnosis.answer.worst_folds", lambda fit: (harmful,))
    told = diagnose(simulate(rv_m2, ["backlash"], seed=1, ratio=(5.0, 6.0))[0], only=["backlash"])
    assert told.verdict == ("backlash",)
    assert (told.probability <= 0.9) == capped
    assert all(f.probability is None or f.probability <= 0.9 for f in told.effects) == capped
    assert told.summary.startswith(f"Correcting harms rows held out by {name}") == capped
    assert any("no probability above 90%" in warning for warning in told.warnings) == capped


SMALL = Discovered("discovered.2", "joint", "joint_2", "time", "step", (3600.0,), 1.0)
LARGE = Discovered("discovered.3", "joint", "joint_3", "temperature", "step", (22.0,), 1.0)
GONE = Discovered("discovered.1", "joint", "joint_4", "payload", "ramp", (), 3.0)


@pytest.fixture(scope="module")
def found(rv_m2):
    """Two laws at work, found second and third, and one that did not last."""
    data = disturbed(with_law(rv_m2, LARGE, [-8e-4, 8e-4], seed=4)[0], [(SMALL, np.array([-2e-4, 2e-4]))])
    known = fit(data, choose(("drift",), (), ()))
    return refit(known, {law.name: (law,) for law in (GONE, SMALL, LARGE)}, [[SMALL, LARGE]])


@pytest.mark.slow
def test_the_largest_share_is_the_first_and_names_agree_wherever_they_stand(found):
    assert {effect.name for effect, _ in found.effects} == {"discovered.2", "discovered.3"}
    before = held_out(found)
    again, shrinkage, laws = numbered(found, before, discovered(found))
    places = {effect.name: effect.place for effect, _ in again.effects}
    assert places == {"discovered.1": LARGE.place, "discovered.2": SMALL.place}
    assert {d.law.name: d.law.place for d in laws} == places
    renamed = {"discovered.1": "discovered.3", "discovered.2": "discovered.2", "drift": "drift"}
    assert {new: shrinkage.shares[new] for new in renamed} == {n: before.shares[old] for n, old in renamed.items()}
    assert [b.effect.name for b in again.explanation.linear.blocks] == list(again.families)
    assert set(again.variants) == set(again.families)
    assert all({effect.name for effect in own} == {name} for name, own in again.variants.items())
    # the law that did not last comes after those that did; where there is none nothing is renamed
    assert again.variants["discovered.3"][0].place == GONE.place
    without = refit(found, {law.name: () for law in (GONE, SMALL, LARGE)})
    assert numbered(without, held_out(without), ())[0].families == without.families


RIVALS = choose(("joint_offset", "joint_gain", "backlash", "drift"), (), ())


def fitted(robot, times, effects=RIVALS):
    """One effect that moves the target by so many times the noise."""
    return fit(simulate(robot, ["backlash"], seed=2, ratio=(times, times), places=["joint_3"])[0], effects)


def test_a_certain_verdict_stays_certain(rv_m2):
    """Against nothing at all; that a small further effect hides beside it is never quite excluded."""
    alone = fitted(rv_m2, 5.0, choose(("backlash",), (), ()))
    beside = fitted(rv_m2, 5.0)
    for known, least in ((alone, 1.0 - 1e-9), (beside, 0.9)):
        assert [effect.name for effect, _ in known.effects] == ["backlash"]
        weighed = prior_sensitivity(known)
        assert min(weighed.smaller, weighed.larger) >= least


def test_noise_alone_is_less_certain_where_effects_may_be_smaller(rv_m2):
    """An effect of a third of its size hides in the noise more easily than one of three times it."""
    weighed = prior_sensitivity(fit(simulate(rv_m2, seed=4)[0], RIVALS))
    assert 0.3 < weighed.smaller < weighed.larger < 1.0


@pytest.mark.parametrize("times", some([0.3, 0.5, 1.5], 3))
def test_at_the_stated_sizes_it_is_the_probability_itself(rv_m2, monkeypatch, times):
    """Among the explanations that are compared again."""
    known = fitted(rv_m2, times)
    weighed = prior_sensitivity(known)
    assert 0.0 <= min(weighed.smaller, weighed.larger) <= max(weighed.smaller, weighed.larger) <= 1.0
    monkeypatch.setattr(settings, "PRIOR_FACTOR", 1.0)
    weighed, e = prior_sensitivity(known), known.explanation
    assert weighed.smaller == weighed.larger
    chosen = {effect.name for effect, _ in known.effects}
    compared = e.combinations[: settings.COMPARED]
    same = [{known.families[b] for b in c.blocks} == chosen for c in compared]
    p = e.probabilities[: len(compared)]
    assert e.discrepancy.kernel is None or times != 0.5
    if e.discrepancy.kernel is None:  # the same noise alone
        assert weighed.smaller == pytest.approx(p[np.array(same)].sum() / p.sum(), abs=1e-3)
