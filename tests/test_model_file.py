"""The file of a model: written and read without loss, and what is damaged is told with its place."""

import json
import os
from dataclasses import fields, replace

import numpy as np
import pytest
from conftest import load_arm
from simulate import simulate
from spoilt_models import broken, spoilt, summed

from thermal_robot import CampaignError, CorrectedModel, EffectError, ThermalRobotError
from thermal_robot.effects import Backlash, Drift, Effect, Geometric, JointRipple, ThermalElongation, TransmissionError
from thermal_robot.effects.gate import checked
from thermal_robot.effects.law import Discovered
from thermal_robot.model_file import PARTS, SCHEMA, VERSION, checksum
from thermal_robot.observations import Frames, observe
from thermal_robot.prediction import Spread, sensitivity


def made(arm, effects, needs, seed=3):
    """A model that holds half the expected size of each parameter, and rows to predict."""
    robot = load_arm(arm)
    campaign, _, (fresh, _) = simulate(robot, seed=seed, samples=30, fresh=6)
    seen = observe(campaign)
    held = tuple((e, 0.5 * np.array([p.size for p in checked(e, seen)])) for e in effects)
    place = Frames(np.linalg.inv(seen.frames.base), seen.frames.tool)
    count = sensitivity(seen, effects).shape[2]
    spread = Spread(1e-12 * np.eye(count), np.full(3, 1e-5), np.full(3, 2e-5), {"time": (0.0, 7200.0)})
    return CorrectedModel(robot, campaign.settings, place, held, "position", needs, spread=spread), fresh


LAGS = ThermalElongation(common=True, lag=600.0, times=(0.0, 60.0, 7200.0), temperatures=(20.0, 22.0, 27.5))
STEP = Discovered(place="joint_2", quantity="time", shape="step", marks=(3000.0,), span=7200.0)
BUILT = {
    "rv_m2": (
        (LAGS, Drift(span=7200.0, time_constant=0.25), STEP, JointRipple(joints=("joint_3",), orders=(100.5,))),
        ("time", "temperature"),
    ),
    "awkward": (
        (Backlash(carriage="moving"), Geometric(), TransmissionError()),
        tuple(f"approach.{joint}" for joint in load_arm("awkward").joint_names),
    ),
}


@pytest.fixture(scope="module", params=BUILT)
def model(request):
    """An arm that turns with a law and a record, an arm that slides; rows to predict."""
    return made(request.param, *BUILT[request.param])


@pytest.fixture(scope="module")
def settled():
    return made("rv_m2", *BUILT["rv_m2"])


def stored(document, folder):
    file = folder / "model.json"
    text = document if isinstance(document, str) else json.dumps(document)
    file.write_text(text, encoding="utf-8", errors="surrogatepass")
    return file


def plain(model):
    return json.loads(json.dumps(model.to_dict()))


def refusal(document, folder, kind=CampaignError):
    file = stored(document, folder)
    with pytest.raises(kind) as refused:
        CorrectedModel.load(file)
    told = str(refused.value)
    assert told.startswith(str(file)), told
    assert "\n" not in told
    return told.removeprefix(str(file)).lstrip(":, ")


def test_every_field_of_a_model_has_its_key():
    assert set(PARTS) == {field.name for field in fields(CorrectedModel)}


def test_a_file_holds_all_of_a_model(model, tmp_path):
    known, fresh = model
    known.save(tmp_path / "model.json")
    again = CorrectedModel.load(tmp_path / "model.json")
    assert again.to_dict() == known.to_dict()
    assert [effect for effect, _ in again.effects] == [effect for effect, _ in known.effects]
    np.testing.assert_array_equal(again.predict(fresh)[0], known.predict(fresh)[0])


def test_a_file_of_the_first_version_is_read(model, tmp_path):
    known, fresh = model
    first = {**plain(known), "schema": "thermal-robot/model/1"}
    del first["checksum"]
    again = CorrectedModel.load(stored(first, tmp_path))
    np.testing.assert_array_equal(again.predict(fresh)[0], known.predict(fresh)[0])


