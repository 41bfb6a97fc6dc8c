"""Displacements as arrows that are long enough to be seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thermal_robot.kinematics import rotation_to_quaternion
from thermal_robot.report.units import round_down
from thermal_robot.viewer.settings import (
    HEAD_LENGTH,
    HEAD_RADIUS,
    LARGE_GAP,
    LONG_ARROW,
    LONGEST_ARROW,
    NARROWEST,
    SHAFT_RADIUS,
    WIDEST,
)

Array = NDArray[np.float64]

_SIDES = 16


@dataclass(frozen=True, eq=False)
class Arrows:
    """N copies of one arrow that goes from the origin to (0, 0, 1), each turned, stretched and moved.

    Attributes
    ----------
    starts
        (N, 3) where they begin, m.
    turns
        (N, 4) unit quaternions wxyz that turn the z axis along them.
    stretches
        (N, 3) factors along the arrow's own axes; the last is the length, m.
    """

    starts: Array
    turns: Array
    stretches: Array


def arrows(starts: Array, displacements: Array, magnification: float, size: float, thicker: float = 1.0) -> Arrows:
    """Return the arrows of displacements.

    Parameters
    ----------
    starts, displacements
        (N, 3) m each.
    magnification
        How many times longer than the displacements they are.
    size
        Of the scene, m: bounds how thick and how long they are.
    thicker
        By how much those bounds on the thickness are wider.
    """
    lengths = np.minimum(magnification * np.linalg.norm(displacements, axis=1), longest(size))
    widths = np.clip(thicker * HEAD_RADIUS * lengths, thicker * NARROWEST * size, thicker * WIDEST * size)
    # an arrow as good as none is a point, not a disc
    widths = np.minimum(widths, lengths)
    return Arrows(
        starts, rotation_to_quaternion(turned_along(displacements)), np.column_stack([widths, widths, lengths])
    )


def longest(size: float) -> float:
    """Return the length, m, at which arrows are cut in a scene of a size, m."""
    return LONGEST_ARROW * size


def unit_arrow() -> tuple[Array, NDArray[np.int64]]:
    """Return vertices (V, 3) and faces (F, 3) of the arrow to (0, 0, 1), whose head has the radius 1."""
    angles = 2.0 * np.pi * np.arange(_SIDES) / _SIDES
    circle = np.column_stack([np.cos(angles), np.sin(angles)])
    radii, heights = (SHAFT_RADIUS, SHAFT_RADIUS, 1.0), (0.0, 1.0 - HEAD_LENGTH, 1.0 - HEAD_LENGTH)
    rings = [np.column_stack([r * circle, np.full(_SIDES, z)]) for r, z in zip(radii, heights, strict=True)]
    vertices = np.vstack([*rings, [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]])
    here = np.arange(_SIDES)
    there = (here + 1) % _SIDES
    foot, tip = 3 * _SIDES, 3 * _SIDES + 1
    faces = [np.column_stack([np.full(_SIDES, foot), there, here])]
    for low in (0, _SIDES):
        high = low + _SIDES
        faces += [np.column_stack([low + here, low + there, high + there])]
        faces += [np.column_stack([low + here, high + there, high + here])]
    faces += [np.column_stack([2 * _SIDES + here, 2 * _SIDES + there, np.full(_SIDES, tip)])]
    return vertices, np.vstack(faces)


def readable(displacements: Array, size: float) -> float:
    """Return the magnification, 1, 2 or 5 times a power of ten, at which large ones are as long as settings say.

    Parameters
    ----------
    displacements
        (N, 3) m.
    size
        Of the scene, m.
    """
    large = float(np.quantile(np.linalg.norm(displacements, axis=1), LARGE_GAP)) if len(displacements) else 0.0
    if large <= 0.0:
        return 1.0
    return round_down(max(LONG_ARROW * size / large, 1.0))


def turned_along(directions: Array) -> Array:
    """Return (N, 3, 3): rotations that turn the z axis along each of N directions, and leave it where there is none."""
    lengths = np.linalg.norm(directions, axis=1, keepdims=True)
    z = np.where(lengths > 0.0, directions / np.where(lengths > 0.0, lengths, 1.0), [0.0, 0.0, 1.0])
    # the axis of the root frame that lies farthest from it, made perpendicular
    helper = np.eye(3)[np.argmin(np.abs(z), axis=1)]
    x = np.cross(helper, z)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    return np.stack([x, np.cross(z, x), z], axis=2)
