"""FIGAROH's data: its columns, both layouts of its configuration, several markers, orientations only once declared."""

import numpy as np
import pytest
from campaign.importers.written import complaint, imported, put, rotations

DATA = """x1,y1,z1,phix1,phiy1,phiz1,x2,y2,z2,turn,lift,slide,roll,shipped_row
1.0,0.1,0.5,0.1,0.2,0.3,2,2,2,0.1,0.2,0.03,0.4,0
0.9,0.2,0.6,0,0,1.5707963267948966,2,2,2,-0.1,0.3,0.06,3.5,1
0.8,0.3,0.7,0.5,0,0,2,2,2,0.5,-0.4,0.09,-0.4,2
"""
UNIFIED = """
extends: "../templates/manipulator_robot.yaml"
tasks:
  calibration:
    kinematics: {base_frame: "universe", tool_frame: "tool"}
    measurements:
      markers:
        - {name: m, measurable_dof: [true, true, true, true, true, true]}
      poses:
        tool_pose: [0.1, 0.2, 0.3, 0.0, 0.0, 0.0]
"""
LEGACY = """
calibration:
  calib_level: full_params
  base_frame: universe
  tool_frame: tool
  markers: [{ref_joint: roll, measure: [True, True, True, False, False, False]}]
  tip_pose: [0.1, 0.2, 0.3, 0.0, -1.57, -1.57]
"""


@pytest.mark.parametrize("text", [UNIFIED, LEGACY], ids=["unified", "legacy"])
def test_the_configuration_names_the_chain_and_the_target(tmp_path, capsys, text):
    folder = put(tmp_path, d__csv=DATA, c__yaml=text)
    robot = ("--robot", str(folder / "robot.urdf"))
    campaign, out = imported(capsys, folder, "figaroh", "d.csv", "c.yaml", *robot, robot=False)
    np.testing.assert_allclose(campaign.position, [[1.0, 0.1, 0.5], [0.9, 0.2, 0.6], [0.8, 0.3, 0.7]])
    np.testing.assert_allclose(campaign.q[:, 2], [0.03, 0.06, 0.09])
    assert campaign.robot.tool_frame == "tool"
    np.testing.assert_allclose(campaign.target, [0.1, 0.2, 0.3])
    assert "marker 1 of 2 taken" in out
    assert campaign.orientation is None
    assert "phix1 phiy1 phiz1 left out" in out


@pytest.mark.parametrize(
    ("kind", "second"),
    [
        ('kind = "rotation_vector"\nunit = "rad"', "vector"),
        ('kind = "euler"\nsequence = "xyz"\nunit = "rad"', "angles"),
    ],
)
def test_an_orientation_is_taken_once_the_mapping_says_what_it_is(tmp_path, capsys, kind, second):
    mapping = f'[orientation]\n{kind}\ncolumns = ["phix1", "phiy1", "phiz1"]\n'
    folder = put(tmp_path, d__csv=DATA, m__toml=mapping)
    campaign, _ = imported(capsys, folder, "figaroh", "d.csv", "--mapping", str(folder / "m.toml"))
    turned = rotations(campaign)
    np.testing.assert_allclose(turned[1], [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-12)
    angle = np.arccos((np.trace(turned[0]) - 1) / 2)
    is_vector = np.isclose(angle, np.linalg.norm([0.1, 0.2, 0.3]), atol=1e-9)
    assert is_vector == (second == "vector")


def test_another_marker(tmp_path, capsys):
    mapping = '[columns]\nx = "x2"\ny = "y2"\nz = "z2"\n'
    folder = put(tmp_path, d__csv=DATA, m__toml=mapping)
    campaign, _ = imported(capsys, folder, "figaroh", "d.csv", "--mapping", str(folder / "m.toml"))
    np.testing.assert_allclose(campaign.position, 2.0)


def test_what_is_no_configuration(tmp_path, capsys):
    folder = put(tmp_path, d__csv=DATA, c__yaml="robot: ur10\n", broken__yaml="a: [1,\nb: 2\n")
    said = complaint(capsys, folder, "figaroh", "d.csv", "c.yaml")
    assert "c.yaml, calibration: is no configuration of FIGAROH, expected tasks.calibration" in said
    assert "broken.yaml, row 3: not valid YAML" in complaint(capsys, folder, "figaroh", "d.csv", "broken.yaml")
    less = DATA.replace("slide", "slid")
    (folder / "d.csv").write_text(less)
    assert "d.csv, row 1, column 'slide': there is no such column" in complaint(capsys, folder, "figaroh", "d.csv")
