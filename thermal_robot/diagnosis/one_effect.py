"""What one effect explains, place by place: the residual with the effect and without it.

These are the data of component-plus-residual plots (Ezekiel 1924; Larsen and McCleary, *American Sociological Review*
37, 1972). In each row, r is the residual of the whole fit (m, rad), c the contribution of the effect at this place, and
D the displacement of the target for a unit error there, in units of the noise:

    before = D'(r + c) / D'D        after = D'r / D'D        spread = 1 / √(D'D)

A constant error that the unknown frames take up as well is a matter of convention, and may be a hundred times what the
error changes by: it is left out, so that the change can be seen.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.diagnosis import settings
from thermal_robot.diagnosis.attribution import locate
from thermal_robot.diagnosis.explained import Explained, Place
from thermal_robot.effects import Effect, Parameter
from thermal_robot.effects.apply import by_place, sensitivity
from thermal_robot.effects.effect import Channel, Driver
from thermal_robot.effects.gate import driver
from thermal_robot.effects.quantities import quantities, unit
from thermal_robot.errors import EffectError
from thermal_robot.inference.algebra import orthonormal, rms, without
from thermal_robot.inference.columns import block
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.settings import FEW_LEVELS, TINY
from thermal_robot.observations import Observations


def explained(fit: Fit, effect: str) -> Explained:
    """Tell what one effect of the fit explains at each place, outliers left out; :class:`EffectError` if not in it."""
    held = {e.name: (e, values) for e, values in fit.effects}
    if effect not in held:
        listed = ", ".join(held) or "no effect"
        raise EffectError(f"{effect!r} is not part of the explanation, which holds {listed}")
    setting, values = held[effect]
    parameters = block(fit.corrected, setting).parameters
    found = [p for p in locate(fit, {effect: 1.0})[1][effect] if p.share > 0.0]
    shown = [p for p in found if p.share >= settings.MATERIAL_PLACE][: settings.MOST_PLACES]
    rows, robot = ~fit.explanation.outliers, fit.campaign.robot
    places = []
    for location in shown:
        each = ((part, float(v)) for p, v in zip(parameters, values, strict=True) for part in by_place(robot, p))
        mine = [(part, v) for part, v in each if (part.kind, part.place) == (location.kind, location.name)]
        places.append(_shown(fit, setting, mine, location.share, rows))
    return Explained(effect, tuple(places), len(found) - len(shown))


def _shown(
    fit: Fit, effect: Effect, parameters: list[tuple[Parameter, float]], share: float, rows: NDArray[np.bool_]
) -> Place:
    observations, e = fit.corrected, fit.explanation
    first = parameters[0][0]
    error, moves, unit = _error(observations, parameters)
    noise = np.broadcast_to(e.whitening.sigma() * e.best.noise, observations.gap.shape)
    direction, remainder = moves / noise, observations.gap / noise
    length2 = np.einsum("nm,nm->n", direction, direction)
    rows = rows & (length2 > 1e-12 * length2.max(initial=0.0))
    after = np.einsum("nm,nm->n", direction, remainder)[rows] / length2[rows]
    name, name_unit, values = _driver(observations, effect, parameters, error)
    values, error = values[rows], error[rows]
    constant = _undetermined(e.linear.frames[rows] / noise[rows, :, None], direction[rows], error)
    error = error - constant
    return Place(
        first.kind,
        first.place,
        share,
        name,
        name_unit,
        values,
        len(np.unique(values)) <= FEW_LEVELS,
        unit,
        error + after,
        after,
        1.0 / np.sqrt(length2[rows]),
        _line(values, error),
        constant != 0.0,
    )


def _undetermined(frames: Array, direction: Array, error: Array) -> float:
    """Return the constant of (n,) errors that nobody knows, and that hides how they change; 0 where there is none.

    It is known to 1 / |D⊥|, with D⊥ the (n, m) displacement for a unit error beyond the span of (n, m, F) frames, both
    in units of the noise. One that is known worse than the errors differ from each other is left out where all errors
    lie on one side of zero.
    """
    change = float(np.ptp(error))
    if not frames.shape[2] or change == 0.0 or error.min() <= 0.0 <= error.max():
        return 0.0
    beyond = without(direction.ravel(), orthonormal(frames.reshape(direction.size, -1)))
    return float(error.mean()) if float(np.linalg.norm(beyond)) * change < 1.0 else 0.0


def _error(observations: Observations, parameters: list[tuple[Parameter, float]]) -> tuple[Array, Array, str]:
    """(N,) error at a place along its first singular vector, (N, m) displacement of the target per unit, and unit."""
    measures = observations.gap.shape[1]
    samples = len(observations.q)
    parts: dict[tuple[Channel, int], Array] = {}
    for parameter, value in parameters:
        for response in parameter.responses:
            moved = value * np.asarray(response.values)
            if response.channel == "joint":
                moved = np.broadcast_to(moved, samples)[:, None]
            moved = np.broadcast_to(moved, (samples, moved.shape[-1]))
            key = (response.channel, response.index)
            parts[key] = parts.get(key, np.zeros(moved.shape)) + moved
    maps = [sensitivity(observations, channel, index)[:, :measures] for channel, index in parts]
    twists = np.concatenate(list(parts.values()), axis=1)
    moves = np.concatenate(maps, axis=2)
    channels = {channel for channel, _ in parts}
    if channels == {"instrument"}:
        # it points elsewhere in every row; the sign is that of its parameter
        length = (-1.0 if parameters[0][1] < 0.0 else 1.0) * np.linalg.norm(twists, axis=1)
        return length, np.einsum("nmk,nk->nm", moves, twists / np.where(length == 0.0, 1.0, length)[:, None]), "m"
    main = np.linalg.svd(twists, full_matrices=False)[2][0]
    main = main * np.sign(main[int(np.abs(main).argmax())])
    if channels == {"joint"} and len(parts) == 1:
        robot, index = observations.robot, next(index for _, index in parts)
        return twists[:, 0], moves[:, :, 0], unit(robot, robot.joint_names[index])
    direction = moves @ main
    if len(parts) == 1:
        shift, turn = np.linalg.norm(main[:3]), np.linalg.norm(main[3:])
        if min(shift, turn) < settings.PURE:
            return twists @ main, direction, "m" if shift > turn else "rad"
    size = rms(direction[:, :3])
    return twists @ main * size, direction / max(size, 1e-300), "m at the tool"


def _driver(
    observations: Observations, effect: Effect, parameters: list[tuple[Parameter, float]], error: Array
) -> Driver:
    """Return the quantity that drives an effect at a place, or else the one that its error follows best."""
    if known_driver := driver(effect, observations, [parameter for parameter, _ in parameters], error):
        return known_driver
    known = quantities(observations)
    name = max(known, key=lambda n: -_unsteady(known[n], error))
    return name, unit(observations.robot, name), known[name]


def _unsteady(values: Array, error: Array) -> float:
    """Mean variance of the error among rows with neighbouring values of a quantity."""
    parts = np.array_split(error[np.argsort(values, kind="stable")], max(len(error) // settings.ROWS_ALIKE, 2))
    return float(np.mean([part.var() for part in parts if len(part)]))


def _line(values: Array, error: Array) -> Array:
    """(2, k) the fitted law over its quantity; means of neighbouring rows where it depends on others, too."""
    levels = np.unique(values)
    if len(levels) <= FEW_LEVELS:
        return np.array([levels, [error[values == level].mean() for level in levels]])
    order = np.argsort(values, kind="stable")
    x, y = values[order], error[order]
    # a law of this quantity alone lies between its neighbours
    between = np.interp(x[1:-1:2], x[::2], y[::2])[: len(x[1:-1:2])]
    alone = float(np.abs(between - y[1:-1:2]).mean()) < settings.ROUGH * float(np.ptp(y)) + TINY
    parts = np.array_split(
        order,
        min(len(order), settings.DENSE_POINTS)
        if alone
        else min(settings.LINE_POINTS, max(len(order) // settings.ROWS_A_POINT, 2)),
    )
    return np.array([[values[p].mean() for p in parts], [error[p].mean() for p in parts]])
