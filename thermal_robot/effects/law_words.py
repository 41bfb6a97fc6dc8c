"""Laws in words and in size: short name, usual cause, and range.

Usual causes are the experience of calibration: Mooring, Roth and Driels, *Fundamentals of Manipulator Calibration*,
1991, chapter 2 (geometry, gears, joints that yield), and ISO 230-1 and 230-3 (play, warming). They are never more than
a hint, and are reported as one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from typing import TYPE_CHECKING

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.campaign.names import CLOCK
from thermal_robot.effects.law import Discovered
from thermal_robot.effects.quantities import GRAVITY, REACH, TURN
from thermal_robot.effects.shapes import SHAPES

if TYPE_CHECKING:
    from thermal_robot.effects.effect import Parameter
    from thermal_robot.observations import Observations


@dataclass(frozen=True)
class Size:
    """Range of a law, or of an effect in one joint, over the measured rows, with its standard deviation; SI.

    ``what`` names the figure (``step``, ``range``, ``peak to peak``, …); ``place`` is the joint, where the effect acts
    in several.
    """

    what: str
    value: float
    std: float
    unit: str
    place: str = ""


def sizes(law: Discovered, observations: Observations, values: Array, covariance: Array) -> tuple[Size, ...]:
    """Largest difference of a law between two measured rows, with its standard deviation.

    Values (K·C,) and covariance are as fitted, functions first, SI. One size for a joint, and for an effect that
    changes; at a link, the base or the tool one of the translation, m, and one of the rotation, rad, each the length of
    a vector. Empty where the campaign cannot tell the law's values.
    """
    rows, parameters = law.at_rows(observations), law.parameters(observations)
    if rows is None or not parameters:
        return ()
    functions = rows[0]
    components = len(parameters) // functions.shape[1]
    by_function = np.asarray(values, dtype=float).reshape(-1, components)
    units = [parameter.unit for parameter in parameters[:components]]
    # all of one unit make up a vector, unless each stands for itself
    together = [[c for c, own in enumerate(units) if own == unit] for unit in dict.fromkeys(units)]
    found = []
    for own in [[c] for c in range(components)] if law.modulated is not None else together:
        moved = functions @ by_function[:, own]
        first = int(np.linalg.norm(moved - moved.mean(axis=0), axis=1).argmax())
        last = int(np.linalg.norm(moved - moved[first], axis=1).argmax())
        change, direction = moved[last] - moved[first], np.zeros(components)
        length = float(np.linalg.norm(change))
        direction[own] = change / length if length > 0.0 else 0.0
        weight = np.kron(functions[last] - functions[first], direction)
        std = sqrt(max(float(weight @ covariance @ weight), 0.0))
        found.append(Size(SHAPES[law.shape].size, length, std, units[own[0]]))
    if law.modulated is not None:  # of an effect with several parameters the one that is plainest
        found = sorted(found, key=lambda size: -size.value / max(size.std, 1e-300))[:1]
    return tuple(found)


def in_joints(parameters: Sequence[Parameter], values: Array, covariance: Array) -> tuple[Size, ...]:
    """Peak-to-peak value of an effect in each joint, over the measured rows.

    Waves of a joint with a limited range, and shapes of a load, are correlated; their sum is better determined. Values
    (K,) and covariance are SI; largest first, none of a place that does not err in its joint alone, or not at all.
    """
    found = []
    for place in dict.fromkeys(parameter.place for parameter in parameters):
        own = [k for k, parameter in enumerate(parameters) if parameter.place == place]
        responses = [parameters[k].responses for k in own]
        if any([response.channel for response in all_of] != ["joint"] for all_of in responses):
            continue
        rows = np.column_stack(np.broadcast_arrays(*(response.values for (response,) in responses)))
        moved = rows @ np.asarray(values, dtype=float)[own]
        if not np.ptp(moved):
            continue
        weight = rows[int(moved.argmax())] - rows[int(moved.argmin())]
        std = sqrt(max(float(weight @ covariance[np.ix_(own, own)] @ weight), 0.0))
        found.append(Size("peak to peak", float(np.ptp(moved)), std, parameters[own[0]].unit, place))
    return tuple(sorted(found, key=lambda size: -size.value))


_LOAD = "something that yields to load"

USUALLY: dict[tuple[str, str], str] = {
    ("joint", "own position"): "gears or an encoder",
    ("joint", "memory"): "play or friction in the gears",
    ("joint", "position"): "load that another joint shifts, or a cable that pulls",
    ("joint", "session"): "a joint that was referenced anew",
    ("joint", "temperature"): "a gear or a brake that warms",
    ("joint", "motion"): "a servo that trails its command",
    ("joint", "approach"): "play in the gears",
    ("joint", "nothing"): "a zero that is off",
    ("link", "session"): "a part that was mounted anew",
    ("link", "temperature"): "a link that grows or bows with heat",
    ("link", "nothing"): "a link that is bent, or made otherwise",
    ("base", "position"): "a base that yields to the arm's load",
    ("base", "session"): "a base or an instrument that was set up anew",
    ("base", "temperature"): "a floor, a stand or an instrument that warms",
    ("base", "motion"): "a base that swings",
    ("tool", "position"): "a tool or a target that bends under its own weight",
    ("tool", "session"): "a tool or a target that was mounted anew",
    ("tool", "temperature"): "a tool that grows with heat",
    ("", "time"): "warming, or something that slips",
    ("", "session"): "something that was mounted anew",
    ("", "temperature"): "something that warms",
    ("", "position"): _LOAD,
    ("", "load"): _LOAD,
    ("", "motion"): "something that swings or trails",
}
"""What errs there, by kind of place and kind of quantity; the empty place stands for those that are not listed."""

TELLS: dict[str, tuple[str, ...]] = {
    "time": ("temperature",),
    "session": ("temperature",),
    "temperature": ("temperature",),
    "position": ("torque", "payload"),
    "load": ("torque", "payload"),
    "own position": (),
    "motion": ("velocity", "acceleration"),
    "approach": ("approach",),
    "memory": ("approach",),
    "nothing": ("approach", "temperature"),
}
"""By kind of quantity that an error follows, the columns that would tell what it is, the most telling first."""

WHETHER = {
    "temperature": "warmth",
    "torque": "load",
    "payload": "load",
    "approach": "lost motion",
    "velocity": "motion",
    "acceleration": "motion",
}
"""By column, the cause that it would show or rule out."""

_KINDS = {
    **dict.fromkeys((*GRAVITY, *REACH), "position"),
    **dict.fromkeys(CLOCK, "time"),
    **dict.fromkeys(("torque", "payload", "tilt"), "load"),
    **dict.fromkeys(("velocity", "acceleration", "speed"), "motion"),
    **{name: name for name in ("session", "temperature", "approach")},
    "none": "nothing",
}


def kind_of(quantity: str, place: str, joints: Sequence[str]) -> str:
    """Class of a quantity as seen from a place, a key of :data:`TELLS`; empty for a user's own quantity."""
    column, _, of = quantity.partition(".")
    if quantity.startswith(TURN):
        return "memory"
    if quantity in joints or (column == "encoder" and of in joints):
        return "own position" if place in (quantity, of) else "position"
    return _KINDS.get(quantity) or ("" if column in CLOCK else _KINDS.get(column, ""))


