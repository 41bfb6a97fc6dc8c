"""Component-plus-residual data of one effect, place by place: the residual with the effect and without it.

Ezekiel 1924; Larsen and McCleary, *American Sociological Review* 37, 1972. In each row, r is the residual of the whole
fit (m, rad), c the contribution of the effect at this place, and D the displacement of the target for a unit error
there, in units of the noise:

    before = D'(r + c) / D'D        after = D'r / D'D        spread = 1 / √(D'D)

A constant error that the unknown frames take up as well is a matter of convention, and may be a hundred times what the
error changes by: it is left out, so that the change can be seen.
"""

from __future__ import annotations

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.diagnosis import settings
from thermal_robot.diagnosis.attribution import locate
from thermal_robot.diagnosis.values import Explained, Location, Place
from thermal_robot.effects import Effect, Parameter
from thermal_robot.effects.apply import by_place, sensitivity
from thermal_robot.effects.effect import Channel, Driver
from thermal_robot.effects.gate import driver
from thermal_robot.effects.quantities import quantities, unit
from thermal_robot.errors import EffectError
from thermal_robot.inference.algebra import equations_of, orthonormal, rms, without
from thermal_robot.inference.columns import block
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.settings import ALIAS, FEW_LEVELS, TINY
from thermal_robot.observations import Observations


def explained(fit: Fit, effect: str) -> Explained:
    """Tell what one effect of the fit explains at each place, outliers left out; :class:`EffectError` if not in it."""
    held = {e.name: (e, values) for e, values in fit.effects}
    if effect not in held:
        listed = ", ".join(held) or "no effect"
        raise EffectError(f"{effect!r} is not part of the explanation, which holds {listed}")
    setting, values = held[effect]
    fitted = zip(block(fit.corrected, setting).parameters, values, strict=True)
    parts = [(part, float(v)) for p, v in fitted for part in by_place(fit.campaign.robot, p)]
    found = [p for p in locate(fit, {effect: 1.0})[1][effect] if p.share > 0.0]
    shown = [p for p in found if p.share >= settings.MATERIAL_PLACE][: settings.MOST_PLACES]
    places = tuple(
        _at(fit, setting, place, [(p, v) for p, v in parts if (p.kind, p.place) == (place.kind, place.name)])
        for place in shown
    )
    return Explained(effect, places, len(found) - len(shown))


def _at(fit: Fit, effect: Effect, place: Location, parameters: list[tuple[Parameter, float]]) -> Place:
    observations, e = fit.corrected, fit.explanation
    error, moves, unit = _error(observations, parameters)
    noise = np.broadcast_to(e.whitening.sigma() * e.best.noise, observations.gap.shape)
    direction, remainder = moves / noise, observations.gap / noise
    length2 = np.einsum("nm,nm->n", direction, direction)
    rows = ~e.outliers & (length2 > 1e-12 * length2.max(initial=0.0))
    after = np.einsum("nm,nm->n", direction, remainder)[rows] / length2[rows]
    name, name_unit, values = _driver(observations, effect, [p for p, _ in parameters], error)
    values, error = values[rows], error[rows]
    constant = _undetermined(e.linear.frames[rows] / noise[rows, :, None], direction[rows], error)
    error = error - constant
    return Place(
        place.kind,
        place.name,
        place.share,
        quantity=name,
        quantity_unit=name_unit,
        values=values,
        levels=len(np.unique(values)) <= FEW_LEVELS,
        unit=unit,
        before=error + after,
        after=after,
        spread=1.0 / np.sqrt(length2[rows]),
        line=_line(values, error),
        centred=constant != 0.0,
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
    beyond = without(direction.ravel(), orthonormal(equations_of(frames)))
    return float(error.mean()) if float(np.linalg.norm(beyond)) * change < 1.0 else 0.0


def _error(observations: Observations, parameters: list[tuple[Parameter, float]]) -> tuple[Array, Array, str]:
    """(N,) error at a place along its first singular vector, (N, m) displacement of the target per unit, and unit."""
    samples, measures = observations.gap.shape
    parts: dict[tuple[Channel, int], Array] = {}
    for parameter, value in parameters:
        for response in parameter.responses:
            moved, key = value * np.asarray(response.values), (response.channel, response.index)
            width = 1 if response.channel == "joint" else moved.shape[-1]
            moved = np.broadcast_to(moved[..., None] if response.channel == "joint" else moved, (samples, width))
            parts[key] = parts[key] + moved if key in parts else moved
    twists = np.concatenate(list(parts.values()), axis=1)
    moves = np.concatenate([sensitivity(observations, *key)[:, :measures] for key in parts], axis=2)
    channels = {channel for channel, _ in parts}
    if channels == {"instrument"}:
        # it points elsewhere in every row; the sign is that of its parameter
        length = (-1.0 if parameters[0][1] < 0.0 else 1.0) * np.linalg.norm(twists, axis=1)
        return length, np.einsum("nmk,nk->nm", moves, twists / np.where(length == 0.0, 1.0, length)[:, None]), "m"
    if channels == {"joint"} and len(parts) == 1:
        robot, index = observations.robot, next(index for _, index in parts)
        return twists[:, 0], moves[:, :, 0], unit(robot, robot.joint_names[index])
    main = np.linalg.svd(twists, full_matrices=False)[2][0]
    main = main * np.sign(main[int(np.abs(main).argmax())])
    direction = moves @ main
    shift, turn = np.linalg.norm(main[:3]), np.linalg.norm(main[3:])
    if len(parts) == 1 and min(shift, turn) < ALIAS:
        return twists @ main, direction, "m" if shift > turn else "rad"
    size = rms(direction[:, :3])
    return twists @ main * size, direction / max(size, TINY), "m at the tool"


def _driver(observations: Observations, effect: Effect, parameters: list[Parameter], error: Array) -> Driver:
    """Return the quantity that drives an effect at a place, or else the one that its error follows best.

    That is the one with the least mean variance of the error among rows with neighbouring values.
    """
    if known_driver := driver(effect, observations, parameters, error):
        return known_driver
    known, number = quantities(observations), max(len(error) // settings.ROWS_A_POINT, 2)

    def unsteady(name: str) -> float:
        parts = np.array_split(error[np.argsort(known[name], kind="stable")], number)
        return float(np.mean([part.var() for part in parts if len(part)]))

    name = min(known, key=unsteady)
    return name, unit(observations.robot, name), known[name]


def _line(values: Array, error: Array) -> Array:
    """(2, k) the fitted law over its quantity; means of neighbouring rows where it depends on others, too."""
    levels = np.unique(values)
    if len(levels) <= FEW_LEVELS:
        return np.array([levels, [error[values == level].mean() for level in levels]])
    order = np.argsort(values, kind="stable")
    x, y = values[order], error[order]
    # a law of this quantity alone lies between its neighbours
    off = np.interp(x[1:-1:2], x[::2], y[::2]) - y[1:-1:2]
    alone = float(np.abs(off).mean()) < settings.ROUGH * float(np.ptp(y)) + TINY
    several = min(settings.LINE_POINTS, max(len(x) // settings.ROWS_A_POINT, 2))
    parts = np.array_split(order, min(len(x), settings.DENSE_POINTS) if alone else several)
    return np.array([[values[p].mean() for p in parts], [error[p].mean() for p in parts]])