def test_a_file_of_a_newer_version_is_told_from_one_that_is_no_model(settled, tmp_path):
    document = plain(settled[0])
    assert document["schema"] == f"{SCHEMA}{VERSION}" == "thermal-robot/model/2"
    assert refusal({**document, "schema": "thermal-robot/model/3", "news": 1}, tmp_path) == (
        "schema: was written by a newer version of thermal-robot, as version 3 of the file; "
        "this one reads up to version 2"
    )
    for other in ("thermal-robot/model/0", "thermal-robot/model/2.1", "thermal-robot/diagnosis/2", None, ["x"], 2):
        assert "not a model that `diagnose --model` wrote" in refusal({**document, "schema": other}, tmp_path)


def test_another_layout_is_the_same_file(settled, tmp_path):
    known, fresh = settled

    def spelt(digits):
        return int(float(digits)) if float(digits).is_integer() else float(digits)

    text = json.dumps(json.loads(json.dumps(known.to_dict()), parse_float=spelt), sort_keys=True)
    assert json.loads(text) == plain(known)
    assert text != json.dumps(plain(known), sort_keys=True)
    broad = json.dumps(plain(known), indent=3).replace("\n", "\r\n")
    for content in (text.encode(), b"\xef\xbb\xbf" + text.encode(), broad.encode()):
        (tmp_path / "model.json").write_bytes(content)
        again = CorrectedModel.load(tmp_path / "model.json")
        np.testing.assert_array_equal(again.predict(fresh)[0], known.predict(fresh)[0])


def test_a_possible_value_that_nobody_wrote_is_refused(settled, tmp_path):
    document = plain(settled[0])
    document["frames"]["base"][0][3] += 0.001
    assert refusal(document, tmp_path) == (
        "was changed after it was written: every value is possible, but the checksum differs"
    )
    assert refusal({**plain(settled[0]), "checksum": "0" * 64}, tmp_path).startswith("was changed")


@pytest.mark.parametrize(
    ("path", "value", "said"),
    [
        (["effects", 1, "values", 3], float("nan"), "effects[1].values[3]: is NaN, expected a finite number"),
        (["effects", 1, "values", 3], 1e300, "effects[1].values[3]: is 1e+300, expected a finite number"),
        (["effects", 1, "values", 3], 1e5, "effects[1].values[3]: is 100000, expected a value of 'rotation x"),
        (["effects", 1, "values"], [1e-4] * 5, "effects[1].values: are 5 values, expected one for each of the 6 param"),
        (["effects", 0, "arguments", "lag"], -1.0, "effects[0].arguments.lag: is -1.0, expected a number that is not"),
        (["effects", 0, "arguments", "lag"], "600", "effects[0].arguments.lag: is '600', expected a number"),
        (
            ["effects", 0, "arguments", "times", 1],
            8000.0,
            "effects[0].arguments.times[2]: is 7200.0, expected a number",
        ),
        (["effects", 0, "arguments", "lagg"], 1.0, "effects[0].arguments.lagg: is not known, expected no other key"),
        (
            ["effects", 2, "arguments", "shape"],
            "stair",
            "effects[2].arguments.shape: is 'stair', expected \"constant\"",
        ),
        (["effects", 2, "arguments", "name"], "discovered.2", "effects[2].arguments.name: is 'discovered.2', expected"),
        (["effects", 2, "surplus"], 1, "effects[2].surplus: is not known, expected no other key than name, arguments"),
        (["frames", "base", 0, 0], 7.0, "frames.base: is no rotation (it misses one by inf), expected three rows"),
        (["frames", "tool", 3], [0, 0, 0, 2], "frames.tool[3]: is [0.0, 0.0, 0.0, 2.0], expected [0.0, 0.0, 0.0, 1.0]"),
        (["frames", "tool", 0, 3], 1e9, "frames.tool[0][3]: is 1000000000.0, expected a number of m, at most 1e+07"),
        (["robot", "gravity", 2], -9810, "robot.gravity[2]: is -9810, expected a number of m/s² from -100 to 100"),
        (["robot", "urdf"], "builtin:rv_m2", "robot.urdf: is 'builtin:rv_m2', expected the text of a URDF"),
        (["robot", "tool_frame"], "nose", "robot: "),
        (["settings", "noise_position"], -1e-5, "settings.noise_position: a standard deviation cannot be negative"),
        (["settings", "units", "length"], "yard", "settings.units.length: unknown unit, expected"),
        (["settings", "gears"], {"knee": 100}, "settings.gears.knee: the chain has no such joint"),
        (["measures"], "place", 'measures: is \'place\', expected "position" or "pose"'),
        (["needs"], ["time", 3], "needs[1]: is 3, expected the name of a column"),
        (["needs"], ["time"], "needs: lacks temperature, expected what 'thermal_elongation' reads"),
        (["simulated"], 0, "simulated: is 0, expected true or false"),
        (["last_order"], [3.0, 1.0], "last_order: is [3.0, 1.0], expected two numbers, the smaller one first"),
        (["last_order"], [3.0], "last_order: is [3.0], expected two numbers, the smaller one first"),
        (["surplus"], 1, "surplus: is not known, expected no other key than robot, settings"),
        (["checksum"], None, "checksum: is null, expected a checksum"),
    ],
)
def test_what_is_wrong_is_told_with_its_place_whatever_the_checksum(settled, tmp_path, path, value, said):
    document = plain(settled[0])
    *way, last = path
    at = document
    for step in way:
        at = at[step]
    at[last] = value
    for written in (document, summed(document)):
        assert refusal(written, tmp_path).startswith(said)


