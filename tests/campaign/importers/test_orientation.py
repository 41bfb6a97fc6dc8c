"""One turn, written in every way, is the same quaternion."""

import numpy as np
import pytest

from thermal_robot.campaign.importers.plan import orientation_kind
from thermal_robot.campaign.table import Table
from thermal_robot.errors import CampaignError
from thermal_robot.kinematics import quaternion_to_rotation
from thermal_robot.schema import MisfitError

# a quarter turn about z, then one about the new x: the target's axes in the measurement frame are y, z, x
TURN = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
H = 0.5
POSE = np.block([[TURN, np.array([[7.0], [8.0], [9.0]])], [np.zeros((1, 3)), np.ones((1, 1))]])


def table(figures):
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
    found = said(figures, **keys).quaternions(table(figures))
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


def test_the_order_of_a_quaternion_matters():
    figures = [np.cos(0.1), np.sin(0.1), 0.0, 0.0]
    one, other = (said(figures, kind="quaternion", order=o).quaternions(table(figures)) for o in ("wxyz", "xyzw"))
    np.testing.assert_allclose(one[0], figures)
    np.testing.assert_allclose(other[0], [0.0, np.cos(0.1), np.sin(0.1), 0.0], atol=1e-15)


def test_a_matrix_has_the_position_too():
    flat = POSE.ravel()
    place = [column.numbers(table(flat))[0] for column in said(flat, kind="matrix").position]
    assert place == [7.0, 8.0, 9.0]
    assert said(TURN.ravel(), kind="matrix").position == ()


@pytest.mark.parametrize(
    ("figures", "keys", "words"),
    [
        (
            [2, 0, 0, 0],
            {"kind": "quaternion", "order": "wxyz"},
            "row 2, column 'c0': a quaternion whose length is not 1",
        ),
        (np.diag([1, 1, 2]).ravel(), {"kind": "matrix"}, "a matrix that is no rotation; found 1, 0, 0"),
        (np.diag([1, 1, -1]).ravel(), {"kind": "matrix"}, "a matrix that is no rotation"),
        ([1, np.nan, 0], {"kind": "rotation_vector", "unit": "rad"}, "row 2, column 'c1': a value is missing"),
    ],
)
def test_what_is_no_orientation(figures, keys, words):
    with pytest.raises(CampaignError, match=r"f\.csv, row 2") as error:
        said(figures, **keys).quaternions(table(np.array(figures, dtype=float)))
    assert words in str(error.value)


@pytest.mark.parametrize(
    ("count", "keys", "words"),
    [
        (3, {"kind": "quaternion", "order": "wxyz"}, "a list of 4 columns for a quaternion"),
        (4, {"kind": "quaternion"}, "orientation.order: is missing"),
        (3, {"kind": "euler", "unit": "rad"}, "orientation.sequence: is missing"),
        (3, {"kind": "euler", "sequence": "XXY", "unit": "rad"}, "orientation.sequence"),
        (9, {"kind": "matrix", "unit": "rad"}, "orientation.unit: a matrix has none"),
    ],
)
def test_what_is_not_said_is_not_guessed(count, keys, words):
    with pytest.raises(MisfitError) as error:
        said(range(count), **keys)
    assert words in str(error.value)
