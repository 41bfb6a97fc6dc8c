"""How large a fitted law or curve is: the height of its step, the range it runs through, with what is known of it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import sqrt
from typing import TYPE_CHECKING

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.effects.shapes import SHAPES

if TYPE_CHECKING:
    from thermal_robot.effects.effect import Parameter
    from thermal_robot.effects.law import Discovered
    from thermal_robot.observations import Observations


@dataclass(frozen=True)
class Size:
    """How much a law, or an effect in one joint, changes over the rows that were measured, with one sigma, in SI.

    ``what`` it is the size of is ``step`` or ``range``; ``place`` is the joint, where the effect acts in several.
    """

    what: str
    value: float
    std: float
    unit: str
    place: str = ""


def sizes(law: Discovered, observations: Observations, values: Array, covariance: Array) -> tuple[Size, ...]:
    """How much a law changes between the two rows between which it changes most.

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
    what = SHAPES[law.shape].size
    found = []
    for unit, own in _together(units, single=law.modulated is not None):
        moved = functions @ by_function[:, own]
        first = int(np.linalg.norm(moved - moved.mean(axis=0), axis=1).argmax())
        last = int(np.linalg.norm(moved - moved[first], axis=1).argmax())
        change = moved[last] - moved[first]
        length = float(np.linalg.norm(change))
        direction = np.zeros(components)
        direction[own] = change / length if length > 0.0 else 0.0
        weight = np.kron(functions[last] - functions[first], direction)
        found.append(Size(what, length, sqrt(max(float(weight @ covariance @ weight), 0.0)), unit))
    if law.modulated is not None:  # of an effect with several parameters the one that is plainest
        found = sorted(found, key=lambda size: -size.value / max(size.std, 1e-300))[:1]
    return tuple(found)


def in_joints(what: str, parameters: Sequence[Parameter], values: Array, covariance: Array) -> tuple[Size, ...]:
    """How much an effect of joints changes in each of them between the two rows between which it changes most.

    Single waves of a joint that moves over part of a turn do the same in part; what they do together is better known.
    Values (K,) and covariance are SI; largest first, none of a place that does not err in its joint alone.
    """
    found = []
    for place in dict.fromkeys(parameter.place for parameter in parameters):
        own = [k for k, parameter in enumerate(parameters) if parameter.place == place]
        responses = [parameters[k].responses for k in own]
        if any([response.channel for response in all_of] != ["joint"] for all_of in responses):
            continue
        rows = np.column_stack(np.broadcast_arrays(*(response.values for (response,) in responses)))
        moved = rows @ np.asarray(values, dtype=float)[own]
        weight = rows[int(moved.argmax())] - rows[int(moved.argmin())]
        variance = float(weight @ covariance[np.ix_(own, own)] @ weight)
        found.append(Size(what, float(np.ptp(moved)), sqrt(max(variance, 0.0)), parameters[own[0]].unit, place))
    return tuple(sorted(found, key=lambda size: -size.value))


def _together(units: list[str], single: bool) -> Iterator[tuple[str, list[int]]]:
    """Yield units with the components that make up one vector: all of one unit, unless each stands for itself."""
    if single:
        yield from ((unit, [c]) for c, unit in enumerate(units))
    else:
        yield from ((unit, [c for c, u in enumerate(units) if u == unit]) for unit in dict.fromkeys(units))
