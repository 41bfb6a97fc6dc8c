"""Constant errors: placements, joint zeros, the frames of base and target, the instrument's scale."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.effects.effect import (
    TWIST,
    UNSOURCED,
    Driver,
    Effect,
    Parameter,
    at_base,
    at_instrument,
    at_joint,
    at_segment,
    at_tool,
)
from thermal_robot.effects.quantities import position_of, unit
from thermal_robot.effects.settings import IN_MODEL
from thermal_robot.observables import components, instrument_rows, of_model

if TYPE_CHECKING:
    from thermal_robot.observations import Observations

_SIZE = 5e-4  # m and rad a component: see Geometric
_PARALLEL = 0.1
"""Sine of the angle of two successive axes below which a turn across both stands for a shift along one, whose effect
then is that of a neighbour's (Hayati and Mirmirani, *Journal of Robotic Systems* 2, 1985)."""
_ALONE = 0.1 / len(TWIST)  # of the weight of all components together: one frame in ten is off in one component alone
_LOCATED = "rows of kind position or pose"
_OFFSET = {"rad": 1e-3, "m": 5e-4}  # see JointOffset


@dataclass(frozen=True)
class Geometric(Effect):
    """Geometric error: every segment's placement is off by a constant twist, P_s exp(ξ_s), LOCAL.

    ξ_s = (translation, rotation). Expected size 0.5 mm and 0.5 mrad a component, what uncalibrated industrial arms show
    (Mooring, Roth and Driels 1991; the UR and ABB arms of the public campaigns): a calibrated arm shows tenths of that,
    a light one several times as much. The six parameters of a segment are redundant along and about parallel axes and
    with unknown frames; the prior sizes hold what the data do not determine. It contains :class:`JointOffset`,
    :class:`InstrumentScale` and :class:`ThermalElongation` at constant temperature.
    """

    name: ClassVar[str] = "geometric"
    title: ClassVar[str] = "geometric errors of the links"
    in_model: ClassVar[str] = "a calibration of this one arm, or another variant, in the controller"
    size_spread: ClassVar[float] = 1.0

    def parameters(self, observations: Observations) -> tuple[Parameter, ...]:
        """Three translations (m) and three rotations (rad) a segment, in the placement's own frame."""
        segments = observations.robot.segments
        # a fixed frame before a joint is part of the body that the joint's own placement describes
        last = max(s for s, segment in enumerate(segments) if segment.movable)
        return tuple(
            Parameter(
                f"{component} of {own.name}", unit, _SIZE, "link", own.parent_link, (at_segment(s, np.eye(6)[k]),)
            )
            for s, own in enumerate(segments)
            if own.movable or s > last
            for k, (component, unit) in enumerate(TWIST)
        )

    def variants(self, observations: Observations) -> tuple[Effect, ...]:
        """Return the settings: all segments; where another model says the pose, without the ends that its frames move.

        A tool of 0.1 m that is set there would else be a calibration of the last segment by as much.
        """
        links = [segment.parent_link for segment in observations.robot.segments]
        if not of_model(observations.campaign) or len(links) < 3:
            return (self,)
        first, last = links[0], links[-1]
        return (self, *(replace(self, excluded=ends) for ends in ((last,), (first,), (first, last))))

    def independent(self, observations: Observations) -> tuple[Parameter, ...]:
        """Denavit-Hartenberg parameter errors (1955) without the joint zeros, which are ``joint_offset``.

        Of each joint's axis: its distance from the axis before it, its twist about their common normal, its shift along
        itself, or its turn if the joint slides (a, α, d, θ); where both are nearly parallel also a turn across (β).
        """
        chain, robot = observations.commanded, observations.robot
        found, before = [], None
        for s, segment in enumerate(robot.segments):
            if not segment.movable:
                continue
            turned, origin = chain.rotations[0, segment.index], chain.positions[0, segment.index]
            axis = turned @ robot.chain.axes[segment.index]
            slides = segment.joint is not None and unit(robot, segment.joint) == "m"
            for label, measured, shift, turn in _of_axis(before, (origin, axis), slides):
                response = at_segment(s, np.concatenate([turned.T @ shift, turned.T @ turn]))
                name = f"{label} of {segment.name}"
                found.append(Parameter(name, measured, _SIZE, "link", segment.parent_link, (response,)))
            before = origin, axis
        return tuple(p for p in found if not self.places or p.place in self.places)

    def driver(self, observations: Observations, parameters: Sequence[Parameter], error: Array) -> Driver | None:
        """Position of the joint of the placement, or of the joint that it mimics."""
        joint = observations.robot.segments[parameters[0].responses[0].index].joint
        return position_of(observations, joint) if joint else None


