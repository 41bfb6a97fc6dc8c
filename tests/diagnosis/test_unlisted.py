"""Causes that no effect describes: found with place, quantity and shape, kept in the model, written as a file."""

import importlib.util
import json
from dataclasses import replace
from functools import cache

import jsonschema
import numpy as np
import pytest
from helpers import NOISE, disturbed, erring, with_law
from simulate import simulate

from thermal_robot import CorrectedModel, diagnose
from thermal_robot.diagnosis.prune import attributed_to_laws, forward_selection
from thermal_robot.diagnosis.residual_tests import analyse_residual
from thermal_robot.diagnosis.values import Dependence, Location, Unexplained
from thermal_robot.effects import choose
from thermal_robot.effects.apply import displacement
from thermal_robot.effects.law import Discovered
from thermal_robot.effects.quantities import quantities
from thermal_robot.inference import settings
from thermal_robot.inference.explain import Discrepancy
from thermal_robot.inference.fit import fit
from thermal_robot.inference.generate import Discovery, discovered
from thermal_robot.inference.kernels import Kernel
from thermal_robot.inference.scatter import random_gap
from thermal_robot.kinematics import Displacement
from thermal_robot.observations import Frames, observe
from thermal_robot.report import schema

CASES = {
    "step": (Discovered(kind="joint", place="joint_3", quantity="time", shape="step", marks=(3600.0,)), [0.0, 5e-4]),
    "hinge": (
        Discovered(kind="joint", place="joint_2", quantity="joint_3", shape="hinge", marks=(-1.0, 1.0), span=2.0),
        [0.0, 4e-3],
    ),
    "ramp": (
        Discovered(kind="base", place="base", quantity="speed", shape="ramp", span=1.0),
        [0.0] * 6 + [3e-4, 0, 0, 0, 4e-4, 0],
    ),
    "bump": (
        Discovered(kind="joint", place="joint_3", quantity="joint_3", shape="bump", marks=(-1.2, 0.15)),
        [0.0, 3e-3],
    ),
}

FIRST = ("ramp",)
"""Of every commit."""


@pytest.fixture(scope="module")
def found(rv_m2):
    @cache
    def found(name):
        law, values = CASES[name]
        data, fresh, true = with_law(rv_m2, law, values, seed=3)
        return law, values, diagnose(data), fresh, true

    return found


@pytest.mark.parametrize("name", [*FIRST, *(pytest.param(n, marks=pytest.mark.slow) for n in CASES if n not in FIRST)])
def test_a_law_is_named_with_its_place_and_predicts_to_less_than_the_noise(found, name, tmp_path):
    # place and quantity are named and nobody is blamed
    law, _, diagnosis, fresh, true = found(name)
    assert diagnosis.unexplained.flagged
    assert diagnosis.verdict[0].startswith("discovered.")
    finding = diagnosis.finding(diagnosis.verdict[0])
    assert (finding.locations[0].kind, finding.locations[0].name) == (law.kind, law.place)
    assert finding.quantity == law.quantity
    assert law.quantity in finding.describes
    assert (diagnosis.unexplained.locations[0].name, diagnosis.unexplained.depends_on[0].covariate) == (
        law.place,
        law.quantity,
    )
    assert all(name.startswith("discovered.") for name in diagnosis.verdict)
    # a step of the clock is an event: its headline names the rows, its description the time, too
    assert ("in rows" if name == "step" else law.quantity) in diagnosis.summary
    # the corrected model predicts to less than the noise
    diagnosis.model.save(tmp_path / "model.json")
    for model in (diagnosis.model, CorrectedModel.load(tmp_path / "model.json")):
        left = model.prediction(fresh)[0] - true
        assert np.sqrt((left**2).mean()) < NOISE
    jsonschema.validate(json.loads(json.dumps(diagnosis.to_dict())), schema())


@pytest.mark.slow
def test_the_time_and_height_of_a_step_are_read_off(found):
    _, values, diagnosis, _, _ = found("step")
    law = next(effect for effect, _ in diagnosis.model.effects if isinstance(effect, Discovered))
    assert law.shape in ("step", "slide")
    clock = diagnosis.rows.covariates["time"]
    between = np.sort(clock)[[np.searchsorted(np.sort(clock), 3600.0) - 2, np.searchsorted(np.sort(clock), 3600.0) + 1]]
    assert between[0] <= law.marks[0] <= between[1]
    before, after = diagnosis.finding(diagnosis.verdict[0]).parameters
    error = np.hypot(before.std, after.std)
    assert abs((after.value - before.value) - (values[1] - values[0])) < 4.0 * error
    assert error < 0.1 * values[1]


