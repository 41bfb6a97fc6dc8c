"""Which effect: status, probability, parameters; what the data cannot tell apart."""

from dataclasses import replace

import numpy as np
import pytest
from conftest import load_arm
from denavit import off
from helpers import with_law
from simulate import simulate

from thermal_robot import diagnose
from thermal_robot.diagnosis.findings import by_share, findings, separates, titled
from thermal_robot.diagnosis.values import Finding, Refused
from thermal_robot.effects import choose, library, random_effects
from thermal_robot.effects.law import Discovered
from thermal_robot.inference.fit import fit, refit
from thermal_robot.inference.registration import register


def in_the_root_frame(campaign):
    """The same measurements with both frames known."""
    frames = register(campaign)
    back = np.linalg.inv(frames.base)
    position = campaign.position @ back[:3, :3].T + back[:3, 3]
    return replace(campaign, position=position, base_known=True, tool_known=True, target=frames.tool[:3, 3])


def test_an_offset_of_the_first_joint_is_an_alias_of_a_known_base(clean):
    known = in_the_root_frame(clean)
    turned = 1e-3 * np.cross([0.0, 0.0, 1.0], known.position)
    found = diagnose(replace(known, position=known.position + turned))
    offset, base = found.finding("joint_offset"), found.finding("base_frame")
    assert {offset.status, base.status} == {"confounded"}
    assert "base_frame" in offset.confounded_with
    assert "joint_offset" in base.confounded_with


def test_a_suppressed_effect_is_not_found_rather_than_confounded(clean):
    found = diagnose(replace(clean, priors={"backlash": 1e-12}))
    assert found.finding("backlash").status == "not_found"
    assert found.finding("backlash").confounded_with == ()


def test_rows_in_another_sequence_leave_the_verdict():
    campaign = in_the_root_frame(simulate(load_arm("ur10"), ["drift"], samples=100, seed=3)[0])
    mixed = campaign.take(np.random.default_rng(0).permutation(100))
    assert diagnose(campaign).verdict == diagnose(mixed).verdict


@pytest.fixture(scope="module")
def offsets(rv_m2):
    """Zeros of three joints at fault, found among a few candidates; time is not recorded."""
    places = ["joint_2", "joint_3", "joint_4"]
    campaign = simulate(rv_m2, ["joint_offset"], seed=2, ratio=(4.0, 5.0), places=places)[0]
    bare = {name: values for name, values in campaign.covariates.items() if name != "time"}
    few = choose(("joint_offset", "geometric", "drift", "instrument_scale"), (), ())
    return fit(replace(campaign, covariates=bare), few)


def said(known, laws=None, refused=None, share=0.9):
    names = dict.fromkeys(known.families)
    shares = {name: (share if name == "joint_offset" else 0.01, (0.0, 1.0)) for name in names}
    return {f.name: f for f in findings(known, shares, {}, laws or {}, refused or {})}


def test_every_candidate_has_one_finding(offsets):
    found = said(offsets)
    assert {name: f.status for name, f in found.items()} == {
        "joint_offset": "found",
        "geometric": "not_found",
        "instrument_scale": "not_found",
        "drift": "not_testable",
    }
    assert found["drift"].needs
    assert found["drift"].probability is None
    for f in found.values():
        assert f.probability is None or 0.0 <= f.probability <= 1.0
        assert bool(f.parameters) == (f.status == "found")


def test_a_known_effect_is_as_probable_as_the_evidence_says(offsets):
    """No factor, no floor: what unlisted causes do to it is in the evidence already."""
    for name, f in said(offsets).items():
        if f.status != "not_testable":
            own = [b for b, family in enumerate(offsets.families) if family == name]
            assert f.probability == offsets.explanation.probability(own)


def test_a_law_is_as_probable_as_its_place_and_quantity(rv_m2):
    law = Discovered("discovered.1", "joint", "joint_3", "temperature", "step", (22.0,), 1.0)
    known = fit(with_law(rv_m2, law, [-2e-4, 2e-4], seed=3)[0], choose(("drift",), (), ()))
    known = refit(known, {law.name: (law,)}, [[law]])
    found = said(known, {law.name: 0.7})
    assert (found[law.name].status, found[law.name].probability) == ("found", 0.7)
    assert (found[law.name].quantity, found[law.name].shape) == ("temperature", "step")
    assert found[law.name].describes == law.describe()
    # a law that did not last was never a candidate of anybody's
    assert set(said(refit(known, {law.name: (law,)}, [[]]), {})) - {law.name} == {"drift"}
    bare = fit(with_law(rv_m2, law, [0.0, 0.0], seed=3)[0], choose(("drift",), (), ()))
    assert set(said(refit(bare, {law.name: (law,)}, [[]]))) == {"drift"}


