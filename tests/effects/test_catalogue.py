"""The library, effects of one's own beside it, what packages install, and names that no effect has."""

import json
from dataclasses import dataclass, replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from conftest import load_arm
from helpers import some
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


SAG, NOISE = np.array([0.0, 3e-4, -2e-4, 0.0, 0.0]), 25e-6


@cache
def with_sag(seed, times=1.0, samples=120):
    """A campaign of a sagging robot, measured in the root frame by an instrument that was not told so."""
    plain = simulate(load_arm("rv_m2"), samples=samples, seed=seed, noise=NOISE)[0]
    rng = np.random.default_rng(seed)
    plain = replace(plain, covariates={**plain.covariates, "speed": rng.uniform(0.1, 1.0, samples)})
    nominal = observe(plain, Frames.declared(plain))
    change, _ = displacement(nominal, [(JointSag(), times * SAG)])
    real = observe(plain, Frames.declared(plain), displacement=change)
    return replace(plain, position=real.predicted_position + NOISE * rng.normal(size=(samples, 3)))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_an_effect_of_ones_own_is_found_with_its_values_and_its_model_needs_its_covariate(rv_m2, seed):
    data = with_sag(seed)
    found = diagnose(data, effects=[JointSag()])
    assert (found.verdict, found.unexplained.flagged) == (("joint_sag",), False)
    sag = {p.name: p for p in found.finding("joint_sag").parameters}
    assert {p.name for p in found.finding("joint_sag").locations[:2]} == {"joint_2", "joint_3"}
    for joint, true in zip(rv_m2.joint_names, SAG, strict=True):
        if not true and f"sag, {joint}" not in sag:  # it stands in some joints alone
            continue
        estimate = sag[f"sag, {joint}"]
        assert estimate.unit == "rad"
        assert estimate.identified or true == 0.0
        assert not estimate.identified or abs(estimate.value - true) < 4.0 * estimate.std
    plain = json.loads(json.dumps(found.to_dict()))
    assert plain["verdict"]["effects"] == ["joint_sag"]
    assert (plain["effects"][0]["name"], plain["effects"][0]["status"]) == ("joint_sag", "found")
    assert found.model.needs == ("speed",)
    assert np.sqrt(((found.model.prediction(data)[0] - data.position) ** 2).mean()) < 1.1 * NOISE
    bare = data.drop_covariate("speed")
    with pytest.raises(CampaignError) as refused:
        found.model.predict(bare)
    assert refused.value.column == "speed"
    finding = diagnose(bare, effects=[JointSag()], only=["joint_sag"]).finding("joint_sag")
    assert (finding.status, finding.needs) == ("not_testable", ("speed",))


@pytest.mark.slow
def test_without_ones_own_effect_its_place_and_quantity_are_named():
    best = []
    for seed in range(4):
        # what varies of it leaves 1.3 times the noise once, which other effects may take up; 2.6 times they may not
        left = diagnose(with_sag(seed, times=2.0)).unexplained
        best.append(left.flagged and left.depends_on[0].covariate == "speed")
    assert sum(best) >= 3


@pytest.mark.parametrize(
    ("wrong", "near"),
    [("joint_ofset", "joint_offset"), ("Geometric", "geometric"), ("thermal_elong", "thermal_elongation")],
)
def test_a_name_that_no_effect_has_is_answered_with_near_ones_or_with_all(wrong, near):
    for given in ({"only": [wrong]}, {"without": ["drift", wrong]}):
        with pytest.raises(EffectError, match=f"{wrong!r}; did you mean {near!r}"):
            choose(**given)
    with pytest.raises(EffectError, match=f"no effect is named {wrong!r}; did you mean {near!r}"):
        named(wrong)
    for ask in (lambda: choose(["#"]), lambda: named("#")):
        with pytest.raises(EffectError) as refused:
            ask()
        assert all(name in str(refused.value) for name in (*library(), *RANDOM))


def names(*args, **kwargs):
    return [effect.name for effect in choose(*args, **kwargs)]


def test_the_library_holds_what_is_fitted_and_choosing_keeps_its_order():
    scatter = {effect.name: effect for effect in random_effects()}
    every = list(library())
    assert tuple(scatter) == RANDOM
    assert not set(RANDOM) & set(every)
    assert not any(effect.random for effect in library().values())
    assert all(name == effect.name for name, effect in library().items())
    assert {name: named(name) for name in (*every, *RANDOM)} == {**library(), **scatter}
    assert names() == names(without=RANDOM) == every
    assert names("drift") == names(["drift", *RANDOM]) == ["drift"]
    assert names(["drift", "geometric"]) == ["geometric", "drift"]
    assert set(names(without=["drift"])) == set(every) - {"drift"}
    assert names(own=[JointSag()]) == [*every, "joint_sag"]
    assert names("joint_sag", own=[JointSag()]) == names(without=every, own=[JointSag()]) == ["joint_sag"]
    for nothing in ((["drift"], ["drift"]), (RANDOM,)):
        with pytest.raises(EffectError, match="no effect is left"):
            choose(*nothing)
    for wrong in ([JointSag], [3], [JointSag(), JointSag()], [JointOffset()]):
        with pytest.raises(EffectError, match="effect"):
            choose(own=wrong)


def installed(monkeypatch, name, thing):
    def load():
        if isinstance(thing, Exception):
            raise thing
        return thing

    point = SimpleNamespace(name=name, value=f"their.package:{name}", load=load)
    monkeypatch.setattr(catalogue, "_installed", catalogue._installed.__wrapped__)
    monkeypatch.setattr(catalogue, "entry_points", lambda group: {"thermal_robot.effects": [point]}[group])


@pytest.mark.parametrize(
    "thing", [JointSag, pytest.param(JointSag(), marks=pytest.mark.slow)], ids=["class", "instance"]
)
def test_an_installed_effect_stands_in_the_library_and_is_diagnosed(monkeypatch, thing):
    installed(monkeypatch, "sag", thing)
    assert names(["joint_sag"]) == ["joint_sag"]
    assert type(named("joint_sag")) is JointSag
    if thing is JointSag:
        found = diagnose(with_sag(0), only=["joint_sag"])
        assert found.verdict == tuple(f.name for f in found.effects) == ("joint_sag",)


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


@pytest.mark.parametrize("case", some(BROKEN, 4))
def test_a_broken_entry_point_warns_by_name_and_is_left_out(rv_m2, monkeypatch, case):
    thing, words = BROKEN[case]
    sound, data = library(), simulate(rv_m2, ["joint_gain"], samples=60, seed=1, ratio=(5.0, 6.0))[0]
    installed(monkeypatch, "theirs", thing)
    with pytest.warns(UserWarning, match=rf"entry point 'theirs' \(their.package:theirs\) is left out: .*{words}"):
        assert library() == sound
    if case == "an exit":  # it does not stop a diagnosis
        with pytest.warns(UserWarning, match=words):
            assert diagnose(data, only=["joint_gain"]).verdict == ("joint_gain",)


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
