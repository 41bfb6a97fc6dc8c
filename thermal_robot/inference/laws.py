"""Candidate laws for an unlisted cause: the places, quantities and shapes that are tried."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.campaign.names import CLOCK
from thermal_robot.campaign.turning import SLIPS
from thermal_robot.effects.law import Discovered
from thermal_robot.effects.quantities import TURN, began, quantities, unit
from thermal_robot.inference import settings
from thermal_robot.observations import Observations

__all__ = [
    "CLOCK",
    "harmonics",
    "hystereses",
    "law_of",
    "laws",
    "of_quantity",
    "relaxing",
    "shapes",
    "smooth_columns",
    "straight",
]


def laws(observations: Observations, kinds: Sequence[str], names: Iterable[str] | None = None) -> list[Discovered]:
    """Smooth laws of each quantity at each place of the given kinds, and at a segment constant ones, too."""
    turns = observations.campaign.measures == "pose"
    robot = observations.robot
    places = {
        "joint": robot.joint_names,
        "base": ("base",),
        "tool": ("tool",),
        # before the first joint a segment is the base, behind the last one the tool
        "link": tuple(s.name for s in robot.segments[1:] if s.movable),
    }
    known = quantities(observations)
    # knots and levels are the same wherever it enters
    follow = {
        n: law_of(observations, Discovered(turns=turns), n, known[n]) for n in (known if names is None else names)
    }
    found = []
    for kind in kinds:
        for place in places[kind]:
            plain = Discovered(kind=kind, place=place, turns=turns)
            if kind == "link":
                found.append(replace(plain, shape="constant", quantity="none"))
            for name, followed in follow.items():
                law = replace(followed, kind=kind, place=place)
                found.append(law)
                if kind == "joint" and name == place and law.shape == "smooth":
                    # five knots do not follow a wheel that turns more than once
                    found += [replace(law, shape="harmonic", marks=(k,)) for k in harmonics(observations, place)]
    return found


def law_of(observations: Observations, plain: Discovered, name: str, values: Array) -> Discovered:
    """Return a law as a smooth one of a quantity (N,), or one of its levels."""
    own = None if name in observations.covariates else observations.campaign.labels.get(name)
    labels = () if own is None else tuple(np.unique(own).tolist())
    law = replace(plain, quantity=name, unit=unit(observations.robot, name), labels=labels)
    return of_quantity(law, values)


def straight(law: Discovered) -> Discovered:
    """Return a law as a straight line; one of labels as it is, since nothing lies between these."""
    return law if law.labels else replace(law, shape="ramp", marks=())


def harmonics(observations: Observations, joint: str) -> tuple[float, ...]:
    """Return the harmonics tried in a joint: the first three, and the motor's where its ratio is stated."""
    ratio = observations.campaign.gears.get(joint)
    return settings.HARMONICS if ratio is None else (*settings.HARMONICS, float(ratio), 2.0 * float(ratio))


def of_quantity(law: Discovered, values: Array, knots: int = settings.KNOTS) -> Discovered:
    """Return the law with knots at the quantity's quantiles, or with its levels where it has few values."""
    levels = np.unique(values)
    low, high = float(values.min()), float(values.max())
    if len(levels) <= settings.FEW_LEVELS:
        return replace(law, shape="levels", marks=tuple(levels.tolist()), origin=low, span=high - low)
    marks = np.quantile(values, np.linspace(settings.OUTER_KNOTS, 1.0 - settings.OUTER_KNOTS, knots))
    if np.diff(marks).min() < settings.NARROW_KNOTS * (high - low) / knots:
        # most values lie in one spot: a spline between knots there would be free to do anything
        marks = np.linspace(low, high, knots)
    return replace(law, shape="smooth", marks=tuple(marks.tolist()), origin=low, span=high - low)


