"""Optimal experimental design of a first campaign: poses, their order, and expected precision.

Candidates are drawn at random; greedy D-optimal design, as in ``next_samples``, chooses those with the most information
on the parameters of all effects, with the frames unknown. Collisions and the line of sight of the instrument are not
checked.

How well a campaign will know each effect: posterior standard deviations of the linear Gaussian model.

All effects are y = F f + Σ_b X_b θ_b + e, θ ~ N(0, S²) with S the expected sizes, the frames f unknown. The covariance
of θ is (1 + S G S)⁻¹, scaled by S, with G the whitened products: it does not depend on what will be measured.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign, Units
from thermal_robot.campaign import names as names_of
from thermal_robot.campaign.turning import arrivals
from thermal_robot.campaign.write import write_commands, write_planned
from thermal_robot.diagnosis import settings as design
from thermal_robot.diagnosis.next_measurement import most_informative
from thermal_robot.effects import Effect, choose, gate
from thermal_robot.effects.catalogue import of_effect
from thermal_robot.errors import CampaignError, require
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import equations_of
from thermal_robot.inference.columns import Block, block, frame_columns
from thermal_robot.inference.problem import Linear, Whitening, whitened
from thermal_robot.inference.registration import register
from thermal_robot.observations import Observations, observe
from thermal_robot.robot import Robot, joint_range
from thermal_robot.schema import fitted, optional, word
from thermal_robot.simulation import schedule
from thermal_robot.simulation.schedule import RISE
from thermal_robot.simulation.simulate import simulate
from thermal_robot.tables import aligned

FRAMES = "unknown frames"


@dataclass(frozen=True)
class ExpectedParameter:
    """Expected precision of one parameter of an effect: its posterior standard deviation by the planned rows.

    Attributes
    ----------
    label, place, unit
        What it is, where, and its unit.
    size
        Expected size: its standard deviation before anything is measured.
    sigma, beside
        Expected posterior standard deviation with unknown frames: with this effect alone, and with all effects.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> from thermal_robot.planning import plan
    >>> found = plan(tr.load_robot("builtin:rv_m2", "tool0"), rows=12, effects=["joint_gain"])
    >>> known = found.effect("joint_gain").parameters[1]
    >>> known.place, known.told, known.sigma < known.size
    ('joint_2', True, True)
    """

    label: str
    place: str
    unit: str
    size: float
    sigma: float
    beside: float

    @property
    def told(self) -> bool:
        """Whether :attr:`sigma`, its expected standard deviation with this effect alone, is below half its size."""
        return self.sigma < settings.DETERMINED * self.size

    def to_dict(self) -> dict[str, Any]:
        """Plain values, ready for JSON."""
        return {**vars(self), "told": self.told}


@dataclass(frozen=True)
class Expected:
    """Expected precision of one effect: of its parameters, and what they are confounded with.

    Attributes
    ----------
    name, title
        The effect.
    parameters
        Its parameters.
    confounded
        What makes at least one of its parameters undeterminable: names of other effects, each taken alone, and
        ``"unknown frames"``.
    lacks
        What the campaign would have to record for it to be testable; it then has no parameters.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> from thermal_robot.planning import plan
    >>> found = plan(tr.load_robot("builtin:rv_m2", "tool0"), rows=12, effects=["joint_gain", "tracking_lag"])
    >>> found.effect("tracking_lag").lacks[0]
    'velocity.joint_1'
    """

    name: str
    title: str
    parameters: tuple[ExpectedParameter, ...]
    confounded: tuple[str, ...] = ()
    lacks: tuple[str, ...] = ()

    @property
    def told(self) -> bool:
        """Whether at least one of its parameters will be known to less than half its size."""
        return any(parameter.told for parameter in self.parameters)

    def to_dict(self) -> dict[str, Any]:
        """Plain values, ready for JSON."""
        parameters = [parameter.to_dict() for parameter in self.parameters]
        return {**vars(self), "confounded": list(self.confounded), "lacks": list(self.lacks), "parameters": parameters}


@dataclass(frozen=True, eq=False)
class Columns:
    """Whitened design matrix of frames and effects: rows over the noise, columns times the expected sizes.

    Attributes
    ----------
    root
        (N, m, f + P): the frames, then the effects.
    flat
        Number f of columns of the frames.
    blocks
        The effects, in the order of their columns.
    """

    root: Array
    flat: int
    blocks: tuple[Block, ...]

    @classmethod
    def of(cls, seen: Observations, effects: Sequence[Effect]) -> Columns:
        """Whitened design matrix of these effects at a campaign's rows, whose noise (m and rad) it states."""
        items = tuple(block(seen, effect) for effect in effects)
        frames = frame_columns(seen)[0] * design.LOOSE
        rows, measures, flat = frames.shape
        campaign = seen.campaign
        noise = np.repeat(np.array([campaign.noise_position, campaign.noise_orientation], dtype=float), 3)[:measures]
        linear = Linear(np.zeros((rows, measures)), frames, items)
        whitening = Whitening(np.ones(rows), noise, 0.0, relative=campaign.relative_noise)
        stack = whitened(linear, whitening).reshape(rows, measures, -1)[:, :, :-1]
        return cls(stack * np.concatenate([np.ones(flat), *(item.sizes for item in items)]), flat, items)

    @property
    def precision(self) -> Array:
        """Posterior precision matrix (f + P, f + P): Gram matrix plus the prior's identity, expected sizes as units."""
        rows = equations_of(self.root)
        return np.asarray(rows.T @ rows + np.eye(rows.shape[1]))

    @property
    def information(self) -> float:
        """Mutual information of all rows and the effects' parameters, nats; the frames are marginalised."""
        precision = self.precision
        whole, frames = (np.linalg.slogdet(part)[1] for part in (precision, precision[: self.flat, : self.flat]))
        return float(0.5 * (whole - frames))


