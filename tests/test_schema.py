"""Kinds of plain values: what fits comes back as it is wanted, what does not is told with its path."""

import math
from fractions import Fraction

import numpy as np
import pytest

from thermal_robot import CampaignError, schema
from thermal_robot.schema import MisfitError, fitted, listed, number, optional, record, text

ARM = record(
    {
        "name": text("a name"),
        "joints": listed(record({"zero": number(), "ratio": schema.POSITIVE}, may_lack=["ratio"])),
        "place": schema.matrix((2, 3)),
        "note": optional(text(empty=True)),
    },
    may_lack=["note"],
)
GOOD = {"name": "arm", "joints": [{"zero": 1}, {"zero": 0.5, "ratio": 100}], "place": [[0, 1, 2], [3, 4, 5]]}


def changed(path, value):
    """The good value with another value at a path; without that key where the value is ``...``."""
    again = {**GOOD, "joints": [dict(joint) for joint in GOOD["joints"]], "place": [list(row) for row in GOOD["place"]]}
    *way, last = path
    at = again
    for step in way:
        at = at[step]
    if value is ...:
        del at[last]
    else:
        at[last] = value
    return again


def test_what_fits_comes_back_as_it_is_wanted():
    found = fitted(ARM, GOOD, "arm.json")
    assert found["joints"] == ({"zero": 1.0}, {"zero": 0.5, "ratio": 100.0})
    assert type(found["joints"][0]["zero"]) is float
    assert found["place"].shape == (2, 3)
    assert "note" not in found
    assert fitted(ARM, {**GOOD, "note": None}, "arm.json")["note"] is None


@pytest.mark.parametrize(
    ("path", "value", "said"),
    [
        (["name"], 3, "name: is 3, expected a name"),
        (["name"], " ", "name: is ' ', expected a name"),
        (["name"], "a\0b", r"name: is 'a\x00b', expected a name"),
        (["name"], "\ud800", r"name: is '\ud800', expected a name in Unicode"),
        (["name"], ..., "name: is missing, expected a value"),
        (["surplus"], 1, "surplus: is not known, expected no other key than name, joints, place, note"),
        (["a key"], 1, "['a key']: is not known, expected no other key than name, joints, place, note"),
        (["joints"], {"zero": 1}, "joints: is {'zero': 1}, expected a list"),
        (["joints", 1], [], "joints[1]: is [], expected an object with the keys zero, ratio"),
        (["joints", 1, "zero"], math.nan, "joints[1].zero: is NaN, expected a finite number"),
        (["joints", 1, "zero"], -math.inf, "joints[1].zero: is -Infinity, expected a finite number"),
        (["joints", 1, "zero"], 1e300, "joints[1].zero: is 1e+300, expected a finite number"),
        (["joints", 1, "zero"], True, "joints[1].zero: is true, expected a finite number"),
        (["joints", 1, "zero"], None, "joints[1].zero: is null, expected a finite number"),
        (["joints", 1, "zero"], "1", "joints[1].zero: is '1', expected a finite number"),
        (["joints", 1, "ratio"], 0, "joints[1].ratio: is 0, expected a number above 0"),
        (["place"], [[0, 1, 2]], "place: is [[0, 1, 2]], expected a list of 2 values"),
        (["place", 1], [0, 1], "place[1]: is [0, 1], expected a list of 3 values"),
        (["place", 1, 2], "x", "place[1][2]: is 'x', expected a finite number"),
    ],
)
def test_what_does_not_fit_is_told_with_its_path(path, value, said):
    with pytest.raises(CampaignError) as refused:
        fitted(ARM, changed(path, value), "arm.json")
    assert str(refused.value) == f"arm.json, {said}"
    assert (refused.value.file, refused.value.key) == ("arm.json", said.split(":")[0])


@pytest.mark.parametrize("value", [10**400, 10**5000, 1j, [1.0], {}, b"1"], ids=lambda value: type(value).__name__)
def test_a_number_is_a_number_and_no_other_passes(value):
    with pytest.raises(MisfitError, match=r"^a: .+, expected a finite number$"):
        number()(value, "a")


def test_numbers_of_numpy_are_numbers():
    for value in (np.float32(1), np.int64(1), Fraction(1), 1):
        assert number()(value, "") == 1.0
    assert listed(number())(np.arange(3), "") == (0.0, 1.0, 2.0)
    assert schema.boolean(np.True_, "") is True


def test_a_range_has_a_sentence_of_its_own():
    size = number(least=0.0, most=2.0, expected="0 to 2", problem="no such size")
    assert (size(0.0, ""), size(2, "")) == (0.0, 2.0)
    with pytest.raises(MisfitError, match="no such size, expected 0 to 2"):
        size(-1e-9, "s")
    with pytest.raises(MisfitError, match="'two', expected 0 to 2"):
        size("two", "s")


@pytest.mark.parametrize(
    ("kind", "good", "wrong", "path"),
    [
        (schema.whole(1), 3, 0, "v"),
        (schema.whole(1), np.int64(3), 1.0, "v"),
        (schema.whole(1), 1, True, "v"),
        (schema.word(("a", "b")), "a", "c", "v"),
        (schema.increasing(number()), [1.0, 2.0], [1.0, 1.0], "v[1]"),
        (schema.either(number(), listed(number())), 1.0, "x", "v"),
        (schema.either(number(), listed(number())), [1.0], ["x"], "v[0]"),
        (schema.mapping(schema.POSITIVE), {"a b": 1.0}, {"a b": -1.0}, "v['a b']"),
        (schema.mapping(schema.POSITIVE), {}, {1: 1.0}, "v"),
        (schema.matrix(), [[1, 2], [3, 4]], [[1, 2], [3]], "v[1]"),
        (schema.plain, {"a": [1, "", None, True, 1e45]}, {"a": [1, math.inf]}, "v.a[1]"),
        (schema.plain, [], {"a": object()}, "v.a"),
    ],
)
def test_kinds_take_theirs_and_refuse_another_with_its_place(kind, good, wrong, path):
    kind(good, "v")
    with pytest.raises(MisfitError) as refused:
        kind(wrong, "v")
    assert refused.value.path == path


def test_what_was_found_is_shown_in_one_short_line():
    for value in ("x" * 1000, "a\nb", [0.0] * 1000, 10**5000, Unspeakable()):
        assert len(schema.shown(value)) < 100
        assert "\n" not in schema.shown(value)


class Unspeakable:
    """What cannot be shown."""

    def __repr__(self):
        raise RuntimeError
