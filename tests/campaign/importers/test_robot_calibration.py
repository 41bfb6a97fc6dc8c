"""robot_calibration: samples as text of messages, and capture poses with a table of measured points."""

import numpy as np
from campaign.importers.written import complaint, imported, put

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
    said = complaint_of(capsys, folder)
    assert "it is not clear which sensor measured; found 'arm', 'camera', expected [recording] sensor" in said


def complaint_of(capsys, folder):
    import shutil

    shutil.rmtree(folder / "made")
    return complaint(capsys, folder, "robot_calibration", "s.yaml")


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
