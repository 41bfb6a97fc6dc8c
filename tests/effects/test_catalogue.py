"""The library, effects of one's own beside it, what packages install, and names that no effect has."""

import json
from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from simulate import simulate

from thermal_robot import CampaignError, EffectError, diagnose
from thermal_robot.effects import (
    RANDOM,
    Effect,
    JointOffset,
    Parameter,
    at_joint,
    catalogue,
    choose,
    library,
    named,
    random_effects,
)
from thermal_robot.effects.apply import displacement
from thermal_robot.effects.catalogue import of_effect
from thermal_robot.observations import Frames, observe


@dataclass(frozen=True)
class JointSag(Effect):
    """Joints give way to speed."""

    name = "joint_sag"
    needs = ("speed",)

    def parameters(self, observations):
        return tuple(
            Parameter("sag", "rad", 1e-3, "joint", joint, (at_joint(j, observations.covariates["speed"]),))
            for j, joint in enumerate(observations.robot.joint_names)
        )


SAG = np.array([0.0, 3e-4, -2e-4, 0.0, 0.0])


def with_sag(robot, seed, noise=25e-6, samples=120, times=1.0):
    """A campaign of a sagging robot, measured in the root frame by an instrument that was not told so."""
    plain = simulate(robot, samples=samples, seed=seed, noise=noise)[0]
    rng = np.random.default_rng(seed)
    plain = replace(plain, covariates={**plain.covariates, "speed": rng.uniform(0.1, 1.0, samples)})
    nominal = observe(plain, Frames.declared(plain))
    change, _ = displacement(nominal, [(JointSag(), times * SAG)])
    real = observe(plain, Frames.declared(plain), displacement=change)
    return replace(plain, position=real.predicted_position + noise * rng.normal(size=(samples, 3)))


def test_an_effect_of_ones_own_is_found_with_its_values(rv_m2):
    hits = 0
    for seed in range(4):
        found = diagnose(with_sag(rv_m2, seed), effects=[JointSag()])
        if found.verdict != ("joint_sag",) or found.unexplained.flagged:
            continue
        hits += 1
        sag = {p.name: p for p in found.finding("joint_sag").parameters}
        assert {f"sag, {joint}" for joint, true in zip(rv_m2.joint_names, SAG, strict=True) if true} <= set(sag)
        for joint, true in zip(rv_m2.joint_names, SAG, strict=True):
            if f"sag, {joint}" not in sag:  # it stands in some joints alone
                continue
            estimate = sag[f"sag, {joint}"]
            assert estimate.unit == "rad"
            assert estimate.identified or true == 0.0
            assert not estimate.identified or abs(estimate.value - true) < 5.0 * estimate.std
        places = [p.name for p in found.finding("joint_sag").locations]
        assert set(places[:2]) == {"joint_2", "joint_3"}
        plain = json.loads(json.dumps(found.to_dict()))
        assert plain["verdict"]["effects"] == ["joint_sag"]
        assert plain["effects"][0]["name"] == "joint_sag"
        assert plain["effects"][0]["status"] == "found"
    assert hits >= 3


def test_the_model_that_holds_it_needs_its_covariate(rv_m2):
    data = with_sag(rv_m2, 0)
    model = diagnose(data, effects=[JointSag()], only=["joint_sag"]).model
    assert model.needs == ("speed",)
    assert np.sqrt(((model.predict(data)[0] - data.position) ** 2).mean()) < 1.1 * 25e-6
    with pytest.raises(CampaignError) as refused:
        model.predict(data.drop_covariate("speed"))
    assert refused.value.column == "speed"


def test_without_its_covariate_ones_own_effect_is_not_testable(rv_m2):
    data = with_sag(rv_m2, 0).drop_covariate("speed")
    finding = diagnose(data, effects=[JointSag()]).finding("joint_sag")
    assert (finding.status, finding.needs) == ("not_testable", ("speed",))


@pytest.mark.slow
def test_without_ones_own_effect_its_place_and_quantity_are_named(rv_m2):
    best = []
    for seed in range(4):
        # what varies of it leaves 1.3 times the noise once, which other effects may take up; 2.6 times they may not
        left = diagnose(with_sag(rv_m2, seed, times=2.0)).unexplained
        best.append(left.flagged and left.depends_on[0].covariate == "speed")
    assert sum(best) >= 3


@pytest.mark.parametrize(
    ("wrong", "near"),
    [("joint_ofset", "joint_offset"), ("Geometric", "geometric"), ("thermal_elong", "thermal_elongation")],
)
def test_a_name_that_no_effect_has_is_answered_with_near_ones(wrong, near):
    for given in ({"only": [wrong]}, {"without": ["drift", wrong]}):
        with pytest.raises(EffectError, match=f"{wrong!r}; did you mean {near!r}"):
            choose(**given)


def test_a_name_like_no_other_is_answered_with_all():
    with pytest.raises(EffectError) as refused:
        choose(["#"])
    assert all(name in str(refused.value) for name in library())


def test_what_is_no_effect_of_ones_own_is_refused():
    assert [e.name for e in choose(own=[JointSag()])] == [*library(), "joint_sag"]
    assert [e.name for e in choose("joint_sag", own=[JointSag()])] == ["joint_sag"]
    assert [e.name for e in choose(without=list(library()), own=[JointSag()])] == ["joint_sag"]
    for wrong in ([JointSag], [3], [JointSag(), JointSag()], [JointOffset()]):
        with pytest.raises(EffectError, match="effect"):
            choose(own=wrong)


