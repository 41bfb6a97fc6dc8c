"""Compliance of bodies under load, or as inclinometers measure it: the base, and links as cantilevers.

An inclinometer's columns are ``tilt.x``, ``tilt.y`` of the base, and ``tilt.<link>.x``, ``tilt.<link>.y`` of a link.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.effects.beam import beams, cross_axes, shafts
from thermal_robot.effects.effect import UNSOURCED, Driver, Effect, Parameter, at_base, at_segment
from thermal_robot.effects.quantities import driving

if TYPE_CHECKING:
    from thermal_robot.observations import Observations

BASE = ""
"""In place of a link."""
_TIP = 2e-4  # rad
_DEPTH = 0.5  # m: a pedestal
_SAG = 2e-4  # m
_STEADY = 1e-9  # N·m, N·m², rad
_UNIT = "1/(N·m²)"
_MASSES = "masses in the URDF"


def tilts(*links: str) -> tuple[str, ...]:
    """Return the names of the inclinometer columns, x and y, of some links, or of the base."""
    return tuple(f"tilt.{link}.{axis}" if link else f"tilt.{axis}" for link in links for axis in "xy")


def measured_turn(observations: Observations, link: str = BASE) -> Array:
    """Rotation vectors (N, 3) read by an inclinometer about x and y, rad; zero where it was not read."""
    read = np.zeros((observations.campaign.samples, 3))
    for k, column in enumerate(tilts(link)):
        read[:, k] = observations.covariates.get(column, 0.0)
    return read


class _Yielding(Effect):
    """Base class of compliances: deformation by a computed load, or the rotation by inclinometers (``tilt``)."""

    tilt: bool  # a field of each class

    @abstractmethod
    def _inclined(self, observations: Observations) -> tuple[str, ...]:
        """Links, or the base, on which an inclinometer may stand, whether it was read or not."""

    @abstractmethod
    def _loaded(self, observations: Observations) -> bool:
        """Whether masses are known and their load varies."""

    @property
    def sided_by(self) -> tuple[str, ...]:  # type: ignore[override]
        """Quantity that gives the parameters their sign: gravity, unless rotations were measured."""
        return () if self.tilt else ("gravity",)

    def _kinds(self, observations: Observations) -> list[bool]:
        """Values of ``tilt`` that a campaign allows: False if a load varies, True if an inclinometer's reading does."""
        measured = any(observations.varies(column) for column in tilts(*self._inclined(observations)))
        return [*([False] if self._loaded(observations) else []), *([True] if measured else [])]

    def reads(self, observations: Observations) -> tuple[str, ...]:
        """Return the recorded tilt columns where these are used (``tilt``), else the payload where it was recorded."""
        used = tilts(*dict.fromkeys((BASE, *self._inclined(observations)))) if self.tilt else ("payload",)
        return tuple(column for column in used if column in observations.covariates)


def _tilt_read(observations: Observations, link: str) -> Driver | None:
    """Driver of an effect by tilt: the inclinometer column of a link with the largest range."""
    read = [column for column in tilts(link) if column in observations.covariates]
    return driving(observations, max(read, key=lambda column: float(np.ptp(observations.covariates[column]))))


def _moment(name: str, moment: Array, error: Array) -> Driver:
    """Driver of an effect: component of a moment (N, 3) along the axis that fits an error (N,) by least squares."""
    axis = np.linalg.lstsq(moment, error, rcond=1e-9)[0]
    return name, "N·m", moment @ axis / (np.linalg.norm(axis) + 1e-300)