def expectations(columns: Columns) -> tuple[Expected, ...]:
    """Compute the expected posterior standard deviations of each effect's parameters, and what confounds the effect."""
    flat, precision = columns.flat, columns.precision
    ends = np.cumsum([flat, *(len(item.sizes) for item in columns.blocks)])
    own = [np.arange(a, b) for a, b in pairwise(ends)]
    frames, whole = np.arange(flat), _left(precision, np.arange(len(precision)))
    found = []
    for b, item in enumerate(columns.blocks):
        alone = _left(precision, np.concatenate([frames, own[b]]))[flat:]
        told = alone < settings.DETERMINED
        lost = [FRAMES] if (~told & (_left(precision, own[b]) < settings.DETERMINED)).any() else []
        for other, rival in enumerate(columns.blocks):
            if other != b and told.any():
                both = _left(precision, np.concatenate([frames, own[b], own[other]]))[flat : flat + len(own[b])]
                lost += [rival.effect.name] if (told & (both >= settings.DETERMINED)).any() else []
        figures = np.column_stack([item.sizes, item.sizes * alone, item.sizes * whole[own[b]]]).tolist()
        known = zip(item.bare, figures, strict=True)
        parameters = tuple(ExpectedParameter(p.label, p.place, p.unit, *each) for p, each in known)
        found.append(Expected(item.effect.name, item.effect.title, parameters, tuple(lost)))
    return tuple(found)


def foreseen(campaign: Campaign, effects: str | Iterable[str] | None = None) -> tuple[Expected, ...]:
    """Return the expected posterior standard deviations of effects from the rows of a campaign, whatever these measure.

    Parameters
    ----------
    campaign
        Rows of any kind, as :func:`~thermal_robot.simulate` makes them; of its readings only the noise that it states
        counts.
    effects
        Names of those that are asked for; all that can be tested where absent.

    Raises
    ------
    CampaignError
        The campaign states no noise.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> from thermal_robot.planning.plan import foreseen
    >>> rows = tr.simulate("builtin:rv_m2", tool_frame="tool0", rows=60, measures="distance", noise=5e-5)
    >>> [known.name for known in foreseen(rows, "joint_offset")]
    ['joint_offset']
    """
    if campaign.noise_position is None:
        raise CampaignError(campaign.name, "states no noise", column="noise.position", expected="one sigma per axis")
    names = [effects] if isinstance(effects, str) else effects
    return expectations(_testable(observe(campaign), choose(tuple(names or ()))))


