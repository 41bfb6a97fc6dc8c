"""Of what cancels one is kept, what no robot reaches is left out, and both only where rows held out allow it."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import NOISE
from simulate import simulate

from thermal_robot.diagnosis import credible as room
from thermal_robot.diagnosis import diagnose
from thermal_robot.diagnosis.cautions import cautions
from thermal_robot.diagnosis.credible import Cancelling, credible, goes_astray, outsized
from thermal_robot.effects import LinkCompliance, choose, gate
from thermal_robot.inference.fit import fit, less
from thermal_robot.inference.frames import register
from thermal_robot.observations import observe
from thermal_robot.simulation import simulate as program


def test_rows_set_aside_count_where_a_model_goes_astray(rv_m2):
    campaign = simulate(rv_m2, ["joint_gain"], seed=4, noise=NOISE)[0]
    known = fit(campaign, choose(("joint_gain",)))
    assert known.effects
    assert goes_astray(known) == pytest.approx(np.sqrt(3.0) * NOISE, rel=0.15)
    off = campaign.position.copy()
    off[7] += 0.01
    spoilt = fit(replace(campaign, position=off), choose(("joint_gain",)))
    assert spoilt.explanation.outliers.sum() == 1
    assert goes_astray(spoilt) == pytest.approx(0.01 * np.sqrt(3.0 / campaign.samples), rel=0.1)


@pytest.fixture(scope="module")
def both(rv_m2):
    """Gains and lost motion at work, neither of which stands for the other."""
    campaign = simulate(rv_m2, ["joint_gain", "backlash"], seed=4, noise=NOISE, ratio=(5.0, 6.0))[0]
    known = fit(campaign, choose(("joint_gain", "backlash")))
    assert {effect.name for effect, _ in known.effects} == {"joint_gain", "backlash"}
    return known


def paired(monkeypatch, known):
    """Say of a fit that two effects cancel as long as it holds both, not in any one joint."""
    pair = Cancelling(("joint_gain", "backlash"), (("base", ""),) * 2, 12.0)
    monkeypatch.setattr(room, "cancelling", lambda fit: (pair,) if len(fit.effects) > 1 else ())
    return credible(known, lambda _: None)


def test_two_that_rows_held_out_need_both_stay(both, monkeypatch):
    kept, refused = paired(monkeypatch, both)
    assert kept is both
    assert refused == {}


def test_the_one_without_which_rows_held_out_are_predicted_better_stays(both, monkeypatch):
    monkeypatch.setattr(room, "goes_astray", lambda fit: 1.0 if fit.blocks_of("backlash") else 1.01)
    kept, refused = paired(monkeypatch, both)
    assert [effect.name for effect, _ in kept.effects] == ["backlash"]
    (why,) = refused.values()
    assert set(refused) == {"joint_gain"}
    assert 0.0 <= why.probability <= 1.0
    assert why.reason.endswith("joint_gain is left out")


def soft(robot, times, effect):
    """An arm in which one effect is at work, its links said to bend a number of times less than they do."""
    plain = simulate(robot, [effect], seed=2, ratio=(6.0, 6.0))[0]
    size = max(p.size for p in LinkCompliance().parameters(observe(plain, register(plain))))
    return replace(plain, priors={"link_compliance": size / times})


@pytest.mark.parametrize(("times", "count"), [(1.0, 0), (100.0, 1)])
def test_links_softer_than_any_stay_where_nothing_else_predicts_rows_held_out(rv_m2, times, count):
    """The same bend: expected at the size as it is, not at one a hundred times smaller."""
    known = fit(soft(rv_m2, times, "link_compliance"), choose(("link_compliance",)))
    assert known.effects
    assert min(len(outsized(known)), 1) == count
    kept, refused = credible(known, lambda _: None)
    assert [effect.name for effect, _ in kept.effects] == ["link_compliance"]
    assert goes_astray(kept) < 1.05**2 * goes_astray(known)
    assert all(why.place for why in refused.values())  # at most links that do next to nothing
    assert any("times its expected size" in note for note in cautions(kept)) == bool(count)


def test_links_softer_than_any_lose_where_something_else_predicts_rows_held_out(rv_m2):
    """Joints that yield, told as links that bend: those would be softer than any."""
    known = fit(soft(rv_m2, 300.0, "joint_compliance"), choose(("joint_compliance", "link_compliance")))
    links = replace(less(known, "joint_compliance"), variants=known.variants)
    assert [effect.name for effect, _ in links.effects] == ["link_compliance"]
    doubts = outsized(links)
    assert [doubt.times for doubt in doubts] == sorted((doubt.times for doubt in doubts), reverse=True)
    kept, refused = credible(links, lambda _: None)
    assert [effect.name for effect, _ in kept.effects] == ["joint_compliance"]
    assert refused
    for called, why in refused.items():
        assert why.place in called
        assert why.reason.endswith(f"{called} is left out")
    assert 0.0 <= kept.probability("link_compliance") < 0.5 < kept.probability("joint_compliance")


def test_one_joint_alone_is_left_out_of_an_effect(rv_m2):
    campaign = simulate(rv_m2, ["joint_gain"], seed=4, noise=NOISE, ratio=(5.0, 6.0))[0]
    known = fit(campaign, choose(("joint_gain",)))
    ((effect, values),) = known.effects
    best = gate.checked(effect, known.nominal)[int(np.argmax(np.abs(values)))].place
    for place in (best, next(name for name in campaign.robot.joint_names if name != best)):
        others = less(known, "joint_gain", place=place)
        for cut in (*others.variants["joint_gain"], *(cut for cut, _ in others.effects)):
            assert place not in [p.place for p in gate.checked(cut, known.nominal)]
        assert (goes_astray(others) > 2.0 * goes_astray(known)) == (place == best)


def beyond(robot, name, size):
    return diagnose(program(robot, {name: size}, rows=60, noise=2e-5, base_known=False, seed=3))


@pytest.mark.parametrize(
    ("name", "size", "too_large"), [("instrument_scale", 4e-4, 2.3e-3), ("thermal_elongation", 2e-5, 1.2e-4)]
)
def test_what_no_instrument_and_no_material_does_is_told(rv_m2, name, size, too_large):
    """Links of five times the expansion of aluminium may be of a polymer; who reads it shall know."""
    possible, impossible = (beyond(rv_m2, name, own) for own in (size, too_large))
    assert name in possible.verdict
    assert not any("physically possible" in warning for warning in possible.warnings)
    assert any("physically possible" in warning for warning in impossible.warnings)


def test_what_a_campaign_expects_may_be(rv_m2):
    """Links of a polymer, where that is stated."""
    campaign = program(rv_m2, {"thermal_elongation": 1.2e-4}, rows=60, noise=2e-5, base_known=False, seed=3)
    assert "thermal_elongation" in diagnose(replace(campaign, priors={"thermal_elongation": 1e-4})).verdict
