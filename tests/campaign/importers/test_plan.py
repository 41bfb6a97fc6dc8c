"""A mapping: what it states counts for more than what a format says; columns, orientations, rows left out."""

import numpy as np
import pytest

from thermal_robot.campaign.document import KINDS as OF_CAMPAIGN
from thermal_robot.campaign.importers.plan import (
    KINDS,
    Plan,
    Source,
    campaign_of,
    column_kind,
    columns_kind,
    orientation_kind,
    planned,
)
from thermal_robot.campaign.table import Table
from thermal_robot.errors import CampaignError
from thermal_robot.kinematics import exp3, quaternion_to_rotation
from thermal_robot.schema import MisfitError

UNITS = {"measurements": {"angle_unit": "rad", "length_unit": "mm"}}


def test_a_mapping_has_every_section_of_a_campaign_and_every_key():
    for section, kinds in OF_CAMPAIGN.items():
        assert KINDS[section] is kinds or set(KINDS[section]) == set(kinds) - {"file"}


def test_the_one_that_is_over_counts_key_by_key():
    below = planned({**UNITS, "columns": {"x": "a", "y": "b"}, "table": {"skip": 3}})
    above = planned({"measurements": {"length_unit": "m"}, "columns": {"x": "c"}, "noise": {"position": 0.1}})
    both = above.over(below)
    assert both.get("measurements", "angle_unit") == "rad"
    assert both.get("measurements", "length_unit") == "m"
    assert [both.get("columns", axis).sources for axis in "xy"] == [("c",), ("b",)]
    assert both.layout().skip == 3
    assert both.get("noise", "position") == 0.1
    matrix = planned({"orientation": {"kind": "matrix", "columns": list(range(1, 10))}})
    vector = planned({"orientation": {"kind": "rotation_vector", "unit": "deg", "columns": ["a", "b", "c"]}})
    assert vector.over(matrix).get("orientation", "stated").kind == "rotation_vector"  # as a whole
    assert Plan().over(matrix).get("orientation", "stated").kind == "matrix"
    layout = planned({"table": {"separator": "tab", "comment": "#", "header": False, "key": "n"}}).layout()
    assert (layout.separator, layout.skip, layout.header, layout.comment) == ("\t", 0, False, "#")


TABLE = Table(
    "f.csv",
    {
        "a": ["1", "", "3"],
        "b": np.arange(10.0, 31.0, 10.0),
        "c": ["p", "q", ""],
        "t": ["7 s", "9 s", ""],
        "e": [""] * 3,
    },
    np.array([2, 3, 4]),
    1,
)


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ("a", [1, np.nan, 3]),
        (2, [10, 20, 30]),
        ({"column": "a", "scale": -2.0, "offset": 1.0}, [-1, np.nan, -5]),
        ({"sum": ["a", 2]}, [11, np.nan, 33]),
        ({"value": 4}, [4, 4, 4]),
        ({"count": True}, [0, 1, 2]),
        ({"column": "b", "since_first": True}, [0, 10, 20]),
        ({"column": "t", "time": "%S s"}, [0, 2, np.nan]),
        ({"column": "e", "since_first": True}, [np.nan] * 3),
    ],
)
def test_numbers(given, expected):
    np.testing.assert_array_equal(column_kind(given, "").numbers(TABLE), expected)


def test_texts():
    assert column_kind("c", "").text(TABLE) == ["p", "q", ""]
    assert column_kind({"sum": ["a", "c"]}, "").text(TABLE) == ["1 p", " q", "3 "]
    assert column_kind({"value": "run 1"}, "").text(TABLE) == ["run 1"] * 3
    assert column_kind({"count": True}, "").text(TABLE) == ["0", "1", "2"]


@pytest.mark.parametrize("given", [0, "", 1.5, {}, {"column": "a", "count": True}, {"colum": "a"}, {"sum": "a"}, None])
def test_what_is_no_source(given):
    with pytest.raises(MisfitError, match=r"columns\.x"):
        columns_kind({"x": given}, "columns")


# a quarter turn about z, then one about the new x: the target's axes in the measurement frame are y, z, x
TURN = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
H = 0.5
POSE = np.block([[TURN, np.array([[7.0], [8.0], [9.0]])], [np.zeros((1, 3)), np.ones((1, 1))]])


def figured(figures):
    columns = {f"c{k}": np.array([value, value]) for k, value in enumerate(figures)}
    return Table("f.csv", columns, np.array([2, 3]), 1)


def said(figures, **keys):
    return orientation_kind({"columns": [f"c{k}" for k in range(len(figures))], **keys}, "orientation")["stated"]