def shapes(
    law: Discovered, values: Array, jumps: bool = True, orders: Sequence[float] = settings.HARMONICS
) -> list[Discovered]:
    """Return a law in its own shape, as a smooth one, and in all simpler shapes that may suffice, each once.

    Always: straight, quadratic, and hinges at quantiles of the quantity. With ``jumps`` also steps and bumps: of
    positions, gravity and the clock, as nothing jumps at a temperature. Of a velocity also its sign. Of a joint's own
    position also harmonics of the given orders. Of labels also one that is apart from the others. Of two quantities
    their product alone. Of what a joint remembers elements that slip.
    """
    if law.shape == "constant":
        return [law]
    law = replace(of_quantity(law, values), runs=(), starts=()) if law.starts else law
    if law.by:
        largest = float(np.abs(values).max())
        product = [replace(law, shape="product", span=largest)] if largest > 0.0 else []
        return list(dict.fromkeys([law, *product]))
    smooth = of_quantity(law, values)
    found = [law, smooth] if law.labels or len(smooth.marks) < 3 else [law, smooth, straight(law)]
    if law.labels and len(levels := np.unique(values)) > 2:
        found += [replace(law, shape="apart", marks=(float(m),)) for m in levels]
    if smooth.shape == "levels":
        return list(dict.fromkeys(found))
    found.append(replace(law, shape="quadratic", marks=()))
    middle = np.quantile(values, np.linspace(settings.INNER_MARKS, 1.0 - settings.INNER_MARKS, settings.MARKS))
    if law.quantity.startswith(TURN):
        return list(dict.fromkeys([*found, *hystereses(law, values)]))
    if jumps:
        found += _jumps(law, middle)
    found += [replace(law, shape="hinge", marks=(float(m), side)) for m in middle[2:-2:2] for side in (1.0, -1.0)]
    if law.quantity.startswith("velocity."):
        found.append(replace(law, shape="drag", marks=()))
    if law.quantity == law.place and law.kind == "joint" and not law.of:
        found += [replace(law, shape="harmonic", marks=(k,)) for k in orders]
    return list(dict.fromkeys(found))


def _jumps(law: Discovered, middle: Array) -> list[Discovered]:
    found = [replace(law, shape="step", marks=(float(m),)) for m in middle]
    found += [replace(law, shape="slide", marks=(float(m), settings.SLIDE_WIDTH * law.span)) for m in middle[::2]]
    widths = [w * law.span for w in settings.BUMP_WIDTHS]
    return found + [replace(law, shape="bump", marks=(float(m), w)) for m in middle[1:-1:2] for w in widths]


def hystereses(law: Discovered, values: Array) -> list[Discovered]:
    """Return a law of a joint's memory as elements that slip: over the whole range, coarsely first, or some neighbours.

    Which show, ``values`` (N,) tell, rad or m from the last turning point; one between two is nearly their sum.
    """
    least, most = (share * float(np.abs(values).max()) for share in settings.SLIP_SHARES)
    slips = tuple(r for r in SLIPS if least <= r <= most)
    whole = [slips[::step] for step in settings.SLIP_STEPS]
    few = [slips[k : k + n] for n in settings.SLIPS_TOGETHER for k in range(len(slips) - n + 1)]
    return [replace(law, shape="hysteresis", marks=marks) for marks in dict.fromkeys([*whole, *few]) if marks]


def relaxing(observations: Observations, law: Discovered) -> list[Discovered]:
    """Return a law of the clock as one that relaxes after each start: of one size, and of one each.

    A session begins with its first row; where there are none, the campaign does.
    """
    clock = law.values(observations)
    if clock is None or not np.ptp(clock) > 0.0:
        return []
    span, starts = float(np.ptp(clock)), began(observations, clock)
    law = replace(law, labels=(), runs=(), origin=float(clock.min()), span=span, starts=tuple(starts.values()))
    if len(starts) < 2:
        found = [replace(law, shape="relaxing")]
    else:
        found = [replace(law, shape=shape, runs=tuple(starts)) for shape in ("relaxing", "relaxing each")]
    return [replace(one, marks=(share * span,)) for one in found for share in settings.RELAXED_WITHIN]


def smooth_columns(values: Array) -> Array:
    """Return an (N, k) basis of the smooth laws of a quantity: centred, uncorrelated, of mean square one.

    It spans the laws of :func:`of_quantity` without their constant: levels of a quantity with few values, a natural
    cubic spline otherwise. It is empty (N, 0) where the quantity does not vary.
    """
    if np.ptp(values) == 0.0:
        return np.zeros((len(values), 0))
    functions, _ = of_quantity(Discovered(), values).functions(values)
    u, s, _ = np.linalg.svd(functions - functions.mean(axis=0), full_matrices=False)
    kept: Array = u[:, s > settings.SPLINE_FLOOR * s[0]] * np.sqrt(len(values))
    return kept
