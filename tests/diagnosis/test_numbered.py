"""Laws count from 1 by their shares, under whatever numbers they were found."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import with_law
from simulate import simulate

from thermal_robot.diagnosis.answer import numbered
from thermal_robot.diagnosis.cross_validation import held_out
from thermal_robot.effects import choose
from thermal_robot.effects.apply import displacement
from thermal_robot.effects.law import Discovered
from thermal_robot.inference.fit import fit, refit
from thermal_robot.inference.generate import discovered
from thermal_robot.observations import Frames, observe

SMALL = Discovered("discovered.2", "joint", "joint_2", "time", "step", (3600.0,), 1.0)
LARGE = Discovered("discovered.3", "joint", "joint_3", "temperature", "step", (22.0,), 1.0)
GONE = Discovered("discovered.1", "joint", "joint_4", "payload", "ramp", (), 3.0)


@pytest.fixture(scope="module")
def found(rv_m2):
    """Two laws at work, found second and third, and one that did not last."""
    data = with_law(rv_m2, LARGE, [-8e-4, 8e-4], seed=4)[0]
    here = observe(data, Frames.declared(data))
    moved, _ = displacement(here, [(SMALL, np.array([-2e-4, 2e-4]))])
    shift = observe(data, here.frames, displacement=moved).predicted_position - here.predicted_position
    known = fit(replace(data, position=data.position + shift), choose(("drift",), (), ()))
    return refit(known, {law.name: (law,) for law in (GONE, SMALL, LARGE)}, [[SMALL, LARGE]])


def test_the_largest_share_is_the_first(found):
    assert {effect.name for effect, _ in found.effects} == {"discovered.2", "discovered.3"}
    before = held_out(found)
    again, shrinkage, laws = numbered(found, before, discovered(found))
    places = {effect.name: effect.place for effect, _ in again.effects}
    assert places == {"discovered.1": LARGE.place, "discovered.2": SMALL.place}
    assert {d.law.name: d.law.place for d in laws} == places
    assert shrinkage.shares["discovered.1"] == before.shares["discovered.3"]
    assert shrinkage.shares["discovered.2"] == before.shares["discovered.2"]
    assert shrinkage.shares["drift"] == before.shares["drift"]


def test_names_agree_wherever_they_stand(found):
    again, _, _ = numbered(found, held_out(found), discovered(found))
    assert [b.effect.name for b in again.explanation.linear.blocks] == list(again.families)
    assert set(again.variants) == set(again.families)
    assert all({effect.name for effect in own} == {name} for name, own in again.variants.items())
    # the law that did not last comes after those that did
    assert again.variants["discovered.3"][0].place == GONE.place


def test_without_laws_nothing_is_renamed(rv_m2):
    known = fit(simulate(rv_m2, ["drift"], seed=3)[0], choose(("drift",), (), ()))
    again, _, laws = numbered(known, held_out(known), ())
    assert laws == ()
    assert again.families == known.families
    assert again.variants == known.variants
