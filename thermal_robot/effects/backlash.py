"""Lost motion of joints: backlash towards the side of approach or of the load, hysteresis, play of a carriage."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, ClassVar

import numpy as np
from scipy.special import erf

from thermal_robot.arrays import Array
from thermal_robot.effects.arguments import NotNegative, Share
from thermal_robot.effects.effect import Driver, Effect, Parameter, at_joint, at_segment
from thermal_robot.effects.quantities import driving, torque_columns, unit
from thermal_robot.schema import word

if TYPE_CHECKING:
    from thermal_robot.observations import Observations

_SHARES = (0.2, 0.35, 0.5, 0.7, 0.9)  # their odds grow by about two
_HANGS = 0.02  # of the largest torque of any joint: what is lighter, friction holds
_SIZE = 5e-4  # rad or m
_TURNS = 5e-5  # rad
_CARRIAGES = ("moving", "staying")
_SOFT = 0.05  # of friction: how far a film of grease lets a tooth lie between its two sides
_SHARPEST, _SOFTEST = 0.005, 0.3  # nothing below is seen, nothing above is dry friction
_STANDS = 0.1  # of the rows: where friction wins in fewer, play that hangs to one side is an offset to the data


@dataclass(frozen=True)
class Backlash(Effect):
    """Backlash: every joint stops short by half its play, q_actual = q_command − ½ b_j · side_j; rad or m.

    side is ``approach.<joint>``: +1 where the joint was increasing, −1 where it was decreasing, 0 where that is not
    known. Where gravity outweighs friction F_j = held · max|τ_j|, the joint hangs on its teeth, however it came: side
    is the sign of the torque τ_j that holds it. Near |τ_j| = F_j it changes gradually, over a share of friction: side =
    ½ (1 + a) erf((τ + F)/(soft F)) + ½ (1 − a) erf((τ − F)/(soft F)), a the approach. A joint that never carries more
    than 2 % of the robot's largest torque never hangs. Expected size 0.5 mrad, two minutes of arc: catalogues promise
    0.3 mrad of cycloidal gears (1′), wear adds to it, and light arms show ten.

    Hysteresis of a loaded gear grows with the load: lost motion is then b_j + h_j |τ_j|, with h_j in rad/(N·m), of
    0.5 mrad at the joint's largest torque. A slide's carriage turns when it reverses, by −½ t_e side about each axis e
    of the joint's frame. Expected size 0.05 mrad: catalogues of guides state pitch and yaw of 5 to 20″.

    Only poses that are reached from both sides show it. Where torque decides always, only a jump at zero torque tells
    it from :class:`JointCompliance`.

    ``held``: share of the joint's ``largest`` torque in the campaign, N·m, above which gravity wins, 0 never; one for
    all joints or one for each of the ``chain``. ``soft``: share of friction over which teeth change sides, 0 at once.
    ``steady``: each joint's torque, N·m, that all but a tenth of the rows exceed to one side; with less friction it
    always lies there: an offset. ``grows``: lost motion grows with the torque. ``carriage`` of a slide sits ``moving``
    with it or ``staying`` where the stroke begins; empty where none turns.
    """

    held: Share | tuple[Share, ...] = 0.0
    largest: tuple[NotNegative, ...] = ()
    chain: tuple[str, ...] = ()
    soft: Share = 0.0
    steady: tuple[NotNegative, ...] = ()
    grows: bool = False
    carriage: Annotated[str, word(("", *_CARRIAGES))] = ""

    name: ClassVar[str] = "backlash"
    title: ClassVar[str] = "lost motion in the joints"
    singular: ClassVar[str] = "lost motion"
    sided_by: ClassVar[tuple[str, ...]] = ("approach",)
    size_spread: ClassVar[float] = 1.0

    def missing(self, observations: Observations) -> tuple[str, ...]:
        """Approach columns, none if at least one varies; and ``order``, where approaches would follow from it."""
        columns = tuple(f"approach.{joint}" for joint in observations.robot.joint_names)
        if any(observations.varies(column) for column in columns):
            return ()
        follow = observations.clock is None and observations.campaign.moves == "direct"
        return (*columns, "order") if follow else columns

    def reads(self, observations: Observations) -> tuple[str, ...]:
        """Return the recorded approach columns of the chain's joints, and the columns from which torques follow."""
        columns = (f"approach.{joint}" for joint in observations.robot.joint_names)
        recorded = tuple(column for column in columns if column in observations.covariates)
        return (*recorded, *torque_columns(observations)) if np.any(self.held) or self.grows else recorded

    def variants(self, observations: Observations) -> tuple[Effect, ...]:
        """Grid of settings: friction always holds the teeth, or below a share of torque; play that grows; carriages."""
        turning = tuple(replace(self, carriage=sits) for sits in _CARRIAGES if _slides(observations))
        torque = observations.torque
        if torque is None or not np.any(np.ptp(torque, axis=0) > 1e-9):
            return (self, *turning)
        largest = tuple(np.abs(torque).max(axis=0).tolist())
        one_sided = (torque > 0.0).all(axis=0) | (torque < 0.0).all(axis=0)
        steady = tuple(np.where(one_sided, np.quantile(np.abs(torque), _STANDS, axis=0), 0.0).tolist())
        chain = observations.robot.joint_names
        hangs = replace(self, largest=largest, chain=chain, soft=_SOFT, steady=steady)
        return (*(replace(hangs, held=share) for share in (0.0, *_SHARES)), replace(hangs, grows=True), *turning)

    @property
    def weight(self) -> float:
        """Prior weight: 1 if friction always wins, 1 for all its shares together; ½ if it grows or a carriage turns."""
        return 1.0 / len(_SHARES) if np.any(self.held) else 0.5 if self.grows or self.carriage else 1.0

    @property
    def _shares(self) -> Array:
        """Share (n,) of each joint's largest torque above which gravity turns it."""
        return np.broadcast_to(self.held, len(self.largest))

    @property
    def apart(self) -> int:
        """Number of joints whose share of friction differs from the most common one, of those that may hang."""
        shares = [share for j, share in enumerate(self._shares.tolist()) if self._may_hang(j)]
        return len(shares) - max(map(shares.count, shares), default=0)

    def nearby(self, factor: float) -> tuple[Effect, ...]:
        """Neighbours of a setting: odds of the shares multiplied and divided by a factor, jointly and one by one.

        Also softer and sharper changes of side, a share of zero or of its own for one joint, and, where shares differ,
        one of them for all.
        """
        shares = self._shares
        able = [j for j, joint in enumerate(self.chain) if self._may_hang(j) and joint in (self.places or self.chain)]
        own = [j for j in able if shares[j] > 0.0]
        if not own:
            return (self, *(self._with(j, share) for j in able for share in _SHARES if len(able) > 1))
        found: list[Effect] = [self, *(replace(self, held=float(shares[j])) for j in own if self.apart)]
        odds = [shares * by / (1.0 - shares + shares * by) for by in (factor, 1.0 / factor)]
        if len(own) > 1:
            # before all together: of equals the first is taken, and the other joints stay
            found += [self._with(j, float(share)) for j in own for share in (0.0, *(moved[j] for moved in odds))]
        for moved in odds:
            found.append(replace(self, held=tuple(moved.tolist()) if isinstance(self.held, tuple) else float(moved[0])))
        films = (float(np.clip(self.soft * by, _SHARPEST, _SOFTEST)) for by in (factor, 1.0 / factor) if self.soft)
        return (*found, *(replace(self, soft=film) for film in films))

    def _with(self, j: int, share: float) -> Effect:
        """Copy with another share of friction in one joint."""
        shares = self._shares
        return replace(self, held=tuple(np.where(np.arange(len(shares)) == j, share, shares).tolist()))

    def parameters(self, observations: Observations) -> tuple[Parameter, ...]:
        """One lost motion for each joint with a recorded approach, rad or m; where it grows, one per torque."""
        robot, covariates, torque = observations.robot, observations.covariates, observations.torque
        found = []
        for j, joint in enumerate(robot.joint_names):
            if f"approach.{joint}" not in covariates:
                continue
            own = unit(robot, joint)
            short = -0.5 * self._side(observations, j, np.asarray(covariates[f"approach.{joint}"]))
            told = [("lost motion", own, _SIZE, short)]
            if self.grows and torque is not None and self._may_hang(j):
                per = "m/N" if own == "m" else "rad/(N·m)"
                told.append(("lost motion per torque", per, _SIZE / self.largest[j], short * np.abs(torque[:, j])))
            for label, measured, size, lost in told:
                found.append(Parameter(label, measured, size, "joint", joint, (at_joint(j, lost),), positive=True))
            if self.carriage and robot.joint_types[j] == "prismatic":
                found += self._turning(observations, j, short)
        return tuple(found)

    def _turning(self, observations: Observations, j: int, short: Array) -> Iterator[Parameter]:
        """Yield three rotations of the carriage of a prismatic joint, rad; none for a joint outside the chain."""
        robot, joint = observations.robot, observations.robot.joint_names[j]
        for s in (s for s, segment in enumerate(robot.segments) if segment.name == joint):
            stroke = observations.q[:, [j]] * (self.carriage == "moving")
            at = stroke * robot.chain.axes[robot.segments[s].index]
            for name, axis in zip("xyz", np.eye(3), strict=True):
                twist = short[:, None] * np.hstack([np.cross(at, axis), np.broadcast_to(axis, at.shape)])
                label = f"turn about {name} at reversal"
                yield Parameter(label, "rad", _TURNS, "joint", joint, (at_segment(s, twist),))

    def driver(self, observations: Observations, parameters: Sequence[Parameter], error: Array) -> Driver | None:
        """Direction of approach of the joint."""
        return driving(observations, f"approach.{parameters[0].place}")

    def _side(self, observations: Observations, j: int, approach: Array) -> Array:
        """Side (N,) of its play on which a joint rests, −1 to 1, by torque and approach; 0 where it never changes."""
        torque = observations.torque
        held = self.held[j] if isinstance(self.held, tuple) else self.held
        if not held or torque is None or not self._may_hang(j):
            return approach
        friction = held * self.largest[j]
        if self.steady and friction < self.steady[j]:
            return np.zeros_like(approach)
        film = max(self.soft, 1e-9) * friction
        up, down = (erf((torque[:, j] + side * friction) / film) for side in (1.0, -1.0))
        return np.asarray(0.5 * ((1.0 + approach) * up + (1.0 - approach) * down))

    def _may_hang(self, j: int) -> bool:
        """Whether a joint's largest torque is 2 % or more of the largest of all: gravity can then take up its play."""
        return self.largest[j] >= _HANGS * max(self.largest)


def _slides(observations: Observations) -> bool:
    """Whether any prismatic joint has a direction of approach that varies."""
    robot = observations.robot
    sliding = (n for n, kind in zip(robot.joint_names, robot.joint_types, strict=True) if kind == "prismatic")
    return any(observations.varies(f"approach.{joint}") for joint in sliding)
