"""Files of those who measured without an instrument: sockets of MUKCa, hand-eye sets of MoveIt, corners of OpenCV."""

import numpy as np
import pytest
import yaml

import thermal_robot as tr
from thermal_robot.campaign.importers.plan import Plan, planned, read_mapping
from thermal_robot.campaign.importers.run import import_files
from thermal_robot.errors import CampaignError
from thermal_robot.inference.registration import register
from thermal_robot.kinematics import exp6, tool_poses
from thermal_robot.observations import observe

ROBOT = {"robot": {"urdf": "example-robot-data:ur10", "tool_frame": "tool0"}}
EYE = exp6(np.array([0.03, -0.02, 0.08, 0.2, -0.1, 1.2]))
BOARD = exp6(np.array([0.7, 0.2, 0.1, 2.9, 0.1, 0.3]))


@pytest.fixture(scope="module")
def robot():
    return tr.load_robot("example-robot-data:ur10", "tool0")


@pytest.fixture(scope="module")
def q(robot):
    return np.random.default_rng(4).uniform(-1.2, 1.2, (16, robot.n))


def test_folders_of_sockets_make_a_campaign(robot, q, tmp_path):
    for stand in ("front", "left high"):
        for hole in (0, 1):
            file = tmp_path / "arm" / stand / f"hole_{hole}.csv"
            file.parent.mkdir(parents=True, exist_ok=True)
            np.savetxt(file, q[4 * hole : 4 * hole + 4], delimiter=",")
            np.savetxt(file.with_name(f"hole_{hole}_pose.csv"), np.zeros((4, 16)), delimiter=",")
    campaign = import_files("mukca", [tmp_path / "arm"], tmp_path / "out", planned(ROBOT)).campaign
    assert campaign.kinds == ("socket",)
    assert campaign.samples == 16
    assert campaign.numbered["stand"][0] == ("front", "left high")
    assert np.array_equal(campaign.q[4:8], q[4:8])
    assert not any(name.startswith("approach") for name in campaign.covariates)
    assert tr.read_campaign(tmp_path / "out").kinds == ("socket",)
    with pytest.raises(CampaignError, match="no readings of sockets"):
        import_files("mukca", [tmp_path / "out"], tmp_path / "other", planned(ROBOT))


@pytest.mark.parametrize("mount", ["hand", "room"])
@pytest.mark.parametrize("rows_first", [True, False])
def test_a_hand_eye_set_is_a_campaign_of_poses(robot, q, tmp_path, mount, rows_first):
    pytest.importorskip("yaml")
    hand = tool_poses(robot, q)
    seen = np.linalg.inv(hand @ EYE) @ BOARD if mount == "hand" else np.linalg.inv(BOARD) @ hand @ EYE
    flat = [(own if rows_first else own.transpose(0, 2, 1)).reshape(-1, 16).tolist() for own in (hand, seen)]
    samples = [{"effector_wrt_world": one, "object_wrt_sensor": two} for one, two in zip(*flat, strict=True)]
    states = {"joint_names": list(robot.joint_names), "joint_values": q.tolist()}
    for name, content in (("joints", states), ("samples", samples)):
        (tmp_path / f"{name}.yaml").write_text(yaml.safe_dump(content))
    files = [tmp_path / "samples.yaml", tmp_path / "joints.yaml"]
    found = import_files("moveit", files, tmp_path / "out", planned(ROBOT))
    assert any(f"the camera is {'on the hand' if mount == 'hand' else 'in the room'}" in note for note in found.notes)
    gap = observe(found.campaign, register(found.campaign)).gap
    assert np.abs(gap).max() < 1e-6


SAMPLE = {"effector_wrt_world": np.eye(4).ravel().tolist(), "object_wrt_sensor": np.eye(4).ravel().tolist()}


@pytest.mark.parametrize(
    ("values", "samples", "said"),
    [
        ([[0.0] * 6, [0.0]], [SAMPLE] * 2, r"joints\.yaml, joint_values\[1\]: .* expected a list of 6 values"),
        ([["a"] * 6], [SAMPLE], r"joint_values\[0\]\[0\]: is 'a', expected a finite number"),
        ([[0.0] * 6], [SAMPLE] * 2, "found 1 joint states, 2 samples"),
        ([[0.0] * 6], [{**SAMPLE, "object_wrt_sensor": [0.0] * 16}], r"\[0\]\.object_wrt_sensor: is no pose"),
        ([[0.0] * 6], [{**SAMPLE, "effector_wrt_world": [np.nan] * 16}], r"\[0\]\.effector_wrt_world: is no pose"),
        ([[0.0] * 6] * 3, [SAMPLE] * 3, "do not tell whether the camera is on the hand"),
    ],
)
def test_a_hand_eye_set_that_cannot_be_used_is_refused(robot, tmp_path, values, samples, said):
    states = {"joint_names": list(robot.joint_names), "joint_values": values}
    (tmp_path / "joints.yaml").write_text(yaml.safe_dump(states))
    (tmp_path / "samples.yaml").write_text(yaml.safe_dump(samples))
    with pytest.raises(CampaignError, match=said):
        import_files("moveit", [tmp_path / "joints.yaml", tmp_path / "samples.yaml"], tmp_path, planned(ROBOT))


