"""Zeros of a corrected model in the files that robots read: PAL's master_calibration.yaml, LeRobot's calibration.

**PAL.** Sources: pal-robotics/tiago_robot, ``tiago_description/urdf/calibration/eye_hand_calibration.urdf.xacro.j2``,
and tiago_pro_robot, ``calibration_offset.urdf.xacro.j2``: ``/etc/calibration/master_calibration.yaml`` has, under
``robot_state_publisher: ros__parameters:``, a section of the template's name with ``<joint>_offset`` in rad for the
joints of arms and head. It is the offset of the joint's transmission, joint = actuator / reduction + offset
(ros2_control, ``transmission_interface/SimpleTransmission``): a joint that stands at command + zero is read, and
commanded, where it stands once its zero is added to the offset. Frames of joints have no place in these templates.

**LeRobot.** Sources: huggingface/lerobot, ``motors/motors_bus.py``, ``motors/feetech/feetech.py`` and
``motors/dynamixel/dynamixel.py``: by motor ``id``, ``drive_mode``, ``homing_offset``, ``range_min`` and ``range_max``,
in ticks of 4096 a turn. A Feetech motor reports its position less the homing offset, a Dynamixel one its position plus
the offset; in degrees the zero is the middle of the range, which is told in reported ticks and stays.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np

from thermal_robot.campaign.document import read_yaml, yaml_text
from thermal_robot.correction.constant import zeros_in
from thermal_robot.correction.holding import FORMATS, TICK, expectation
from thermal_robot.correction.model import CorrectedModel
from thermal_robot.errors import CampaignError

_NODE, _PARAMETERS = "robot_state_publisher", "ros__parameters"
_SINGLE, _DUAL = "eye_hand_calibration", "calibration_offset"
_SECTIONS = (_SINGLE, _DUAL, "arm_calibration")
"""Templates of TIAGo, of TIAGo Pro, and of TIAGo Pro without a head."""
_JOINT = re.compile(r"(arm_(left_|right_)?|head_)\d_joint")
"""Joints whose transmissions have an offset in them."""


def pal_calibration(
    model: CorrectedModel, own: str | Path | None = None, *, min_sigma: float | None = None, alone: bool = False
) -> str:
    """Write joint zeros as master_calibration.yaml of PAL Robotics' robots (TIAGo, TIAGo Pro).

    Parameters
    ----------
    model
        The corrected model.
    own
        The robot's file, whose other sections stay, and to whose offsets the zeros are added: measured with it in use.
    min_sigma, alone
        As for :func:`~thermal_robot.correction.zero_offsets`.

    Returns
    -------
    str
        YAML, with a comment that says what is in it and what is not.

    Raises
    ------
    CampaignError
        If no joint of the chain is one of PAL's arms or head, or PyYAML is not installed; if ``own`` is no such file.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> from thermal_robot.correction import pal_calibration
    >>> pal_calibration(tr.diagnose(tr.demo_campaign()).model)
    Traceback (most recent call last):
    thermal_robot.errors.CampaignError: master_calibration.yaml: is for robots of PAL Robotics, and 'rv_m2' has no ...
    """
    robot = model.robot
    if not any(_JOINT.fullmatch(joint) for joint in robot.joint_names):
        problem = f"is for robots of PAL Robotics, and {robot.name!r} has no joint of an arm of theirs"
        raise CampaignError("master_calibration.yaml", problem, expected="arm_1_joint, arm_left_1_joint, head_1_joint")
    zeros = zeros_in(model, None, min_sigma, alone)
    whole = _mapping(own, (read_yaml(Path(own)) or [{}])[0]) if own else {}
    held = whole
    for key in (_NODE, _PARAMETERS):
        held = _section(own, held, key)
    dual = any(re.match("arm_(left|right)_", joint) for joint in robot.joint_names)
    known = [name for name in _SECTIONS if name in held]
    offsets = _section(own, held, known[0] if known else _DUAL if dual else _SINGLE)
    for joint, zero in zip(robot.joint_names, zeros.values.tolist(), strict=True):
        if _JOINT.fullmatch(joint):
            offsets[f"{joint}_offset"] = _number(own, f"{joint}_offset", offsets.get(f"{joint}_offset", 0.0)) + zero
    notes = [
        f"Calibrated by thermal_robot: the zeros of {robot.name!r}, rad.",
        *expectation(model.files, "pal", min_sigma, alone),
        f"It cannot hold {FORMATS['pal'].lacks}, nor what changes with the pose: these stay in the model.",
    ]
    return "\n".join([*(f"# {note}" for note in notes), yaml_text(whole)])


Motors: TypeAlias = Literal["feetech", "dynamixel"]
_SIGN = {"feetech": -1, "dynamixel": 1}
"""Of a zero in the homing offset: by how much a motor reports more."""
_MOST = 2047
"""Ticks that a Feetech motor's homing offset can hold: eleven bits and a sign."""


