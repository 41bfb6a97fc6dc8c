"""What is said of a diagnosis of motion: the headline's length and order, units for reading, what is not shown."""

from dataclasses import replace

import numpy as np
import pytest
from motion.found import COUNT, TRUE, found, nothing

from thermal_robot.diagnosis.values import Estimate, HeldOut
from thermal_robot.motion.result import with_summary

CASES = {
    "plain": lambda: found(),
    "stated stiffness": lambda: found(stated=True),
    "a remainder": lambda: found(flagged=True),
    "rivals": lambda: found(rivals=(("lag", ("delay", "armature")), ("coulomb", ("dead_zone",)))),
    "nothing": nothing,
    "no joint": lambda: with_summary(replace(found(), joints={}, verdict=(), effects=())),
}


@pytest.mark.parametrize("case", CASES)
def test_a_headline_is_one_sentence_of_at_most_45_words(case):
    d = CASES[case]()
    assert 0 < len(d.summary.split()) <= 45
    assert d.summary.count(". ") == 0
    assert d.summary.endswith(".")


def test_the_headline_names_causes_joints_and_how_far():
    text = found().summary
    assert "lag of the servos" in text
    assert "Coulomb friction in joint_2" in text
    assert "93 % sure" in text
    assert "simulated from the command alone" in text


def test_the_fewest_causes_that_hold_95_percent_are_named():
    d = found()
    sizes = {"lag": 0.97, "coulomb": 0.01, "droop": 0.01}
    less = tuple(replace(one, shrinkage=sizes.get(one.name, one.shrinkage)) for one in d.effects)
    text = with_summary(replace(d, effects=less)).summary
    assert "lag of the servos and 2 smaller ones" in text
    assert "Coulomb" not in text


def test_a_fit_that_harms_motions_held_out_says_so():
    d = found()
    worse = HeldOut("motion", 3, 0.01, 0.02, -3.0, (-4.0, -2.0))
    assert "no better" in with_summary(replace(d, held_out=worse)).summary


def test_what_moves_a_joint_by_less_than_twice_its_noise_is_not_shown():
    d = found()
    assert ("gain", "joint_3") in TRUE
    assert d.moves["gain", "joint_3"] < 2.0 * COUNT / np.sqrt(12.0)
    assert "gain" in d.verdict
    assert "gain" not in [one.name for one in d.shown]
    assert "gain, joint_3" not in str(d)
    assert "Told, but not shown" in str(d)
    stated = replace(d, log=replace(d.log, tolerance={"joint_2": 10.0, "joint_3": 10.0}))
    assert stated.shown == ()


@pytest.mark.parametrize("effect", ["lag", "coulomb", "droop"])
def test_how_far_an_effect_moves_a_joint_is_what_its_simulation_changes(effect):
    d = found()
    for (name, joint), size in d.moves.items():
        assert size >= 0.0
        assert (name, joint) in TRUE
    whole = d.joints["joint_2"].before
    assert 0.0 < d.moves[effect, "joint_2"] < 20.0 * whole


def test_units_are_those_of_a_data_sheet():
    plain, stated = found(), found(stated=True)
    (friction,) = plain.physical("coulomb")
    assert (friction.unit, friction.value) == ("rad", 0.012)
    (friction,) = stated.physical("coulomb")
    assert friction.unit == "N·m"
    assert friction.value == pytest.approx(20.0 * 0.012)
    assert friction.std == pytest.approx(0.05 * friction.value)
    assert "12.00 ± 0.60 mrad" in str(plain)
    assert "80.0 ± 4.0 ms" in str(plain)
    assert "0.240 ± 0.012 N·m" in str(stated)


def test_what_cannot_be_told_apart_stands_in_groups():
    d = CASES["rivals"]()
    assert d.separates == (("lag", "delay", "armature"), ("coulomb", "dead_zone"))
    assert "In this log lag, delay and armature do the same." in str(d)
    assert "steps and quick reversals" in d.advice
    assert d.to_dict()["next"]["separates"] == [list(group) for group in d.separates]


def test_what_no_log_of_this_kind_can_tell_is_always_said():
    text = " ".join(str(found()).split())
    assert "viscous friction in the joint and damping in the servo are one" in text
    assert "stiffness is not stated" in text
    assert "stiffness is not stated" not in str(found(stated=True))


def test_of_a_single_joint_it_is_always_said_that_masses_and_stiffness_droop_alike():
    several = found(stated=True)
    mass = Estimate("mass", 0.3, 0.02, "kg", True)
    payload = replace(several.finding("payload"), status="found", probability=0.99, shrinkage=0.5, parameters=(mass,))
    effects = (payload, *(one for one in several.effects if one.name not in ("payload", "droop")))
    moves = several.moves | {("payload", "joint_2"): 0.1}
    alone = {
        "effects": effects,
        "verdict": ("payload",),
        "moves": moves,
        "joints": {"joint_2": several.joints["joint_2"]},
    }
    assert "masses droop alike" in str(with_summary(replace(several, **alone)))
    assert "masses droop alike" not in str(with_summary(replace(several, **alone | {"joints": several.joints})))


def test_a_remainder_is_told_with_what_it_follows():
    d = found(flagged=True)
    assert "42 % of what remains in joint_2 follows velocity." in str(d)
    assert d.advice == "Record motions at several constant velocities: what remains follows velocity."


@pytest.mark.parametrize("case", CASES)
def test_a_text_is_at_most_96_columns_wide(case):
    assert max(map(len, str(CASES[case]()).splitlines())) <= 96


def test_kinds_without_a_verdict_are_listed():
    d = with_summary(replace(found(), refused={"free fall": 5.0}))
    assert "free fall: 5.0 times what the other kinds leave" in str(d)
    assert "free fall" in d.advice


def test_faults_of_the_log_are_told():
    d = replace(found(), faults=("q.joint_2 is in degrees",), warnings=("row 3 left out",))
    for told_of in (str(d), d._repr_html_()):
        assert "q.joint_2 is in degrees" in told_of
        assert "row 3 left out" in told_of