def _testable(seen: Observations, kinds: Sequence[Effect]) -> Columns:
    """Whitened design matrix of those effects for which the rows lack no column, each in its first variant."""
    return Columns.of(seen, [gate.variants(kind, seen)[0] for kind in kinds if not gate.missing(kind, seen)])


def _left(precision: Array, which: NDArray[np.int64]) -> Array:
    """Posterior standard deviations (k,), over expected sizes, of the parameters ``which``, with all others zero."""
    return np.asarray(np.sqrt(np.diag(np.linalg.inv(precision[np.ix_(which, which)]))))


NOISE, NOISE_TURN = 20e-6, 1e-4
"""m and rad, one sigma per axis: a laser tracker at a few metres, and the turn of its target with three reflectors."""
ROWS, CRASH_ROWS = 60, 40
"""Rows of a plan unless asked otherwise: an hour's; and those after a crash, a quarter of a minute each, ten in all."""
CHOICES, MOST_CANDIDATES, FEWEST_CHOICES = 60, 4000, 4
"""Poses among which each place in the order is filled, but no more rows of all together than this, nor fewer poses
than that."""
FEWEST_ROWS, MOST_ROWS = 6, 1000
"""Rows that a plan may have: with fewer not even the frames are known, more are not planned but measured."""
ORDERS = 16
"""Orders of the poses that are compared, each balanced first."""


@dataclass(frozen=True, eq=False)
class Plan:
    """Planned campaign with its expected precision.

    Attributes
    ----------
    commands
        The rows in their order, a campaign without measurements: joints, time, temperature, payload, and the approaches
        that follow from the order.
    effects
        Expected precision of each effect.
    information
        Information of all rows on the parameters of all effects, nats.
    repeats
        How often each pose is measured.
    artefacts
        Stands, planes, anchors or cameras by name, where rows are of these: ``points``, ``normal`` and ``offset``,
        ``place``, ``pose``, m, in the root frame.

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
    artefacts: Mapping[str, Any] = field(default_factory=dict)

    def effect(self, name: str) -> Expected:
        """Return the expected precision of one effect.

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
        """Plain values, SI, ready for JSON.

        Examples
        --------
        >>> from thermal_robot.planning import plan
        >>> found = plan(tr.load_robot("builtin:rv_m2", "tool0"), rows=12, effects=["joint_gain"])
        >>> list(found.to_dict())
        ['information', 'repeats', 'effects', 'joints', 'conditions', 'labels', 'artefacts']
        """
        q, names = self.commands.q, self.commands.robot.joint_names
        joints = {name: q[:, j].tolist() for j, name in enumerate(names)}
        given = {name: values.tolist() for name, values in self.commands.covariates.items()}
        effects = [expected.to_dict() for expected in self.effects]
        told = {"information": self.information, "repeats": self.repeats, "effects": effects}
        places = {name: {k: np.asarray(v).tolist() for k, v in vars(a).items()} for name, a in self.artefacts.items()}
        labels = {name: np.asarray(values).tolist() for name, values in self.commands.labels.items()}
        return {**told, "joints": joints, "conditions": given, "labels": labels, "artefacts": places}


