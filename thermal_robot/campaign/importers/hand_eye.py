"""Hand-eye data: joint states and samples of MoveIt's calibration; corners that OpenCV found in images.

Source of MoveIt's: github.com/moveit/moveit_calibration, ``handeye_control_widget.cpp``: joint states are a map of
``joint_names`` and ``joint_values``, a list for each sample; samples a list of maps with ``effector_wrt_world`` and
``object_wrt_sensor``, 4 × 4 each as sixteen figures; rad and m. What the camera says of the board is its pose in the
camera's frame: with the camera in the room it is an instrument that measures the pose of a target on the tool. With the
camera on the hand the inverse is the camera's pose in the board's frame. Which of the two it is follows from the poses
themselves: the motions that hand and eye see turn about axes that one rotation takes into each other (Park and Martin,
*IEEE Transactions on Robotics and Automation* 10, 1994). Samples of easy_handeye hold no joints: they are no campaign.

OpenCV: a row for each corner, u v of ``findChessboardCorners`` or ``detectMarkers``, undistorted, in pixels, and X Y Z
of the corner on the board as ``calibrateCamera`` is given it; a column ``image``; and a second table with the joints at
each image. The mapping has ``[camera.NAME]``: fx, fy, cx, cy and the mount.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.campaign.document import read_yaml
from thermal_robot.campaign.importers.plan import Format, Plan, Source, planned
from thermal_robot.campaign.importers.table import joined
from thermal_robot.campaign.names import ORIENTATION, POSITION
from thermal_robot.campaign.table import Cells, Table, read_table
from thermal_robot.errors import CampaignError
from thermal_robot.kinematics import align, log3, rotation_to_quaternion

_HAND, _EYE = "effector_wrt_world", "object_wrt_sensor"
_LEAST_TURN = 0.05  # rad: the axis of a smaller turn is lost in what a camera sees of it


def _poses(file: str, samples: Sequence[Any], key: str) -> Array:
    """(N, 4, 4) of all samples, whichever way the sixteen figures are laid out."""
    try:
        found = np.array([sample[key] for sample in samples], dtype=float).reshape(-1, 4, 4)
    except (TypeError, KeyError, ValueError) as error:
        raise CampaignError(file, f"samples lack {key}", expected="sixteen figures of a 4 × 4 matrix") from error
    upright = np.allclose(found[:, 3], [0.0, 0.0, 0.0, 1.0])
    return found if upright else np.asarray(found.transpose(0, 2, 1))


def _apart(one: Array, other: Array) -> float:
    """Return how far the axes of turns are from one common rotation of the others: rms over their size."""
    origin = np.zeros((1, 3))
    first, second = (np.concatenate([own, -own, origin]) for own in (one, other))
    turn = align(first, second, np.ones(len(first)))[:3, :3]
    return float(np.linalg.norm(one @ turn.T - other) / np.linalg.norm(other))


def on_the_hand(hand: Array, eye: Array) -> bool:
    """Tell whether the camera moves with the hand, from poses (N, 4, 4) of both: see the module's text."""
    hand, eye = hand[:, :3, :3], eye[:, :3, :3]
    seen = log3(eye[1:] @ eye[:-1].transpose(0, 2, 1))
    moved = log3(hand[1:].transpose(0, 2, 1) @ hand[:-1]), log3(hand[1:] @ hand[:-1].transpose(0, 2, 1))
    large = np.linalg.norm(seen, axis=1) > _LEAST_TURN
    with_it, before_it = (_apart(own[large], seen[large]) for own in moved)
    return with_it < before_it


def _moveit(files: Sequence[Path], plan: Plan) -> Source:
    """Read joint states and samples, in either order."""
    read = {str(file): (read_yaml(file) or [None])[0] for file in files}
    states = next(((name, own) for name, own in read.items() if isinstance(own, dict)), None)
    samples = next(((name, own) for name, own in read.items() if isinstance(own, list)), None)
    if states is None or samples is None or not {"joint_names", "joint_values"} <= {*states[1]}:
        expected = "joint states (joint_names, joint_values) and samples (a list), both as MoveIt saves them"
        raise CampaignError(str(files[0]), "these are no such files", expected=expected)
    (name, own), (file, listed) = states, samples
    values = np.array(own["joint_values"], dtype=float)
    if values.shape != (len(listed), len(own["joint_names"])):
        found, expected = f"{len(values)} joint states, {len(listed)} samples", "as many of both, in the same order"
        raise CampaignError(name, "does not belong to the samples", found=found, expected=expected)
    hand, eye = _poses(file, listed, _HAND), _poses(file, listed, _EYE)
    mounted = on_the_hand(hand, eye)
    seen = np.linalg.inv(eye) if mounted else eye
    columns: dict[str, Cells] = dict(zip(map(str, own["joint_names"]), values.T, strict=True))
    columns |= dict(zip(POSITION, seen[:, :3, 3].T, strict=True))
    columns |= dict(zip(ORIENTATION, rotation_to_quaternion(seen[:, :3, :3]).T, strict=True))
    units: dict[str, dict[str, Any]] = {"measurements": {"angle_unit": "rad", "length_unit": "m"}}
    where = "on the hand: the target is the camera" if mounted else "in the room: the target is the board"
    table = Table(file, columns, np.arange(1, len(listed) + 1))
    return Source(table, planned(units), (f"the camera is {where}",))


def _corners(files: Sequence[Path], plan: Plan) -> Source:
    """Read corners by image, and the joints at each image; the one camera that the mapping states sees them."""
    cameras = [*plan.sections.get("camera", {})]
    corners, states = (read_table(file, plan.layout()) for file in files)
    if "camera" not in corners.columns and len(cameras) != 1:
        expected = "[camera.NAME] with fx, fy, cx, cy and mount in the file of --mapping, or a column camera"
        raise CampaignError(str(files[0]), "it is not clear which camera saw this", expected=expected)
    both, notes = joined(corners, states, "image")
    columns: dict[str, Any] = {"u": "u", "v": "v"}
    columns |= {f"board.{axis}": axis.upper() for axis in "xyz" if axis.upper() in both.columns}
    if "camera" not in both.columns:
        columns["camera"] = {"value": cameras[0]}
    sections: dict[str, dict[str, Any]] = {
        "robot": {"moves": "unknown"},
        "measurements": {"kind": "pixel"},
        "columns": columns,
    }
    return Source(both, planned(sections), notes)


MOVEIT = Format(
    "joint states and samples of MoveIt's hand-eye calibration, as YAML", "JOINTS.yaml SAMPLES.yaml", _moveit, least=2
)
CORNERS = Format(
    "corners that OpenCV found in images, and the joints at each image", "CORNERS.csv JOINTS.csv", _corners, least=2
)