def _of_axis(
    before: tuple[Array, Array] | None, own: tuple[Array, Array], slides: bool
) -> Iterator[tuple[str, str, Array, Array]]:
    """Yield label, unit and unit twist (shift of its origin, turn) of each Denavit-Hartenberg error of a joint axis.

    ``before`` and ``own`` are two successive axes (origin, direction), root frame. Turns are about the foot of the
    common normal, so that the distance stays. A joint that ``slides`` has the turn θ, others the shift d.
    """
    origin, axis = own
    still = np.zeros(3)
    if before is not None:
        first, along = before
        normal, span = np.cross(along, axis), first - origin
        parallel = float(np.linalg.norm(normal)) < _PARALLEL
        if parallel:
            normal = span - (span @ axis) * axis
            normal = normal if normal @ normal > 0.0 else np.cross(axis, np.eye(3)[int(np.abs(axis).argmin())])
        normal = normal / np.linalg.norm(normal)
        foot = 0.0 if parallel else float(np.cross(span, along) @ np.cross(axis, along)) / (1.0 - (axis @ along) ** 2)
        yield "distance a", "m", normal, still
        yield "twist α", "rad", np.cross(normal, -foot * axis), normal
        if parallel:
            yield "turn β", "rad", still, np.cross(axis, normal)
    yield ("turn θ", "rad", still, axis) if slides else ("shift d", "m", axis, still)


@dataclass(frozen=True)
class JointOffset(Effect):
    """Joint zero error (mastering): q_actual = q_command + o_j.

    Expected size 1 mrad (0.5 mm for a prismatic joint), the order that mastering with a gauge leaves
    (Mooring, Roth and Driels, *Fundamentals of Manipulator Calibration*, 1991). The first joint's offset is exactly a
    turn of the base about that joint's axis, the last one's a turn of the tool: with unknown frames neither can be
    told. Where :class:`Geometric` was found, offsets are what a controller's zeros can take of it.
    """

    name: ClassVar[str] = "joint_offset"
    title: ClassVar[str] = "joint zero offsets"
    in_model: ClassVar[str] = "other joint zeros in the controller"
    singular: ClassVar[str] = "a zero offset"
    size_spread: ClassVar[float] = UNSOURCED
    contained_in: ClassVar[tuple[str, ...]] = ("geometric",)
    told_inside: ClassVar[bool] = True

    def parameters(self, observations: Observations) -> tuple[Parameter, ...]:
        """One offset a joint; rad or m."""
        robot = observations.robot
        units = [unit(robot, joint) for joint in robot.joint_names]
        return tuple(
            Parameter("zero offset", own, _OFFSET[own], "joint", joint, (at_joint(j, 1.0),))
            for j, (joint, own) in enumerate(zip(robot.joint_names, units, strict=True))
        )

    def driver(self, observations: Observations, parameters: Sequence[Parameter], error: Array) -> Driver | None:
        """Position of the joint."""
        return position_of(observations, parameters[0].place)


@dataclass(frozen=True)
class BaseFrame(Effect):
    """Registration error of the base: its declared pose is off by a constant twist in the root frame.

    Expected size 2 mm and 2 mrad. Only where the campaign declares ``base = "known"`` and a reading says where it is:
    an unknown base is fitted before any effect, and without an instrument its error is not observable.
    It is a twist of the first joint's placement, too (:class:`Geometric`), and about that joint's axis its zero offset.
    ``alone`` names the one component that is off.
    """

    alone: str = ""

    name: ClassVar[str] = "base_frame"
    title: ClassVar[str] = "a misplaced base frame"
    in_model: ClassVar[str] = "a base frame set in the controller"
    frame: ClassVar[str] = "base"
    in_model_times: ClassVar[float] = IN_MODEL
    size_spread: ClassVar[float] = UNSOURCED
    contained_in: ClassVar[tuple[str, ...]] = ("geometric",)

    @property
    def weight(self) -> float:
        """Prior weight: 1 for all components together, 1/60 for one alone, as one registration in ten is off in one."""
        return _ALONE if self.alone else 1.0

    def variants(self, observations: Observations) -> tuple[Effect, ...]:
        """Return the settings: all components together, and each alone."""
        return (self, *(replace(self, alone=component) for component, _ in TWIST))

    def missing(self, observations: Observations) -> tuple[str, ...]:
        """Return what makes it untestable: no row that an instrument located, or a base that is not declared known.

        A base that is not declared known is fitted, before any effect.
        """
        campaign = observations.campaign
        if not instrument_rows(campaign).any() and not of_model(campaign):
            return (_LOCATED,)
        return () if campaign.base_known else ('frames.base = "known"',)

    def parameters(self, observations: Observations) -> tuple[Parameter, ...]:
        """Twist of the base in the root frame: m and rad."""
        return tuple(
            Parameter(component, unit, 2e-3, "base", "base", (at_base(np.eye(6)[k]),))
            for k, (component, unit) in enumerate(TWIST)
            if self.alone in ("", component)
        )


