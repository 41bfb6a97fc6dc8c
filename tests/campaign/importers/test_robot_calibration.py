"""robot_calibration: samples as text of messages, capture poses with a table of points; FIGAROH: data and markers."""

import shutil

import numpy as np
import pytest
from campaign.importers.written import complaint, imported, put, rotations

STATE = """joint_states:
  header: {{seq: {k}, stamp: {{secs: 1, nsecs: 0}}, frame_id: ''}}
  name: [roll, turn, lift, slide, head_pan]
  position: [{roll}, {turn}, {lift}, {slide}, 0.0]
  velocity: []
  effort: []
observations:
  - sensor_name: {sensor}
    features: {features}
    cloud: {{data: []}}
---
"""
POINT = "[{{header: {{frame_id: cam}}, point: {{x: {x}, y: 0.5, z: 1.5}}}}, {{point: {{x: 9.0, y: 9.0, z: 9.0}}}}]"
POSES = """
- joints: [turn, lift, slide, roll]
  positions: [0.1, 0.2, 0.03, 0.4]
  features: [f]
- joints: [roll, slide, lift, turn]
  positions: [3.5, 0.06, 0.3, -0.1]
- {joints: [turn, lift, slide, roll], positions: [0.5, -0.4, 0.09, -0.4]}
"""


def samples(count=4, sensor="camera", unseen=()):
    parts = []
    for k in range(count):
        features = "[]" if k in unseen else POINT.format(x=0.1 * k)
        parts.append(
            STATE.format(k=k, roll=k, turn=0.1 * k, lift=0.2, slide=0.01 * k, sensor=sensor, features=features)
        )
    return "".join(parts)


def test_samples(tmp_path, capsys):
    folder = put(tmp_path, s__yaml=samples(5, unseen=[2]))
    campaign, out = imported(capsys, folder, "robot_calibration", "s.yaml")
    np.testing.assert_allclose(campaign.position[:, 0], [0.0, 0.1, 0.3, 0.4])
    np.testing.assert_allclose(campaign.q, [[0.1 * k, 0.2, 0.01 * k, k] for k in (0, 1, 3, 4)])
    assert "feature 1 of sensor 'camera' taken as the target; 5 rows read, 4 taken; 1 row (3) left out" in out


def test_samples_in_one_list_are_those_of_documents_of_their_own(tmp_path, capsys):
    each = [part for part in samples(4).split("---\n") if part.strip()]
    whole = "".join("- " + part.strip().replace("\n", "\n  ") + "\n" for part in each)
    folder = put(tmp_path, s__yaml=samples(4), list__yaml=whole)
    apart, _ = imported(capsys, folder, "robot_calibration", "s.yaml")
    together, _ = imported(capsys, folder, "robot_calibration", "list.yaml")
    np.testing.assert_array_equal(together.position, apart.position)
    np.testing.assert_array_equal(together.q, apart.q)


def test_another_sensor_and_feature(tmp_path, capsys):
    both = samples(4).replace(
        "  - sensor_name: camera", "  - {sensor_name: arm, features: []}\n  - sensor_name: camera"
    )
    mapping = '[recording]\nsensor = "camera"\nfeature = 2\n'
    folder = put(tmp_path, s__yaml=both, m__toml=mapping)
    campaign, _ = imported(capsys, folder, "robot_calibration", "s.yaml", "--mapping", str(folder / "m.toml"))
    np.testing.assert_allclose(campaign.position, 9.0)
    shutil.rmtree(folder / "made")
    said = complaint(capsys, folder, "robot_calibration", "s.yaml")
    assert "it is not clear which sensor measured; found 'arm', 'camera', expected [recording] sensor" in said


def test_capture_poses_with_measured_points(tmp_path, capsys):
    folder = put(tmp_path, p__yaml=POSES, m__csv="x,y,z\n1,2,3\n4,5,6\n7,8,9\n")
    campaign, _ = imported(capsys, folder, "robot_calibration", "p.yaml", "m.csv")
    np.testing.assert_allclose(campaign.q[1], [-0.1, 0.3, 0.06, 3.5])
    np.testing.assert_allclose(campaign.position[2], [7, 8, 9])


def test_what_is_no_sample(tmp_path, capsys):
    folder = put(tmp_path, p__yaml=POSES, s__yaml="- 3\n", odd__yaml=samples(3).replace("point:", "place:"))
    assert "p.yaml: holds poses and no measurements" in complaint(capsys, folder, "robot_calibration", "p.yaml")
    assert "s.yaml, [0]: is no sample; found 3" in complaint(capsys, folder, "robot_calibration", "s.yaml")
    assert "odd.yaml, [0]: is no sample" in complaint(capsys, folder, "robot_calibration", "odd.yaml")
    less = samples(3).replace("slide", "slid")
    (folder / "s.yaml").write_text(less)
    assert "column 'slide': there is no such column" in complaint(capsys, folder, "robot_calibration", "s.yaml")


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
