"""Attribution of the gap's mean square: to axes, joints, links, quantities, laws, and to the places of each effect."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.diagnosis.values import Location, Unexplained, Where
from thermal_robot.effects.apply import by_place, column
from thermal_robot.effects.law import PREFIX
from thermal_robot.effects.quantities import quantities
from thermal_robot.inference.algebra import equations_of, orthonormal, without
from thermal_robot.inference.columns import Block
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.laws import smooth_columns
from thermal_robot.inference.settings import TINY
from thermal_robot.observations import Observations
from thermal_robot.percents import percent


def without_laws(fit: Fit, left: Unexplained) -> Unexplained:
    """Residual of the known effects of a fit, given that of the whole fit, its laws included.

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
    """(N, m) displacement by place; a parameter common to all links is divided by its response at each."""
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
