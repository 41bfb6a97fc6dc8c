"""The schema accepts every diagnosis and rejects what breaks the contract."""

import copy
import json

import jsonschema
import pytest
from report.cases import case

import thermal_robot as tr
from thermal_robot.report import schema


@pytest.fixture(scope="module")
def validator():
    return jsonschema.Draft202012Validator(schema())


def test_the_schema_is_a_schema_and_the_callers_own():
    jsonschema.Draft202012Validator.check_schema(schema())
    assert schema()["$schema"].endswith("2020-12/schema")
    schema()["properties"].clear()
    assert schema()["properties"]


def test_every_diagnosis_is_valid(validator, diagnosis):
    validator.validate(json.loads(json.dumps(diagnosis.to_dict())))


def test_a_law_has_a_shape_and_an_effect_of_the_library_none(validator):
    plain = json.loads(json.dumps(case("law").to_dict()))
    validator.validate(plain)
    effect, law = plain["effects"][:2]
    assert (law["name"], law["quantity"], law["shape"]) == ("discovered.1", "time", "step")
    assert not validator.is_valid({**plain, "effects": [effect, {k: v for k, v in law.items() if k != "shape"}]})
    assert not validator.is_valid({**plain, "effects": [{**effect, "shape": "step"}, law]})
    validator.validate({**plain, "effects": [effect, {**law, "of": "backlash"}]})
    assert not validator.is_valid({**plain, "effects": [{**effect, "of": "backlash"}, law]})
    bare = copy.deepcopy(plain)
    optional = {
        "gap": ("noise_source", "schemes", "hardest"), "campaign": ("name", "warnings"), "where": ("beyond",),
        "unexplained": ("reasons",), "verdict": ("left_out", "if_prior_sizes"),
    }  # fmt: skip
    known = ("unseen", "describes", "size", "usually", "title", "random")
    for part, names in [(bare[name], names) for name, names in optional.items()] + [
        (e, known) for e in bare["effects"]
    ]:
        for name in names:
            part.pop(name, None)
    bare["gap"]["held_out"].update(rms_before_with_aside=1.5e-4, rms_after_with_aside=None)
    validator.validate(bare)


BREAKAGES = {
    "another format": lambda d: d.update(schema="thermal-robot/diagnosis/1"),
    "an unknown key": lambda d: d.update(extra=1),
    "no effects": lambda d: d.pop("effects"),
    "an unknown measurement": lambda d: d["campaign"].update(measures="positions"),
    "a row that is no number": lambda d: d["campaign"].update(outliers=["17"]),
    "a row twice": lambda d: d["campaign"].update(outliers=[17, 17]),
    "no sample": lambda d: d["campaign"].update(samples=0),
    "a negative gap": lambda d: d["gap"].update(rms_before=-1e-4),
    "a gap that is not a number": lambda d: d["gap"].update(rms_after=None),
    "an orientation that was not measured": lambda d: d["gap"].update(orientation={"rms_before": 0.1, "rms_after": 0}),
    "an orientation that is missing": lambda d: d["campaign"].update(measures="pose"),
    "no word on orientation": lambda d: d["gap"].pop("orientation"),
    "a negative gap with rows set aside": lambda d: d["gap"]["held_out"].update(rms_after_with_aside=-1e-4),
    "no held-out interval": lambda d: d["gap"]["held_out"].pop("shrinkage_ci95"),
    "an interval of three": lambda d: d["gap"]["held_out"].update(shrinkage_ci95=[0.1, 0.2, 0.3]),
    "a shrinkage above one": lambda d: d["gap"]["held_out"].update(shrinkage=1.2),
    "a probability above one": lambda d: d["verdict"].update(probability=98.0),
    "a verdict that is a word": lambda d: d["verdict"].update(effects="drift"),
    "no sentence": lambda d: d["verdict"].update(summary=""),
    "an unknown status": lambda d: d["effects"][0].update(status="maybe"),
    "a found effect without probability": lambda d: d["effects"][0].update(probability=None),
    "a found effect without shrinkage": lambda d: d["effects"][0].update(shrinkage=None),
    "a found effect that needs something": lambda d: d["effects"][0].update(needs=["time"]),
    "a found effect without interval": lambda d: d["effects"][0].update(shrinkage_ci95=None),
    "an effect's interval of one": lambda d: d["effects"][0].update(shrinkage_ci95=[0.9]),
    "a share above one": lambda d: d["effects"][0]["locations"][0].update(share=1.5),
    "an unknown kind of place": lambda d: d["effects"][0]["locations"][0].update(kind="gearbox"),
    "an undetermined number": lambda d: d["effects"][0]["parameters"][2].update(value=1e-5),
    "an undetermined deviation": lambda d: d["effects"][0]["parameters"][2].update(std=1e-5),
    "a determined nothing": lambda d: d["effects"][0]["parameters"][0].update(value=None),
    "a parameter without unit": lambda d: d["effects"][0]["parameters"][0].pop("unit"),
    "an untested effect with a probability": lambda d: d["effects"][-1].update(probability=0.5),
    "an untested effect with a shrinkage": lambda d: d["effects"][-1].update(shrinkage=0.0),
    "an untested effect that needs nothing": lambda d: d["effects"][-1].update(needs=[]),
    "confounded with nothing": lambda d: d["effects"][1].update(status="confounded"),
    "a law without quantity": lambda d: d["effects"][0].update(name="discovered.1", shape="step"),
    "a fourth axis": lambda d: d["where"]["axes"].update(w=0.1),
    "a negative share": lambda d: d["where"]["links"].update(hand=-0.1),
    "a place without probability": lambda d: d["unexplained"].update(locations=[{"kind": "joint", "name": "a"}]),
    "a p-value above one": lambda d: d["unexplained"].update(p_value=2),
    "a group of none": lambda d: d["next"].update(separates=[[]]),
    "a noise of unknown source": lambda d: d["gap"].update(noise_source="guessed"),
    "a sample with a joint that is no number": lambda d: d["next"]["samples"][0]["joints"].update(joint_1="far"),
    "a sample without conditions": lambda d: d["next"]["samples"][0].pop("conditions"),
    "a sample for words": lambda d: d["next"]["samples"][0].update(separates=["drift"]),
    "a sample without gain": lambda d: d["next"]["samples"][0].pop("gain"),
    "a sample with an unknown key": lambda d: d["next"]["samples"][0].update(cost=1.0),
}
SAMPLE = {"joints": {"joint_1": 0.3}, "conditions": {"payload": 1.0}, "separates": [["drift"], []], "gain": 0.7}


