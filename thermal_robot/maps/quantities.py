"""The columns of a map: what each configuration is good for."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.assembly.thermal.elongation import elongation
from thermal_robot.assembly.workspace import assembly_map
from thermal_robot.errors import RobotError
from thermal_robot.kinematics import elongation_jacobian
from thermal_robot.maps import settings
from thermal_robot.maps.postures import Task, all_postures
from thermal_robot.maps.question import Joints, Spec, within

Columns = dict[str, NDArray[Any]]

UNITS = {
    "place": "",
    "branch": "",
    "x": "m",
    "y": "m",
    "z": "m",
    "std.x": "m",
    "std.y": "m",
    "std.z": "m",
    "shift.x": "m",
    "shift.y": "m",
    "shift.z": "m",
    "polygon.area": "m²",
    "polygon.width": "m",
    "probability": "1",
    "probability_warm": "1",
    "capability": "1",
    "capability_warm": "1",
    "required": "m",
    "required_warm": "m",
    "margin": "1",
}
"""Columns beside the joints', and their units."""


def columns(spec: Spec, rows: NDArray[np.int64]) -> Columns:
    """Return a chunk of the map: all postures of its places, or its configurations.

    Parameters
    ----------
    spec
        The map.
    rows
        Numbers of places or configurations, one after the other.
    """
    robot, asked = spec.robot, spec.question
    if isinstance(spec.over, Joints):
        q = spec.over.drawn(rows, robot)
        places, branch = rows, np.zeros(len(rows), dtype=np.int64)
    else:
        home = np.mean(within(robot), axis=0) if spec.over.home is None else np.asarray(spec.over.home, dtype=float)
        approach, axis = (np.asarray(v, dtype=float) / np.linalg.norm(v) for v in (asked.approach, asked.axis))
        task = Task(robot, approach, axis, np.asarray(asked.point, dtype=float), home)
        here, q = all_postures(task, spec.over.place(rows))
        places = rows[here]
        branch = np.arange(len(here)) - np.searchsorted(here, here)
    told = _told(spec, q) if len(q) else dict.fromkeys(list(UNITS)[2:-1], np.zeros(0))
    joints = {name: q[:, k] for k, name in enumerate(robot.joint_names)}
    inside = np.minimum(q - robot.lower, robot.upper - q)
    with np.errstate(invalid="ignore"):
        share = np.where(np.isfinite(inside), inside / (robot.upper - robot.lower), 0.5)
    told["margin"] = share.min(axis=1) if len(q) else np.zeros(0)
    return {"place": places, "branch": branch, **joints, **told}


def _told(spec: Spec, q: Array) -> Columns:
    from thermal_robot.assembly.probability import capability, failing_probability, planes

    robot, asked = spec.robot, spec.question
    found = assembly_map(
        robot,
        q,
        asked.sigma_q,
        coefficients=asked.coefficients,
        rise=asked.rise,
        clearance=asked.clearance,
        capability=asked.capability,
        law=asked.law,
        axis=asked.axis,
        point=asked.point,
    )
    plane = planes(found.directions)
    scatter = plane @ found.covariance @ np.swapaxes(plane, 1, 2)
    across = np.einsum("nij,nj->ni", plane, found.displacement)
    heated: dict[str, Any] = {"mean": across} if asked.law == "shift" else {"segments": across}
    grown = elongation(robot, asked.rise, coefficients=asked.coefficients, reference=0.0)
    area, width = polygon(plane @ (elongation_jacobian(robot, q) * grown))
    std = np.sqrt(np.diagonal(found.covariance, axis1=1, axis2=2))
    return {
        **dict(zip(("x", "y", "z"), found.positions.T, strict=True)),
        **dict(zip(("std.x", "std.y", "std.z"), std.T, strict=True)),
        **dict(zip(("shift.x", "shift.y", "shift.z"), found.displacement.T, strict=True)),
        "polygon.area": area,
        "polygon.width": width,
        "probability": found.probability,
        "probability_warm": found.probability_warm,
        "capability": capability(failing=failing_probability(scatter, asked.clearance)),
        "capability_warm": capability(failing=failing_probability(scatter, asked.clearance, **heated)),
        "required": found.required,
        "required_warm": found.required_warm,
    }


def polygon(edges: Array) -> tuple[Array, Array]:
    """Area and width of the polygons in which a tip may be when each segment is anywhere between cold and warm.

    A polygon of edges ``g`` (Eqs 14-15) has the area ``sum |g_i x g_j|`` over all pairs; its width, the largest
    distance of two corners, is the longest ``sum ± g_i``.

    Parameters
    ----------
    edges
        (N, 2, S) m: what the whole rise of each segment does across the tool.

    Returns
    -------
    area, width
        (N,) m² and m.

    Raises
    ------
    RobotError
        More segments than have their corners compared.
    """
    links = edges.shape[2]
    if links > settings.MOST_LINKS:
        raise RobotError(f"the polygon of {links} segments has too many corners; {settings.MOST_LINKS} are compared")
    first, second = np.triu_indices(links, 1)
    crossed = edges[:, 0, first] * edges[:, 1, second] - edges[:, 1, first] * edges[:, 0, second]
    # a corner and the one opposite are as far apart as one with its signs and one with all others: half of them do
    signs = np.array(list(product((-1.0, 1.0), repeat=links)))[: max(2**links // 2, 1)]
    corners = edges @ signs.T
    return np.abs(crossed).sum(axis=1), np.sqrt((corners**2).sum(axis=1).max(axis=1))
