"""Inputs of the ledger: the robot's unknown length, the paper's measurements, simulation settings."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from xml.etree import ElementTree

import numpy as np
from numpy.typing import ArrayLike

from thermal_robot.arrays import Array
from thermal_robot.errors import RobotError
from thermal_robot.robot import Robot, load_robot

Three = tuple[float, float, float]
Four = tuple[float, float, float, float]
Five = tuple[float, float, float, float, float]

_SHORTEST, _LONGEST = 1e-3, 1e3
# m, of l5: far beyond any hand on either side, and well within what squares and inverses of lengths bear.


@dataclass(frozen=True)
class PaperInputs:
    """Inputs of the computed column; only ``sigma_q`` is fitted to a printed result.

    Parameters
    ----------
    l5
        m, wrist to tool point: assumed, the paper does not print it. The other lengths are the robot file's.
    sigma_q
        (4,) rad: standard deviations of joints 1–4, one choice of those that fit the theoretical column of Table 1
        (the ledger gives their ranges); the fifth joint does not move a point on its axis.
    delta_l
        (5,) m, section 3: elongations of l1 … l5 after the rise of temperature.
    reference_temperature, temperature
        °C, section 3.
    poses
        Joint coordinates q1 … q4 of rows 1 and 2 of Table 1, rad.
    pose_5a
        Those of Fig 5a; Fig 5b is row 1 of Table 1.
    experimental_sigma
        Table 1, standard deviations x y z in rows 1 and 2, m.
    static_displacements, sample_means
        Table 2, displacement of the tool, which the paper says was measured, and mean of the sample, x y z in rows 1
        and 2, m.
    n
        Size of each sample.
    n_simulated
        Pseudo-random numbers drawn in section 4.
    alpha
        Level of significance.
    delta_y
        m: the thermal error in y is ± this (section 4); its σ_k is that of y in row 1.
    clearance
        L, m (section 5).
    capability
        Required capability of the process (section 5).
    reading_noise
        m: standard deviation of one reading of the displacements of Eq 12; assumed. n readings are averaged.
    pose_sets
        Sets of five random poses for Eq 12.
    repetitions
        Simulated samples behind a rate of rejection; ten times as many behind the law of the skewness.
    seed
        Seed of all simulations.

    Raises
    ------
    RobotError
        If ``l5`` is not a positive finite number, or shorter than 1 mm or longer than 1 km.
    """

    l5: float = 0.150
    sigma_q: Four = (33e-6, 38e-6, 62e-6, 49e-6)
    delta_l: Five = (14e-6, 5e-6, 9e-6, 7e-6, 8e-6)
    reference_temperature: float = 20.0
    temperature: float = 23.0
    poses: tuple[Four, Four] = ((0.5235, 0.8726, -1.3962, -1.0471), (1.3963, 0.3839, -1.2217, -0.7330))
    pose_5a: Four = (0.5235, 0.6981, -0.3490, -1.0471)
    experimental_sigma: tuple[Three, Three] = ((14e-6, 18e-6, 17e-6), (23e-6, 16e-6, 18e-6))
    static_displacements: tuple[Three, Three] = ((8e-6, 14e-6, 9e-6), (17e-6, 3e-6, 4e-6))
    sample_means: tuple[Three, Three] = ((7e-6, 16e-6, 11e-6), (20e-6, 3e-6, 6e-6))
    n: int = 100
    n_simulated: int = 5000
    alpha: float = 0.05
    delta_y: float = 16e-6
    clearance: float = 145e-6
    capability: float = 1.33
    reading_noise: float = 30e-6
    pose_sets: int = 20_000
    repetitions: int = 2000
    seed: int = 0

    def __post_init__(self) -> None:
        if not 0.0 < self.l5 < np.inf:
            raise RobotError(f"l5 must be a positive number of metres, got {self.l5}", name="rv_m2")
        if not _SHORTEST <= self.l5 <= _LONGEST:
            raise RobotError(f"l5 must be from {_SHORTEST:g} to {_LONGEST:g} m long, got {self.l5}", name="rv_m2")


@lru_cache(maxsize=8)
def rv_m2_with_hand(l5: float | None = None) -> Robot:
    """Load the RV-M2 with the tool point ``l5`` metres from the wrist; by default as far as its robot file says."""
    robot = load_robot("builtin:rv_m2", "tool0")
    if l5 is None:
        return robot
    root = ElementTree.fromstring(robot.urdf)
    origin = root.find("joint[@name='tool_point']/origin")
    if origin is None:
        raise RobotError("the file of the RV-M2 has no joint 'tool_point' with an origin", name="tool_point")
    origin.set("xyz", f"0 {l5!r} 0")
    return load_robot(ElementTree.tostring(root, encoding="unicode"), "tool0")


def joints(*poses: ArrayLike) -> Array:
    """Joint positions (N, 5) from q1 … q4 of N poses; q5, the hand's own rotation, is zero."""
    rows = np.array(poses, dtype=float)
    return np.hstack([rows, np.zeros((len(rows), 1))])
