"""Which effect: status, probability, parameters; what the data cannot tell apart; what scatters."""

from dataclasses import replace

import numpy as np
import pytest
from denavit import off
from helpers import erring, with_law
from simulate import simulate

import thermal_robot as tr
from thermal_robot import diagnose
from thermal_robot.diagnosis.findings import (
    by_share,
    confounding,
    divided_effects,
    estimates,
    findings,
    fitted_values,
    random_findings,
    separates,
    titled,
    unknown_frames,
    within_frames,
)
from thermal_robot.diagnosis.values import Finding, Refused
from thermal_robot.effects import choose, library, named, random_effects
from thermal_robot.effects.law import Discovered
from thermal_robot.inference import settings
from thermal_robot.inference.evidence import Combination
from thermal_robot.inference.fit import fit, fit_named, refit
from thermal_robot.inference.registration import register
from thermal_robot.inference.scatter import random_gap
from thermal_robot.simulation import simulate as program


def in_the_root_frame(campaign):
    """The same measurements with both frames known."""
    frames = register(campaign)
    back = np.linalg.inv(frames.base)
    position = campaign.position @ back[:3, :3].T + back[:3, 3]
    return replace(campaign, position=position, base_known=True, tool_known=True, target=frames.tool[:3, 3])


@pytest.mark.slow
def test_an_offset_of_the_first_joint_is_an_alias_of_a_known_base(clean):
    known = in_the_root_frame(clean)
    turned = 1e-3 * np.cross([0.0, 0.0, 1.0], known.position)
    found = diagnose(replace(known, position=known.position + turned))
    offset, base = found.finding("joint_offset"), found.finding("base_frame")
    assert {offset.status, base.status} == {"confounded"}
    assert "base_frame" in offset.confounded_with
    assert "joint_offset" in base.confounded_with


def test_a_suppressed_effect_is_not_found_rather_than_confounded(clean):
    found = diagnose(replace(clean, priors={"backlash": 1e-12}), only=["backlash", "joint_offset"])
    assert found.finding("backlash").status == "not_found"
    assert found.finding("backlash").confounded_with == ()


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


def test_every_candidate_has_one_finding_as_probable_as_the_evidence_says(offsets, rv_m2):
    found = said(offsets, refused={"joint_gain": Refused(0.03, -0.05)})
    # what rows held out refused is not found with its probability
    refused = found.pop("joint_gain")
    assert (refused.status, refused.probability, refused.parameters) == ("not_found", 0.03, ())
    assert None not in (refused.shrinkage, refused.shrinkage_ci95)
    assert {name: f.status for name, f in found.items()} == {
        "joint_offset": "found",
        "geometric": "not_found",
        "instrument_scale": "not_found",
        "drift": "not_testable",
    }
    assert found["drift"].needs
    assert found["drift"].probability is None
    for name, f in found.items():
        assert bool(f.parameters) == (f.status == "found")
        if f.status != "not_testable":
            own = [b for b, family in enumerate(offsets.families) if family == name]
            assert 0.0 <= f.probability == offsets.explanation.probability(own) <= 1.0
    # the zero of the first joint turns the whole robot about an axis, as the unknown base does
    estimates = {p.name.rpartition(", ")[2]: p for p in found["joint_offset"].parameters}
    first, *others = rv_m2.joint_names
    assert (estimates[first].identified, estimates[first].value, estimates[first].std) == (False, None, None)
    assert all(estimates[name].identified and estimates[name].std > 0.0 for name in others[:3])
    assert found["joint_offset"].unseen == ()  # that is told of parts inside another effect


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


def test_figures_stand_where_the_data_identify_and_parts_name_their_container():
    off = {"joint_offset": {"joint_3": 1e-3}}
    campaign = tr.simulate("builtin:rv_m2", off, rows=60, noise=2e-5, base=np.eye(4), tool_frame="tool0", seed=8)
    parted = fit_named(campaign, [named("joint_offset"), named("geometric"), named("backlash")])
    for block in parted.explanation.best.blocks:
        told = estimates(parted, block)
        assert len(told) == len(fitted_values(parted, block))
        for one in told:
            assert (one.value is None, one.std is None) == (not one.identified, not one.identified)
    first = [one.identified for one in estimates(parted, 0)]
    assert any(first)
    assert not all(first)  # segments have redundant parameters
    parts = divided_effects(parted)
    assert {name: part.container for name, part in parts.items()} == dict.fromkeys(
        ("joint_offset", "geometric"), "geometric"
    )
    zero = next(one for one in parts["joint_offset"].parameters if one.name == "zero offset, joint_3")
    assert zero.value == pytest.approx(1e-3, abs=4.0 * zero.std)


NOISE, SIGMA = 20e-6, 6e-4  # m, rad
JOINT = 1


def scattering(robot, *, repeats=1, poses=120, sigma=SIGMA, seed=2):
    """Frames fitted to a campaign in which one joint errs anew at each visit, standard deviation sigma, rad."""
    once = simulate(robot, samples=poses, seed=seed, noise=NOISE)[0]
    rows = poses * repeats
    plain = replace(once.take(np.tile(np.arange(poses), repeats)), rows=np.arange(2, rows + 2), priors={})
    drawn = np.random.default_rng([seed, 5]).normal(size=rows)
    noisy = erring(plain, [seed, 6], NOISE, joint=np.outer(sigma * drawn, np.arange(robot.n) == JOINT))
    timed = replace(noisy, covariates={**noisy.covariates, "time": np.linspace(0.0, 3600.0, rows)})
    known = fit(timed, choose(("joint_offset",), (), ()))
    return known, random_gap(known)