def test_a_law_becomes_an_effect_file_that_does_the_same_and_needs_its_column(found, tmp_path):
    _, _, diagnosis, fresh, _ = found("ramp")
    law, values = next((e, v) for e, v in diagnosis.model.effects if isinstance(e, Discovered))
    (tmp_path / "base_creep.py").write_text(law.to_source(values, "base_creep"))
    spec = importlib.util.spec_from_file_location("base_creep", tmp_path / "base_creep.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    named = module.BaseCreep()
    assert named.name == "base_creep"
    here = observe(fresh, diagnosis.model.frames)
    own, again = (displacement(here, [(e, values)])[0].base for e in (law, named))
    assert np.abs(own).max() > 0.0
    np.testing.assert_array_equal(own, again)
    # a law of a column that is missing cannot be predicted
    assert "speed" in diagnosis.model.needs
    with pytest.raises(Exception, match="speed"):
        diagnosis.model.predict(fresh.drop_covariate("speed"))


def beside_play(robot, seed):
    """The verdict where a step in time works beside play of a joint."""
    law, values = CASES["step"]
    data = simulate(robot, ["backlash"], seed=seed, samples=120, noise=NOISE, places=["joint_2"])[0]
    return diagnose(disturbed(data, [(law, np.array(values))])).verdict


@pytest.mark.slow
def test_with_a_known_effect_beside_it_both_are_named(rv_m2):
    verdicts = [beside_play(rv_m2, seed) for seed in range(4)]
    assert sum("backlash" in v and len(v) == 2 and any(n.startswith("discovered.") for n in v) for v in verdicts) >= 3


@pytest.mark.slow
def test_a_noise_that_is_not_stated_does_not_explain_a_remainder(rv_m2):
    """Without it the variance of anything would pass as noise."""
    data = replace(simulate(rv_m2, ["drift"], seed=4, ratio=(8.0, 9.0))[0], noise_position=None)
    left = fit(data, choose((), ("drift", "thermal_elongation", "thermal_bending", "instrument_scale"), ()))
    assert not random_gap(left).explains_size
    found = diagnose(data, without=["drift"])
    assert found.unexplained.flagged
    assert all(f.probability < 0.9 for f in found.effects if f.name in found.verdict and not f.describes)
    assert found.finding("discovered.1").locations[0].kind == "base"


@pytest.mark.slow
@pytest.mark.parametrize("ratio", [101.0, 51.0])
def test_a_wheel_on_the_motor_is_found_where_its_effect_is_not_in_the_library(rv_m2, ratio):
    law = Discovered(kind="joint", place="joint_2", quantity="joint_2", shape="harmonic", marks=(ratio,))
    data, fresh, true = with_law(rv_m2, law, [0.0, 3e-4, 2e-4], seed=7)
    found = diagnose(replace(data, gears={"joint_2": ratio}), without=["transmission_error", "joint_ripple"])
    (own,) = [f for f in found.effects if f.describes]
    assert (own.locations[0].name, own.quantity, own.shape) == ("joint_2", "joint_2", "harmonic")
    assert f"of order {ratio:g}" in own.describes
    amplitude = np.hypot(*[p.value for p in own.parameters if p.name.startswith(("sine", "cosine"))])
    assert amplitude == pytest.approx(np.hypot(3e-4, 2e-4), rel=0.1)
    # beyond the range that was measured a wave is no longer claimed
    inside = (fresh.q[:, 1] > data.q[:, 1].min()) & (fresh.q[:, 1] < data.q[:, 1].max())
    assert 0.9 < inside.mean() < 1.0
    assert np.abs(found.model.prediction(fresh)[0] - true)[inside].max() < 25e-6


def test_what_a_law_follows_does_not_depend_on_the_law(rv_m2):
    """Gravity and reach are those of the command: else a law would be evaluated elsewhere than it was fitted."""
    data = simulate(rv_m2, samples=30, seed=2)[0]
    moved = Displacement(joint=np.full((30, rv_m2.n), 0.05))
    plain, bent = observe(data, Frames.declared(data)), observe(data, Frames.declared(data), displacement=moved)
    assert np.abs(plain.position - bent.position).max() > 1e-3
    for name, values in quantities(plain).items():
        np.testing.assert_array_equal(quantities(bent)[name], values, err_msg=name)


@pytest.mark.slow
def test_one_eccentric_wheel_is_no_unlisted_cause(rv_m2):
    """Nothing is left of it; over part of a turn a law of few numbers, a parabola, is nearly as good."""
    names = []
    for seed in range(8):
        plain = simulate(rv_m2, samples=130, seed=seed, noise=NOISE)[0]
        q, error = plain.q[:, 1], np.zeros_like(plain.q)
        error[:, 1] = 3e-3 * np.cos(q) - 1.4e-3 * np.sin(q) - 7e-4 * np.cos(2 * q) - 2e-4 * np.sin(2 * q)
        found, true = diagnose(erring(plain, seed, joint=error)), erring(plain, seed, 0.0, joint=error).position
        assert not found.unexplained.flagged
        assert np.sqrt(((found.model.prediction(plain)[0] - true) ** 2).mean()) < 0.5 * NOISE
        names.append(found.verdict)
    # where the parabola is lost in the noise a zero and a gain say the same with fewer numbers
    assert names.count(("transmission_error",)) >= 6, names


def test_a_law_joins_the_fit_and_takes_its_remainder(rv_m2):
    law, values = CASES["step"]
    known = fit(with_law(rv_m2, law, values, seed=3)[0], choose(("joint_offset",), (), ()))
    before = analyse_residual(known).unexplained
    assert before.flagged
    stages = []
    after = forward_selection(known, 2, stages.append)
    assert stages[0] == "causes that nobody listed: scan 2"
    (own,) = [effect for effect, _ in after.effects if isinstance(effect, Discovered)]
    assert (own.name, own.place, own.quantity) == ("discovered.2", law.place, law.quantity)
    assert "discovered.2" in after.families
    assert not analyse_residual(after).unexplained.flagged
    said = attributed_to_laws(before, discovered(after), after.explanation.discrepancy)
    assert (said.rms, said.p_value, said.reasons) == (before.rms, before.p_value, before.reasons)
    assert (said.locations[0].kind, said.locations[0].name) == (law.kind, law.place)
    assert [d.covariate for d in said.depends_on] == [law.quantity]
    assert all(0.0 <= d.p_value <= 1.0 for d in said.depends_on)
    assert all(settings.LIKELY_PLACE <= place.share <= 1.0 for place in said.locations)


@pytest.mark.slow
def test_a_second_law_is_looked_for_beside_the_first(rv_m2):
    """A step in one joint and a hinge in another: after one of them the other is worth its place."""
    (first, one), (second, two) = CASES["step"], CASES["hinge"]
    data = disturbed(with_law(rv_m2, first, one, seed=5)[0], [(second, np.array(two))])
    known = fit(data, choose(("joint_offset",), (), ()))
    alone = forward_selection(known, 1, lambda _: None)
    both = forward_selection(alone, 2, lambda _: None)
    laws = {effect.name: effect.place for effect, _ in both.effects if isinstance(effect, Discovered)}
    assert set(laws) == {"discovered.1", "discovered.2"}
    assert set(laws.values()) == {first.place, second.place}


NONE = Discrepancy(None, 0.0, 0.0, {})


def a_discovery(place, quantity, probability, places=None):
    law = Discovered("discovered.1", "joint", place, quantity, "ramp", (), 1.0)
    return Discovery(
        law, probability, places or ((("joint", place), probability),), ((quantity, probability), ("time", 0.0))
    )


def test_laws_say_where_the_remainder_enters_and_what_it_follows():
    left = Unexplained(True, 2e-4, 1e-9, ("it is large",))
    likely, unlikely = settings.LIKELY_PLACE + 0.01, settings.LIKELY_PLACE - 0.01
    places = ((("joint", "elbow"), 1.0 + 1e-12), (("base", "base"), likely), (("tool", "tool"), unlikely))
    found = (a_discovery("elbow", "payload", 0.9, places), a_discovery("wrist", "speed", 0.8))
    said = attributed_to_laws(left, found, NONE)
    assert [(p.kind, p.name) for p in said.locations] == [("joint", "elbow"), ("base", "base"), ("joint", "wrist")]
    assert max(p.share for p in said.locations) == 1.0
    assert [d.covariate for d in said.depends_on] == ["payload", "speed"]
    np.testing.assert_allclose([d.p_value for d in said.depends_on], [0.1, 0.2])
    # rounding may lift a probability above one; a law describes, it does not say why, however little is left
    small = attributed_to_laws(Unexplained(False, 0.0, 0.4), (a_discovery("elbow", "payload", 1.0 + 1e-12),), NONE)
    assert small.flagged
    assert [d.p_value for d in small.depends_on] == [0.0]


def beside(anew, place):
    """A discrepancy of one form that has three quarters of the probability."""
    kernel = Kernel("poses, elbow", np.zeros((0, 0)), np.zeros((3, 0)), anew, place)
    return Discrepancy(kernel, 4.0, 0.9, {kernel.name: 0.75})


def test_what_errs_anew_in_every_pose_has_a_place_and_follows_nothing():
    left = Unexplained(True, 1e-4, 1e-6, (), (Location("base", "base", 1.0),), (Dependence("time", 1e-6),))
    said = attributed_to_laws(left, (), beside(True, ("joint", "elbow")))
    assert said.locations == (Location("joint", "elbow", 0.75),)
    assert said.depends_on == ()
    assert (said.rms, said.p_value) == (left.rms, left.p_value)
    # what is smooth or anywhere has the place that the tests found; where nothing is left there is no place
    nothing = Unexplained(False, 0.0, 0.4)
    assert attributed_to_laws(left, (), beside(False, ("joint", "elbow"))) is left
    assert attributed_to_laws(left, (), beside(True, ("", ""))) is left
    assert attributed_to_laws(left, (), NONE) is left
    assert attributed_to_laws(nothing, (), beside(True, ("joint", "elbow"))) is nothing
