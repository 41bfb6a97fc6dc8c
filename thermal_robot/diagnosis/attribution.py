"""Attribution of the gap's mean square: to axes, joints, links, quantities, laws, and to the places of each effect.

One effect in detail: component-plus-residual data, place by place.
Ezekiel 1924; Larsen and McCleary, *American Sociological Review* 37, 1972. In each row, r is the residual of the whole
fit (m, rad), c the contribution of the effect at this place, and D the displacement of the target for a unit error
there, in units of the noise:

    before = D'(r + c) / D'D        after = D'r / D'D        spread = 1 / √(D'D)

A constant error that the unknown frames also explain is a convention and may be a hundred times the variation: it is
subtracted.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.diagnosis import settings
from thermal_robot.diagnosis.values import Explained, Location, Place, Unexplained, Where
from thermal_robot.effects import Effect, Parameter
from thermal_robot.effects.apply import by_place, column, sensitivity
from thermal_robot.effects.effect import Channel, Driver
from thermal_robot.effects.gate import driver
from thermal_robot.effects.law import PREFIX
from thermal_robot.effects.quantities import quantities, unit
from thermal_robot.errors import EffectError
from thermal_robot.inference.algebra import equations_of, orthonormal, rms, without
from thermal_robot.inference.columns import Block, block
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.screening import smooth_columns
from thermal_robot.inference.settings import ALIAS, FEW_LEVELS, TINY
from thermal_robot.observations import Observations
from thermal_robot.percents import percent


def without_laws(fit: Fit, left: Unexplained) -> Unexplained:
    """Residual of the known effects of a fit, from the residual of the whole fit with its laws.

    What the laws do to the target is added in quadrature, with the unknown frames projected out. The p-value is at most
    the posterior probability that none of a law's rivals is at work.
    """
    e = fit.explanation
    laws = [b for b in e.best.blocks if fit.families[b].startswith(PREFIX)]
    if not laws:
        return left
    kept = ~e.outliers
    moved = np.sum([e.linear.contribution(b, e.values[b][0])[kept] for b in laws], axis=0)
    moved = without(moved.ravel(), orthonormal(equations_of(e.linear.frames[kept]))).reshape(moved.shape)[:, :3]
    taken2, rest2 = (float((v**2).sum(axis=1).mean()) for v in (moved, fit.corrected.gap[kept, :3]))
    what = "a law explains" if len(laws) == 1 else f"{len(laws)} laws explain"
    part = percent(taken2 / max(taken2 + rest2, TINY), 0)
    return replace(
        left,
        rms=float(np.sqrt(left.rms**2 + taken2)),
        p_value=max(min(left.p_value, *(1.0 - fit.probability(fit.families[b]) for b in laws)), 0.0),
        reasons=(f"{what} {part} of what the known effects leave", *left.reasons),
    )


def locate(fit: Fit, shrinkage: dict[str, float]) -> tuple[Where, dict[str, tuple[Location, ...]]]:
    """Attribute the gap to places: shares over axes, joints, links, base, tool, instrument, quantities; by effect.

    The ``shrinkage`` of an effect on held-out rows is divided among its places, largest first, in proportion to the
    mean square displacement that its parameters there cause, with the unknown frames projected out.
    """
    e, robot, kept = fit.explanation, fit.corrected.robot, ~fit.explanation.outliers
    basis = orthonormal(equations_of(e.linear.frames[kept]))
    locations: dict[str, tuple[Location, ...]] = {}
    shares: dict[str, dict[str, float]] = defaultdict(lambda: defaultdict(float))
    for b, (effect, values) in zip(e.best.blocks, fit.effects, strict=True):
        power = {}
        for site, displaced in _displaced(fit.corrected, e.linear.blocks[b], values).items():
            moved = without(displaced[kept].ravel(), basis).reshape(-1, e.linear.measures)
            power[site] = float((moved[:, :3] ** 2).sum())
        each = max(shrinkage.get(effect.name, 0.0), 0.0) / (sum(power.values()) or 1.0)
        found = [Location(*site, min(each * part, 1.0)) for site, part in power.items()]
        locations[effect.name] = tuple(sorted(found, key=lambda place: -place.share))
        for place in found:
            shares[place.kind][place.name] += place.share
    bodies = dict.fromkeys(segment.parent_link for segment in robot.segments)
    joints = {name: shares["joint"][name] for name in robot.joint_names if name in shares["joint"]}
    links = {name: shares["link"][name] for name in bodies if name in shares["link"]}
    beyond: dict[str, float] = {k: sum(shares[k].values()) for k in ("base", "tool", "instrument") if k in shares}
    gap = fit.nominal.gap[kept, :3]
    power_of_axes = (gap**2).sum(axis=0)
    axes = dict(zip("xyz", (power_of_axes / (power_of_axes.sum() or 1.0)).tolist(), strict=True))
    laws = {name: smooth_columns(values[kept]) for name, values in quantities(fit.corrected).items()}
    return Where(axes, joints, links, _determination(gap, laws), beyond), locations


def _displaced(observations: Observations, block: Block, values: Array) -> dict[tuple[str, str], Array]:
    """Displacement (N, m) by place; a parameter common to all links is divided by its response at each."""
    found: dict[tuple[str, str], Array] = {}
    whole = block.columns
    for k, parameter in enumerate(block.parameters):
        for part in by_place(observations.robot, parameter):
            if part is parameter:
                columns = whole[:, :, k]
            else:
                columns = sum((column(observations, r, whole.shape[1]) for r in part.responses), np.zeros(1))
            site = part.kind, part.place
            found[site] = found.get(site, 0.0) + columns * values[k]
    return found


def _determination(gap: Array, laws: dict[str, Array]) -> dict[str, float]:
    """Coefficient of determination (adjusted R²) of the gap (N, 3) by each smooth law (N, k) alone, largest first."""
    centred, rows, shares = gap - gap.mean(axis=0), len(gap), {}
    total = float((centred**2).sum()) or 1.0
    for name, law in laws.items():
        freedom = rows - law.shape[1] - 1
        if law.shape[1] and freedom >= 3:
            rest = (total - float(((law.T @ centred) ** 2).sum()) / rows) / freedom * (rows - 1)
            shares[name] = float(np.clip(1.0 - rest / total, 0.0, 1.0))
    return dict(sorted(shares.items(), key=lambda item: -item[1]))


def explained(fit: Fit, effect: str) -> Explained:
    """Partial residuals of one effect of the fit, place by place, without outliers (:class:`EffectError` if absent)."""
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
    """Constant of (n,) errors that the unknown frames take up; 0 where there is none.

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
    """Error (N,) at a place along its first singular vector, displacement (N, m) of the target per unit, and unit."""
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
    """Quantity that drives an effect at a place, else the quantity with the largest R² of its error.

    R² is from the mean variance of the error among rows with neighbouring values.
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
    """Points (2, k) of an effect's line over a quantity: the law itself if smooth in it, else means of near rows."""
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