@dataclass(frozen=True)
class BaseCompliance(_Yielding):
    """Base compliance: pedestal or floor tips by c_e M_e about each horizontal axis e of the root frame; rad.

    M (N·m) is the moment of the weight of all links, and of the payload, about the root frame's origin (the URDF's
    masses); c_e in rad/(N·m), a spring about each axis. What yields ``below`` the origin moves the whole arm sideways,
    too: by c_e h_e M_e, with c_e h_e in m/(N·m), for a depth h_e. Expected size: it tips by 0.2 mrad at the largest
    moment of the campaign, 0.5 m below. Where an inclinometer on the base was read, its reading (``tilt``) is the turn
    about these axes times a gain, 1 where it stands where the base does; and a depth in m. A joint that turns the arm
    about the vertical tells the two axes apart.
    """

    below: bool = False
    tilt: bool = False

    name: ClassVar[str] = "base_compliance"
    title: ClassVar[str] = "a base that yields under the arm"
    size_spread: ClassVar[float] = UNSOURCED

    def _inclined(self, observations: Observations) -> tuple[str, ...]:
        return (BASE,)

    def _loaded(self, observations: Observations) -> bool:
        return observations.robot.has_masses and bool((np.ptp(overturning(observations), axis=0) > _STEADY).any())

    def missing(self, observations: Observations) -> tuple[str, ...]:
        """Columns that would give the base's rotation, unless its tilt or the moment of known masses varies."""
        return () if self._kinds(observations) else (*tilts(BASE), _MASSES)

    def variants(self, observations: Observations) -> tuple[Effect, ...]:
        """Grid of settings: springs and measured tilt, as far as recorded, about the origin and about a lower point."""
        every = [(tilt, below) for tilt in self._kinds(observations) for below in (False, True)]
        return tuple(replace(self, below=below, tilt=tilt) for tilt, below in every) or (self,)

    def parameters(self, observations: Observations) -> tuple[Parameter, ...]:
        """One compliance about each horizontal axis, rad/(N·m), if ``below`` also in m/(N·m); or those of the tilt."""
        gravity = observations.robot.gravity
        up = -gravity / max(float(np.linalg.norm(gravity)), _STEADY)
        if self.tilt:
            told = (("turn per tilt measured", "1", 1.0), ("depth", "m", _DEPTH))
            return self._tipping(measured_turn(observations), up, *told)
        moment = overturning(observations)
        axes = [k for k in range(3) if k != int(np.argmax(np.abs(up)))]
        size = _TIP / max(float(np.abs(moment[:, axes]).max()), _STEADY)
        found: tuple[Parameter, ...] = ()
        for k in axes:
            spring = f"compliance about {'xyz'[k]}", "rad/(N·m)", size
            sideways = f"shift by the moment about {'xyz'[k]}", "m/(N·m)", _DEPTH * size
            found += self._tipping(moment[:, [k]] * np.eye(3)[k], up, spring, sideways)
        return found

    def _tipping(self, turn: Array, up: Array, *told: tuple[str, str, float]) -> tuple[Parameter, ...]:
        """Parameters, by label, unit and size, of a rotation (N, 3) about the origin, and about a point below."""
        still = np.zeros_like(turn)
        twists = [np.hstack([still, turn]), np.hstack([np.cross(turn, up), still])][: 1 + self.below]
        rows = zip(told, twists, strict=False)
        return tuple(Parameter(*one, "base", "base", (at_base(twist),), positive=True) for one, twist in rows)

    def driver(self, observations: Observations, parameters: Sequence[Parameter], error: Array) -> Driver | None:
        """Tilt with the largest range, or the moment about the axis that fits the error best."""
        if self.tilt:
            return _tilt_read(observations, BASE)
        return _moment("overturning moment", overturning(observations), error)


def overturning(observations: Observations) -> Array:
    """Overturning moment (N, 3) of the moving weight about the root frame's origin, root frame axes, N·m."""
    first = observations.robot.segments[0].index
    turns, place = observations.commanded.rotations[:, first], observations.commanded.positions[:, first]
    load = np.einsum("nij,nkj->nki", turns, observations.segment_load[:, 0].reshape(-1, 2, 3))
    return np.asarray(load[:, 1] + np.cross(place, load[:, 0]))