def plan(
    robot: Robot,
    rows: int = ROWS,
    effects: str | Iterable[str] | None = None,
    *,
    repeats: int = 1,
    noise: float = NOISE,
    orientation: bool = False,
    noise_orientation: float = NOISE_TURN,
    target: Sequence[float] = (0.0, 0.0, 0.0),
    loads: Sequence[float] = (),
    rise: float = RISE,
    base_known: bool = False,
    tool_known: bool = False,
    units: Units | None = None,
    seed: int = 0,
    measures: str | None = None,
) -> Plan:
    """Plan a first campaign by optimal design, before anything was measured.

    Parameters
    ----------
    robot
        Robot with n joints, commanded within their limits and within 2.4 rad where one can turn once round.
    rows
        Number of rows, repeats included.
    effects
        Names of the effects to be determined; all by default.
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
        Units of the plan; rad and m by default.
    seed
        Seed of the random candidates; the same seed gives the same plan.
    measures
        ``"socket"``, ``"plane"``, ``"distance"`` or ``"pixel"`` where no instrument measures positions: the plan then
        says where stands are best placed, or where planes, the anchors of a draw wire or cameras about the middle of
        all poses; its joints are postures at stands and planes.

    Returns
    -------
    Plan
        Rows in their order, and what is expected of each effect.

    Raises
    ------
    CampaignError
        A number that no campaign has; a joint that slides without limits; places that the robot does not reach.
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
    measures = fitted(optional(word(names_of.BESIDE)), measures, "plan", "measures")
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
    found = _planned(made, given, schedule.visits(rows, repeats), kinds, rng)
    return found if measures is None else _elsewhere(found, measures, kinds, seed)


def _filled(empty: Campaign, q: Array, covariates: dict[str, Array], labels: dict[str, Any] | None = None) -> Campaign:
    """Copy of an empty campaign with commands (N, n), conditions, labels, and orientations if it states their noise."""
    turned = None if empty.noise_orientation is None else np.tile([1.0, 0.0, 0.0, 0.0], (len(q), 1))
    rows = np.arange(2, len(q) + 2)
    return replace(empty, q=q, orientation=turned, covariates=covariates, rows=rows, labels=labels or {})


def _planned(
    empty: Campaign, given: dict[str, Array], visits: schedule.Rows, kinds: Sequence[Effect], rng: np.random.Generator
) -> Plan:
    """Plan by greedy D-optimal choice of poses among random ones, in the most informative of :data:`ORDERS` orders.

    ``given`` are the conditions (N,) of the rows, ``visits`` (P, K) the rows of each pose.
    """
    poses, places = visits.shape
    each = max(FEWEST_CHOICES, min(CHOICES, MOST_CANDIDATES // (poses * places)))
    place = np.repeat(np.arange(poses), each)
    robot = empty.robot
    offered = rng.uniform(*joint_range(robot), (len(place), robot.n))
    rows = visits[place].ravel()
    covariates = {name: values[rows] for name, values in given.items()}
    for joint in robot.joint_names:
        covariates[f"approach.{joint}"] = rng.choice([-1.0, 1.0], len(rows))
    seen = observe(_filled(empty, np.repeat(offered, places, axis=0), covariates))
    columns = _testable(seen, kinds)
    tested = [item.effect for item in columns.blocks]
    root = columns.root.reshape(len(place), -1, columns.root.shape[2])
    chosen = most_informative(root, root[:, :, : columns.flat], poses, place)[0]
    chosen.sort(key=lambda row: int(place[row]))
    orders = (_in_order(empty, given, visits, offered[chosen], k, rng) for k in range(ORDERS))
    found = ((commands, Columns.of(observe(commands), tested)) for commands in orders)
    return _best(found, kinds, places)


def _best(found: Iterable[tuple[Campaign, Columns]], kinds: Sequence[Effect], repeats: int) -> Plan:
    """Plan of the campaign with the most :attr:`Columns.information`, and what it lacks for the other effects."""
    commands, told, columns = max(((c, own.information, own) for c, own in found), key=lambda each: each[1])
    known, seen = {expected.name: expected for expected in expectations(columns)}, observe(commands)
    without = {kind.name: Expected(kind.name, kind.title, (), lacks=gate.missing(kind, seen)) for kind in kinds}
    return Plan(commands, tuple(known.get(kind.name, without[kind.name]) for kind in kinds), told, repeats)


def _elsewhere(planned: Plan, measures: str, kinds: Sequence[Effect], seed: int) -> Plan:
    """Convert a plan to rows of another kind: of :data:`ORDERS` draws of stands, the most informative.

    Planes, anchors and cameras follow from the poses alone, and are placed once. Raises the last draw's CampaignError
    if the robot reaches none.
    """
    lost, found = CampaignError("plan", "cannot be planned"), []
    for k in range(ORDERS if measures == "socket" else 1):
        try:
            rows = _measured_by(planned.commands, measures, seed + k)
            found.append((rows, _testable(observe(rows), kinds)))
        except CampaignError as error:  # out of reach
            lost = error
    if not found:
        raise lost
    best = _best(found, kinds, planned.repeats)
    return replace(best, artefacts=register(best.commands).artefacts)


def _measured_by(commands: Campaign, measures: str, seed: int) -> Campaign:
    """Simulate rows of another kind by a sound robot; without approaches where a hand leads it."""
    noise = commands.noise_position or NOISE
    rows = simulate(commands.robot, commands=commands, measures=measures, noise=noise, seed=seed)
    # from which side a hand brings each joint is not known
    hidden = [name for name in rows.covariates if measures in names_of.TOUCHED and name.startswith("approach.")]
    given = {name: values for name, values in rows.covariates.items() if name not in hidden}
    return replace(rows, name=commands.name, covariates=given)


def _in_order(
    empty: Campaign, given: dict[str, Array], visits: schedule.Rows, poses: Array, k: int, rng: np.random.Generator
) -> Campaign:
    """Campaign of poses (P, n) in a balanced order, random but for k = 0, with columns of resulting approaches."""
    mixed = poses if k == 0 else poses[rng.permutation(len(poses))]
    q, labels = schedule.in_turn(mixed[schedule.balanced(mixed, visits, rng)], visits)
    sides = arrivals(q, empty.robot.joint_names, given, None)
    return _filled(empty, q, {**given, **sides}, labels)


def _number(value: object) -> bool:
    return isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)


def _check(
    robot: Robot, rows: int, repeats: int, noise: float, turn: float, rise: float, loads: Sequence[float]
) -> None:
    """Raise CampaignError for invalid rows, repeats, noise, rise or loads, or a sliding joint without limits."""

    def refuse(column: str, found: object, expected: str) -> None:
        raise CampaignError("plan", "cannot be planned", column=column, found=repr(found), expected=expected)

    least, most, whole = FEWEST_ROWS, MOST_ROWS, (int, np.integer)
    if not isinstance(rows, whole) or not least <= rows <= most:
        refuse("rows", rows, f"a whole number from {least} to {most}")
    if not isinstance(repeats, whole) or not 1 <= repeats <= rows // 2 or rows % repeats:
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


_HEAD = ("effect", "unit", "expected size", "1 sigma", "worst", "beside all", "told", "confounded with")


def text(plan: Plan) -> str:
    """Plain text of a plan: rows, approaches, and a line for each effect and unit.

    ``1 sigma`` and ``worst`` are the median and the largest over the parameters that are told, else over all, were the
    effect alone at work; ``beside all`` is the median were all of them; ``told`` counts the parameters known to less
    than half their expected size.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> from thermal_robot.planning import plan, text
    >>> print(text(plan(tr.load_robot("builtin:rv_m2", "tool0"), rows=12, effects=["joint_gain"])))
    12 rows: 12 poses. Joints come from below in ...
    ...
    joint_gain ...
    """
    rows = [_HEAD, *(line for expected in plan.effects for line in _lines(expected))]
    lacking = [f"{e.name} {_why(e)}" for e in plan.effects if not e.parameters]
    return "\n".join(
        [_opening(plan), *_places(plan), "", *aligned(rows, left=(0, 1, 7)), *(["", *lacking] if lacking else [])]
    )


def _opening(plan: Plan) -> str:
    commands = plan.commands
    names = commands.robot.joint_names
    if plan.artefacts:
        return f"{commands.samples} rows. What is to be set up, in the robot's root frame:"
    shares = [float((commands.covariates[f"approach.{name}"] > 0.0).mean()) for name in names]
    poses = commands.samples // plan.repeats
    each = f", each {plan.repeats} times" if plan.repeats > 1 else ""
    return (
        f"{commands.samples} rows: {poses} poses{each}. Joints come from below in {100 * min(shares):.0f} to "
        f"{100 * max(shares):.0f} % of rows, if the robot goes direct from row to row."
    )


def _lines(expected: Expected) -> Iterator[tuple[str, ...]]:
    for k, unit in enumerate(dict.fromkeys(parameter.unit for parameter in expected.parameters)):
        own = [parameter for parameter in expected.parameters if parameter.unit == unit]
        told = [parameter for parameter in own if parameter.told]
        sigmas, beside = ([getattr(p, name) for p in told or own] for name in ("sigma", "beside"))
        figures = (np.median([p.size for p in own]), np.median(sigmas), max(sigmas), np.median(beside))
        counted = f"{len(told)} of {len(own)}"
        name, confounded = ("", "") if k else (expected.name, ", ".join(expected.confounded))
        yield name, unit, *(f"{figure:.2g}" for figure in figures), counted, confounded


def _why(expected: Expected) -> str:
    """Reason in words why an effect of a plan has no expected parameters."""
    lacks = expected.lacks
    if not lacks:
        return "has no columns before there are data: it is looked for in what is measured"
    return f"is not planned for: it needs {lacks[0]}{f' and {len(lacks) - 1} more' if len(lacks) > 1 else ''}"


TABLE = ".csv"
_LED = "lead the robot to what the row names, near the posture of plan.csv, and fill in the joints that it reports"
_TO_DO = {
    "socket": f"set the stands up where the plan says, to a hand's breadth; {_LED}",
    "plane": f"use surfaces about where the plan says; {_LED}",
    "pixel": "set the cameras up where the plan says, to a hand's breadth; fill in where images show the target, "
    "and in [camera.NAME] the lenses that they have",
    "distance": "fix the wire's anchors where the plan says, to a hand's breadth; fill in the distances read",
}


def _comments(plan: Plan) -> tuple[str, ...]:
    """Return comments for campaign.toml: how to measure the plan and fill in its files, and where artefacts stand."""
    usual = "go direct from row to row in this order, and fill in measurements.csv: the target's place"
    return (
        f"Planned, not yet measured: {_TO_DO.get(plan.commands.measures, usual)}, and, where measurements.csv has such "
        "a column, time in s and temperature in °C as recorded.",
        "plan.csv stays as it was planned; a column that will not be recorded is taken out of measurements.csv.",
        *_places(plan),
    )


def _places(plan: Plan) -> list[str]:
    return [f"{name}: {artefact.words}" for name, artefact in plan.artefacts.items()]


def write_plan(plan: Plan, path: str | Path) -> Path:
    """Write a plan: a table where the name ends in ``.csv``, else a campaign folder.

    Parameters
    ----------
    plan
        What to write, in the units of its commands. Approaches are left out: they follow from the order of the rows.
    path
        The table, or the folder: campaign.toml, plan.csv, measurements.csv with empty cells for what is measured, and
        the robot.

    Returns
    -------
    Path
        The table or the campaign.toml.

    Raises
    ------
    CampaignError
        What cannot be written; a folder that holds a campaign already.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> from thermal_robot.planning import plan, write_plan
    >>> found = plan(tr.load_robot("builtin:rv_m2", "tool0"), rows=12, effects=["joint_gain"])
    >>> sorted(path.name for path in write_plan(found, "hall_3").parent.iterdir())
    ['campaign.toml', 'measurements.csv', 'plan.csv', 'robot.urdf']
    """
    derived = [name for name in plan.commands.covariates if name.startswith("approach.")]
    if Path(path).suffix.lower() != TABLE:
        return write_planned(plan.commands, path, comments=_comments(plan), derived=derived)
    write_commands(plan.commands, path, derived=derived)
    return Path(path)
