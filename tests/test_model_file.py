"""The file of a model: written and read without loss, and what is damaged is told with its place."""

import copy
import json
import math
import operator
import os
import random
import re
from dataclasses import fields, replace
from functools import reduce
from itertools import chain, islice

import numpy as np
import pytest
from conftest import load_arm
from simulate import simulate

from thermal_robot import CampaignError, CorrectedModel, EffectError, ThermalRobotError
from thermal_robot.effects import Backlash, Drift, Effect, Geometric, JointRipple, ThermalElongation, TransmissionError
from thermal_robot.effects.gate import checked
from thermal_robot.effects.law import Discovered
from thermal_robot.model_file import PARTS, SCHEMA, VERSION, checksum
from thermal_robot.observations import Frames, observe
from thermal_robot.prediction import FileGap, Spread, sensitivity


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
    model, samples = made("rv_m2", *BUILT["rv_m2"])
    zeros = (1e-3,) * 5 + (0.0,) * 6 * len(model.robot.segments)
    return replace(model, files=(FileGap("zeros", None, 2e-4, 1e-4, 0.75, (0.5, 0.9), zeros),)), samples


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


def test_a_file_holds_all_of_a_model(model, tmp_path):
    known, fresh = model
    assert set(PARTS) == {field.name for field in fields(CorrectedModel)}
    known.save(tmp_path / "model.json")
    again = CorrectedModel.load(tmp_path / "model.json")
    assert again.to_dict() == known.to_dict()
    assert [effect for effect, _ in again.effects] == [effect for effect, _ in known.effects]
    np.testing.assert_array_equal(again.prediction(fresh)[0], known.prediction(fresh)[0])


def test_a_file_of_the_first_version_is_read(model, tmp_path):
    known, fresh = model
    first = {**plain(known), "schema": "thermal-robot/model/1"}
    del first["checksum"]
    again = CorrectedModel.load(stored(first, tmp_path))
    np.testing.assert_array_equal(again.prediction(fresh)[0], known.prediction(fresh)[0])


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
        np.testing.assert_array_equal(again.prediction(fresh)[0], known.prediction(fresh)[0])


def test_a_possible_value_that_nobody_wrote_is_refused(settled, tmp_path):
    document = plain(settled[0])
    document["frames"]["base"][0][3] += 0.001
    assert refusal(document, tmp_path) == (
        "was changed after it was written: every value is possible, but the checksum differs"
    )
    assert refusal({**plain(settled[0]), "checksum": "0" * 64}, tmp_path).startswith("was changed")