def test_what_rows_held_out_refused_is_not_found_with_its_probability(offsets):
    found = said(offsets, refused={"joint_gain": Refused(0.03, -0.05)})["joint_gain"]
    assert (found.status, found.probability, found.parameters) == ("not_found", 0.03, ())
    assert found.shrinkage is not None
    assert found.shrinkage_ci95 is not None


def test_a_parameter_that_the_data_do_not_determine_has_no_number(offsets, rv_m2):
    """The zero of the first joint turns the whole robot about an axis, as the unknown base does."""
    estimates = {p.name.rpartition(", ")[2]: p for p in said(offsets)["joint_offset"].parameters}
    first = estimates[rv_m2.joint_names[0]]
    assert (first.identified, first.value, first.std) == (False, None, None)
    for name in rv_m2.joint_names[1:4]:
        assert estimates[name].identified
        assert estimates[name].std > 0.0


def test_of_one_joint_at_fault_only_its_own_parameter_is_said(rv_m2):
    campaign = simulate(rv_m2, ["joint_offset"], seed=2, ratio=(4.0, 5.0), places=["joint_3"])[0]
    (own,) = said(fit(campaign, choose(("joint_offset",), (), ())))["joint_offset"].parameters
    assert own.name.endswith("joint_3")
    assert own.identified


def test_titles_are_those_of_the_effects(offsets):
    effects = library()
    found = titled(tuple(said(offsets).values()), (*effects.values(), *random_effects()))
    assert {f.name: f.title for f in found} == {f.name: effects[f.name].title for f in found}
    assert not any(f.random for f in found)
    scatter = random_effects()[0]
    law = Finding("discovered.1", "found", 1.0, describes="a step in time")
    again = titled((law, Finding(scatter.name, "found", 1.0)), random_effects())
    assert [(f.title, f.random) for f in again] == [("a step in time", False), (scatter.title, True)]


def test_the_largest_share_comes_first_and_what_is_not_testable_last():
    found = [
        Finding("d", "not_testable"),
        Finding("c", "not_found", 0.1, -0.01),
        Finding("a", "found", 1.0, 0.2),
        Finding("b", "not_found", 0.4, 0.0),
        Finding("e", "found", 1.0, 0.7),
    ]
    assert [f.name for f in by_share(found)] == ["e", "a", "b", "c", "d"]


def test_separates_lists_each_group_once_and_frames_only_where_nothing_else_is_left():
    def one(name, *others, needs=()):
        return Finding(name, "confounded", 0.5, confounded_with=others, needs=needs)

    pair = [one("drift", "thermal_elongation"), one("thermal_elongation", "drift")]
    base = one("joint_offset", "base_frame")
    unknown = Finding("base_frame", "not_testable", needs=("frames.base",))
    assert separates(pair) == (("drift", "thermal_elongation"),)
    assert separates([base, unknown]) == (("base_frame", "joint_offset"),)
    assert separates([*pair, base, unknown]) == (("drift", "thermal_elongation"),)
    assert separates([Finding("drift", "found", 1.0)]) == ()


def test_where_geometry_is_found_its_zeros_are_told_with_numbers(rv_m2):
    campaign, zeros = off(rv_m2, 5, zero=5e-3)
    found = said(fit(campaign, choose(("joint_offset", "geometric"), (), ())))
    whole, inside = found["geometric"], found["joint_offset"]
    assert (whole.status, inside.status, inside.confounded_with) == ("found", "contained", ("geometric",))
    assert inside.probability == whole.probability
    first, *others = rv_m2.joint_names
    assert f"zero offset, {first}" in inside.unseen
    told = {p.name.rpartition(", ")[2]: p for p in inside.parameters}
    assert list(told) == others[: len(told)]
    for name, p in told.items():
        assert p.identified
        assert abs(p.value - zeros[rv_m2.joint_names.index(name)]) < 4.0 * p.std < 1e-3
    assert all(p.identified for p in whole.parameters)
    # that zeros are inside geometry is no question that further measurements would answer
    assert separates(tuple(found.values())) == ()


def test_zeros_that_suffice_are_found_themselves(offsets):
    assert said(offsets)["joint_offset"].unseen == ()
