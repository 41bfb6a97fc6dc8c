"""Elastic links: every segment bends and twists under the weight on its far end."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.effects import inclinometer
from thermal_robot.effects.beam import beams, cross_axes, shafts
from thermal_robot.effects.effect import Driver, Effect, Parameter, at_segment

if TYPE_CHECKING:
    from thermal_robot.observations import Observations

_SAG = 2e-4  # m
_STEADY = 1e-9  # N·m²
_UNIT = "1/(N·m²)"


@dataclass(frozen=True)
class LinkCompliance(Effect):
    """Every segment is a cantilever, clamped at its link, that carries force F and moment M on its far end.

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

    Where inclinometers on links were read (``tilt.<link>.x``, ``tilt.<link>.y``), a link turns about the origin of its
    frame by the reading ω_k less that of the last one before it in the chain, both in the link's frame, times a gain:
    1 where it stands where the link does (``tilt``). What is before, or the base, carries the link with it.
    ``twist`` is not tried by itself: on a real arm whose joints yield, twisting links took their place, each ten times
    softer than a tube.
    """

    twist: bool = False
    tilt: bool = False

    name: ClassVar[str] = "link_compliance"
    title: ClassVar[str] = "links that bend under load"

    @property
    def sided_by(self) -> tuple[str, ...]:  # type: ignore[override]
        """Gravity, unless the turns were measured."""
        return () if self.tilt else ("gravity",)

    def missing(self, observations: Observations) -> tuple[str, ...]:
        """Return what would give a load, unless one that bends a segment, or a measured tilt, varies.

        Where the arm's own masses are not known, what a payload bends it by stands in for their share, too.
        """
        return () if _measured(observations) or _loaded(observations) else ("masses in the URDF",)

    def reads(self, observations: Observations) -> tuple[str, ...]:
        """Return the tilts where they are used, else the payload where it was recorded."""
        used = inclinometer.columns(inclinometer.BASE, *_links(observations)) if self.tilt else ("payload",)
        return tuple(column for column in used if column in observations.covariates)

    def variants(self, observations: Observations) -> tuple[Effect, ...]:
        """Return bending under load and the measured tilts, as far as the campaign has them."""
        kinds = [tilt for tilt, has in ((False, _loaded), (True, _measured)) if has(observations)]
        return tuple(replace(self, tilt=tilt) for tilt in kinds) or (self,)

    def parameters(self, observations: Observations) -> tuple[Parameter, ...]:
        """Return two bending compliances a segment, then what twists, 1/(N·m²); or gains of measured turns."""
        if self.tilt:
            return _inclined(observations)
        robot = observations.robot
        bent = {s: _yields(observations, s) for s in beams(robot)}
        most = max((float(np.abs(shift).max(initial=0.0)) for pair in bent.values() for _, shift in pair), default=0.0)
        size = _SAG / max(most, 1e-9)
        found = []
        for s, pair in bent.items():
            segment, axes = robot.segments[s], cross_axes(robot, s)
            for k, (turn, shift) in enumerate(pair):
                across = np.concatenate([np.cross(axes[k], segment.direction), axes[k]])
                twist = np.column_stack([np.repeat(shift[:, None], 3, 1), np.repeat(turn[:, None], 3, 1)]) * across
                label = f"bending compliance of {segment.name}, axis {k + 1}"
                response = (at_segment(s, twist),)
                found.append(Parameter(label, _UNIT, size, "link", segment.parent_link, response, positive=True))
        for s in shafts(robot) if self.twist else ():
            segment = robot.segments[s]
            twist = segment.length * np.outer(
                observations.segment_load[:, s, 3:] @ segment.direction, segment.direction
            )
            response = (at_segment(s, np.hstack([np.zeros_like(twist), twist])),)
            label = f"twisting compliance of {segment.name}"
            found.append(Parameter(label, _UNIT, size, "link", segment.parent_link, response, positive=True))
        return tuple(found)

    def driver(self, observations: Observations, parameters: Sequence[Parameter], error: Array) -> Driver | None:
        """Return the bending moment, about the axis about which the error goes with it, or the tilt."""
        if self.tilt:
            return inclinometer.varying_most(observations, parameters[0].place)
        moment = observations.segment_load[:, parameters[0].responses[0].index, 3:]
        axis = np.linalg.lstsq(moment, error, rcond=1e-9)[0]
        values = moment @ axis / (np.linalg.norm(axis) + 1e-300)
        return f"bending moment on {parameters[0].place}", "N·m", values


def _loaded(observations: Observations) -> bool:
    """Whether the masses are known and what they bend a segment by varies."""
    return observations.robot.has_masses and any(
        np.ptp(turn) > _STEADY for s in beams(observations.robot) for turn, _ in _yields(observations, s)
    )


def _links(observations: Observations) -> tuple[str, ...]:
    """Return the links that carry a segment, each once."""
    return tuple(dict.fromkeys(segment.parent_link for segment in observations.robot.segments))


def _measured(observations: Observations) -> bool:
    return inclinometer.varies(observations, *_links(observations))


def _inclined(observations: Observations) -> tuple[Parameter, ...]:
    """Return a gain for each link with an inclinometer, in the order of the chain."""
    robot, chain = observations.robot, observations.robot.chain
    before = inclinometer.turn(observations)  # root frame
    found = []
    for s, segment in enumerate(robot.segments):
        link, e = segment.parent_link, segment.index
        if not inclinometer.recorded(observations, link):
            continue
        frame = observations.commanded.rotations[:, e] @ chain.rotations[e].T  # of the link, in the root frame
        turn = inclinometer.turn(observations, link)
        carried = np.einsum("nij,ni->nj", frame, before) * [1.0, 1.0, 0.0]
        own, before = turn - carried, np.einsum("nij,nj->ni", frame, turn)
        twist = np.hstack([np.cross(own, chain.translations[e]), own]).reshape(-1, 2, 3) @ chain.rotations[e]
        response = (at_segment(s, twist.reshape(-1, 6)),)
        found.append(Parameter("turn per tilt measured", "1", 1.0, "link", link, response, positive=True))
    return tuple(found)


def _yields(observations: Observations, s: int) -> tuple[tuple[Array, Array], ...]:
    """Turn (N,) and displacement (N,) of a segment's far end about each axis, for E I = 1 N·m²."""
    segment, load = observations.robot.segments[s], observations.segment_load[:, s]
    length = segment.length
    found = []
    for axis in cross_axes(observations.robot, s):
        moment = load[:, 3:] @ axis
        force = load[:, :3] @ np.cross(axis, segment.direction)  # (d × F)·e = F·(e × d)
        turn = length * (moment + length * force / 2.0)
        found.append((turn, length**2 * (moment / 2.0 + length * force / 3.0)))
    return tuple(found)