@dataclass(frozen=True)
class LinkCompliance(_Yielding):
    """Cantilever beam: every segment is clamped at its link and carries force F and moment M on its far end.

    Euler and Bernoulli: about an axis e across the segment, with d along it, L its length and k = 1/(E I),

    ====================== ========================================
    turn of the far end    k L (M·e + ½ L (d × F)·e), about e
    its displacement       k L² (½ M·e + ⅓ L (d × F)·e), along e × d
    its twist              k L M·d, about d, with k = 1/(G J)
    ====================== ========================================

    (Timoshenko, *Strength of Materials* I, 1930, table of cantilevers, and torsion of tubes.) F (N) and M (N·m) are the
    weight of all that lies beyond: the URDF's masses and ``payload``. Two parameters a segment, 1/(N·m²), one for each
    axis across it, and if ``twist``, a third where it does not lie along a joint's axis. Expected size: the segment
    that yields most in the campaign sags by 0.2 mm, some 1e-6 to 1e-5 /(N·m²) for an aluminium tube of 100 mm (E I =
    1e5 N·m² and more; of a tube, G J = E I/(1 + ν)).

    About the axis of the joint at its end a segment bends as that joint yields (:class:`JointCompliance`), but for the
    part of the force: only bending across the joints' axes tells the two apart well. A load that stays the same bends
    a link once for all, which is :class:`Geometric`. How a link bends under its own weight is not in it.

    Where inclinometers on links were read, a link turns about the origin of its frame by the reading ω_k less that of
    the last one before it in the chain, both in the link's frame, times a gain: 1 where it stands where the link does
    (``tilt``). What is before, or the base, carries the link with it. ``twist`` is not tried by itself: on a real arm
    whose joints yield, twisting links took their place, each ten times softer than a tube.
    """

    twist: bool = False
    tilt: bool = False

    name: ClassVar[str] = "link_compliance"
    title: ClassVar[str] = "links that bend under load"

    def _inclined(self, observations: Observations) -> tuple[str, ...]:
        return tuple(dict.fromkeys(segment.parent_link for segment in observations.robot.segments))

    def _loaded(self, observations: Observations) -> bool:
        bent = (turn for s in beams(observations.robot) for turn, _ in _yields(observations, s))
        return observations.robot.has_masses and any(np.ptp(turn) > _STEADY for turn in bent)

    def missing(self, observations: Observations) -> tuple[str, ...]:
        """Column of masses, unless a bending load by known masses or a measured tilt varies.

        A payload alone is not enough: without the arm's own masses, bending by the payload would include their
        share.
        """
        return () if self._kinds(observations) else (_MASSES,)

    def variants(self, observations: Observations) -> tuple[Effect, ...]:
        """Return the settings: bending under load and measured tilts, as far as the campaign has them."""
        return tuple(replace(self, tilt=tilt) for tilt in self._kinds(observations)) or (self,)

    def parameters(self, observations: Observations) -> tuple[Parameter, ...]:
        """Two bending compliances a segment, with ``twist`` a torsional one, 1/(N·m²); or gains of measured tilts."""
        if self.tilt:
            return _by_tilt(observations)
        robot = observations.robot
        told, most = [], 0.0  # of each parameter what it is, the segment, and the shift and turn of its far end
        for s in beams(robot):
            along = robot.segments[s].direction
            for k, (axis, (turn, shift)) in enumerate(zip(cross_axes(robot, s), _yields(observations, s), strict=True)):
                moved = np.outer(shift, np.cross(axis, along)), np.outer(turn, axis)
                told.append((f"bending compliance of {{}}, axis {k + 1}", s, *moved))
                most = max(most, float(np.abs(shift).max(initial=0.0)))
        for s in shafts(robot) if self.twist else ():
            along = robot.segments[s].direction
            turn = robot.segments[s].length * np.outer(observations.segment_load[:, s, 3:] @ along, along)
            told.append(("twisting compliance of {}", s, np.zeros_like(turn), turn))
        found = []
        for label, s, shift, turn in told:
            segment, response = robot.segments[s], (at_segment(s, np.hstack([shift, turn])),)
            label, size = label.format(segment.name), _SAG / max(most, 1e-9)
            found.append(Parameter(label, _UNIT, size, "link", segment.parent_link, response, positive=True))
        return tuple(found)

    def driver(self, observations: Observations, parameters: Sequence[Parameter], error: Array) -> Driver | None:
        """Bending moment about the axis that fits the error best, or the tilt with the largest range."""
        link = parameters[0].place
        if self.tilt:
            return _tilt_read(observations, link)
        moment = observations.segment_load[:, parameters[0].responses[0].index, 3:]
        return _moment(f"bending moment on {link}", moment, error)


def _by_tilt(observations: Observations) -> tuple[Parameter, ...]:
    """One gain for each link with an inclinometer, in the order of the chain."""
    robot, chain, found = observations.robot, observations.robot.chain, []
    before = measured_turn(observations)  # root frame
    for s, segment in enumerate(robot.segments):
        link, e = segment.parent_link, segment.index
        if not observations.covariates.keys() & {*tilts(link)}:
            continue
        frame = observations.commanded.rotations[:, e] @ chain.rotations[e].T  # of the link, in the root frame
        turn = measured_turn(observations, link)
        carried = np.einsum("nij,ni->nj", frame, before) * [1.0, 1.0, 0.0]
        own, before = turn - carried, np.einsum("nij,nj->ni", frame, turn)
        twist = np.hstack([np.cross(own, chain.translations[e]), own]).reshape(-1, 2, 3) @ chain.rotations[e]
        response = (at_segment(s, twist.reshape(-1, 6)),)
        found.append(Parameter("turn per tilt measured", "1", 1.0, "link", link, response, positive=True))
    return tuple(found)


def _yields(observations: Observations, s: int) -> list[tuple[Array, Array]]:
    """Rotation (N,) and deflection (N,) of a cantilever's free end about each axis, for E I = 1 N·m²."""
    segment, load, found = observations.robot.segments[s], observations.segment_load[:, s], []
    length = segment.length
    for axis in cross_axes(observations.robot, s):
        moment = load[:, 3:] @ axis
        force = load[:, :3] @ np.cross(axis, segment.direction)  # (d × F)·e = F·(e × d)
        found.append((length * (moment + length * force / 2.0), length**2 * (moment / 2.0 + length * force / 3.0)))
    return found
