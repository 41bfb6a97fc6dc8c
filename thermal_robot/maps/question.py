"""Specification of a workspace map: the robot's errors and its joining task, and the places or joint positions."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.errors import RobotError
from thermal_robot.robot import ENDS, Robot

CHUNK = 4096
"""Places, or configurations, that are worked on at once: their arrays take some ten megabytes."""
Span = tuple[float, float, int]
"""First and last value of an axis, and how many."""


@dataclass(frozen=True)
class Question:
    """Joint errors, rise of temperature and joining task for which a map evaluates each configuration.

    Parameters
    ----------
    sigma_q
        Standard deviation of each joint, rad or m: one number for all, or by the names of all joints.
    coefficients, rise
        Coefficient of thermal expansion, 1/K, and rise of temperature, K: of all segments, or by their names.
    clearance, capability
        Diametral clearance, m, for which the probability of joining is computed; capability C_p for which the required
        clearance is computed.
    law
        ``"shift"``: the rise is fixed, a displacement; ``"uniform"``: it is uniform within ± ``rise``.
    approach
        Direction in which the tool enters, in the root frame.
    axis, point
        The tool's direction and its tip, m, in the tool frame.
    """

    sigma_q: float | Mapping[str, float] = 5e-5
    coefficients: float | Mapping[str, float] = 1.2e-5
    rise: float | Mapping[str, float] = 3.0
    clearance: float = 2e-4
    capability: float = 1.33
    law: Literal["shift", "uniform"] = "shift"
    approach: tuple[float, float, float] = (0.0, 0.0, -1.0)
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    point: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Positions:
    """Rectangular grid of places of the tip in the root frame, m; an axis with one value makes it a plane or a line.

    Parameters
    ----------
    x, y, z
        First value, last value, number of values.
    home
        (n,) rad or m: postures are numbered from the one nearest to it; the middle of the limits where left out.
    """

    x: Span
    y: Span
    z: Span
    home: tuple[float, ...] | None = None

    @property
    def count(self) -> int:
        """Number of places."""
        return self.x[2] * self.y[2] * self.z[2]

    def place(self, rows: NDArray[np.int64]) -> Array:
        """Positions (K, 3), m, of the grid points with these numbers (K,); x runs fastest, then y."""
        x, y, z = (np.linspace(low, high, many) for low, high, many in (self.x, self.y, self.z))
        along, rest = rows % len(x), rows // len(x)
        return np.stack([x[along], y[rest % len(y)], z[rest // len(y)]], axis=1)


@dataclass(frozen=True)
class Joints:
    """Halton sequence of joint configurations within limits, in place of a grid of places.

    Parameters
    ----------
    count
        Number of configurations.
    lower, upper
        (n,) rad or m; where left out the robot's limits, for rotating joints cut at half a turn either side of zero.
    """

    count: int
    lower: tuple[float, ...] | None = None
    upper: tuple[float, ...] | None = None

    def drawn(self, rows: NDArray[np.int64], robot: Robot) -> Array:
        """Return the configurations (K, n), rad or m, of K consecutive numbers in the Halton sequence."""
        from scipy.stats import qmc

        low, high = within(robot, self.lower, self.upper)
        engine = qmc.Halton(robot.n, scramble=False)
        engine.fast_forward(int(rows[0]) + 1)  # the first point of all lies in a corner
        return np.asarray(low + engine.random(len(rows)) * (high - low))


Over = Positions | Joints


def within(
    robot: Robot, lower: tuple[float, ...] | None = None, upper: tuple[float, ...] | None = None
) -> tuple[Array, Array]:
    """Finite lower and upper joint limits (n,), rad or m: those given, else the robot's, rotating joints cut at ± π.

    A prismatic joint without limits, or limits of another number of joints, raise a :class:`RobotError`.
    """
    turns = np.array([kind != "prismatic" for kind in robot.joint_types])
    low, high = (
        np.where(turns, np.clip(own, -np.pi, np.pi), own) if given is None else np.asarray(given, dtype=float)
        for given, own in ((lower, robot.lower), (upper, robot.upper))
    )
    if low.shape != (robot.n,) or high.shape != (robot.n,) or not np.all(np.isfinite(low) & np.isfinite(high)):
        raise RobotError(f"limits of {robot.n} joints are needed, finite ones: a slide has none", name=robot.name)
    return low, high


@dataclass(frozen=True)
class Spec:
    """Specification of a map: robot, places, question; arguments as for :func:`~thermal_robot.maps.workspace_map`."""

    robot: Robot
    over: Over
    question: Question = field(default_factory=Question)

    def chunks(self) -> Iterator[NDArray[np.int64]]:
        """Yield the numbers of places or configurations, 4096 at a time."""
        for start in range(0, self.over.count, CHUNK):
            yield np.arange(start, min(start + CHUNK, self.over.count))

    @property
    def parts(self) -> int:
        """Number of chunks, of 4096 places or configurations each."""
        return -(-self.over.count // CHUNK)

    def to_dict(self) -> dict[str, Any]:
        """Return everything that determines the map as a dict for JSON: robot, places, question, chunk size."""
        return {
            "schema": "thermal-robot/map/1",
            "robot": self.robot.name,
            "urdf_sha256": hashlib.sha256(self.robot.urdf.encode()).hexdigest(),
            **{end: getattr(self.robot, end) for end in ENDS},
            "joints": list(self.robot.joint_names),
            "over": type(self.over).__name__.lower(),
            **{key: _plain(value) for part in (self.over, self.question) for key, value in vars(part).items()},
            "chunk": CHUNK,
        }

    @property
    def fingerprint(self) -> str:
        """SHA-256 hash of :meth:`to_dict`, by which a run recognises the map that it may resume."""
        return hashlib.sha256(json.dumps(self.to_dict(), sort_keys=True).encode()).hexdigest()


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): float(number) for key, number in value.items()}
    return list(value) if isinstance(value, tuple) else value