def usually(law: Discovered, joints: Sequence[str]) -> str:
    """Usual cause of a law, in words, by kind of its place and of its quantity; empty where none is known."""
    names = ["session"] if is_event(law) else [law.quantity, law.by]  # what was set up anew, once or for a session
    kinds = [kind_of(name, law.place, joints) for name in names if name]
    found = (USUALLY.get((law.kind, kind)) or USUALLY.get(("", kind), "") for kind in kinds)
    return next((words for words in found if words), "")


def called(law: Discovered) -> str:
    """Short name of a law, in words: shape, place and quantity."""
    at = {"joint": law.place, "link": f"{law.place}'s placement"}.get(law.kind, f"the {law.kind}")
    own = law.kind == "joint" and law.quantity == law.place
    over = f"over {f'{law.quantity} times {law.by}' if law.by else 'its position' if own else law.quantity}"
    if law.modulated is not None:
        return f"{law.modulated.singular} in {at} {over}"
    if law.shape == "apart" and law.labels:
        return f"{at} standing elsewhere in {law.quantity} {law.labels[int(law.marks[0])]}"
    if law.shape == "constant":
        over = ""
    elif law.runs and law.shape == "step":
        over = "between sessions"
    elif law.quantity.startswith(TURN):
        over = "since it turned"
    return f"{SHAPES[law.shape].noun} at {at} {over}".rstrip()


def is_event(law: object) -> bool:
    """Whether a law is an event: base, tool or a joint's zero displaced from a row on, for a while, or by session."""
    if not isinstance(law, Discovered) or law.by or law.of or law.kind == "link":
        return False
    in_time = law.quantity in CLOCK and law.shape in ("step", "run")
    return in_time or (law.quantity == "session" and law.shape in ("apart", "levels"))


def event(law: Discovered, observations: Observations, sizes: Sequence[Size]) -> tuple[str, str]:
    """Describe an event by its rows: in a few words, and in a sentence without a full stop.

    Both are empty for other laws, for levels of several sessions, and where the rows are not consecutive in the file.
    """
    rows = law.at_rows(observations) if is_event(law) and law.shape != "levels" else None
    there = np.zeros(0, dtype=bool) if rows is None else rows[0][:, 1] > 0.0
    if law.shape == "step" and 2 * there.sum() > len(there):
        there = ~there  # what was seldom is told
    own = np.flatnonzero(there)
    if rows is None or not len(own) or np.ptp(own) >= len(own):
        return "", ""
    numbers = observations.campaign.rows[own]
    when, brief = f"in rows {numbers[0]} to {numbers[-1]}", f"in rows {numbers[0]}–{numbers[-1]}"
    if law.shape == "step" and there[-1]:
        when = brief = f"from row {numbers[0]} on"
    if law.labels:
        full = f"in session {law.labels[int(law.marks[0])]} ({when.removeprefix('in ')})"
    else:
        clock = np.asarray(law.values(observations))[own]
        until = "" if brief == when else f" to {clock[-1]:.4g}"
        full = f"{when} ({law.quantity} {clock[0]:.4g}{until}{' ' * bool(law.unit)}{law.unit})"
    far = " and ".join(_amount(s.value, s.unit) for s in sizes if s.value > 2.0 * s.std) or "a little"
    first = far.split(" and ")[0]
    if law.kind == "joint":
        return f"{law.place} {first} off {brief}", f"{full} {law.place} counts from a zero {far} off"
    if law.kind == "base":
        return f"the base {first} off {brief}", f"{full} the base or the instrument stands {far} elsewhere"
    return f"the target {first} off {brief}", f"{full} the target sits {far} elsewhere on the tool"


def _amount(value: float, unit: str) -> str:
    """Write a length or an angle in thousandths of its unit, or millionths where it is small."""
    factor, prefix = (1e3, "m") if value >= 1e-4 else (1e6, "µ")
    return f"{factor * value:.2g} {prefix}{unit}" if value < 0.1 else f"{value:.2g} {unit}"
