"""Headers of other programs: what is found under them, in which unit, and what is left as it is."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from thermal_robot.campaign import campaign_from_table
from thermal_robot.campaign.campaign import Campaign
from thermal_robot.campaign.recognise import bare, headings, joint_columns
from thermal_robot.campaign.units import Units
from thermal_robot.campaign.write import with_commands
from thermal_robot.robot import Robot, load_robot

ARMS = {
    5: ("builtin:rv_m2", "tool0"),
    6: ("example-robot-data:ur5", "tool0"),
    7: ("example-robot-data:panda", "panda_link8"),
}
"""Robots by their number of joints."""


def arm(n: int = 6) -> Robot:
    if n > 5:
        pytest.importorskip("example_robot_data")
    return load_robot(*ARMS[n])


@pytest.mark.parametrize(
    ("column", "name", "unit"),
    [
        ("X [mm]", "X", "mm"),
        ("X (mm)", "X", "mm"),
        ("x_mm", "x", "mm"),
        ("x_m", "x_m", None),
        ("A1 [°]", "A1", "deg"),
        ("A1[Degrees]", "A1", "deg"),
        ("velocity.a (rad/s)", "velocity.a", "rad/s"),
        ("acceleration.a [deg/s^2]", "acceleration.a", "deg/s²"),
        ("temperature [°C]", "temperature", "°C"),
        ("torque.a [Nm]", "torque.a", "N·m"),
        ("z [µm]", "z", "um"),
        ("actual_q[0]", "actual_q[0]", None),
        ("X [measured]", "X [measured]", None),
    ],
)
def test_a_header_and_its_unit(column: str, name: str, unit: str | None) -> None:
    assert (bare(column).column, bare(column).unit) == (name, unit)


@pytest.mark.parametrize("n", ARMS)
@pytest.mark.parametrize(
    "spelled", ["A{1} [deg]", "J{1}", "Joint {1} (rad)", "axis_{1}/position", "actual_q_{0}", "actual_q{0}", "q[{0}]",
                "theta{1}_deg", "target_q_{0}"]
)  # fmt: skip
def test_numbered_columns_are_the_joints_in_order(n: int, spelled: str) -> None:
    robot = arm(n)
    columns = [spelled.format(k, k + 1) for k in range(n)]
    known = headings([*columns, "other"], robot)
    assert [known[joint].column for joint in robot.joint_names] == columns
    assert not headings(columns[:-1], robot), "one joint is lacking: nobody knows which"
    taken = headings([*columns, *robot.joint_names], robot)
    assert not set(taken) & set(robot.joint_names), "a joint's own name counts first"


def test_what_was_commanded_counts_for_more_than_what_encoders_said() -> None:
    robot = arm()
    known = headings([f"{what}_q_{k}" for what in ("actual", "target") for k in range(6)], robot)
    assert known["elbow_joint"].column == "target_q_2"
    assert known["encoder.elbow_joint"].column == "actual_q_2"


def test_joints_by_name() -> None:
    columns = ["a/velocity", "a/position", "/states/b/position", "c", "/c/position"]
    assert joint_columns(columns, "abcd") == {"a": "a/position", "b": "/states/b/position", "c": "c"}
    assert joint_columns(["/one/a/position", "/two/a/position"], "a") == {}, "either may be meant"


def table(robot: Robot, header: list[str], scales: list[float]) -> tuple[Campaign, pd.DataFrame]:
    """A campaign in rad and m, and its table under another header and in other units."""
    rng = np.random.default_rng(5)
    q = rng.uniform(-1, 1, (8, robot.n))
    plain = pd.DataFrame(q, columns=list(robot.joint_names))
    plain[["x", "y", "z"]] = robot.forward(q)[:, :3, 3]
    plain["temperature"] = rng.uniform(20, 25, 8)
    spelled = (plain * np.array(scales)).set_axis(header, axis=1)
    return campaign_from_table(robot, plain), spelled


@pytest.mark.parametrize("n", ARMS)
@pytest.mark.parametrize(("angle", "length"), [("rad", "m"), ("deg", "um")])
def test_a_unit_in_the_header_counts_whatever_is_declared(n: int, angle: str, length: str) -> None:
    robot = arm(n)
    header = [*(f"A{k + 1} [deg]" for k in range(n)), "X [mm]", "Y (mm)", "z_mm", "Temperature [°C]"]
    plain, spelled = table(robot, header, [180 / np.pi] * n + [1e3] * 3 + [1.0])
    campaign = campaign_from_table(robot, spelled, angle_unit=angle, length_unit=length)
    np.testing.assert_allclose(campaign.q, plain.q, rtol=0, atol=1e-12)
    np.testing.assert_allclose(campaign.position, plain.position, rtol=0, atol=1e-12)
    np.testing.assert_allclose(campaign.covariates["temperature"], plain.covariates["temperature"])
    told = [warning for warning in campaign.warnings if "as headers say" in warning]
    assert [warning.count("read in mm") for warning in told if "'X [mm]', 'Y (mm)', 'z_mm'" in warning] == [1]
    assert len([warning for warning in told if "read in deg" in warning]) == (angle == "rad")


def test_columns_of_the_users_own_stay() -> None:
    robot = arm()
    extra = ["Speed [mm/s]", "temperature_min", "RH [%]", "X [deg]", "Noise"]
    known = headings([*robot.joint_names, "x", "y", "z", *extra], robot)
    assert known == {}
    assert headings(["X [mm]", "X (m)"], robot) == {}, "either may be meant"


def test_corrected_commands_stand_under_their_header_and_in_its_unit() -> None:
    robot = arm()
    samples = pd.DataFrame([[10.0] * 6 + [1.0]], columns=[*(f"A{k} [deg]" for k in range(1, 7)), "X [mm]"])
    given = with_commands(samples, robot, [[0.1] * 6], [[0.0] * 3], [[]], [0.0], Units("rad", "m"))
    np.testing.assert_allclose(given[samples.columns[:6]].to_numpy(), np.rad2deg(0.1))
    assert "X [mm]" not in given  # what was measured belongs to the old commands
