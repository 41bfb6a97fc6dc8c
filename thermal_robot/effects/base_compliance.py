"""A base that yields: pedestal, floor or vehicle tip under the arm's overturning moment."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.effects import inclinometer
from thermal_robot.effects.effect import UNSOURCED, Driver, Effect, Parameter, at_base

if TYPE_CHECKING:
    from thermal_robot.observations import Observations

_TIP = 2e-4  # rad
_DEPTH = 0.5  # m: a pedestal
_STEADY = 1e-9  # N·m, rad


@dataclass(frozen=True)
class BaseCompliance(Effect):
    """The base tips by c_e M_e about each horizontal axis e of the root frame; rad.

    M (N·m) is the moment of the weight of all links, and of the payload, about the root frame's origin (the URDF's
    masses); c_e in rad/(N·m), a spring about each axis. What yields ``below`` the origin, a floor under a pedestal,
    moves the whole arm sideways, too: by c_e h_e M_e, with c_e h_e in m/(N·m), for a depth h_e of the place that
    yields. Expected size: it tips by 0.2 mrad at the largest moment of the campaign, 0.5 m below; from a foundation to
    a vehicle nobody knows it better.

    Where an inclinometer on the base was read (``tilt.x``, ``tilt.y``), its reading (``tilt``) is the turn about these
    axes of the root frame, times a gain, 1 where it stands where the base does; and a depth in m. A constant reading is
    a frame of the base.

    Springs in the joints let each arm beyond them yield to its own load, this one the whole arm to all of it. A joint
    that turns the arm about the vertical tells the two axes apart.
    """

    below: bool = False
    tilt: bool = False

    name: ClassVar[str] = "base_compliance"
    title: ClassVar[str] = "a base that yields under the arm"
    size_spread: ClassVar[float] = UNSOURCED

    @property
    def sided_by(self) -> tuple[str, ...]:  # type: ignore[override]
        """Gravity, unless the turns were measured."""
        return () if self.tilt else ("gravity",)

    def missing(self, observations: Observations) -> tuple[str, ...]:
        """Return what would give the base's turn, unless the tilt or the moment of known masses varies."""
        return (
            ()
            if _measured(observations) or _loaded(observations)
            else (*inclinometer.columns(inclinometer.BASE), "masses in the URDF")
        )

    def reads(self, observations: Observations) -> tuple[str, ...]:
        """Return the tilts where they are used, else the payload where it was recorded."""
        used = inclinometer.columns(inclinometer.BASE) if self.tilt else ("payload",)
        return tuple(column for column in used if column in observations.covariates)

    def variants(self, observations: Observations) -> tuple[Effect, ...]:
        """Return springs and the measured tilt, as far as the campaign has them, at the origin and below."""
        kinds = [tilt for tilt, has in ((False, _loaded), (True, _measured)) if has(observations)]
        return tuple(replace(self, below=below, tilt=tilt) for tilt in kinds for below in (False, True)) or (self,)

    def parameters(self, observations: Observations) -> tuple[Parameter, ...]:
        """Return two compliances about each horizontal axis, rad/(N·m) and m/(N·m), or gain and depth of the tilt."""
        robot = observations.robot
        up = -robot.gravity / max(float(np.linalg.norm(robot.gravity)), _STEADY)
        if self.tilt:
            turn = inclinometer.turn(observations)
            return self._tipping(turn, up, ("turn per tilt measured", "1", 1.0), ("depth", "m", _DEPTH))
        moment = overturning(observations)
        axes = [k for k in range(3) if k != int(np.argmax(np.abs(up)))]
        size = _TIP / max(float(np.abs(moment[:, axes]).max()), _STEADY)
        found: tuple[Parameter, ...] = ()
        for k in axes:
            spring = f"compliance about {'xyz'[k]}", "rad/(N·m)", size
            sideways = f"shift by the moment about {'xyz'[k]}", "m/(N·m)", _DEPTH * size
            found += self._tipping(moment[:, [k]] * np.eye(3)[k], up, spring, sideways)
        return found

    def _tipping(
        self, turn: Array, up: Array, first: tuple[str, str, float], second: tuple[str, str, float]
    ) -> tuple[Parameter, ...]:
        """Return the parameters, by label, unit and size, of a turn (N, 3) at the origin, and of one below it."""
        still = np.zeros_like(turn)
        twists = (np.hstack([still, turn]), np.hstack([np.cross(turn, up), still]))
        return tuple(
            Parameter(*told, "base", "base", (at_base(twist),), positive=True)
            for told, twist in zip((first, second) if self.below else (first,), twists, strict=False)
        )

    def driver(self, observations: Observations, parameters: Sequence[Parameter], error: Array) -> Driver | None:
        """Return the tilt that varies most, or the moment about the axis about which the error goes with it."""
        if self.tilt:
            return inclinometer.varying_most(observations)
        moment = overturning(observations)
        axis = np.linalg.lstsq(moment, error, rcond=1e-9)[0]
        return "overturning moment", "N·m", moment @ axis / (np.linalg.norm(axis) + 1e-300)


def overturning(observations: Observations) -> Array:
    """(N, 3) moment of the weight of all that moves about the root frame's origin, root frame axes, N·m."""
    first = observations.robot.segments[0].index
    turns, place = observations.commanded.rotations[:, first], observations.commanded.positions[:, first]
    load = np.einsum("nij,nkj->nki", turns, observations.segment_load[:, 0].reshape(-1, 2, 3))
    return np.asarray(load[:, 1] + np.cross(place, load[:, 0]))


def _measured(observations: Observations) -> bool:
    return inclinometer.varies(observations, inclinometer.BASE)


def _loaded(observations: Observations) -> bool:
    """Whether the masses are known and their moment varies."""
    return observations.robot.has_masses and bool((np.ptp(overturning(observations), axis=0) > _STEADY).any())
