"""Holding rows out in other ways tells an explanation that interpolates from one that is right."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis.simulated import forced
from simulate import simulate

from thermal_robot import simulate as simulated
from thermal_robot.diagnosis.beside import grown
from thermal_robot.diagnosis.cross_validation import hardest, harmed, worst_folds
from thermal_robot.diagnosis.parts import FoldScheme, HeldOut
from thermal_robot.effects import choose
from thermal_robot.inference.columns import block
from thermal_robot.inference.fit import fit
from thermal_robot.kinematics import exp6

NOISE = 25e-6
SEEDS = range(8)


def in_sessions(campaign, count=4):
    """The same campaign, said to have been measured in several sessions one after the other."""
    labels = np.array([f"day {k * count // campaign.samples + 1}" for k in range(campaign.samples)])
    return replace(campaign, labels={"session": labels})


@pytest.fixture(scope="module")
def warm(rv_m2):
    """Campaigns of links that grow; each with its schemes under the right effect and under drift alone."""
    found = []
    for seed in SEEDS:
        campaign, _, _ = simulate(rv_m2, ["thermal_elongation"], seed=seed, ratio=(4.0, 6.0))
        campaign = in_sessions(campaign)
        right, nothing = (fit(campaign, choose(only, (), ()) if only else ()) for only in (("thermal_elongation",), ()))
        (drift,) = choose(("drift",), (), ())
        wrong = forced(nothing, block(nothing.corrected, drift))
        found.append([{s.name: s for s in worst_folds(f)} for f in (right, wrong)])
    return found


def test_a_correction_that_interpolates_leaves_more_where_it_must_extrapolate(warm):
    for name, factor in (("session", 1.2), ("temperature", 1.15)):
        ratio = [wrong[name].rms_after / wrong["time"].rms_after for _, wrong in warm]
        assert np.mean(ratio) > factor, name
        assert np.mean(np.array(ratio) > 1.0) > 0.75, name


def test_the_right_explanation_leaves_the_same_whatever_is_held_out(warm):
    apart = []
    for right, _ in warm:
        blocked = right["time"]
        for name, scheme in right.items():
            if name != "time":
                apart.append((scheme.rms_after - blocked.rms_after) / np.hypot(scheme.uncertainty, blocked.uncertainty))
    assert np.median(np.abs(apart)) < 1.0
    assert np.max(np.abs(apart)) < 4.0
    for right, _ in warm:
        assert all(0.8 < s.rms_after / (np.sqrt(3.0) * NOISE) < 1.5 for s in right.values())


def test_schemes_come_in_order_and_say_what_they_are(warm):
    for pair in warm:
        for schemes in pair:
            after = [s.rms_after for s in schemes.values()]
            assert after == sorted(after, reverse=True)
            assert set(schemes) == {"time", "session", "temperature", "region", "reach", "range"}
            for s in schemes.values():
                assert s.shrinkage == pytest.approx(1.0 - (s.rms_after / s.rms_before) ** 2)
            assert (schemes["session"].folds, schemes["time"].folds, schemes["temperature"].folds) == (4, 20, 2)
            assert schemes["reach"].rows == pytest.approx(0.2 * schemes["time"].rows, abs=1)


def test_the_hardest_is_told_where_it_leaves_clearly_more_than_the_average():
    average = HeldOut("blocked", 5, 4e-4, 1e-4, 0.94, (0.9, 0.96))
    found = [FoldScheme(name, name, 2, 40, 4e-4, left, 0.9, 1e-6) for name, left in (("reach", 1.5e-4), ("time", 1e-4))]
    assert hardest(found, average).name == "reach"
    assert hardest(found, replace(average, rms_after=1.3e-4)) is None
    assert hardest((), average) is None


def test_harm_to_other_sessions_and_regions_is_told_and_no_other():
    found = [FoldScheme(name, name, 2, 40, 1e-4, 2e-4, -3.0, 1e-6) for name in ("reach", "temperature", "region")]
    assert harmed(found).name == "region"
    assert harmed(found[:2]) is None
    assert harmed([replace(found[2], shrinkage=0.1)]) is None


def test_a_target_mounted_anew_for_a_session_does_not_count_against_what_carries_over(rv_m2):
    """Lost motion in all sessions; in one of them the target sits elsewhere: held out, it is taken as it was found."""
    tools = (exp6(np.array([0.03, 0.02, 0.09, 0.0, 0.0, 0.0])), exp6(np.array([0.0306, 0.0205, 0.0896, 0.0, 0.0, 0.0])))
    campaign, other = (
        in_sessions(simulated(rv_m2, {"backlash": 3e-4}, rows=100, noise=NOISE, base=np.eye(4), tool=tool, seed=3))
        for tool in tools
    )
    there = campaign.labels["session"] == "day 2"
    moved = np.where(there[:, None], other.position, campaign.position)
    alone = {s.name: s for s in worst_folds(fit(campaign, choose(("backlash",), (), ())))}
    known = grown(fit(replace(campaign, position=moved), choose(("backlash",), (), ())), 1, lambda _: None)
    (event,) = [law for law, _ in known.effects if law.name == "discovered.1"]
    assert (event.kind, event.quantity, event.labels[int(event.marks[0])]) == ("tool", "session", "day 2")
    for name, scheme in {s.name: s for s in worst_folds(known)}.items():
        assert scheme.rms_after == pytest.approx(alone[name].rms_after, rel=0.1), name


def test_folds_by_time_are_those_of_the_diagnosis(rv_m2):
    from thermal_robot.diagnosis.cross_validation import held_out

    found = fit(simulate(rv_m2, ["backlash"], seed=3)[0], choose((), (), ()))
    blocked = next(s for s in worst_folds(found) if s.name == "time")
    overall = held_out(found).overall
    assert blocked.rms_before == pytest.approx(overall.rms_before, rel=1e-9)
    assert blocked.rms_after == pytest.approx(overall.rms_after, rel=1e-9)


def test_a_column_that_is_not_there_makes_no_scheme(rv_m2):
    campaign, _, _ = simulate(rv_m2, ["joint_offset"], seed=1)
    bare = replace(campaign, covariates={})
    schemes = worst_folds(fit(bare, choose(("joint_offset",), (), ())))
    assert {s.name for s in schemes} == {"time", "region", "reach", "range"}


def test_without_an_effect_nothing_shrinks(rv_m2):
    campaign, _, _ = simulate(rv_m2, [], seed=1)
    for scheme in worst_folds(fit(campaign, choose((), (), ()))):
        assert scheme.shrinkage == pytest.approx(0.0, abs=1e-9)