WAYS = {
    "wxyz": ([H, H, H, H], {"kind": "quaternion", "order": "wxyz"}),
    "xyzw": ([H, H, H, H], {"kind": "quaternion", "order": "xyzw"}),
    "moving ZXY": ([90, 90, 0], {"kind": "euler", "sequence": "ZXY", "unit": "deg"}),
    "fixed xzy": ([90, 90, 0], {"kind": "euler", "sequence": "xzy", "unit": "deg"}),
    "rad": ([np.pi / 2, np.pi / 2, 0], {"kind": "euler", "sequence": "ZXZ", "unit": "rad"}),
    "vector": (np.full(3, 2 * np.pi / 3 / np.sqrt(3)), {"kind": "rotation_vector", "unit": "rad"}),
    "3x3": (TURN.ravel(), {"kind": "matrix"}),
    "3x4": (POSE[:3].ravel(), {"kind": "matrix"}),
    "4x4": (POSE.ravel(), {"kind": "matrix"}),
    "inverse": (TURN.T.ravel(), {"kind": "matrix", "inverse": True}),
}


@pytest.mark.parametrize("way", WAYS)
def test_every_way_is_the_same_turn(way):
    figures, keys = WAYS[way]
    found = said(figures, **keys).quaternions(figured(figures))
    turned = quaternion_to_rotation(found)
    np.testing.assert_allclose(turned, [TURN] * 2, atol=1e-12)


@pytest.mark.parametrize("kind", ["euler", "rotation_vector"])
def test_a_unit_in_a_header_counts(kind):
    figures = {"RX [deg]": [90.0], "RY (rad)": [0.0], "RZ [°]": [0.0]}
    written = {name: np.array(values) for name, values in figures.items()}
    more = {"sequence": "XYZ"} if kind == "euler" else {}
    told = orientation_kind({"kind": kind, "columns": list(figures), "unit": "rad", **more}, "orientation")["stated"]
    found = told.quaternions(Table("f.csv", written, np.array([2]), 1))
    np.testing.assert_allclose(found, [[np.sqrt(0.5), np.sqrt(0.5), 0, 0]], atol=1e-12)


def test_the_order_of_a_quaternion_matters_and_a_matrix_has_the_position_too():
    figures = [np.cos(0.1), np.sin(0.1), 0.0, 0.0]
    one, other = (said(figures, kind="quaternion", order=o).quaternions(figured(figures)) for o in ("wxyz", "xyzw"))
    np.testing.assert_allclose(one[0], figures)
    np.testing.assert_allclose(other[0], [0.0, np.cos(0.1), np.sin(0.1), 0.0], atol=1e-15)
    flat = POSE.ravel()
    place = [column.numbers(figured(flat))[0] for column in said(flat, kind="matrix").position]
    assert place == [7.0, 8.0, 9.0]
    assert said(TURN.ravel(), kind="matrix").position == ()


@pytest.mark.parametrize(
    ("figures", "keys", "words"),
    [
        ([2, 0, 0, 0], {"kind": "quaternion", "order": "wxyz"}, "column 'c0': a quaternion whose length is not 1"),
        (np.diag([1, 1, 2]).ravel(), {"kind": "matrix"}, "a matrix that is no rotation; found 1, 0, 0"),
        (np.diag([1, 1, -1]).ravel(), {"kind": "matrix"}, "a matrix that is no rotation"),
        ([1, np.nan, 0], {"kind": "rotation_vector", "unit": "rad"}, "row 2, column 'c1': a value is missing"),
    ],
)
def test_what_is_no_orientation(figures, keys, words):
    with pytest.raises(CampaignError, match=r"f\.csv, row 2") as error:
        said(figures, **keys).quaternions(figured(np.array(figures, dtype=float)))
    assert words in str(error.value)


@pytest.mark.parametrize(
    ("count", "keys", "words"),
    [
        (3, {"kind": "quaternion", "order": "wxyz"}, "a list of 4 columns for a quaternion"),
        (4, {"kind": "quaternion"}, "orientation.order: is missing"),
        (3, {"kind": "euler", "sequence": "XXY", "unit": "rad"}, "orientation.sequence"),
        (9, {"kind": "matrix", "unit": "rad"}, "orientation.unit: a matrix has none"),
    ],
)
def test_what_is_not_said_is_not_guessed(count, keys, words):
    with pytest.raises(MisfitError) as error:
        said(range(count), **keys)
    assert words in str(error.value)


METRES = {"measurements": {"angle_unit": "rad", "length_unit": "m"}}