def installed(monkeypatch, name, thing):
    def load():
        if isinstance(thing, Exception):
            raise thing
        return thing

    point = SimpleNamespace(name=name, value=f"their.package:{name}", load=load)
    points = {"thermal_robot.effects": [point]}
    monkeypatch.setattr(catalogue, "entry_points", lambda group: points[group])


@pytest.mark.parametrize("thing", [JointSag, JointSag()], ids=["class", "instance"])
def test_an_installed_effect_stands_in_the_library_and_is_diagnosed(rv_m2, monkeypatch, thing):
    installed(monkeypatch, "sag", thing)
    assert [e.name for e in choose(["joint_sag"])] == ["joint_sag"]
    found = diagnose(with_sag(rv_m2, 0), only=["joint_sag"])
    assert found.verdict == ("joint_sag",)
    assert {f.name for f in found.effects} == {"joint_sag"}


class Unfinished(JointSag):
    """Raises where it is made."""

    name = "unfinished"

    def __init__(self):
        raise ValueError("no licence")


BROKEN = {
    "a dict": (dict, "not an effect"),
    "a number": (3, "not an effect"),
    "nothing": (None, "not an effect"),
    "a name that is taken": (JointOffset, "two effects named 'joint_offset'"),
    "the name of a random effect": (type("Wear", (JointSag,), {"name": "excess_repeatability"}), "two effects named"),
    "a random effect": (type("Shaking", (JointSag,), {"name": "shaking", "random": True}), "'shaking' is random"),
    "no name": (type("Nameless", (JointSag,), {"name": ""}), "not an effect with a name"),
    "a name that is no text": (type("Numbered", (JointSag,), {"name": 7}), "not an effect with a name"),
    "a module that is gone": (ModuleNotFoundError("No module named 'theirs'"), "No module named 'theirs'"),
    "an exit": (AttributeError("module has no attribute 'Sag'"), "AttributeError"),
    "a class that cannot be made": (Unfinished, "no licence"),
}


@pytest.mark.parametrize("case", BROKEN)
def test_a_broken_entry_point_warns_by_name_and_is_left_out(monkeypatch, case):
    thing, words = BROKEN[case]
    sound = library()
    installed(monkeypatch, "theirs", thing)
    with pytest.warns(UserWarning, match=rf"entry point 'theirs' \(their.package:theirs\) is left out: .*{words}"):
        assert library() == sound


def test_a_broken_entry_point_does_not_stop_a_diagnosis(rv_m2, monkeypatch):
    installed(monkeypatch, "theirs", ImportError("their package is broken"))
    with pytest.warns(UserWarning, match="their package is broken"):
        found = diagnose(simulate(rv_m2, ["joint_gain"], samples=60, seed=1, ratio=(5.0, 6.0))[0], only=["joint_gain"])
    assert found.verdict == ("joint_gain",)


def test_the_library_holds_what_is_fitted_and_beside_it_stands_what_scatters():
    assert not any(effect.random for effect in library().values())
    assert all(effect.random for effect in random_effects())
    assert tuple(effect.name for effect in random_effects()) == RANDOM
    assert not set(RANDOM) & set(library())
    assert all(name == effect.name for name, effect in library().items())


def test_random_effects_may_be_asked_for_and_are_not_fitted():
    assert [e.name for e in choose(["drift", *RANDOM])] == ["drift"]
    assert [e.name for e in choose(without=RANDOM)] == list(library())
    with pytest.raises(EffectError, match="no effect is left"):
        choose(RANDOM)


def test_choosing_keeps_the_order_of_the_library():
    assert [e.name for e in choose()] == list(library())
    assert [e.name for e in choose("drift")] == ["drift"]
    assert {e.name for e in choose(["drift", "geometric"])} == {"drift", "geometric"}
    assert {e.name for e in choose(without=["drift"])} == set(library()) - {"drift"}
    with pytest.raises(EffectError, match="no effect is left"):
        choose(["drift"], ["drift"])


def test_an_effect_is_found_by_its_name_one_that_scatters_too():
    everything = {**library(), **{effect.name: effect for effect in random_effects()}}
    assert {name: named(name) for name in everything} == everything
    with pytest.raises(EffectError, match="no effect is named 'joint_ofset'; did you mean 'joint_offset'"):
        named("joint_ofset")
    with pytest.raises(EffectError, match=r"no effect is named 'quux'; there are .*encoder_resolution"):
        named("quux")


def test_an_answer_is_looked_up_by_its_effect():
    said = {"drift": 1, "backlash": 2}
    assert of_effect(said, "backlash") == 2
    for error in (EffectError, KeyError):  # both kinds of user find it
        with pytest.raises(error, match=r"^no effect named 'drft' was considered; did you mean 'drift'\?$"):
            of_effect(said, "drft")
    with pytest.raises(KeyError, match=r"^no effect named 'xyz' was considered; there are backlash, drift$"):
        of_effect(said, "xyz")
    with pytest.raises(KeyError, match=r"there are none$"):
        of_effect({}, "drift")
