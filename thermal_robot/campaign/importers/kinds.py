"""Importers of measurements without a tracker: hand-eye samples, board corners in images, a ball in sockets.

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

Kalibr: in place of X Y Z a column ``corner`` may hold the corner's number on a board, from 0, with the board's YAML
as a third file: github.com/ethz-asl/kalibr, wiki *Calibration targets*, ``GridCalibrationTarget*.cpp``: row by row,
of an aprilgrid two corners a tag in each row.

MUKCa, a ball on the tool that is held in each of two sockets of a stand: Franzese, Spahn, Kober and Della Santina,
*MUKCa: Accurate and Affordable Cobot Calibration Without External Measurement Devices* (arXiv 2503.12584),
github.com/platonics-delft/kinematics_calibration, ``data``, ``calibrate_fk/utils.py``: a folder for each place of the
stand, with ``hole_0.csv`` and ``hole_1.csv``, a row for each posture, joint positions in rad without a header; sockets
are 0.05 m apart. Files ``hole_0_pose.csv`` beside them hold what the controller made of it, and are left out. An arm
was led by hand from posture to posture. One table of all rows, with columns ``stand`` and ``socket``, is read, too.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.campaign.checked import beyond, first_true, no_rotation
from thermal_robot.campaign.document import read_yaml
from thermal_robot.campaign.importers.plan import IN_SI, Format, Plan, Source, column_name, planned
from thermal_robot.campaign.importers.table import joined
from thermal_robot.campaign.names import ORIENTATION, POSITION
from thermal_robot.campaign.table import Cells, Layout, Table, read_table
from thermal_robot.campaign.units import LENGTH_UNITS
from thermal_robot.errors import CampaignError
from thermal_robot.kinematics import align, log3, rotation_to_quaternion
from thermal_robot.schema import Kind, boolean, fitted, matrix, number, text, whole, word
from thermal_robot.schema import listed as list_of

_HAND, _EYE = "effector_wrt_world", "object_wrt_sensor"
_LEAST_TURN = 0.05  # rad: the axis of a smaller turn is lost in what a camera sees of it


def _poses(file: str, samples: Sequence[Any], key: str) -> Array:
    """Homogeneous transforms (N, 4, 4) under a key of all samples, row- or column-major; an invalid one is refused."""
    try:
        found = np.array([sample[key] for sample in samples], dtype=float).reshape(-1, 4, 4)
    except (TypeError, KeyError, ValueError) as error:
        raise CampaignError(file, f"samples lack {key}", expected="sixteen figures of a 4 × 4 matrix") from error
    found = found if np.allclose(found[:, 3], [0.0, 0.0, 0.0, 1.0]) else found.transpose(0, 2, 1)
    wrong = first_true(beyond(found.reshape(-1, 16)))
    wrong = first_true(no_rotation(found[:, :3, :3])) if wrong is None else wrong
    if wrong is not None:
        raise CampaignError(file, "is no pose", key=f"[{wrong}].{key}", expected="a rotation and a place")
    return found


def _apart(one: Array, other: Array) -> float:
    """Relative rms residual of the best rotation that takes rotation vectors ``one`` (N, 3) to ``other`` (N, 3)."""
    origin = np.zeros((1, 3))
    first, second = (np.concatenate([own, -own, origin]) for own in (one, other))
    turn = align(first, second, np.ones(len(first)))[:3, :3]
    return float(np.linalg.norm(one @ turn.T - other) / np.linalg.norm(other))


def _on_the_hand(file: str, hand: Array, eye: Array) -> bool:
    """Whether the camera is on the hand, not in the room, from hand poses and seen board poses (N, 4, 4).

    It is if one rotation maps the hand's motions in its own frame better to those seen than its motions in the world.
    """
    hand, eye = hand[:, :3, :3], eye[:, :3, :3]
    seen = log3(eye[1:] @ eye[:-1].transpose(0, 2, 1))
    large = np.linalg.norm(seen, axis=1) > _LEAST_TURN
    if not large.any():
        expected = f"poses that turn the camera by more than {_LEAST_TURN:g} rad"
        raise CampaignError(file, "samples do not tell whether the camera is on the hand", expected=expected)
    moved = log3(hand[1:].transpose(0, 2, 1) @ hand[:-1]), log3(hand[1:] @ hand[:-1].transpose(0, 2, 1))
    with_it, before_it = (_apart(own[large], seen[large]) for own in moved)
    return with_it < before_it


def _moveit(files: Sequence[Path], plan: Plan) -> Source:
    """Read MoveIt's joint states and hand-eye samples, two files in either order, as a table of joints and poses."""
    read = [(str(file), (read_yaml(file) or [None])[0]) for file in files]
    (name, own), (file, listed) = sorted(read, key=lambda each: isinstance(each[1], list))
    if not isinstance(own, dict) or not isinstance(listed, list) or not {"joint_names", "joint_values"} <= {*own}:
        expected = "joint states (joint_names, joint_values) and samples (a list), both as MoveIt saves them"
        raise CampaignError(str(files[0]), "these are no such files", expected=expected)
    joints = fitted(list_of(text("the name of a joint")), own["joint_names"], name, "joint_names")
    values = fitted(matrix((None, len(joints))), own["joint_values"], name, "joint_values")
    if len(values) != len(listed):
        found, expected = f"{len(values)} joint states, {len(listed)} samples", "as many of both, in the same order"
        raise CampaignError(name, "does not belong to the samples", found=found, expected=expected)
    hand, eye = _poses(file, listed, _HAND), _poses(file, listed, _EYE)
    mounted = _on_the_hand(file, hand, eye)
    seen = np.linalg.inv(eye) if mounted else eye
    columns: dict[str, Cells] = dict(zip(joints, values.T, strict=True))
    columns |= dict(zip(POSITION, seen[:, :3, 3].T, strict=True))
    columns |= dict(zip(ORIENTATION, rotation_to_quaternion(seen[:, :3, :3]).T, strict=True))
    where = "on the hand: the target is the camera" if mounted else "in the room: the target is the board"
    table = Table(file, columns, np.arange(1, len(listed) + 1))
    return Source(table, planned(IN_SI), (f"the camera is {where}",))