def table(rows=4, **columns):
    q = {f"joint_{k + 1}": 0.1 * np.arange(rows) + 0.01 * k for k in range(5)}
    place = {axis: np.arange(float(rows)) for axis in "xyz"}
    return Table("t.csv", {**q, **place, **columns}, np.arange(2, rows + 2), 1)


def campaign(robot, given, **sections):
    plan = planned({**METRES, **sections})
    return campaign_of(Source(given, Plan(), ("before",)), plan, robot, "c")


def test_columns_of_the_format_are_taken_by_their_own_names_and_others_only_when_asked(rv_m2):
    given = table(temperature=np.full(4, 21.0), order=np.arange(4.0), humidity=np.full(4, 40.0))
    found, notes = campaign(rv_m2, given)
    assert set(found.covariates) == {"temperature", "order"}
    assert notes == ("before", "4 rows read, 4 taken", "columns left out: 'humidity'")
    found, _ = campaign(rv_m2, given, columns={"humidity": "humidity"})
    assert "humidity" in found.covariates


def test_directions_of_approach_are_left_to_follow_from_the_order(rv_m2):
    found, _ = campaign(rv_m2, table(order=np.arange(4.0)))
    assert not [name for name in found.covariates if name.startswith("approach")]
    found, _ = campaign(rv_m2, table(**{"approach.joint_2": np.array([1.0, -1, 1, 1])}))
    assert "approach.joint_2" in found.covariates


def test_rows_without_a_measurement_are_left_out_and_half_a_measurement_is_refused(rv_m2):
    given = table(rows=6)
    for axis in "xyz":
        given.columns[axis][2] = np.nan
    found, notes = campaign(rv_m2, given)
    assert found.samples == 5
    assert found.rows.tolist() == [2, 3, 5, 6, 7]
    assert "1 row (4) left out, without a measured position" in notes
    given.columns["y"][3] = np.nan
    with pytest.raises(CampaignError, match=r"t\.csv, row 5, column 'y': a value is missing, for the column 'y'"):
        campaign(rv_m2, given)
    for axis in "xyz":
        given.columns[axis][:] = np.nan
    with pytest.raises(CampaignError, match="no row has a measured position"):
        campaign(rv_m2, given)


def test_a_matrix_gives_the_position_unless_columns_say_another(rv_m2):
    cells = {f"m{k}": np.full(4, value) for k, value in enumerate([1, 0, 0, 7, 0, 1, 0, 8, 0, 0, 1, 9])}
    plain = {name: values for name, values in table().columns.items() if name not in "xyz"}
    given = Table("t.csv", {**plain, **cells}, np.arange(2, 6), 1)
    matrix = {"kind": "matrix", "columns": list(cells)}
    found, _ = campaign(rv_m2, given, orientation=matrix)
    np.testing.assert_allclose(found.position, [[7, 8, 9]] * 4)
    np.testing.assert_allclose(found.orientation, [[1, 0, 0, 0]] * 4)
    found, _ = campaign(rv_m2, given, orientation=matrix, columns={"x": "joint_1"})
    np.testing.assert_allclose(found.position[:, 0], found.q[:, 0])


def test_the_noise_of_each_row_comes_from_a_column_of_another_name(rv_m2):
    given = table(uncertainty=np.array([2.0, 4.0, 2.0, 6.0]))
    found, notes = campaign(rv_m2, given, columns={"noise": {"column": "uncertainty", "scale": 0.5e-5}})
    np.testing.assert_allclose(found.noise_of_rows, [1e-5, 2e-5, 1e-5, 3e-5], rtol=1e-12)
    assert notes == ("before", "4 rows read, 4 taken")


def test_several_targets_come_from_columns_of_other_names_and_rows_without_any_are_left_out(rv_m2):
    rng, places = np.random.default_rng(0), np.array([[0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]])
    points = rng.normal(size=(6, 1, 3)) + places @ exp3(rng.normal(size=(6, 3))).transpose(0, 2, 1)
    points[2] = np.nan
    plain = {name: values for name, values in table(6).columns.items() if name not in "xyz"}
    seen = {f"T{k}{a}": points[:, k, "xyz".index(a)] for k in range(3) for a in "xyz"}
    named = {f"{a}.{k + 1}": f"T{k}{a}" for k in range(3) for a in "xyz"}
    found, notes = campaign(rv_m2, Table("t.csv", {**plain, **seen}, np.arange(2, 8), 1), columns=named)
    assert found.rows.tolist() == [2, 3, 5, 6, 7]
    assert "1 row (4) left out, without a measured position" in notes
    np.testing.assert_allclose(found.targets.points, points[[0, 1, 3, 4, 5]])