@dataclass(frozen=True)
class ToolFrame(Effect):
    """Tool-centre-point error: the declared place of the target is off by a constant twist in the tool frame.

    Expected size 2 mm and 2 mrad; a campaign of positions shows the three translations only. Only where the campaign
    declares ``tool = "known"``. ``turns``: the three rotations are parameters, too; ``None`` asks the campaign, while a
    model keeps what it was fitted with. ``alone`` names the one component that is off. About the last joint's axis it
    is that joint's zero offset.
    """

    turns: bool | None = None
    alone: str = ""

    name: ClassVar[str] = "tool_frame"
    title: ClassVar[str] = "a misplaced tool frame"
    in_model: ClassVar[str] = "a tool or flange frame set in the controller"
    frame: ClassVar[str] = "tool"
    in_model_times: ClassVar[float] = IN_MODEL
    size_spread: ClassVar[float] = UNSOURCED

    @property
    def weight(self) -> float:
        """Prior weight: 1 for all components together, 1/60 for one alone, as one target in ten is off in one."""
        return _ALONE if self.alone else 1.0

    def missing(self, observations: Observations) -> tuple[str, ...]:
        """Return the declaration ``frames.tool = "known"`` where it lacks: an unknown tool is fitted as a frame."""
        campaign = observations.campaign
        # a simulator predicts the declared target: an unknown tool is not refitted to it
        return () if campaign.tool_known or campaign.simulated_position is not None else ('frames.tool = "known"',)

    def variants(self, observations: Observations) -> tuple[Effect, ...]:
        """Return the settings: all observable components together, and each alone."""
        own = replace(self, turns=self._turns(observations))
        return (own, *(replace(own, alone=component) for component, _ in TWIST))

    def _turns(self, observations: Observations) -> bool:
        return components(observations.campaign) == 6 if self.turns is None else self.turns

    def parameters(self, observations: Observations) -> tuple[Parameter, ...]:
        """Twist of the tool in the tool frame: m, and rad where orientation is measured."""
        return tuple(
            Parameter(component, unit, 2e-3, "tool", "tool", (at_tool(np.eye(6)[k]),))
            for k, (component, unit) in enumerate(TWIST)
            if (self.alone == component if self.alone else k < 3 or self._turns(observations))
        )


@dataclass(frozen=True)
class InstrumentScale(Effect):
    """Scale error of the instrument: measured = (1 + s) · true, about its origin.

    Expected size 1e-4: a tracker whose refraction is corrected with a wrong temperature errs by 1e-6 per
    kelvin, a camera or a photogrammetric scale bar by a hundred times that. All link lengths wrong by the same share
    look alike, so :class:`Geometric` contains it, unless a joint slides or the target stands off a known tool frame.
    """

    name: ClassVar[str] = "instrument_scale"
    title: ClassVar[str] = "a scale error of the instrument"
    size_spread: ClassVar[float] = UNSOURCED
    contained_in: ClassVar[tuple[str, ...]] = ("geometric",)

    def missing(self, observations: Observations) -> tuple[str, ...]:
        """Return the rows that it needs, of kind position or pose, where no instrument measured any."""
        return () if instrument_rows(observations.campaign).any() else (_LOCATED,)

    def parameters(self, observations: Observations) -> tuple[Parameter, ...]:
        """One scale error; dimensionless."""
        response = at_instrument(observations.predicted_position)
        return (Parameter("scale error", "1", 1e-4, "instrument", "instrument", (response,)),)

    def driver(self, observations: Observations, parameters: Sequence[Parameter], error: Array) -> Driver | None:
        """Distance from the instrument."""
        return "distance from the instrument", "m", np.linalg.norm(observations.predicted_position, axis=1)
