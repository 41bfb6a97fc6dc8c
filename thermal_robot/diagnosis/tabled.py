"""A diagnosis as data frames: parameters, their covariance, and the gap row by row. SI throughout."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.inference import settings
from thermal_robot.kinematics import rotation_to_rpy

if TYPE_CHECKING:
    import pandas as pd

    from thermal_robot.correction import CorrectedModel
    from thermal_robot.diagnosis.parts import Estimate, Finding, Rows
    from thermal_robot.inference.fit import Fit

LEVELS = ("effect", "parameter")
_AXES = ("x", "y", "z", "rx", "ry", "rz")


def parameters(findings: tuple[Finding, ...]) -> pd.DataFrame:
    """Return a row for each parameter that is told of an effect, in the order of the findings.

    Index (effect, parameter); columns ``status``, ``value``, ``std`` (one sigma), ``unit`` and ``identified``; NaN
    where the data do not identify it.
    """
    found = estimates((finding.name, estimate) for finding in findings for estimate in finding.parameters)
    found.insert(0, "status", [finding.status for finding in findings for _ in finding.parameters])
    return found


def estimates(of_effects: Iterable[tuple[str, Estimate]]) -> pd.DataFrame:
    """Return the same of estimates, each with the name of its effect, without ``status``."""
    import pandas as pd

    told, nothing = list(of_effects), float("nan")
    return pd.DataFrame(
        {
            "value": np.array([nothing if e.value is None else e.value for _, e in told], dtype=float),
            "std": np.array([nothing if e.std is None else e.std for _, e in told], dtype=float),
            "unit": [e.unit for _, e in told],
            "identified": np.array([e.identified for _, e in told], dtype=bool),
        },
        index=pd.MultiIndex.from_tuples([(name, e.name) for name, e in told], names=LEVELS),
    )


def covariance(fit: Fit, joint: Array) -> pd.DataFrame:
    """Covariance of the identified parameters of the fit, by (effect, parameter), in the product of their SI units.

    Deviations are those of :func:`parameters`, widened to what the remainder says of each effect
    (:func:`~thermal_robot.diagnosis.uncertainty.as_remainder_says`); correlations those of the ``joint`` (K, K)
    posterior of all frames and parameters, those of the effects last, frames marginalised.
    """
    import pandas as pd

    e = fit.explanation
    names: list[tuple[str, str]] = []
    spread, prior = [np.empty(0)], [np.empty(0)]
    for b, (effect, _) in zip(e.best.blocks, fit.effects, strict=True):
        item = e.linear.blocks[b]
        names += [(effect.name, parameter.name) for parameter in item.parameters]
        spread.append(np.sqrt(np.maximum(np.diag(e.values[b][1]), 0.0)))
        prior.append(item.sizes * e.best.scales[b])
    std = np.concatenate(spread)
    kept = np.flatnonzero(std < settings.DETERMINED * np.concatenate(prior))
    own = joint[len(joint) - len(std) :, len(joint) - len(std) :][np.ix_(kept, kept)]
    size = std[kept] / np.sqrt(own.diagonal())
    index = pd.MultiIndex.from_tuples([names[k] for k in kept], names=LEVELS)
    return pd.DataFrame(own * np.outer(size, size), index=index, columns=index)


def fitted_frames(model: CorrectedModel) -> pd.DataFrame:
    """Where the robot stands and where the target sits, as they were declared or fitted.

    Index ``base`` (the root frame in the measurement frame) and ``tool`` (the target in the tool frame); columns ``x``
    ``y`` ``z`` in m, and ``roll`` ``pitch`` ``yaw`` in rad, as in a URDF; NaN for a target of which positions alone
    were measured, unless declared: a point has no direction.
    """
    import pandas as pd

    turned = {"base": True, "tool": model.measures == "pose" or model.settings.tool_known}
    told = [
        [*pose[:3, 3], *(rotation_to_rpy(pose[:3, :3]) if turned[name] else np.full(3, np.nan))]
        for name, pose in (("base", model.frames.base), ("tool", model.frames.tool))
    ]
    return pd.DataFrame(told, index=list(turned), columns=["x", "y", "z", "roll", "pitch", "yaw"])


def residuals(rows: Rows) -> pd.DataFrame:
    """Gap and remainder by ``row``, the number in the file, in the root frame's axes.

    Columns ``gap.x`` … and ``remainder.x`` … in m, of poses also ``.rx`` ``.ry`` ``.rz`` in rad, the turn of several
    targets in the axes of their common frame; ``held_out.before`` and ``held_out.after``, distance in m when held out
    (NaN where set aside); ``set_aside``.
    """
    import pandas as pd

    axes = _AXES[: rows.gap.shape[1]]
    columns = {
        f"{kind}.{axis}": values[:, k]
        for kind, values in (("gap", rows.gap), ("remainder", rows.remainder))
        for k, axis in enumerate(axes)
    }
    held = {"held_out.before": rows.held_out_before, "held_out.after": rows.held_out_after}
    return pd.DataFrame({**columns, **held, "set_aside": rows.outliers}, index=pd.Index(rows.rows, name="row"))