def test_a_mirror_is_no_rotation(settled, tmp_path):
    document = plain(settled[0])
    document["frames"]["base"] = [[-1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
    assert refusal(document, tmp_path).startswith("frames.base: is a reflection, expected")
    slack = np.eye(4)
    slack[0, 1] = 1e-5
    document["frames"]["base"] = slack.tolist()
    assert refusal(document, tmp_path).startswith("frames.base: is no rotation (it misses one by 1e-05)")


@pytest.mark.parametrize("key", [*PARTS, "checksum"])
def test_a_key_that_lacks_is_named(settled, tmp_path, key):
    document = plain(settled[0])
    del document[key]
    if key in PARTS and PARTS[key].optional:
        assert "was changed after it was written" in refusal(document, tmp_path)
        document["checksum"] = checksum(document)
        assert CorrectedModel.load(stored(document, tmp_path)).spread is None
    else:
        assert refusal(document, tmp_path) == f"{key}: is missing, expected a value"


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda c: c[:-1], "expected a symmetric matrix"),
        (lambda c: [[-1e-12, *c[0][1:]], *c[1:]], "expected variances that are not negative"),
        (lambda c: [[*c[0][:-1], 1e-12], *c[1:]], "expected a symmetric matrix"),
    ],
)
def test_a_covariance_is_one_and_fits_the_values(settled, tmp_path, change, said):
    document = plain(settled[0])
    document["spread"]["covariance"] = change(document["spread"]["covariance"])
    told = refusal(document, tmp_path)
    assert told.startswith("spread.covariance: ")
    assert said in told


def test_an_effect_that_is_not_installed_is_named_with_its_place(settled, tmp_path):
    document = plain(settled[0])
    document["effects"][1]["name"] = "worn_belt"
    told = refusal(document, tmp_path, EffectError)
    assert told == "effects[1].name: the model holds the effect 'worn_belt', which is not installed here"


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "found an empty file"),
        (b" \n", "found an empty file"),
        (b"\x00" * 100, "found no JSON"),
        (b"\x89PNG\r\n\x1a\n\xff", "found no text in UTF-8"),
        (b"{}", "found None"),
        (b"[1, 2]", "found None"),
        (b'{\n"schema": }', "row 2: this is not a model"),
        (b"[" * 100000, "too deep to read"),
        (b'{"a": 1, "a": 2}', "a: stands twice in one object, expected every key once"),
        (b'{"schema": 1' + b"0" * 5000 + b"}", "found inf"),
    ],
)
def test_what_is_no_json_of_a_model_is_said_in_a_sentence(tmp_path, content, said):
    (tmp_path / "model.json").write_bytes(content)
    with pytest.raises(CampaignError, match=r"model\.json") as refused:
        CorrectedModel.load(tmp_path / "model.json")
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


def test_what_is_no_file_is_not_read(tmp_path):
    large = tmp_path / "large.json"
    with large.open("wb") as file:
        file.truncate(129 << 20)
    for path, said in (
        (tmp_path, "is a folder, a pipe or a device, expected a model file"),
        (tmp_path / "none.json", "no such file"),
        (large, "is larger than any model (128 MiB)"),
        (tmp_path / "a\0b", "cannot be read; found embedded null byte"),
        (tmp_path / ("a" * 300), "cannot be read; found File name too long"),
        *([("/dev/zero", "is a folder, a pipe or a device, expected a model file")] if os.name == "posix" else []),
    ):
        with pytest.raises(CampaignError) as refused:
            CorrectedModel.load(path)
        name = str(path).replace("\0", r"\x00")  # what a terminal cannot show is written out
        assert str(refused.value) == f"{name}: {said}"


