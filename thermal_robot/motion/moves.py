"""Local sensitivity of a fit: by how much each parameter alone moves what is simulated of each joint."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.motion.model import SHARED, JointModel


def moves(model: JointModel, values: Array) -> Mapping[tuple[str, str], float]:
    """Root mean square of the change of each joint's simulation without one effect, all others as they were fitted.

    Parameters
    ----------
    model
        Of the log, with the loads where the joints go.
    values
        (P,) as fitted; what is zero is no part of the fit.

    Returns
    -------
    Mapping
        By effect and joint, in the unit of the gap; of what all joints share in each joint.
    """

    def of_joint(joint: int) -> dict[tuple[str, str], float]:
        own = [p for p, x in enumerate(model.parameters) if x.joint in (joint, SHARED) and values[p]]
        sets = np.tile(values, (1 + len(own), 1))
        sets[1 + np.arange(len(own)), own] = 0.0
        left = model.residuals(joint, sets)
        sizes = np.sqrt(np.mean((left[1:] - left[0]) ** 2, axis=1))
        name = model.log.joints[joint]
        return {(model.parameters[p].effect, name): float(size) for p, size in zip(own, sizes, strict=True)}

    return {key: size for one in model.each(of_joint) for key, size in one.items()}
