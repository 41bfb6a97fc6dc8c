"""Simulation of a campaign from a robot and its effects."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.campaign import names as columns
from thermal_robot.campaign.checked import checked_mapping
from thermal_robot.campaign.names import did_you_mean, listed, split_name, tilted
from thermal_robot.campaign.plausible import doubts
from thermal_robot.campaign.read import arrived
from thermal_robot.campaign.recognise import TYPING_ERROR
from thermal_robot.effects import Effect, Parameter, RandomEffect, gate, named
from thermal_robot.effects.apply import displacement
from thermal_robot.effects.quantities import unit
from thermal_robot.errors import CampaignError, EffectError
from thermal_robot.inference.grouping import repeated_poses
from thermal_robot.kinematics import exp3, rotation_to_quaternion
from thermal_robot.observations import Frames, Observations, observe
from thermal_robot.robot import ENDS, Robot, joint_range, load_robot
from thermal_robot.schema import LARGEST, MisfitError, boolean, fitted, matrix, number, optional, shown, whole, word
from thermal_robot.simulation import schedule
from thermal_robot.simulation.brought import as_kind, touched

if TYPE_CHECKING:
    from thermal_robot.urdf_text import WritesUrdf


CALL = "simulate()"
"""What messages call the file that there is none of."""


def _commanded(
    robot: Robot, rows: Any, repeats: Any, commands: Any, conditions: Any, rng: np.random.Generator
) -> Campaign:
    """Campaign to simulate: drawn or given commands, conditions and approaches, without measurements."""
    if isinstance(commands, Campaign):
        plan = _of_campaign(robot, rows, repeats, commands)
    else:
        poses, times = _poses(robot, rows, repeats, commands, rng)
        q, labels = schedule.in_turn(poses, schedule.visits(len(poses) * times, times))
        given = schedule.conditions(len(q), schedule.RISE)
        plan = Campaign("simulated", robot, q, covariates=given, labels=labels, base_known=True, tool_known=True)
    return arrived(_under(plan, conditions))


def _of_campaign(robot: Robot, rows: Any, repeats: Any, commands: Campaign) -> Campaign:
    """Copy of a campaign without its measurements; CampaignError if its joints differ, or rows or repeats are given."""
    if rows is not None or repeats != 1:
        expected = "neither rows nor repeats beside a campaign, which has its own"
        raise CampaignError(CALL, "too much is said of the rows", expected=expected)
    if commands.robot.joint_names != robot.joint_names:
        found, expected = listed(commands.robot.joint_names), f"the robot's {listed(robot.joint_names)}"
        raise CampaignError(
            CALL, "the campaign commands other joints", column="commands", found=found, expected=expected
        )
    return replace(
        commands, robot=robot, position=None, orientation=None, targets=None, noise_of_rows=None, warnings=()
    )


def _poses(robot: Robot, rows: Any, repeats: Any, commands: Any, rng: np.random.Generator) -> tuple[Array, int]:
    """Distinct poses (P, n), given or drawn uniformly within the joints' ranges, and the number of repeats of each."""
    times = fitted(whole(1), repeats, CALL, "repeats")
    if commands is not None:
        if rows is not None:
            raise CampaignError(CALL, "too much is said of the rows", expected="either rows or commands")
        return _given(robot, commands), times
    count = fitted(whole(1), schedule.ROWS if rows is None else rows, CALL, "rows")
    if count % times:
        expected = f"a number of rows of which {times} visit each pose"
        raise CampaignError(CALL, "does not divide into poses", column="rows", found=str(count), expected=expected)
    low, high = joint_range(robot)
    for joint, width in zip(robot.joint_names, high - low, strict=True):
        if not np.isfinite(width):
            expected = "a <limit> in the URDF for a joint that slides, or commands of your own"
            raise CampaignError(CALL, "no poses can be drawn", column=joint, found="no limits", expected=expected)
    return rng.uniform(low, high, (count // times, robot.n)), times


def _given(robot: Robot, commands: Any) -> Array:
    """Check joint positions that a user gave, and return them as (P, n); (n,) counts as one row."""
    rows = f"rows of {robot.n} joint positions, or a campaign, which read_samples makes of a table"
    if not isinstance(commands, (list, tuple, np.ndarray)):
        raise CampaignError(CALL, "no positions", column="commands", found=type(commands).__name__, expected=rows)
    if len(commands) == robot.n and not any(isinstance(each, (list, tuple, np.ndarray)) for each in commands):
        commands = [commands]
    plain = [each.tolist() if isinstance(each, np.ndarray) else each for each in commands]
    poses: Array = fitted(matrix((None, robot.n)), plain, CALL, "commands")
    if not len(poses):
        raise CampaignError(CALL, "there is no row", column="commands", expected=rows)
    return poses


def _under(plan: Campaign, conditions: Any) -> Campaign:
    """Campaign with given conditions added to its own or in their place; ``None`` removes a column."""
    given: Mapping[str, Any] = checked_mapping(CALL, "conditions", {} if conditions is None else conditions)
    covariates, labels, extra = dict(plan.covariates), dict(plan.labels), list(plan.extra)
    for name, values in given.items():
        own = _known(name, plan.robot)
        held: dict[str, Any] = labels if name in columns.LABELS else covariates
        held.pop(name, None)
        if values is not None:
            held[name] = _of_rows(name, values, plan.samples)
            extra += [name] if not own and name not in extra else []
    kept = {name: gaps for name, gaps in plan.missing.items() if name not in given}
    # what followed from an order follows anew from another
    followed = tuple(name for name in plan.derived if name not in given)
    if {*columns.CLOCK, "session"} & set(given):
        covariates = {name: values for name, values in covariates.items() if name not in followed}
    left = tuple(name for name in followed if name in covariates)
    named = tuple(name for name in extra if name in covariates)
    return replace(plan, covariates=covariates, labels=labels, extra=named, missing=kept, derived=left, travelled={})


def _of_rows(name: str, values: Any, rows: int) -> NDArray[Any]:
    """Values (N,) of a condition, one value broadcast to all rows; CampaignError for any other number of them."""
    try:
        found = np.asarray(values, dtype=np.str_ if name in columns.LABELS else np.float64)
        return np.broadcast_to(found, rows).copy()
    except (TypeError, ValueError):
        expected = f"one value for all rows, or one for each of {rows}"
        raise CampaignError(CALL, "no condition", column=name, found=shown(values), expected=expected) from None


def _known(name: str, robot: Robot) -> bool:
    """Whether the format defines a condition's column; false for a name of the user's own.

    CampaignError for commands, measurements, unknown joints or links, and names that look like a typing error.
    """
    if name in robot.joint_names or name in (*columns.MEASURED, *columns.SIMULATED):
        what = "is commanded, no condition" if name in robot.joint_names else "is no condition"
        raise CampaignError(CALL, what, column=name, expected="positions in commands; poses are what is simulated")
    places = {
        **dict.fromkeys(columns.PER_JOINT, robot.joint_names),
        **dict.fromkeys(columns.PER_LINK, robot.urdf_links),
    }
    known = columns.conditions(robot.joint_names, robot.urdf_links)
    quantity, place = split_name(name)
    if name in known or name in columns.LABELS:
        return True
    if place and quantity in places:
        what = "the chain has no such joint" if quantity in columns.PER_JOINT else "the robot has no such link"
        near = did_you_mean(place, places[quantity])
        raise CampaignError(
            CALL, f"{what}{near}", column=name, expected=f"{quantity}. and one of {listed(places[quantity])}"
        )
    # a tilt of what is no link is a column of the user's own
    offered = [*(column for column in known if not tilted(column)), *columns.LABELS]
    meant = did_you_mean(name, offered, cutoff=TYPING_ERROR)
    if meant:
        raise CampaignError(CALL, f"there is no such condition{meant}", column=name)
    return False


Values: TypeAlias = "float | Sequence[float] | Array | Mapping[str, float]"
"""One number for all parameters, one for each in their order, or some by name: the others are 0. SI."""
AtWork: TypeAlias = "Mapping[str | Effect, Values] | Mapping[str, Values] | Iterable[tuple[str | Effect, Values]]"
"""Effects with their values: by name, in the setting in which they are first looked for, or as they are."""

_EACH = "values by name of an effect, such as {'joint_gain': {'joint_2': 1e-3}}"


def _pairs(effects: Any) -> list[tuple[Any, Any]]:
    if effects is None:
        return []
    if isinstance(effects, Mapping):
        return list(effects.items())
    if isinstance(effects, (list, tuple)) and all(isinstance(e, (list, tuple)) and len(e) == 2 for e in effects):
        return [(kind, values) for kind, values in effects]
    raise EffectError(f"these are no effects with values: {shown(effects)}; expected {_EACH}")


def _asked(kind: Any, values: Any, seen: Observations) -> tuple[Effect, Array]:
    if not isinstance(kind, (str, Effect)):
        raise EffectError(f"{shown(kind)} is neither the name of an effect nor an effect; expected {_EACH}")
    effect = named(kind) if isinstance(kind, str) else kind
    if isinstance(effect, RandomEffect):
        joints = effect.joints(seen.robot.joint_names)
        sizes = [Parameter(effect.label, unit(seen.robot, j), 1.0, "joint", j, (), positive=True) for j in joints]
        return effect, _values(effect, sizes, values)
    _require_conditions(effect, seen)
    if isinstance(kind, str):
        effect = gate.variants(effect, seen)[0]
    parameters = gate.checked(effect, seen)
    if not parameters:
        settings = ", ".join(f"{argument}=…" for argument in gate.arguments(effect))
        raise EffectError(
            f"effect {effect.name!r} has no parameters here, so that nothing can be simulated; give it with the "
            f"settings that bring some, as {type(effect).__name__}({settings})"
        )
    return effect, _values(effect, parameters, values)


def _require_conditions(effect: Effect, seen: Observations) -> None:
    """Raise EffectError, naming the columns, if the campaign lacks one that the effect needs."""
    # a condition may stand still, as on a robot that has warmed through
    lacks = [column for column in gate.missing(effect, seen) if column not in seen.covariates]
    if not lacks:
        return
    columns = [column for column in lacks if " " not in column and "<" not in column]
    how = f"; give one value, or one a row, as conditions={{{columns[0]!r}: [...]}}" if columns else ""
    raise EffectError(f"effect {effect.name!r} has nothing to follow: it needs {', '.join(lacks)}{how}")


def _values(effect: Effect, places: Sequence[Parameter], given: Any) -> Array:
    """Parameter values (P,) of an effect, SI, from one number for all, a sequence, or a mapping by name; else 0."""
    pairs: Iterable[tuple[int, Any]]
    names = [place.name for place in places]
    if isinstance(given, Mapping):
        pairs = [(_which(effect, places, name), value) for name, value in given.items()]
    elif isinstance(given, (list, tuple, np.ndarray)):
        if len(given) != len(places):
            told = f"effect {effect.name!r} has {len(places)} parameters, {len(given)} values given"
            raise EffectError(f"{told}: {listed(names)}")
        pairs = enumerate(given)
    else:
        units = dict.fromkeys(place.unit for place in places)
        if len(units) > 1:
            told = f"effect {effect.name!r}: one number cannot stand for parameters in {', '.join(units)}"
            raise EffectError(f"{told}; give values by name: {listed(names)}")
        pairs = ((k, given) for k in range(len(places)))
    found = np.zeros(len(places))
    for k, value in pairs:
        found[k] = _number(effect, places[k], value)
    return found


def _which(effect: Effect, places: Sequence[Parameter], name: Any) -> int:
    """Index of the one parameter with this name, else this place, else this label; EffectError for none or several."""
    for candidates in ([p.name for p in places], [p.place for p in places], [p.label for p in places]):
        found = [k for k, candidate in enumerate(candidates) if candidate == name]
        if len(found) == 1:
            return found[0]
        if found:
            meant = listed([places[k].name for k in found])
            raise EffectError(f"effect {effect.name!r}: {name!r} is {len(found)} parameters; name one of {meant}")
    names = [place.name for place in places]
    near = did_you_mean(str(name), dict.fromkeys((*names, *(place.place for place in places))))
    raise EffectError(f"effect {effect.name!r} has no parameter {name!r} here{near}; there are {listed(names)}")


def _number(effect: Effect, place: Parameter, value: Any) -> float:
    """Return a parameter's value as float; EffectError if it is no number, or negative where it must not be."""
    least = 0.0 if place.positive else -LARGEST
    what = f"a number{', not negative,' if place.positive else ''} in {place.unit}"
    kind = number(least=least, expected=what)
    try:
        return float(kind(value, f"effect {effect.name!r}, parameter {place.name!r}"))
    except MisfitError as error:
        raise EffectError(str(error)) from None


_MEASURES = tuple(columns.KINDS)
_TURNED = ("pose", "controller")
_ALIGNED = (1.0, 0.0, 0.0, 0.0)
"""Quaternion wxyz of no turn: it tells effects that orientations will be measured."""


def _instrument(measures: Any, noise: Any, noise_orientation: Any) -> tuple[str, float, float]:
    """Check and return the kind of measurement, and the noise of positions and orientations, one sigma per axis, SI."""
    sigma = number(least=0.0, expected="one sigma per axis, 0 for none", problem="a noise cannot be negative")
    shift, turn = fitted(sigma, noise, CALL, "noise"), fitted(sigma, noise_orientation, CALL, "noise_orientation")
    what = fitted(word(_MEASURES), _MEASURES[0] if measures is None else measures, CALL, "measures")
    if turn > 0.0 and what not in _TURNED:
        expected = 'measures="pose", or no noise of orientations'
        raise CampaignError(CALL, "only positions are measured", column="noise_orientation", expected=expected)
    return str(what), shift, turn


_RIGID = 1e-6
"""Of a rotation: by how much its entries, written with few digits, may be off."""


def _placed(plan: Campaign, base: Any, tool: Any, base_known: Any, tool_known: Any) -> tuple[Campaign, Frames]:
    """Campaign that declares its frames known or not, and the true frames; CampaignError if known ones differ."""
    told = {"base_known": base_known, "tool_known": tool_known}
    known = {key: fitted(optional(boolean), value, CALL, key) for key, value in told.items()}
    ground = Frames.declared(plan).base if base is None else _pose("base", base)
    point, target = _array(tool), None
    sits = point.shape == (3,)
    if sits:
        plan = replace(plan, target=point)
    elif tool is not None:
        target = _pose("tool", tool)
        plan = replace(plan, target=target[:3, 3])
    declared = Frames.declared(plan)
    true = Frames(ground, declared.tool if target is None else target)
    usual = {
        "base_known": plan.base_known if base is None else False,
        "tool_known": plan.tool_known if tool is None else sits,
    }
    sure = {key: usual[key] if value is None else value for key, value in known.items()}
    apart = {"base_known": (true.base, declared.base), "tool_known": (true.tool, declared.tool)}
    for key, pair in apart.items():
        if sure[key] and not np.allclose(*pair, atol=_RIGID, rtol=0.0):
            expected = "a frame where it is declared: its error is an effect of its own"
            raise CampaignError(CALL, "the frame that is given is elsewhere", column=key, expected=expected)
    return replace(plan, base_known=sure["base_known"], tool_known=sure["tool_known"]), true


def _array(given: Any) -> Array:
    """Convert to an array of floats; an empty one if that is not possible."""
    try:
        return np.array(given, dtype=np.float64)
    except (TypeError, ValueError):
        return np.empty(0)


def _pose(key: str, given: Any) -> Array:
    """Check and return a homogeneous transform (4, 4), m; CampaignError for anything else."""
    also, pose = ", or three numbers" if key == "tool" else "", _array(given)
    if pose.shape == (4, 4) and np.isfinite(pose).all():
        turn = pose[:3, :3]
        right = np.allclose(turn @ turn.T, np.eye(3), atol=_RIGID) and np.linalg.det(turn) > 0.0
        if right and np.array_equal(pose[3], [0.0, 0.0, 0.0, 1.0]):
            return pose
    expected = f"a (4, 4) pose: a rotation, a shift in m, and the row 0 0 0 1{also}"
    raise CampaignError(CALL, "no pose", column=key, found=shown(given), expected=expected)


def _measured(
    plan: Campaign,
    frames: Frames,
    effects: Sequence[tuple[Effect, Array]],
    noise: tuple[float, float],
    joints: np.random.Generator,
    readings: np.random.Generator,
) -> Campaign:
    """Simulate the measurement of a robot with effects at work: exact kinematics, scatter of joints, normal noise.

    Each effect has the (P,) values of its parameters; ``noise`` is one sigma per axis, m and rad; ``joints`` and
    ``readings`` are the random generators of the scatter and of the instrument.
    """
    systematic = [(effect, values) for effect, values in effects if not isinstance(effect, RandomEffect)]
    moved, shift = displacement(observe(plan, frames), systematic)
    moved = replace(moved, joint=np.asarray(moved.joint) + _scatter(plan, effects, joints))
    real = observe(plan, frames, displacement=moved)
    position = real.predicted_position + (0.0 if shift is None else shift)
    if not np.isfinite(position).all():
        raise CampaignError(CALL, "these values lead to no finite position", column="effects", expected="smaller ones")
    read, turned = position + noise[0] * readings.normal(size=position.shape), None
    if plan.orientation is not None:
        turn = exp3(noise[1] * readings.normal(size=position.shape))
        turned = rotation_to_quaternion(turn @ (frames.base[:3, :3] @ real.rotation))
    shift_sigma, turn_sigma = (sigma or None for sigma in noise)
    found = replace(plan, position=read, orientation=turned, noise_position=shift_sigma, noise_orientation=turn_sigma)
    return replace(found, warnings=tuple(doubts(found)))


def _scatter(plan: Campaign, effects: Sequence[tuple[Effect, Array]], rng: np.random.Generator) -> Array:
    """Random deviation (N, n) of the joints from their commands, rad or m, by the random effects alone."""
    away, pose, names = np.zeros_like(plan.q), repeated_poses(plan), plan.robot.joint_names
    for effect, sizes in effects:
        if isinstance(effect, RandomEffect):
            for joint, size in zip(effect.joints(names), sizes.tolist(), strict=True):
                j = names.index(joint)
                away[:, j] += effect.drawn(plan.q[:, j], pose, size, rng)
    return away


_POSES, _JOINTS, _INSTRUMENT = range(3)
"""Chance of the poses, of joints that scatter and of the instrument: each is its own, so that none changes another."""


def simulate(
    robot: Robot | str | Path | WritesUrdf,
    effects: AtWork | None = None,
    *,
    tool_frame: str = "",
    rows: int | None = None,
    repeats: int = 1,
    commands: Campaign | ArrayLike | None = None,
    conditions: Mapping[str, Any] | None = None,
    measures: str | None = None,
    noise: float = 0.0,
    noise_orientation: float = 0.0,
    base: ArrayLike | None = None,
    tool: ArrayLike | None = None,
    base_known: bool | None = None,
    tool_known: bool | None = None,
    seed: int = 0,
) -> Campaign:
    """Simulate the measurement of a robot with effects of known size.

    The exact model of the program, not its linear one: joints, links, base and tool are displaced by what the effects
    say, and the kinematics run through all of it, as in :meth:`CorrectedModel.predict
    <thermal_robot.CorrectedModel.predict>`. It shares the effects' formulas with the diagnosis: it tests what a
    campaign can tell, not whether robots are so.

    Parameters
    ----------
    robot
        A robot, or what :func:`~thermal_robot.load_robot` takes, with its ``tool_frame``.
    effects
        Values of the parameters by effect, SI: ``{"backlash": {"joint_3": 3e-4}}``. An effect stands by its name, in
        the setting in which it is first looked for, or as it is, with settings or code of your own; pairs of effect and
        values, such as :attr:`CorrectedModel.effects <thermal_robot.CorrectedModel>`, do as well. Values stand by name
        of the parameter (``"lost motion, joint_3"``), or by its place or its label where that is one parameter alone;
        those not named are 0. One number is given to all parameters, if these have one unit; an array gives all in
        their order. Effects that scatter are drawn.
    tool_frame
        Link whose pose is measured; only where ``robot`` is no robot yet.
    rows
        Number of measurements, 60 by default, at poses drawn evenly within the joints' limits, and within 2.4 rad where
        a joint can turn once round.
    repeats
        How often each pose is measured: once a round, labelled ``pose``.
    commands
        (P, n) joint positions instead of drawn ones, rad or m, or (n,) of one pose; or a campaign, such as that of a
        plan or one that was measured, whose commands, conditions and declarations are taken over.
    conditions
        Columns beside the commands, SI: one value for all rows or (N,); ``None`` leaves a column out. Without a
        campaign a row a minute is measured while the robot warms by 6 K from 20 °C and cools again (``time``,
        ``temperature``). Directions of approach follow from the order of the rows where none are given.
    measures
        ``"position"``, or ``"pose"`` for orientations, too; by default what the campaign in ``commands`` has, or
        positions. ``"distance"`` to four points about the robot, whose places and common zero nobody knows;
        ``"pixel"``, its image in two cameras in the room by turns, at unknown places;
        ``"controller"``, the pose that the controller has of it. ``"socket"``, two on each of three stands, and
        ``"plane"``, three at right angles that are touched: the postures are led there from those drawn, by the robot
        that is simulated.
    noise, noise_orientation
        One sigma per axis of the instrument, m and rad, normal; the campaign states it.
    base
        (4, 4) pose of the root frame in the measurement frame, m; the identity by default. The campaign does not know
        one that is given.
    tool
        (3,) the measured point in the tool frame, m, which the campaign knows; or (4, 4) the target's pose in it, of
        which it knows a start value. The origin by default.
    base_known, tool_known
        Whether the campaign declares these frames as known, if not as said above.
    seed
        Random seed: the same seed gives the same campaign, and the same poses whatever the effects.

    Returns
    -------
    Campaign
        As :func:`~thermal_robot.read_campaign` returns one.

    Raises
    ------
    EffectError
        A name that no effect, or no parameter of it, has; a value that is no number, or negative where none can be; an
        effect that needs a condition that is not there.
    CampaignError
        Rows, conditions or frames that no campaign has.
    RobotError
        A robot that cannot be loaded.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> robot = tr.load_robot("builtin:rv_m2", "tool0")
    >>> worn = tr.simulate(robot, {"backlash": {"joint_3": 3e-4}}, rows=40, noise=20e-6, seed=1)
    >>> worn
    <Campaign 'simulated': 40 samples of position, 5 joints, 7 covariates>
    >>> sound = tr.simulate(robot, rows=40, noise=20e-6, seed=1)
    >>> bool(abs(worn.position - sound.position).max() > 5e-5)
    True
    """
    robot = _loaded(robot, tool_frame)
    seed = fitted(whole(0), seed, CALL, "seed")
    poses, joints, readings = (np.random.default_rng([seed, part]) for part in (_POSES, _JOINTS, _INSTRUMENT))
    given = commands.measures if measures is None and isinstance(commands, Campaign) else measures
    what, *noises = _instrument(given, noise, noise_orientation)
    plan = _commanded(robot, rows, repeats, commands, conditions, poses)
    plan = replace(plan, orientation=np.tile(_ALIGNED, (plan.samples, 1)) if what in _TURNED else None)
    plan, frames = _placed(plan, base, tool, base_known, tool_known)
    seen = observe(plan, frames)
    at_work = [_asked(kind, values, seen) for kind, values in _pairs(effects)]
    if what in columns.TOUCHED:
        systematic = [(effect, values) for effect, values in at_work if not isinstance(effect, RandomEffect)]
        return touched(what, plan, frames, systematic, noises[0], readings)
    return as_kind(what, _measured(plan, frames, at_work, (noises[0], noises[1]), joints, readings))


def _loaded(robot: Any, tool_frame: str) -> Robot:
    if isinstance(robot, Campaign):
        expected = "its robot, and the campaign in commands: simulate(campaign.robot, ..., commands=campaign)"
        raise CampaignError(CALL, "a campaign is no robot", column="robot", expected=expected)
    if not isinstance(robot, Robot):
        return load_robot(robot, tool_frame)
    if tool_frame in ("", robot.tool_frame):
        return robot
    expected = f"{robot.tool_frame!r}, where its chain ends; load_robot makes another"
    raise CampaignError(CALL, "this robot has a tool frame", column=ENDS[0], found=repr(tool_frame), expected=expected)
