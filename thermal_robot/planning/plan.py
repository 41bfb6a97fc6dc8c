"""Plan a first campaign: poses that tell the effects apart, in an order that brings both approaches.

Candidates for each place in the order are drawn at random; of these the engine of ``next_samples`` chooses greedily
what tells most about the parameters of all effects together, with the frames unknown. Collisions and the line of sight
of the instrument are not checked.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign, Units
from thermal_robot.diagnosis.next_samples import most_informative
from thermal_robot.effects import Effect, choose, gate
from thermal_robot.effects.catalogue import of_effect
from thermal_robot.errors import CampaignError, require
from thermal_robot.observations import observe
from thermal_robot.planning import settings
from thermal_robot.planning.expected import Columns, Expected, expectations
from thermal_robot.robot import Robot, joint_range
from thermal_robot.simulation import schedule
from thermal_robot.simulation.schedule import RISE


@dataclass(frozen=True, eq=False)
class Plan:
    """What to command, and how well each effect will be known.

    Attributes
    ----------
    commands
        The rows in their order, a campaign without measurements: joints, time, temperature, payload, and the approaches
        that follow from the order.
    effects
        How well each effect will be known.
    information
        Of all rows about the parameters of all effects, nats.
    repeats
        How often each pose is measured.

    Examples
    --------
    >>> from thermal_robot.planning import plan
    >>> found = plan(tr.load_robot("builtin:rv_m2", "tool0"), rows=12, effects=["joint_gain"], repeats=2)
    >>> [expected.name for expected in found.effects], found.repeats
    (['joint_gain'], 2)
    """

    commands: Campaign
    effects: tuple[Expected, ...]
    information: float
    repeats: int

    def effect(self, name: str) -> Expected:
        """Return what is expected of one effect.

        Raises
        ------
        UnknownEffectError
            If it was not considered; says which name was probably meant. It is a ``KeyError``, too.

        Examples
        --------
        >>> from thermal_robot.planning import plan
        >>> found = plan(tr.load_robot("builtin:rv_m2", "tool0"), rows=12, effects=["joint_gain", "backlash"])
        >>> found.effect("backlash").title
        'lost motion in the joints'
        """
        return of_effect({expected.name: expected for expected in self.effects}, name)

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, SI, ready for JSON.

        Examples
        --------
        >>> from thermal_robot.planning import plan
        >>> found = plan(tr.load_robot("builtin:rv_m2", "tool0"), rows=12, effects=["joint_gain"])
        >>> list(found.to_dict())
        ['information', 'repeats', 'effects', 'joints', 'conditions']
        """
        q, names = self.commands.q, self.commands.robot.joint_names
        joints = {name: q[:, j].tolist() for j, name in enumerate(names)}
        given = {name: values.tolist() for name, values in self.commands.covariates.items()}
        effects = [expected.to_dict() for expected in self.effects]
        told = {"information": self.information, "repeats": self.repeats, "effects": effects}
        return {**told, "joints": joints, "conditions": given}


def plan(
    robot: Robot,
    rows: int = 60,
    effects: str | Iterable[str] | None = None,
    *,
    repeats: int = 1,
    noise: float = settings.NOISE,
    orientation: bool = False,
    noise_orientation: float = settings.NOISE_TURN,
    target: Sequence[float] = (0.0, 0.0, 0.0),
    loads: Sequence[float] = (),
    rise: float = RISE,
    base_known: bool = False,
    tool_known: bool = False,
    units: Units | None = None,
    seed: int = 0,
) -> Plan:
    """Plan a campaign before anything was measured.

    Parameters
    ----------
    robot
        Whose n joints are commanded, within their limits and within 2.4 rad where one can turn once round.
    rows
        Of the campaign, repeats included.
    effects
        Names of those that are to be told; all where absent.
    repeats
        How often each pose is measured: rows / repeats poses, all of them once a round.
    noise, noise_orientation
        One sigma per axis of the instrument, m and rad.
    orientation
        Whether orientations will be measured, too.
    target
        (3,) m: the measured point in the tool frame. One on the last joint's axis does not see that joint.
    loads
        Payloads beside none that the robot can be given, kg.
    rise
        K by which the robot warms before it cools; 0 where its temperature will not be recorded.
    base_known, tool_known
        Whether the frames will be known; by default they are fitted.
    units
        In which the plan is written; rad and m by default.
    seed
        Of the candidates; the same seed gives the same plan.

    Returns
    -------
    Plan
        Rows in their order, and what is expected of each effect.

    Raises
    ------
    CampaignError
        A number that no campaign has; a joint that slides without limits.
    EffectError
        A name that no effect has, or none that these rows could tell.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> from thermal_robot.planning import plan
    >>> found = plan(tr.load_robot("builtin:rv_m2", "tool0"), rows=12, effects=["joint_gain", "backlash"])
    >>> found.commands
    <Campaign 'plan': 12 samples to predict, 5 joints, 7 covariates>
    """
    require("plan()", robot, (Robot,), "a robot, from load_robot")
    _check(robot, rows, repeats, noise, noise_orientation, rise, loads)
    kinds = choose(() if effects is None else effects)
    rng = np.random.default_rng(seed)
    given = schedule.conditions(rows, rise, loads)
    if rise == 0.0:
        del given["temperature"]
    made = Campaign(
        "plan",
        robot,
        np.zeros((0, robot.n)),
        base_known=base_known,
        tool_known=tool_known,
        target=np.asarray(target, dtype=float),
        noise_position=noise,
        noise_orientation=noise_orientation if orientation else None,
        units=units or Units(),
    )
    draft = _Draft(made, given, schedule.visits(rows, repeats), orientation)
    return _planned(draft, kinds, rng)


