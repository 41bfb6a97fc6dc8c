"""Causes that no effect describes: found with place, quantity and shape, kept in the model, written as a file."""

import importlib.util
import json
from dataclasses import replace

import jsonschema
import numpy as np
import pytest
from helpers import NOISE, with_law
from simulate import simulate

from thermal_robot import CorrectedModel, diagnose
from thermal_robot.effects.apply import displacement
from thermal_robot.effects.law import Discovered
from thermal_robot.effects.quantities import GRAVITY, quantities
from thermal_robot.inference.frames import register
from thermal_robot.observations import observe
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


@pytest.fixture(scope="module")
def found(rv_m2):
    cases = {}
    for name, (law, values) in CASES.items():
        data, fresh, true = with_law(rv_m2, law, values, seed=3)
        cases[name] = (law, values, diagnose(data), fresh, true)
    return cases


@pytest.mark.parametrize("name", CASES)
def test_place_and_quantity_are_named_and_nobody_is_blamed(found, name):
    law, _, diagnosis, _, _ = found[name]
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
    assert law.quantity in diagnosis.summary


@pytest.mark.parametrize("name", CASES)
def test_the_corrected_model_predicts_to_less_than_the_noise(found, name, tmp_path):
    _, _, diagnosis, fresh, true = found[name]
    diagnosis.model.save(tmp_path / "model.json")
    for model in (diagnosis.model, CorrectedModel.load(tmp_path / "model.json")):
        left = model.predict(fresh)[0] - true
        assert np.sqrt((left**2).mean()) < NOISE
    jsonschema.validate(json.loads(json.dumps(diagnosis.to_dict())), schema())


def test_a_steps_time_and_height_are_read_off(found):
    _, values, diagnosis, _, _ = found["step"]
    law = next(effect for effect, _ in diagnosis.model.effects if isinstance(effect, Discovered))
    assert law.shape in ("step", "slide")
    clock = diagnosis.rows.covariates["time"]
    between = np.sort(clock)[[np.searchsorted(np.sort(clock), 3600.0) - 2, np.searchsorted(np.sort(clock), 3600.0) + 1]]
    assert between[0] <= law.marks[0] <= between[1]
    before, after = diagnosis.finding(diagnosis.verdict[0]).parameters
    error = np.hypot(before.std, after.std)
    assert abs((after.value - before.value) - (values[1] - values[0])) < 4.0 * error
    assert error < 0.1 * values[1]


def test_a_law_becomes_an_effect_file_that_does_the_same(found, tmp_path, rv_m2):
    _, _, diagnosis, fresh, _ = found["hinge"]
    law, values = next((e, v) for e, v in diagnosis.model.effects if isinstance(e, Discovered))
    (tmp_path / "elbow_cable.py").write_text(law.to_source(values, "elbow_cable"))
    spec = importlib.util.spec_from_file_location("elbow_cable", tmp_path / "elbow_cable.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    named = module.ElbowCable()
    assert named.name == "elbow_cable"
    here = observe(fresh, diagnosis.model.frames)
    own, again = (displacement(here, [(e, values)])[0].joint for e in (law, named))
    np.testing.assert_array_equal(own, again)


def test_with_a_known_effect_beside_it_both_are_named(rv_m2):
    law, values = CASES["step"]
    hits = 0
    for seed in range(4):
        data = simulate(rv_m2, ["backlash"], seed=seed, samples=120, noise=NOISE, places=["joint_2"])[0]
        here = observe(data, register(data))
        moved, _ = displacement(here, [(law, np.array(values))])
        shift = observe(data, here.frames, displacement=moved).predicted_position - here.predicted_position
        names = diagnose(replace(data, position=data.position + shift)).verdict
        hits += "backlash" in names and any(n.startswith("discovered.") for n in names) and len(names) == 2
    assert hits >= 3


@pytest.mark.parametrize("arm", ["rv_m2", "ur10"], indirect=True)
def test_in_noise_nothing_is_discovered(arm):
    for seed in range(8):
        verdict = diagnose(simulate(arm, seed=seed, noise=NOISE)[0]).verdict
        assert not any(name.startswith("discovered.") for name in verdict)


def test_gravity_in_the_tool_is_a_quantity_of_length_one(rv_m2):
    data = simulate(rv_m2, seed=1)[0]
    known = quantities(observe(data, register(data)))
    down = np.column_stack([known[name] for name in GRAVITY if name in known])
    assert np.all(np.linalg.norm(down, axis=1) <= 1.0 + 1e-12)
    assert {"time", "temperature", "joint_1", "approach.joint_1", "reach.x"} <= set(known)


def test_a_law_of_a_column_that_is_missing_cannot_be_predicted(found):
    _, _, diagnosis, fresh, _ = found["ramp"]
    assert "speed" in diagnosis.model.needs
    with pytest.raises(Exception, match="speed"):
        diagnosis.model.predict(fresh.drop_covariate("speed"))