def lerobot_calibration(
    model: CorrectedModel,
    own: str | Path,
    *,
    motors: Motors = "feetech",
    min_sigma: float | None = None,
    alone: bool = False,
) -> str:
    """Write joint zeros to a LeRobot arm's calibration file, as changed homing offsets of its motors.

    Parameters
    ----------
    model
        The corrected model, of a campaign whose joint positions are degrees as LeRobot reads them.
    own
        The arm's file, in use while it was measured; its motors have the names of the chain's joints.
    motors
        ``feetech`` (SO-100, SO-101) or ``dynamixel`` (Koch): which way the offset counts.
    min_sigma, alone
        As for :func:`~thermal_robot.correction.zero_offsets`.

    Returns
    -------
    str
        JSON; ids, ranges and motors outside the chain as they stand. Zeros are rounded to ticks of 1.5 mrad.

    Raises
    ------
    CampaignError
        If ``own`` is no calibration, lacks a motor, has one that counts backwards (``drive_mode``), or an offset would
        not fit into the motor's register.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> from thermal_robot.correction import lerobot_calibration
    >>> lerobot_calibration(tr.diagnose(tr.demo_campaign()).model, "my_arm.json")
    Traceback (most recent call last):
    thermal_robot.errors.CampaignError: my_arm.json: there is no such file...
    """
    if motors not in _SIGN:
        raise CampaignError("motors", "are unknown", found=repr(motors), expected=" or ".join(_SIGN))
    held = _mapping(own, _json(Path(own)))
    ticks = np.round(_SIGN[motors] * zeros_in(model, None, min_sigma, alone).values / TICK)
    for joint, kind, change in zip(model.robot.joint_names, model.robot.joint_types, ticks.tolist(), strict=True):
        if joint not in held:
            raise CampaignError(str(own), f"has no motor {joint!r}", found=", ".join(held), expected="the URDF's names")
        motor = _mapping(own, held[joint], joint)
        if motor.get("drive_mode", 0) != 0 or kind == "prismatic":
            raise CampaignError(
                str(own), "the motor counts backwards, or slides", key=f"{joint}.drive_mode", expected="0, and a turn"
            )
        offset = int(_number(own, f"{joint}.homing_offset", motor.get("homing_offset")) + change)
        if motors == "feetech" and abs(offset) > _MOST:
            problem = "leaves the motor's register: home it anew, nearer to the middle"
            raise CampaignError(str(own), problem, key=f"{joint}.homing_offset", found=str(offset), expected="±2047")
        motor["homing_offset"] = offset
    return json.dumps(held, indent=4, ensure_ascii=False) + "\n"


def _json(file: Path) -> Any:
    try:
        return json.loads(file.read_text(encoding="utf-8-sig"))
    except FileNotFoundError:
        raise CampaignError(str(file), "there is no such file", expected="the calibration of your arm") from None
    except (OSError, ValueError) as error:
        raise CampaignError(str(file), "is no calibration of LeRobot", found=str(error), expected="JSON") from None


def _mapping(own: str | Path | None, value: Any, key: str = "") -> dict[str, Any]:
    if not isinstance(value, Mapping):
        raise CampaignError(str(own), "is no calibration", key=key or None, expected="names with values")
    return value  # type: ignore[return-value]


def _section(own: str | Path | None, held: dict[str, Any], key: str) -> dict[str, Any]:
    """Return the section ``key`` of a file, added empty where it is missing; ``CampaignError`` if it is no mapping."""
    return _mapping(own, held.setdefault(key, {}), key)


def _number(own: str | Path | None, key: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not np.isfinite(value):
        raise CampaignError(str(own), "is no number", key=key, found=repr(value), expected="a number")
    return float(value)