@dataclass(frozen=True, eq=False)
class _Draft:
    """What is decided before poses are: an empty campaign, (N,) conditions, (P, K) rows of each pose."""

    empty: Campaign
    given: dict[str, Array]
    places: NDArray[np.int64]
    orientation: bool

    @property
    def noise(self) -> Array:
        """(m,) one sigma of each component."""
        turn = self.empty.noise_orientation
        return np.array([self.empty.noise_position] * 3 + ([turn] * 3 if turn else []), dtype=float)

    def campaign(self, q: Array, covariates: dict[str, Array], labels: dict[str, Any] | None = None) -> Campaign:
        """Return rows with these commands and conditions."""
        turned = np.tile([1.0, 0.0, 0.0, 0.0], (len(q), 1)) if self.orientation else None
        rows = np.arange(2, len(q) + 2)
        return replace(self.empty, q=q, orientation=turned, covariates=covariates, rows=rows, labels=labels or {})

    def ordered(self, poses: Array) -> Campaign:
        """Return the plan of poses (P, n) in this order, with the approaches that follow from it."""
        q, which = schedule.in_turn(poses, self.places)
        names = self.empty.robot.joint_names
        sides = schedule.approaches(q, names, self.given)
        labels = {"pose": np.array([str(k + 1) for k in which])} if self.places.shape[1] > 1 else {}
        return self.campaign(q, {**self.given, **sides}, labels)


def _planned(draft: _Draft, kinds: Sequence[Effect], rng: np.random.Generator) -> Plan:
    """Choose poses, then their order."""
    poses, places = draft.places.shape
    each = max(settings.FEWEST_CHOICES, min(settings.CHOICES, settings.MOST_CANDIDATES // (poses * places)))
    place = np.repeat(np.arange(poses), each)
    robot = draft.empty.robot
    offered = rng.uniform(*joint_range(robot), (len(place), robot.n))
    rows = draft.places[place].ravel()
    covariates = {name: values[rows] for name, values in draft.given.items()}
    for joint in robot.joint_names:
        covariates[f"approach.{joint}"] = rng.choice([-1.0, 1.0], len(rows))
    seen = observe(draft.campaign(np.repeat(offered, places, axis=0), covariates))
    lacks = {kind.name: gate.missing(kind, seen) for kind in kinds}
    tested = [gate.variants(kind, seen)[0] for kind in kinds if not lacks[kind.name]]
    columns = Columns.of(seen, tested, draft.noise)
    root, frames = (part.reshape(len(place), -1, part.shape[2]) for part in (columns.root, columns.frames))
    chosen = most_informative(root, frames, poses, place)[0]
    chosen.sort(key=lambda row: int(place[row]))
    best, found, told = _best_order(draft, offered[chosen], tested, rng)
    known = {expected.name: expected for expected in expectations(found)}
    without = {kind.name: Expected(kind.name, kind.title, (), lacks=lacks[kind.name]) for kind in kinds}
    effects = tuple(known.get(kind.name, without[kind.name]) for kind in kinds)
    return Plan(best, effects, told, places)


def _best_order(
    draft: _Draft, poses: Array, tested: Sequence[Effect], rng: np.random.Generator
) -> tuple[Campaign, Columns, float]:
    """Return the balanced order of poses that tells most, its columns and what it tells."""
    best: tuple[Campaign, Columns, float] | None = None
    for k in range(settings.ORDERS):
        start = np.arange(len(poses)) if k == 0 else rng.permutation(len(poses))
        mixed = poses[start]
        campaign = draft.ordered(mixed[schedule.balanced(mixed, draft.places, rng)])
        columns = Columns.of(observe(campaign), tested, draft.noise)
        told = columns.information
        if best is None or told > best[2]:
            best = campaign, columns, told
    assert best is not None
    return best


def _number(value: object) -> bool:
    return isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)


def _check(
    robot: Robot, rows: int, repeats: int, noise: float, turn: float, rise: float, loads: Sequence[float]
) -> None:
    """Refuse numbers that no campaign has."""

    def refuse(column: str, found: object, expected: str) -> None:
        raise CampaignError("plan", "cannot be planned", column=column, found=repr(found), expected=expected)

    least, most = settings.FEWEST_ROWS, settings.MOST_ROWS
    if not isinstance(rows, (int, np.integer)) or not least <= rows <= most:
        refuse("rows", rows, f"a whole number from {least} to {most}")
    if not isinstance(repeats, (int, np.integer)) or not 1 <= repeats <= rows // 2 or rows % repeats:
        refuse("repeats", repeats, f"a whole number that divides the {rows} rows into two poses or more")
    for name, value in (("noise", noise), ("noise_orientation", turn)):
        if not _number(value) or not 0.0 < value < np.inf:
            refuse(name, value, "a number above 0")
    if not _number(rise) or not 0.0 <= rise <= 100.0:
        refuse("rise", rise, "from 0 to 100 K")
    if not isinstance(loads, (list, tuple, np.ndarray)) or not all(_number(m) and 0.0 < m < np.inf for m in loads):
        refuse("loads", loads, "a list of payloads above 0 kg")
    for joint, low, high in zip(robot.joint_names, *joint_range(robot), strict=True):
        if not np.isfinite(high - low):
            refuse(joint, "no limits", "a <limit> in the URDF for a joint that slides")