@pytest.mark.parametrize("breakage", list(BREAKAGES))
def test_what_breaks_the_contract_is_rejected(validator, breakage):
    plain = case("found").to_dict()
    plain["next"]["samples"] = [SAMPLE]
    broken = copy.deepcopy(plain)
    BREAKAGES[breakage](broken)
    assert validator.is_valid(plain)
    assert not validator.is_valid(broken)


def test_held_out_shares_may_be_negative(validator):
    plain = case("found").to_dict()
    plain["gap"]["held_out"].update(shrinkage=-0.4, shrinkage_ci95=[-0.9, 0.1])
    plain["effects"][0].update(shrinkage=1.05, shrinkage_ci95=[0.9, 1.2])  # what another loses, this one gains
    plain["effects"][1].update(shrinkage=-2.0, shrinkage_ci95=[-3.0, -1.0])
    validator.validate(plain)


def keys(plain):
    """Names of all keys, wherever they stand, as paths without the numbers of lists."""
    if isinstance(plain, dict):
        return {(k, *rest) for k, v in plain.items() for rest in ((), *keys(v))}
    return set().union(*map(keys, plain)) if isinstance(plain, list) else set()


def declared(whole, part):
    """Paths of all properties that a schema declares."""
    part = whole["$defs"][part["$ref"].rsplit("/", 1)[1]] if "$ref" in part else part
    found = {(k, *rest) for k, v in part.get("properties", {}).items() for rest in ((), *declared(whole, v))}
    return found | (declared(whole, part["items"]) if isinstance(part.get("items"), dict) else set())


def test_a_real_diagnosis_is_valid_and_writes_all_that_is_declared(validator, drifted, zeros):
    real = json.loads(json.dumps(drifted.to_dict(), allow_nan=False))
    validator.validate(real)
    assert real["next"]["samples"]
    by_hand = keys(json.loads(json.dumps(case("repeated").to_dict())))
    remainder = keys(json.loads(json.dumps(case("unexplained").to_dict())))
    law = keys(json.loads(json.dumps(case("law").to_dict())))
    deployed = keys(json.loads(json.dumps(zeros.to_dict())))
    film = tr.simulate("builtin:rv_m2", tool_frame="tool0", rows=60, measures="pixel", noise=5e-5, tool=[0.0, 0.0, 0.1])
    filmed = json.loads(json.dumps(tr.diagnose(film).to_dict()))
    validator.validate(filmed)
    told = keys(real) | by_hand | remainder | law | deployed | keys(filmed)
    assert declared(schema(), schema()) - told == set()
