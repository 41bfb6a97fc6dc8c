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
    parameters = model.parameters

    def of_joint(joint: int) -> dict[tuple[str, str], float]:
        own = [
            one.effect if one.joint in (joint, SHARED) and x else "" for one, x in zip(parameters, values, strict=True)
        ]
        effects = [name for name in dict.fromkeys(own) if name]
        without = [np.where(np.array(own) == name, 0.0, values) for name in effects]
        left = model.residuals(joint, np.stack([values, *without]))
        sizes = np.sqrt(np.mean((left[1:] - left[0]) ** 2, axis=1))
        return {(name, model.log.joints[joint]): float(x) for name, x in zip(effects, sizes, strict=True)}

    return {key: size for one in model.each(of_joint) for key, size in one.items()}
