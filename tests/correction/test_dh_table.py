"""The table of Denavit and Hartenberg: read back by a chain of its own it leads where the model does."""

import io
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from arms import arms
from conftest import load_arm
from hypothesis import given
from readers import displaced

from thermal_robot import CampaignError
from thermal_robot.campaign import Units
from thermal_robot.correction import dh_table
from thermal_robot.correction.robot_files import CONVENTIONS
from thermal_robot.kinematics import Displacement, tool_poses

ROWS = 10


def turn(axis, angle):
    """Rotation about x, y or z, rad."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array(
        {
            "x": [[1, 0, 0, 0], [0, cosine, -sine, 0], [0, sine, cosine, 0], [0, 0, 0, 1]],
            "y": [[cosine, 0, sine, 0], [0, 1, 0, 0], [-sine, 0, cosine, 0], [0, 0, 0, 1]],
            "z": [[cosine, -sine, 0, 0], [sine, cosine, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]],
        }[axis]
    )


def shift(x, y, z):
    pose = np.eye(4)
    pose[:3, 3] = x, y, z
    return pose


def led(table, commands):
    """Where a table leads: its own kinematics, of rad and m, by the commands of joints."""
    pose = np.eye(4)
    for row in table.to_dict("records"):
        a = {name.split(" ")[0]: value for name, value in row.items()}
        if a["type"] in ("base", "tool"):
            turned = turn("z", a["yaw"]) @ turn("y", a["pitch"]) @ turn("x", a["roll"])
            pose = pose @ shift(a["x"], a["y"], a["z"]) @ turned
            continue
        moved = a["multiplier"] * commands[a["follows"]] if a["multiplier"] else 0.0
        slides = a["type"] == "prismatic"
        joint = turn("z", a["theta"] + (0 if slides else moved)) @ shift(0, 0, a["d"] + (moved if slides else 0))
        link = shift(a["a"], 0, 0) @ turn("x", a["alpha"]) @ turn("y", a["beta"])
        pose = pose @ (joint @ link if a["convention"] == "standard" else link @ joint)
    return pose


def written(robot, *how):
    return pd.read_csv(io.StringIO(dh_table(robot, *how).to_csv(index=False)))


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_a_table_that_is_written_leads_to_the_models_poses(arm, convention, configurations):
    q = configurations(arm, ROWS, seed=3)
    for size in (0.0, 1e-3, 3e-2):
        robot = displaced(arm, seed=2, size=size)
        table = written(robot, convention)
        seen = [led(table, dict(zip(arm.joint_names, row, strict=True))) for row in q]
        expected = tool_poses(arm, q, robot.displacement) @ robot.target
        np.testing.assert_allclose(seen, expected, rtol=0, atol=1e-9)


@given(arms())
def test_any_arm_has_a_table(arm):
    robot = displaced(arm, seed=8)
    q = np.random.default_rng(9).uniform(np.maximum(arm.lower, -3.0), np.minimum(arm.upper, 3.0), (3, arm.n))
    for convention in CONVENTIONS:
        table = written(robot, convention)
        seen = [led(table, dict(zip(arm.joint_names, row, strict=True))) for row in q]
        np.testing.assert_allclose(seen, tool_poses(arm, q, robot.displacement) @ robot.target, rtol=0, atol=1e-9)


def test_the_table_of_a_sound_ur10_is_its_makers():
    """Universal Robots' own table: d 0.1273 0 0 0.163941 0.1157 0.0922, a 0 −0.612 −0.5723, α ±90° where axes cross."""
    arm = load_arm("ur10")
    table = dh_table(displaced(arm, 0, size=0.0, target=False))[1:-1]
    np.testing.assert_allclose(np.abs(table["a [m]"]), [0, 0.612, 0.5723, 0, 0, 0], atol=1e-9)
    crossing = np.isclose(np.abs(table["alpha [rad]"]), np.pi / 2)
    assert crossing.tolist() == [True, False, False, True, True, False]
    np.testing.assert_allclose(table["beta [rad]"], 0.0, atol=1e-9)
    np.testing.assert_allclose(np.abs(table["d [m]"]), [0.1273, 0, 0, 0.163941, 0.1157, 0.0922], atol=1e-4)


def test_a_calibrated_table_differs_little_from_the_nominal_one(rv_m2):
    """So that a controller's table can be corrected by the difference; axes that coincide are the exception."""
    robot = displaced(rv_m2, 4, size=1e-4, target=False)
    sound = replace(robot, displacement=Displacement(np.zeros(5), np.zeros((len(rv_m2.segments), 6))))
    after, before = (dh_table(r, "modified")[1:-2] for r in (robot, sound))
    for name in ("theta [rad]", "a [m]", "alpha [rad]", "beta [rad]", "d [m]"):
        apart = np.abs(after[name] - before[name])
        assert apart.max() < 2e-3, name
        assert apart.max() > 1e-6, name


def test_units_are_those_that_are_asked_for_and_said(rv_m2):
    robot = displaced(rv_m2, 1)
    plain, other = dh_table(robot), dh_table(robot, "standard", Units("deg", "mm"))
    np.testing.assert_allclose(np.radians(other["alpha [deg]"]), plain["alpha [rad]"])
    np.testing.assert_allclose(other["a [mm]"], 1e3 * plain["a [m]"])
    np.testing.assert_allclose(other["x [mm]"], 1e3 * plain["x [m]"])
    with pytest.raises(CampaignError, match="standard or modified"):
        dh_table(robot, "paul")
