"""Names of columns: which are reserved, how they split, and what a typing error was meant to be."""

from __future__ import annotations

import pytest

from thermal_robot.campaign import names
from thermal_robot.campaign.names import did_you_mean, listed, nearest, split_name


@pytest.mark.parametrize(
    ("column", "parts"),
    [
        ("approach.elbow_joint", ("approach", "elbow_joint")),
        ("temperature.left.arm", ("temperature", "left.arm")),
        ("time", ("time", "")),
        ("torque.", ("torque", "")),
    ],
)
def test_a_name_is_a_quantity_and_a_place(column: str, parts: tuple[str, str]) -> None:
    assert split_name(column) == parts


def test_a_reserved_name_means_one_thing() -> None:
    assert len(set(names.RESERVED)) == len(names.RESERVED)
    assert {*"xyz", "qw", "sim.x", "sim.qz", "session", "pose", "path", "time", "speed"} <= set(names.RESERVED)


def test_the_nearest_come_first_whatever_their_case() -> None:
    candidates = ["Shoulder_Lift_Joint", "shoulder_pan_joint", "elbow_joint", "x"]
    assert nearest("shoulder_lift_joint", candidates)[0] == "Shoulder_Lift_Joint"
    assert nearest("shoulder_lift_joint", candidates, count=1) == ["Shoulder_Lift_Joint"]
    assert "x" not in nearest("shoulder_lift_joint", candidates)
    assert nearest("elbow", []) == []


def test_a_suggestion_is_made_only_where_there_is_one() -> None:
    assert did_you_mean("elbow_jiont", ["elbow_joint", "wrist"]) == "; did you mean 'elbow_joint'?"
    assert did_you_mean("humidity", ["elbow_joint", "wrist"]) == ""
    assert did_you_mean("elbow", ["elbow_joint"]) != ""
    assert did_you_mean("elbow", ["elbow_joint"], cutoff=0.85) == ""


def test_a_long_list_is_cut_off_and_counted() -> None:
    assert listed(["a", "b"]) == "'a', 'b'"
    assert listed(["a", "b", "c", "d"], limit=2) == "'a', 'b' and 2 more"
    assert listed([]) == ""