def test_the_checksum_is_of_all_values_and_of_no_spelling():
    whole = {"schema": "s", "a": [1, 2.0, "x", None, True], "b": {"c": 1e-5}}
    same = {"checksum": "y", "b": {"c": 0.00001}, "a": (1.0, 2, "x", None, True), "schema": "s"}
    assert checksum(whole) == checksum(same)
    others = [{**whole, "schema": "t"}, {**whole, "a": [1, 2.0, "x", None, 1]}, {**whole, "b": {"c": 1.1e-5}}]
    assert len({checksum(each) for each in (whole, *others)}) == 4


def outcome(file, fresh, right):
    """Tell what becomes of a file: refused in one line that names it, another finite prediction, or the right one."""
    told = ""
    try:
        predicted = CorrectedModel.load(file).predict(fresh)[0]
    except ThermalRobotError as error:
        told = str(error)
    if told:
        assert "\n" not in told
        assert told.startswith((str(file), "effect '", fresh.name))
        return "refused"
    assert predicted.shape == right.shape
    assert np.isfinite(predicted).all()
    return "right" if np.array_equal(predicted, right) else "other"


def trial(known, fresh, folder, documents):
    right = known.predict(fresh)[0]
    return {name: outcome(stored(document, folder), fresh, right) for name, document in documents}


@pytest.mark.parametrize("step", [pytest.param(1, marks=pytest.mark.slow), 17])
def test_no_damage_to_a_value_gives_a_wrong_number(model, tmp_path, step):
    known, fresh = model
    damaged = list(spoilt(plain(known)))[::step]
    found = trial(known, fresh, tmp_path, damaged)
    assert "other" not in found.values()
    assert list(found.values()).count("refused") > 0.95 * len(found)


@pytest.mark.parametrize("step", [pytest.param(1, marks=pytest.mark.slow), 17])
@pytest.mark.parametrize("version", [1, VERSION])
def test_no_damage_with_a_checksum_of_its_own_gives_a_traceback(model, tmp_path, step, version):
    known, fresh = model
    document = plain(known)
    if version == 1:
        document = {**document, "schema": f"{SCHEMA}1"}
        del document["checksum"]
    found = trial(known, fresh, tmp_path, ((name, summed(each)) for name, each in list(spoilt(document))[::step]))
    assert list(found.values()).count("refused") > 0.8 * len(found)


def test_no_broken_bytes_give_a_wrong_number(model, tmp_path):
    known, fresh = model
    right = known.predict(fresh)[0]
    known.save(tmp_path / "whole.json")
    file, found = tmp_path / "model.json", {}
    for name, content in broken((tmp_path / "whole.json").read_bytes()):
        file.write_bytes(content)
        found[name] = outcome(file, fresh, right)
    assert "other" not in found.values()
    assert all(found[name] == "refused" for name in found if name.startswith("cut"))


def test_an_effect_of_ones_own_is_asked_when_it_predicts(settled, tmp_path):
    known, fresh = settled

    class Own(Effect):
        name = "own"

        def parameters(self, observations):
            if observations.covariates["time"].max() < 100.0:
                raise ValueError("too early")
            return checked(Drift(), observations)[:1]

    own = replace(known, effects=((Own(), np.array([1e-4])),))
    own.save(tmp_path / "model.json")
    again = CorrectedModel.load(tmp_path / "model.json", effects=[Own()])
    np.testing.assert_array_equal(again.predict(fresh)[0], own.predict(fresh)[0])
    more = replace(own, effects=((Own(), np.array([1e-4, 1e-4])),))
    with pytest.raises(EffectError, match="'own' was fitted with 2 parameters and has 1 in these rows"):
        more.predict(fresh)


def test_a_law_that_these_rows_cannot_tell_is_an_error_that_says_why(settled):
    known, fresh = settled
    turn = Discovered(place="joint_3", quantity="since_turn.joint_3", shape="hysteresis", marks=(0.25,))
    memory = replace(known, effects=((turn, np.array([1e-4, 1e-4])),), needs=("time",))
    assert np.isfinite(memory.predict(fresh)[0]).all()
    with pytest.raises(EffectError, match=r"has 0 in these rows, which lack since_turn\.joint_3"):
        memory.predict(replace(fresh, covariates={"time": np.full(6, 60.0)}, travelled={}))
