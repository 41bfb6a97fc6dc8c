"""Where the joints stand that are no part of a chain."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pinocchio as pin

from thermal_robot.arrays import Array
from thermal_robot.errors import RobotError
from thermal_robot.kinematics.mimic import Mimic


def held_configuration(model: pin.Model, ends: Mapping[str, Mimic]) -> Array:
    """Joints at 0 or at the limit nearest to 0, and mimicking ones where those take them.

    Parameters
    ----------
    model
        Of the whole URDF; a mimicking joint is one like any other there.
    ends
        What each mimicking joint follows in the end; none of them is fixed.

    Returns
    -------
    ndarray
        (nq,) configuration of the model.

    Raises
    ------
    RobotError
        If a joint mimics one that has no single position (a floating or planar one).
    """
    q = np.asarray(pin.neutral(model), dtype=float)
    for joint in list(model.joints)[1:]:
        if joint.nq == 1:
            low, high = model.lowerPositionLimit[joint.idx_q], model.upperPositionLimit[joint.idx_q]
            if low < high:
                q[joint.idx_q] = min(max(0.0, low), high)
    for name, end in ends.items():
        position = end.multiplier * held_position(model, q, end.joint) + end.offset
        joint = model.joints[model.getJointId(name)]
        if joint.nq == 1:
            q[joint.idx_q] = position
        elif joint.nv == 1:
            q[joint.idx_q : joint.idx_q + 2] = np.cos(position), np.sin(position)
    return q


def held_position(model: pin.Model, q: Array, name: str) -> float:
    """Position of one joint in a configuration of the whole model, rad or m; 0 for a fixed joint.

    Raises
    ------
    RobotError
        If the joint has more than one degree of freedom.
    """
    if not model.existJointName(name):
        return 0.0
    joint = model.joints[model.getJointId(name)]
    if joint.nv != 1:
        raise RobotError(f"joint {name!r}, which another one mimics, has no single position", name=name)
    if joint.nq == 1:
        return float(q[joint.idx_q])
    return float(np.arctan2(q[joint.idx_q + 1], q[joint.idx_q]))