def seen_corners(robot, q, folder, columns, cells, points):
    """Write corners on the tool at known points (K, 3), m, as a camera in the room sees them; return the files."""
    lens, camera = 800.0, exp6(np.array([0.0, 0.0, 3.0, np.pi, 0.0, 0.0]))
    board = tool_poses(robot, q) @ EYE
    seen = np.einsum("nij,kj->nki", board[:, :3, :3], points) + board[:, None, :3, 3]
    inside = (seen - camera[:3, 3]) @ camera[:3, :3]
    pixels = lens * inside[:, :, :2] / inside[:, :, 2:] + 500.0
    corners = [f"image,{columns},u,v"]
    corners += [f"{n}.png,{cell},{u},{v}" for n in range(len(q)) for cell, (u, v) in zip(cells, pixels[n], strict=True)]
    states = [",".join(["picture", *robot.joint_names])]
    states += [",".join([f"{n}.png", *map(repr, map(float, row))]) for n, row in enumerate(q)]
    (folder / "corners.csv").write_text("\n".join(corners))
    (folder / "joints.csv").write_text("\n".join(states))
    (folder / "mapping.toml").write_text(
        '[robot]\nurdf = "example-robot-data:ur10"\ntool_frame = "tool0"\n[measurements]\nangle_unit = "rad"\n'
        f'length_unit = "mm"\n[camera.front]\nfx = {lens}\nfy = {lens}\ncx = 500\ncy = 500\nmount = "room"\n'
    )
    return [folder / "corners.csv", folder / "joints.csv"]


def test_corners_of_images_make_a_campaign_of_pixels(robot, q, tmp_path):
    points = np.array([[x, y, 0.0] for x in (0.0, 0.1) for y in (0.0, 0.05)])
    cells = [",".join(str(1e3 * each) for each in point) for point in points]
    files = seen_corners(robot, q, tmp_path, "X,Y,Z", cells, points)
    campaign = import_files("corners", files, tmp_path / "out", read_mapping(tmp_path / "mapping.toml")).campaign
    assert campaign.kinds == ("pixel",)
    assert campaign.samples == 4 * len(q)
    assert np.abs(observe(campaign, register(campaign)).gap).max() < 1e-6
    with pytest.raises(CampaignError, match="which camera"):
        import_files("corners", files, tmp_path / "other", Plan())


BOARDS = {
    # tags of 30 mm, 9 mm apart, two in a row: the first corners lie at 0, 30, 39 and 69 mm
    "target_type: aprilgrid\ntagRows: 1\ntagCols: 2\ntagSize: 0.03\ntagSpacing: 0.3": [
        (x, y) for y in (0.0, 0.03) for x in (0.0, 0.03, 0.039, 0.069)
    ],
    "target_type: checkerboard\ntargetRows: 3\ntargetCols: 2\nrowSpacingMeters: 0.04\ncolSpacingMeters: 0.05": [
        (x, y) for x in (0.0, 0.04, 0.08) for y in (0.0, 0.05)
    ],
    "target_type: circlegrid\ntargetRows: 2\ntargetCols: 2\nspacingMeters: 0.02\nasymmetricGrid: True": [
        (x + y, y) for y in (0.0, 0.02) for x in (0.0, 0.04)
    ],
}


@pytest.mark.parametrize("told", BOARDS, ids=lambda told: told.split()[1])
def test_numbers_of_corners_stand_for_places_on_a_board_of_kalibr(robot, q, tmp_path, told):
    points = np.array([(x, y, 0.0) for x, y in BOARDS[told]])
    files = [*seen_corners(robot, q, tmp_path, "corner", range(len(points)), points), tmp_path / "board.yaml"]
    files[2].write_text(told)
    mapping = read_mapping(tmp_path / "mapping.toml")
    campaign = import_files("corners", files, tmp_path / "out", mapping).campaign
    assert campaign.samples == len(points) * len(q)
    assert np.abs(observe(campaign, register(campaign)).gap).max() < 1e-6
    files[2].write_text(told.replace("Rows: ", "Rows: -"))
    with pytest.raises(CampaignError, match="Rows"):
        import_files("corners", files, tmp_path / "other", mapping)


def test_a_number_beyond_the_board_is_refused(robot, q, tmp_path):
    told, places = next(iter(BOARDS.items()))
    points = np.array([(x, y, 0.0) for x, y in places])
    files = [*seen_corners(robot, q, tmp_path, "corner", range(1, 1 + len(points)), points), tmp_path / "board.yaml"]
    files[2].write_text(told)
    with pytest.raises(CampaignError, match="no corner of the board") as refused:
        import_files("corners", files, tmp_path / "out", read_mapping(tmp_path / "mapping.toml"))
    assert "from 0 to 7" in str(refused.value)
