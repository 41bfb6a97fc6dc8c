"""Where the gap lies: shares of axes, joints, links and quantities, and the places of each effect."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

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

_BEYOND = ("base", "tool", "instrument")


def without_laws(fit: Fit, left: Unexplained) -> Unexplained:
    """Return what the known effects of a fit leave, given what the whole fit leaves, its laws included.

    What the laws do to the target is added in quadrature, with the unknown frames projected out. The p-value is at most
    the posterior probability that none of a law's rivals is at work.
    """
    e, laws = fit.explanation, {name for name in fit.families if name.startswith(PREFIX)}
    blocks = [b for b in e.best.blocks if fit.families[b] in laws]
    if not blocks:
        return left
    kept = ~e.outliers
    moved = np.sum([e.linear.contribution(b, e.values[b][0])[kept] for b in blocks], axis=0)
    frames = e.linear.frames[kept].reshape(moved.size, -1)
    moved = without(moved.ravel(), orthonormal(frames)).reshape(moved.shape)[:, :3]
    chance = [1.0 - fit.probability(fit.families[own]) for own in blocks]
    taken2 = float((moved**2).sum(axis=1).mean())
    rest2 = float((fit.corrected.gap[kept, :3] ** 2).sum(axis=1).mean())
    what = "a law explains" if len(blocks) == 1 else f"{len(blocks)} laws explain"
    part = percent(taken2 / max(taken2 + rest2, TINY), 0)
    return replace(
        left,
        rms=float(np.sqrt(left.rms**2 + taken2)),
        p_value=max(min(left.p_value, *chance), 0.0),
        reasons=(f"{what} {part} of what the known effects leave", *left.reasons),
    )


def locate(fit: Fit, shrinkage: dict[str, float]) -> tuple[Where, dict[str, tuple[Location, ...]]]:
    """Attribute the gap to places: shares over axes, joints, links, base, tool, instrument, quantities; by effect.

    The ``shrinkage`` of an effect on held-out rows is divided among its places, largest first, in proportion to the
    mean square displacement that its parameters there cause, with the unknown frames projected out.
    """
    e = fit.explanation
    rows = np.flatnonzero(~e.outliers)
    gap = fit.nominal.gap[rows, :3]
    basis = orthonormal(equations_of(e.linear.frames[rows]))
    locations: dict[str, tuple[Location, ...]] = {}
    by_kind: dict[str, dict[str, float]] = defaultdict(lambda: defaultdict(float))
    for b, (effect, values) in zip(e.best.blocks, fit.effects, strict=True):
        block = e.linear.blocks[b]
        power: dict[tuple[str, str], float] = {}
        for site, displaced in _displaced(fit.corrected, block, values).items():
            moved = without(displaced[rows].ravel(), basis)
            power[site] = float((moved.reshape(len(rows), -1)[:, :3] ** 2).sum())
        total = sum(power.values()) or 1.0
        share = max(shrinkage.get(effect.name, 0.0), 0.0)
        found = [Location(kind, name, min(share * part / total, 1.0)) for (kind, name), part in power.items()]
        locations[effect.name] = tuple(sorted(found, key=lambda place: -place.share))
        for place in found:
            by_kind[place.kind][place.name] += place.share
    links = dict.fromkeys(segment.parent_link for segment in fit.corrected.robot.segments)
    order = {"joint": fit.corrected.robot.joint_names, "link": tuple(links)}
    joints, bodies = (
        {name: by_kind[kind][name] for name in order[kind] if name in by_kind[kind]} for kind in ("joint", "link")
    )
    beyond = {kind: sum(by_kind[kind].values()) for kind in _BEYOND if kind in by_kind}
    return Where(_axes(gap), joints, bodies, _covariates(fit, gap, rows), beyond), locations


def _displaced(observations: Observations, block: Block, values: Array) -> dict[tuple[str, str], Array]:
    """(N, m) displacement by place; a parameter common to all links is divided by its response at each."""
    found: dict[tuple[str, str], Array] = {}
    whole = block.columns
    measures = whole.shape[1]
    for k, parameter in enumerate(block.parameters):
        for part in by_place(observations.robot, parameter):
            if part is parameter:
                columns = whole[:, :, k]
            else:
                columns = sum((column(observations, r, measures) for r in part.responses), np.zeros(1))
            site = part.kind, part.place
            found[site] = found.get(site, 0.0) + columns * values[k]
    return found


def _axes(gap: Array) -> dict[str, float]:
    power = (gap**2).sum(axis=0)
    return dict(zip("xyz", (power / (power.sum() or 1.0)).tolist(), strict=True))


def _covariates(fit: Fit, gap: Array, rows: NDArray[np.int64]) -> dict[str, float]:
    """Return by quantity the adjusted R² of a smooth law of it alone, fitted to the gap."""
    centred = gap - gap.mean(axis=0)
    total = float((centred**2).sum()) or 1.0
    shares = {}
    for name, values in quantities(fit.corrected).items():
        law = smooth_columns(values[rows])
        k = law.shape[1]
        if not k or len(rows) - k - 1 < 3:
            continue
        taken = float(((law.T @ centred) ** 2).sum()) / len(rows)
        rest = (total - taken) / (len(rows) - k - 1) * (len(rows) - 1)
        shares[name] = float(np.clip(1.0 - rest / total, 0.0, 1.0))
    return dict(sorted(shares.items(), key=lambda item: -item[1]))
