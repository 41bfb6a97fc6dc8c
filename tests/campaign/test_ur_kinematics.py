"""kinematics.yaml of Universal Robots: its origins become those of the URDF; what is of another robot is refused."""

import numpy as np
import pytest
import ur_arm
from scipy.spatial.transform import Rotation

from thermal_robot import CampaignError
from thermal_robot.campaign import read_campaign
from thermal_robot.campaign.ur_kinematics import FIGURES, with_kinematics
from thermal_robot.robot import load_robot


def moved(rng, lengths=ur_arm.LENGTHS):
    """Figures of a robot that differs from the nominal one by millimetres and milliradians."""
    rows = {link: np.array(row, float) + rng.normal(0, 2e-3, 6) for link, row in ur_arm.figures(lengths).items()}
    # the same rotation, as ur_calibration writes it: roll + π, π − pitch, yaw + π
    roll, pitch, yaw = rows["forearm"][3:]
    rows["forearm"][3:] = roll + np.pi, np.pi - pitch, yaw - np.pi
    rows["shoulder"][0] = 1e-5
    return {link: [float(v) for v in row] for link, row in rows.items()}


def chained(rows, q):
    """Where the flange's frame is: the product of origins and turns about z."""
    pose = Rotation.from_euler("z", np.pi), np.zeros(3)
    for row, angle in zip(rows.values(), q, strict=True):
        x, y, z, *rpy = row
        place = pose[1] + pose[0].apply([x, y, z])
        pose = pose[0] * Rotation.from_euler("xyz", rpy) * Rotation.from_euler("z", angle), place
    return pose[1]


@pytest.mark.parametrize("prefix", ["", "left_"])
@pytest.mark.parametrize("lengths", [ur_arm.LENGTHS, (0.15, -0.24, -0.21, 0.11, -0.085, 0.08)])
def test_the_origins_of_the_file_are_those_of_the_robot(tmp_path, lengths, prefix):
    rng = np.random.default_rng(3)
    rows = moved(rng, lengths)
    (tmp_path / "k.yaml").write_text(ur_arm.yaml(rows))
    nominal = load_robot(ur_arm.urdf(lengths, prefix), f"{prefix}tool0")
    robot = with_kinematics(nominal, tmp_path / "k.yaml")
    q = rng.uniform(-3, 3, (20, 6))
    expected = [chained(rows, angles) for angles in q]
    np.testing.assert_allclose(robot.forward(q)[:, :3, 3], expected, rtol=0, atol=1e-12)
    assert np.abs(nominal.forward(q)[:, :3, 3] - expected).max() > 1e-3


def refused(tmp_path, text, robot=None):
    (tmp_path / "k.yaml").write_text(text)
    with pytest.raises(CampaignError) as caught:
        with_kinematics(robot or load_robot(ur_arm.urdf(), "tool0"), tmp_path / "k.yaml")
    return str(caught.value)


def test_another_model_or_convention_is_refused(tmp_path):
    smaller = ur_arm.yaml(ur_arm.figures((0.16, -0.43, -0.39, 0.13, -0.1, 0.1)))
    assert "kinematics.shoulder: is of another model than 'arm'" in refused(tmp_path, smaller)
    assert "20.0 mm and 0 rad from the origin" in refused(tmp_path, smaller)
    pytest.importorskip("example_robot_data")
    older = load_robot("example-robot-data:ur5", "tool0")
    assert "no shoulder_lift_joint that turns about its z axis" in refused(tmp_path, smaller, older)
    assert "no shoulder_pan_joint" in refused(tmp_path, smaller, load_robot("builtin:rv_m2", "tool0"))


@pytest.mark.parametrize("text", ["", "a: 1\n", "kinematics: 3\n", "kinematics:\n  shoulder:\n    x: 0\n",
                                  ur_arm.yaml(ur_arm.figures()).replace("yaw: 0", "yaw: .nan")])  # fmt: skip
def test_what_is_no_kinematics_is_refused(tmp_path, text):
    assert f"is no kinematics.yaml, expected {', '.join(FIGURES)}" in refused(tmp_path, text)


def test_a_campaign_names_the_file(tmp_path):
    rows = moved(np.random.default_rng(4))
    (tmp_path / "k.yaml").write_text(ur_arm.yaml(rows))
    (tmp_path / "r.urdf").write_text(ur_arm.urdf())
    header = ",".join([*ur_arm.JOINTS, "x", "y", "z"])
    lines = [",".join(map(str, [*q, 1, 2, k])) for k, q in enumerate(np.eye(6))]
    (tmp_path / "m.csv").write_text("\n".join([header, *lines]) + "\n")
    told = '[robot]\nurdf = "r.urdf"\ntool_frame = "tool0"\nkinematics = "k.yaml"\n'
    (tmp_path / "campaign.toml").write_text(
        told + '[measurements]\nfile = "m.csv"\nangle_unit = "rad"\nlength_unit = "m"\n'
    )
    robot = read_campaign(tmp_path).robot
    np.testing.assert_allclose(robot.forward(np.zeros((1, 6)))[0, :3, 3], chained(rows, np.zeros(6)), atol=1e-12)