MIRROR, SLACK = np.diag([-1.0, 1.0, 1.0, 1.0]), np.eye(4)
SLACK[0, 1] = 1e-5
PAIR = "is [3.0, 1.0], expected two numbers, the smaller one first"
WRONG = [
    ("effects[1].values[3]", float("nan"), "is NaN, expected a finite number"),
    ("effects[1].values[3]", 1e300, "is 1e+300, expected a finite number"),
    ("effects[1].values[3]", 1e5, "is 100000, expected a value of 'rotation x"),
    ("effects[1].values", [1e-4] * 5, "are 5 values, expected one for each of the 6 param"),
    ("effects[0].arguments.lag", -1.0, "is -1.0, expected a number that is not"),
    ("effects[0].arguments.lag", "600", "is '600', expected a number"),
    ("effects[0].arguments.times[1]", 8000.0, "effects[0].arguments.times[2]: is 7200.0, expected a number"),
    ("effects[0].arguments.lagg", 1.0, "is not known, expected no other key"),
    ("effects[2].arguments.shape", "stair", "is 'stair', expected \"constant\""),
    ("effects[2].arguments.name", "discovered.2", "is 'discovered.2', expected"),
    ("effects[2].surplus", 1, "is not known, expected no other key than name, arguments"),
    ("frames.base[0][0]", 7.0, "frames.base: is no rotation (it misses one by inf), expected three rows"),
    ("frames.base", MIRROR.tolist(), "is a reflection, expected"),
    ("frames.base", SLACK.tolist(), "is no rotation (it misses one by 1e-05)"),
    ("frames.tool[3]", [0, 0, 0, 2], "is [0.0, 0.0, 0.0, 2.0], expected [0.0, 0.0, 0.0, 1.0]"),
    ("frames.tool[0][3]", 1e9, "is 1000000000.0, expected a number of m, at most 1e+07"),
    ("robot.gravity[2]", -9810, "is -9810, expected a number of m/s² from -100 to 100"),
    ("robot.urdf", "builtin:rv_m2", "is 'builtin:rv_m2', expected the text of a URDF"),
    ("robot.tool_frame", "nose", "robot: "),
    ("settings.noise_position", -1e-5, "a standard deviation cannot be negative"),
    ("settings.units.length", "yard", "unknown unit, expected"),
    ("settings.gears", {"knee": 100}, "settings.gears.knee: the chain has no such joint"),
    ("measures", "place", 'is \'place\', expected "position" or "pose"'),
    ("needs", ["time", 3], "needs[1]: is 3, expected the name of a column"),
    ("needs", ["time"], "lacks temperature, expected what 'thermal_elongation' reads"),
    ("simulated", 0, "is 0, expected true or false"),
    ("last_order", [3.0, 1.0], PAIR),
    ("last_order", [3.0], PAIR.replace(", 1.0", "")),
    ("surplus", 1, "is not known, expected no other key than robot, settings"),
    ("checksum", None, "is null, expected a checksum"),
    ("spread.covariance", [[1.0, 0.0]], "expected a symmetric matrix"),
    ("spread.covariance[0][0]", -1e-12, "expected variances that are not negative"),
    ("spread.covariance[0][1]", 1e-12, "expected a symmetric matrix"),
    ("spread.wider", [[1.0]], "expected a matrix of the shape of covariance"),
    ("spread.prior", [1.0] * 99, "expected a deviation for each parameter"),
]


@pytest.mark.parametrize(("path", "value", "said"), WRONG)
def test_what_is_wrong_is_told_with_its_place_whatever_the_checksum(settled, tmp_path, path, value, said):
    document = plain(settled[0])
    *way, last = (int(word) if word.isdigit() else word for word in re.findall(r"[^.\[\]]+", path))
    reduce(operator.getitem, way, document)[last] = value
    place = "spread.covariance" if "covariance" in path else path
    for written in (document, summed(document)):
        told = refusal(written, tmp_path)
        assert told.startswith(said) or (told.startswith(f"{place}: ") and said in told)


@pytest.mark.parametrize("key", [*PARTS, "checksum"])
def test_a_key_that_lacks_is_named(settled, tmp_path, key):
    document = plain(settled[0])
    del document[key]
    if key in PARTS and PARTS[key].optional:
        assert "was changed after it was written" in refusal(document, tmp_path)
        document["checksum"] = checksum(document)
        assert not getattr(CorrectedModel.load(stored(document, tmp_path)), key)
    else:
        assert refusal(document, tmp_path) == f"{key}: is missing, expected a value"


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


FOR_ANY = (None, "wrong", "", math.nan, math.inf, 1e300, 10**400, -1, 0, True, [], [[1.0]], {}, "\ud800", "a\0b")
FEW = 8  # of a long list the ends and the middle are spoilt