@pytest.fixture(scope="module")
def single(rv_m2):
    """Each pose once, where steps are too many to be looked for: what comes at each visit and with a pose are one."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(settings, "MOST_FREQUENCIES", 0)
        return scattering(rv_m2, poses=40, sigma=7e-5)


@pytest.fixture(scope="module")
def visits(rv_m2):
    """Each pose three times."""
    return scattering(rv_m2, repeats=3, poses=50)


def test_scatter_anew_at_each_visit_is_named_with_its_joint_and_sigma(rv_m2, visits):
    encoder, wear = random_findings(*visits)
    assert (encoder.status, wear.status) == ("not_found", "found")
    assert [place.name for place in wear.locations] == [rv_m2.joint_names[JOINT]]
    (size,) = wear.parameters
    assert size.unit == "rad"
    assert rv_m2.joint_names[JOINT] in size.name
    factor = next(e.factor for e in random_effects() if e.name == wear.name)
    assert size.value / factor == pytest.approx(SIGMA, rel=0.15)
    assert abs(size.value / factor - SIGMA) < 3.0 * size.std / factor


def test_without_steps_or_repeats_the_two_kinds_are_one_and_an_encoder_is_one_of_three_causes(single):
    """Wear explains the scatter as well, and so does what nobody recorded."""
    encoder, wear = random_findings(*single)
    assert (encoder.status, encoder.confounded_with) == ("confounded", (wear.name,))
    assert (wear.status, wear.needs, wear.probability) == ("not_testable", ("pose",), None)
    assert single[1].scatter.probability["pose"] > 0.9
    assert 0.2 < encoder.probability < 0.5


def test_scatter_never_shrinks_the_gap_its_places_share_it_out_and_not_found_is_never_probable(single, visits):
    for known, seen in (single, visits):
        for finding in random_findings(known, seen):
            if finding.status != "not_testable":
                assert (finding.shrinkage, finding.shrinkage_ci95) == (0.0, (0.0, 0.0))
            if finding.locations:
                assert sum(place.share for place in finding.locations) == pytest.approx(1.0)
            assert finding.status != "not_found" or finding.probability < 0.5


FEW = ("joint_offset", "joint_gain", "drift", "backlash")


@pytest.fixture(scope="module")
def known(rv_m2):
    """A joint whose zero is off, among four candidates."""
    return fit(simulate(rv_m2, ["joint_offset"], seed=2, places=["joint_3"])[0], choose(FEW))


def weighed(known, odds):
    """The same fit, where sets of effects are as probable as said; the best is what was found."""
    e = known.explanation
    sets = [e.best.blocks, *(tuple(known.blocks_of(name)[0] for name in names) for names in odds)]
    compared = [Combination(blocks, 0.0, 1.0, {}, 0.0) for blocks in sets]
    weight = np.array([1.0, *odds.values()])
    said = replace(known, explanation=replace(e, combinations=compared, probabilities=weight / weight.sum()))
    return confounding(said, {"joint_offset": e.best.blocks[0]})


BESIDE = {("joint_offset", "drift"): 50.0, ("joint_offset", "backlash"): 50.0}


@pytest.mark.parametrize(
    ("odds", "told"),
    [
        # another effect in its place counts from a hundredth
        *(({("joint_gain",): p / (1.0 - p)}, told) for p, told in ((0.4, True), (0.02, True), (0.005, False))),
        # two in its place are no rival of it, nor is one beside it
        ({("joint_gain", "drift"): 0.5}, False),
        ({("joint_offset", "drift"): 0.9}, False),
        # nor has one what is at work for sure, however little mass its own set has beside others in doubt
        ({("joint_gain",): 0.14}, True),
        ({**BESIDE, ("joint_gain",): 0.14}, False),
    ],
)
def test_another_effect_in_its_place_is_a_rival(known, odds, told):
    found = weighed(known, odds)
    assert found == ({"joint_offset": ("joint_gain",), "joint_gain": ("joint_offset",)} if told else {})


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(33, 37))
def test_what_could_do_the_same_and_is_improbable_is_no_rival(rv_m2, seed):
    """A joint that its weight always seats on one side is off by a constant, as by lost motion, at its price."""
    off = {"joint_offset": {"joint_2": 8e-4}}
    found = diagnose(program(rv_m2, off, rows=70, tool=(0.05, 0.03, 0.1), noise=15e-6, base_known=False, seed=seed))
    assert found.finding("backlash").probability < 0.05
    assert found.finding("joint_offset").status == "found"
    assert found.separates == ()


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_links_and_joints_that_bend_are_told_together_on_few_rows(rv_m2, seed):
    bends = {"joint_compliance": {"joint_2": 1e-5}}
    found = diagnose(program(rv_m2, bends, rows=16, tool=(0.05, 0.03, 0.1), noise=2e-5, base_known=False, seed=seed))
    pair = {"joint_compliance", "link_compliance"}
    assert all({name, *found.finding(name).confounded_with} == pair for name in pair)


def test_unknown_frames_hold_the_first_zero_alone(known):
    own = {known.explanation.linear.blocks[b].effect.places: b for b in known.blocks_of("joint_offset")}
    assert set(unknown_frames(known)) == {"base_frame", "tool_frame"}
    assert not within_frames(known, own[()])
    assert not within_frames(known, own[("joint_3",)])