_COUNTED, _SIZED = whole(1), number(above=0.0, expected="a length above 0, m")
_GRID = {"targetRows": _COUNTED, "targetCols": _COUNTED}
_BOARDS: dict[str, dict[str, Kind]] = {
    "aprilgrid": {"tagRows": _COUNTED, "tagCols": _COUNTED, "tagSize": _SIZED, "tagSpacing": number(least=0.0)},
    "checkerboard": {**_GRID, "rowSpacingMeters": _SIZED, "colSpacingMeters": _SIZED},
    "circlegrid": {**_GRID, "spacingMeters": _SIZED, "asymmetricGrid": boolean},
}
"""Of each board of Kalibr what its YAML says: rows and columns first."""


def _board(file: Path) -> Array:
    """Points (K, 3) of a board of Kalibr, m, in the order of their numbers."""
    (said, *_) = read_yaml(file) or [{}]
    stated = said.get("target_type") if isinstance(said, dict) else said
    kind = fitted(word(_BOARDS), stated, str(file), "target_type")
    rows, columns, *sizes = (fitted(own, said.get(key), str(file), key) for key, own in _BOARDS[kind].items())
    twice = 2 if kind == "aprilgrid" else 1
    row, column = np.indices((twice * rows, twice * columns)).reshape(2, -1)
    if kind == "aprilgrid":
        size, gap = sizes
        x, y = (size * ((1.0 + gap) * (k // 2) + k % 2) for k in (column, row))
    elif kind == "checkerboard":
        x, y = sizes[0] * row, sizes[1] * column
    else:
        x, y = (sizes[0] * k for k in ((2 * column + row % 2, row) if sizes[1] else (row, column)))
    return np.stack([x, y, np.zeros(len(row))], axis=1)


def _on_board(corners: Table, file: Path, unit: str) -> Table:
    """Add columns X, Y, Z: the place of each row's corner number on a Kalibr board, in a unit of length."""
    name, points = column_name(corners, "corner"), _board(file) / LENGTH_UNITS[unit]
    numbers = corners.numbers(name)
    wrong = ~np.isin(numbers, np.arange(len(points)))
    expected = f"a whole number from 0 to {len(points) - 1}, as {file.name} has {len(points)} corners"
    corners.refuse(wrong, "is no corner of the board", name, expected, lambda row: f"{numbers[row]:g}")
    places = dict(zip("XYZ", points[numbers.astype(int)].T, strict=True))
    return replace(corners, columns={**corners.columns, **places})


_CORNERS: dict[str, Any] = {"robot": {"moves": "unknown"}, "measurements": {"kind": "pixel"}}


def _corners(files: Sequence[Path], plan: Plan) -> Source:
    """Read corners by image, and join the joints at each image; the mapping, or a column, states the camera."""
    cameras, unit = [*plan.sections.get("camera", {})], plan.sections.get("measurements", {}).get("length_unit", "m")
    corners, states = (read_table(file, plan.layout()) for file in files[:2])
    if len(files) > 2:
        corners = _on_board(corners, files[2], unit)
    if "camera" not in corners.columns and len(cameras) != 1:
        expected = "[camera.NAME] with fx, fy, cx, cy and mount in the file of --mapping, or a column camera"
        raise CampaignError(str(files[0]), "it is not clear which camera saw this", expected=expected)
    both, notes = joined(corners, states, column_name(corners, "image"))
    columns: dict[str, Any] = {"u": "u", "v": "v"}
    columns |= {} if "camera" in both.columns else {"camera": {"value": cameras[0]}}
    columns |= {f"board.{axis}": axis.upper() for axis in "xyz" if axis.upper() in both.columns}
    return Source(both, planned({**_CORNERS, "columns": columns}), notes)


MOVEIT = Format(
    "joint states and samples of MoveIt's hand-eye calibration, as YAML", "JOINTS.yaml SAMPLES.yaml", _moveit, least=2
)
CORNERS = Format(
    "corners found in images by OpenCV, or on a board of Kalibr, and the joints at each image",
    "CORNERS.csv JOINTS.csv [BOARD.yaml]",
    _corners,
    least=2,
    most=3,
)


_HOLE = re.compile(r"hole_(\d+)\.csv")
_APART = 50.0  # mm, OFFSET_DISTANCE of the source
_MOST = 1000  # files: no campaign has so many stands
_SOCKETS: dict[str, dict[str, Any]] = {
    "measurements": {"angle_unit": "rad", "length_unit": "mm", "kind": "socket"},
}


def _mukca(files: Sequence[Path], plan: Plan) -> Source:
    """Read MUKCa's joint readings at sockets: files ``hole_<k>.csv``, also in folders at any depth, or one table."""
    if len(files) == 1 and files[0].is_file() and not _HOLE.fullmatch(files[0].name):
        return Source(read_table(files[0], plan.layout()), planned(_SOCKETS))
    inside = [found for file in files for found in (sorted(file.rglob("hole_*.csv")) if file.is_dir() else [file])]
    holes = [(file, socket[1]) for file in inside if (socket := _HOLE.fullmatch(file.name))]
    if not holes:
        expected = "hole_0.csv, hole_1.csv in a folder for each place of the stand"
        raise CampaignError(str(files[0]), "holds no readings of sockets", expected=expected)
    tables = [read_table(file, Layout(header=False)) for file, _ in holes]
    wide = {len(table.columns) for table in tables}
    if len(wide) > 1:
        raise CampaignError(str(holes[0][0]), "other files have another number of joints", found=str(sorted(wide)))
    rows, joints = [len(table.rows) for table in tables], [f"joint {k + 1}" for k in range(wide.pop())]
    figures = np.vstack([np.column_stack([table.numbers(name) for name in table.columns]) for table in tables])
    columns: dict[str, Cells] = dict(zip(joints, figures.T, strict=True))
    columns["stand"] = np.repeat([file.parent.name for file, _ in holes], rows).tolist()
    columns["socket"] = np.repeat([socket for _, socket in holes], rows).tolist()
    columns["order"] = np.arange(float(sum(rows)))
    table = Table(str(holes[0][0].parent.parent), columns, np.arange(2, sum(rows) + 2))
    stands = len({*columns["stand"]})
    unread = f"{_APART:g} mm between two of a stand are not used: a row of kind 'spacing' says what was measured"
    note = f"{len(holes)} sockets on {stands} stands; {unread}"
    return Source(table, planned({**_SOCKETS, "columns": {"joints": joints}}), (note,))


MUKCA = Format(
    "a ball in printed sockets, read by the joints alone (MUKCa)", "FOLDERS or hole_0.csv …", _mukca, most=_MOST
)