def of_its_kind(value):
    """Damage to a value that leaves it of its kind."""
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return str(value), 1e3 * value + 1.0
    if isinstance(value, list):
        return [*value, 0.0], value[:-1]
    if isinstance(value, dict):
        return ({**value, "surplus": 1},)
    return (value[: len(value) // 2], value.upper() + "X") if isinstance(value, str) else ()


def places(node, path=()):
    """Yield the way to each value of a document, and the value."""
    if path:
        yield path, node
    keys = list(node) if isinstance(node, dict) else range(len(node)) if isinstance(node, list) else ()
    if isinstance(node, list) and len(node) > FEW:
        keys = sorted({0, 1, len(node) // 2, len(node) - 1})
    for key in keys:
        yield from places(node[key], (*path, key))


def spoilt(document, first, step):
    """Yield the document with each so-many-th damage to one of its values; a value may also be gone."""
    every = ((path, other) for path, v in places(document) for other in (*FOR_ANY, *of_its_kind(v), KeyError))
    for path, other in islice(chain((((), other) for other in FOR_ANY), every), first, None, step):
        if not path:
            yield other
            continue
        again = copy.deepcopy(document)
        at = reduce(operator.getitem, path[:-1], again)
        if other is KeyError:
            del at[path[-1]]
        else:
            at[path[-1]] = other
        yield again


def broken(content, count):
    """Yield bytes cut at so many places, and with so many bits flipped, one at a time."""
    yield from ((True, content[: len(content) * k // count]) for k in range(count))
    drawn = random.Random(0)
    for _ in range(count):
        at, bit = drawn.randrange(len(content)), drawn.randrange(8)
        yield False, content[:at] + bytes([content[at] ^ 1 << bit]) + content[at + 1 :]


def summed(document):
    """Return the document with the checksum that it should have, where it has a place for one."""
    if not isinstance(document, dict) or not isinstance(document.get("checksum"), str):
        return document
    try:
        return {**document, "checksum": checksum(document)}
    except (OverflowError, ValueError):  # what has no checksum
        return document


def outcome(file, fresh, right):
    """Tell what becomes of a file: refused in one line that names it, another finite prediction, or the right one."""
    try:
        predicted = CorrectedModel.load(file).prediction(fresh)[0]
    except ThermalRobotError as error:
        told = str(error)
        sound = "\n" not in told and told.startswith((str(file), "effect '", fresh.name))
        return "refused" if sound else told
    assert predicted.shape == right.shape
    assert np.isfinite(predicted).all()
    return "right" if np.array_equal(predicted, right) else "other"


@pytest.mark.parametrize(
    "step", [pytest.param(1, marks=pytest.mark.slow), pytest.param(29, marks=pytest.mark.slow), 293]
)
def test_no_damage_gives_a_wrong_number_and_none_with_a_checksum_of_its_own_a_traceback(model, tmp_path, step):
    known, fresh = model
    right, document = known.prediction(fresh)[0], plain(known)
    found = [outcome(stored(each, tmp_path), fresh, right) for each in spoilt(document, 0, step)]
    assert set(found) <= {"refused", "right"}
    assert found.count("refused") > 0.95 * len(found)
    first = {key: value for key, value in document.items() if key != "checksum"} | {"schema": f"{SCHEMA}1"}
    for written in (first, document):
        damaged = map(summed, spoilt(written, 1, step))
        found = [outcome(stored(each, tmp_path), fresh, right) for each in damaged]
        assert set(found) <= {"refused", "right", "other"}
        assert found.count("refused") > 0.8 * len(found)
    for cut, content in broken(json.dumps(document, indent=1).encode(), 8 if step > 29 else 50):
        (tmp_path / "model.json").write_bytes(content)
        happened = outcome(tmp_path / "model.json", fresh, right)
        assert happened in (("refused",) if cut else ("refused", "right"))


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
    np.testing.assert_array_equal(again.prediction(fresh)[0], own.prediction(fresh)[0])
    more = replace(own, effects=((Own(), np.array([1e-4, 1e-4])),))
    with pytest.raises(EffectError, match="'own' was fitted with 2 parameters and has 1 in these rows"):
        more.predict(fresh)


def test_a_law_that_these_rows_cannot_tell_is_an_error_that_says_why(settled):
    known, fresh = settled
    turn = Discovered(place="joint_3", quantity="since_turn.joint_3", shape="hysteresis", marks=(0.25,))
    memory = replace(known, effects=((turn, np.array([1e-4, 1e-4])),), needs=("time",))
    assert np.isfinite(memory.prediction(fresh)[0]).all()
    with pytest.raises(EffectError, match=r"has 0 in these rows, which lack since_turn\.joint_3"):
        memory.predict(replace(fresh, covariates={"time": np.full(6, 60.0)}, travelled={}))
