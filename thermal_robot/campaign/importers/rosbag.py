"""Recordings of a robot's joints and of an instrument, in a bag or as CSV: a row for each standstill.

Which headers are known stands in :mod:`~thermal_robot.campaign.importers.ros_csv`. The joints are those that the robot
reports, and stand for the commands. Figures are in rad and m, as everywhere in ROS, unless the mapping says otherwise.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.campaign import names
from thermal_robot.campaign.importers.clock import lag
from thermal_robot.campaign.importers.mapped import Format, Source
from thermal_robot.campaign.importers.plan import Plan, planned
from thermal_robot.campaign.importers.ros_bag import ENDINGS, read_bag
from thermal_robot.campaign.importers.ros_csv import read_streams
from thermal_robot.campaign.importers.standstill import Pairs, Stream, paired
from thermal_robot.campaign.table import Cells, Table
from thermal_robot.campaign.units import Units
from thermal_robot.errors import CampaignError
from thermal_robot.files import is_folder
from thermal_robot.robot import Robot

_UNITS = {"measurements": {"angle_unit": "rad", "length_unit": "m"}}
_LIMITS = ("tolerance", "standstill", "velocity", "settling")


def _read(files: Sequence[Path], plan: Plan) -> Source:
    """Read both recordings, estimate how their clocks differ unless it is stated, and pair them at standstill."""
    own = planned(_UNITS)
    robot = plan.robot()
    settings = plan.over(own).settings(robot)
    joints, target = _streams(files, plan, robot)
    scales = _scales(target, settings.units, robot)
    known = plan.get("recording", "offset")
    if known is None:
        estimate = lag(joints.scaled(scales[0]), target.scaled(scales[1]), robot, np.array(settings.target))
        known = estimate.value
        clocks = (
            f"the robot's clock shows {estimate.value:.6f} ± {estimate.std:.6f} s more than the instrument's, "
            f"estimated from the motion, of which {1e3 * estimate.left:.2g} mm rms are left"
        )
    else:
        clocks = f"the robot's clock shows {known:g} s more than the instrument's, as stated"
    limits = {key: plan.get("recording", key) for key in _LIMITS}
    pairs = paired(
        joints.scaled(scales[0]), target, known, **{key: value for key, value in limits.items() if value is not None}
    )
    if not len(pairs.times):
        raise CampaignError(
            joints.file,
            "the robot never stands still long enough beside a sample of the target",
            found=f"{pairs.short} standstills too short, {pairs.lonely} without a sample",
            expected="standstills; [recording] standstill, velocity and tolerance in the mapping",
        )
    notes = [f"{len(joints.time)} joint states and {len(target.time)} samples of the target read", clocks]
    notes.append(f"{len(pairs.times)} standstills taken")
    if pairs.short:
        notes.append(f"{pairs.short} standstills left out, too short")
    if pairs.lonely:
        notes.append(f"{pairs.lonely} standstills left out, no sample of the target near")
    return Source(_table(joints, target, pairs, scales[0]), own, tuple(notes), (f"Clocks: {clocks}.",))


def _streams(files: Sequence[Path], plan: Plan, robot: Robot) -> tuple[Stream, Stream]:
    """Return the recordings of the joints and of the target, each from the one file that has it."""
    found: list[list[Stream]] = [[], []]
    for file in files:
        if file.suffix.lower() in ENDINGS or is_folder(file):
            topics = [plan.get("recording", key) for key in ("joints", "pose")]
            both = read_bag(file, robot.joint_names, *topics)
        else:
            both = read_streams(file, robot.joint_names)
        for streams, stream in zip(found, both, strict=True):
            streams += [stream] if stream is not None else []
    for streams, what in zip(found, ("joint states of the chain", "poses or points of the target"), strict=True):
        if len(streams) != 1:
            named = " and ".join(map(str, files))
            raise CampaignError(
                named,
                f"{'more than one file has' if streams else 'no file has'} {what}",
                expected=f"one recording of {what}",
            )
    return found[0][0], found[1][0]


def _scales(target: Stream, units: Units, robot: Robot) -> tuple[Array, Array]:
    """Return the SI values of one unit of each joint's and each of the target's columns."""
    turned = len(target.names) - len(names.POSITION)
    lengths = np.array([units.length_scale] * len(names.POSITION) + [1.0] * turned)
    return np.array([units.joint_scale(kind) for kind in robot.joint_types]), lengths


def _table(joints: Stream, target: Stream, pairs: Pairs, scale: Array) -> Table:
    """Return the pairs as a table in the columns of a campaign."""
    columns: dict[str, Cells] = dict(zip(joints.names, (pairs.joints / scale).T, strict=True))
    columns.update(zip(target.names, pairs.target.T, strict=True))
    columns["time"] = pairs.times - pairs.times[0]
    return Table(f"{joints.file} with {target.file}", columns, np.arange(1, len(pairs.times) + 1))


FORMAT = Format(
    "joint_states and poses of the target: ROS bags, or CSV of rostopic, ros2 topic echo, PlotJuggler",
    "BAG, or BAG POSES.csv, or JOINT_STATES.csv POSES.csv",
    _read,
)
