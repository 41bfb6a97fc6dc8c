"""Parquet table of a fleet: least-squares estimates of all parameters, one row for each effect; SI.

The parameters of robots in which an effect was found are biased: only large ones are found, and a small effect may be
at work in all robots. So every campaign estimates every parameter of every testable effect, given the effects that were
found and those that may be at work: with G the Gram matrix, the frames projected out, s the noise, and Λ the priors of
the others,

    θ = (G/s² + Λ⁻¹)⁻¹ b/s²,

with nearly flat prior for the effect in question, and no parameter held positive. Such estimates are unbiased, and so
is their mean over a fleet. Effects that may be at work keep their prior of expected size: left out, they would bias
others in all robots alike.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict
from importlib import import_module
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from thermal_robot.diagnosis import Diagnosis, Finding
from thermal_robot.diagnosis.values import jsonable
from thermal_robot.effects import choose, gate
from thermal_robot.errors import ThermalRobotError
from thermal_robot.files import whole
from thermal_robot.fleet import settings
from thermal_robot.inference.columns import block
from thermal_robot.inference.evidence import Gram
from thermal_robot.inference.explain import Explanation
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.problem import Linear, contained, gram

if TYPE_CHECKING:
    import pyarrow as pa


Plain = dict[str, Any]
CAMPAIGN, ROBOT, MODEL = "campaign", "robot", "model"
"""The column of a list that holds the paths; the labels of the robot and of its type, as its URDF names it."""
DIAGNOSED, UNUSABLE, FAILED = "diagnosed", "unusable", "failed"
"""Outcomes: a diagnosis; robot and table do not belong together; no diagnosis, and the reason."""
_COLUMNS = {
    "model": "string",
    "tool": "string",
    "samples": "int64",
    "measures": "string",
    "outcome": "string",
    "reason": "string",
    "summary": "string",
    "rms_before": "double",
    "rms_after": "double",
    "noise_floor": "double",
    "held_out": "double",
    "unexplained": "bool",
    "effect": "string",
    "status": "string",
    "probability": "double",
    "shrinkage": "double",
    "shrinkage_low": "double",
    "shrinkage_high": "double",
    "quantity": "string",
    "shape": "string",
    "needs": "texts",
    "confounded_with": "texts",
    "places": "places",
    "parameters": "values",
    "free": "values",
}
OWN = (CAMPAIGN, *_COLUMNS)
"""Columns that no label may be called; ``robot`` is one."""


def needed(module: str) -> Any:
    """Import a module of the extra ``fleet``; :class:`ThermalRobotError` says how to install it if it is missing."""
    try:
        return import_module(module)
    except ImportError as error:
        package = module.partition(".")[0]
        raise ThermalRobotError(
            f"a fleet needs {package}, which cannot be loaded ({error}); pip install 'thermal-robot[fleet]'"
        ) from error


def rows_of(found: Diagnosis) -> list[Plain]:
    """Table rows of a diagnosis as dicts of plain values, without the campaign's name and labels.

    One for each effect, in the diagnosis's order; only one, without an effect, where it is not usable. ``parameters``
    are those in the diagnosis that the data identify, ``free`` the estimates of :func:`free`.
    """
    campaign = {
        "model": found.robot,
        "tool": found.tool_frame,
        "samples": found.samples,
        "measures": found.measures,
        "outcome": DIAGNOSED if found.usable else UNUSABLE,
        "reason": found.reason,
        "summary": found.summary,
        "rms_before": found.gap.rms_before,
        "rms_after": found.gap.rms_after,
        "noise_floor": found.gap.noise_floor,
        "held_out": found.gap.held_out.shrinkage,
        "unexplained": found.unexplained.flagged,
    }
    if not found.usable:
        return [dict(jsonable(campaign))]
    refused = [f.name for f in found.effects if f.status == "not_found"]
    alone = {} if found.fit is None else free(found.fit, refused)
    return [dict(jsonable({**campaign, **_of_effect(f, alone.get(f.name, ()))})) for f in found.effects]


def _of_effect(finding: Finding, alone: Sequence[Plain]) -> Plain:
    low, high = finding.shrinkage_ci95 or (None, None)
    alike = ("status", "probability", "shrinkage", "quantity", "shape", "needs", "confounded_with")
    known = [p for p in finding.parameters if p.identified]
    return {
        **{name: getattr(finding, name) for name in alike},
        "effect": finding.name,
        "shrinkage_low": low,
        "shrinkage_high": high,
        "places": [asdict(place) for place in finding.locations],
        "parameters": [{name: getattr(p, name) for name in ("name", "value", "std", "unit")} for p in known],
        "free": alone,
    }


def failed(reason: str) -> list[Plain]:
    """Table row, in a list, of a campaign that could not be diagnosed, with the reason."""
    return [{"outcome": FAILED, "reason": reason}]


def schema(labels: Sequence[str]) -> pa.Schema:
    """Arrow schema of the fleet's table: columns of campaign, labels, diagnosis and effect."""
    pa = needed("pyarrow")
    text, real = pa.string(), pa.float64()
    nested = {
        "texts": pa.list_(text),
        "places": pa.list_(pa.struct({"kind": text, "name": text, "share": real})),
        "values": pa.list_(pa.struct({"name": text, "value": real, "std": real, "unit": text})),
    }
    own = [(name, nested.get(kind) or pa.type_for_alias(kind)) for name, kind in _COLUMNS.items()]
    return pa.schema([*((name, text) for name in (CAMPAIGN, *labels)), *own])


def write_rows(path: Path, labels: Sequence[str], rows: Iterable[Plain]) -> None:
    """Write the Parquet table of a fleet by an atomic replace, 4096 rows at a time; equal rows give equal bytes.

    Raises as :func:`~thermal_robot.files.whole`.
    """
    pa, columns, left = needed("pyarrow"), schema(labels), iter(rows)
    parquet = needed("pyarrow.parquet")
    with whole(path) as place, parquet.ParquetWriter(place, columns, compression="zstd") as writer:
        while some := list(islice(left, settings.ROWS_AT_ONCE)):
            writer.write_table(pa.Table.from_pylist(some, schema=columns))


def free(fit: Fit, names: Iterable[str] = ()) -> dict[str, list[Plain]]:
    """Least-squares estimates of each effect's parameters, jointly with the other effects found or probable enough.

    Each effect of the fit, and of ``names`` that were refused, is estimated in all its places with a nearly flat prior.
    Listed are name, value, one sigma (SI) and unit of the parameters known to better than one expected size.
    """
    e, likely = fit.explanation, _likely(fit)
    own = {name: _everywhere(fit, name) for name in dict.fromkeys(fit.families)}
    linear, problem = e.linear, e.problem
    known = {effect.name: effect for effect in choose()}
    asked = [known[name] for name in names if name in known and name not in own]
    further = [block(fit.corrected, gate.variants(effect, fit.nominal)[0]) for effect in asked]
    if further:
        own |= {item.effect.name: len(linear.blocks) + k for k, item in enumerate(further)}
        linear = Linear(linear.gap, linear.frames, (*linear.blocks, *further))
        problem = gram(linear, e.whitening)
    inside = contained(problem)
    told = {}
    for name, number in own.items():
        others = [b for b in e.best.blocks if fit.families[b] != name]
        others += [b for other, b in likely.items() if other != name and frozenset((b, number)) not in inside]
        told[name] = _alone(e, linear, problem, [number, *others])
    return told


def _everywhere(fit: Fit, name: str) -> int:
    """Index of the block of an effect in all its places; where none was compared, of the effect's first block."""
    blocks = fit.blocks_of(name)
    return next((b for b in blocks if not fit.explanation.linear.blocks[b].effect.places), blocks[0])


def _likely(fit: Fit) -> dict[str, int]:
    """Index of the most probable block, by name, of each effect not found whose probability is at least 0.1."""
    e = fit.explanation
    found = {fit.families[b] for b in e.best.blocks}
    others = (name for name in dict.fromkeys(fit.families) if name not in found)
    may_be = (name for name in others if fit.probability(name) >= settings.MAY_BE)
    return {name: max(fit.blocks_of(name), key=lambda b: e.probability([b])) for name in may_be}


def _alone(e: Explanation, linear: Linear, problem: Gram, blocks: Sequence[int]) -> list[Plain]:
    """Posterior estimates of the first block's parameters, its prior nearly flat, the other blocks' Gaussian as usual.

    Listed are those that the data see fully and determine to better than one expected size.
    """
    problem = problem.some(blocks)
    tight = np.zeros_like(problem.matrix)
    for k, (number, at) in enumerate(zip(blocks, problem.slices, strict=True)):
        sizes = linear.blocks[number].sizes
        prior = np.full(len(sizes), 1.0 if k else settings.UNHELD)
        prior = e.held(number) / sizes if k and number in e.best.blocks else prior
        tight[at, at] = problem.bases[k].T @ (prior[:, None] ** -2.0 * problem.bases[k])
    covariance = np.linalg.inv(problem.matrix / e.best.noise**2 + tight)
    found = covariance @ problem.vector / e.best.noise**2
    at, basis, item = problem.slices[0], problem.bases[0], linear.blocks[blocks[0]]
    values = basis @ found[at]
    spread = np.sqrt(np.einsum("pi,ij,pj->p", basis, covariance[at, at], basis))
    seen = (np.einsum("pi,pi->p", basis, basis) > settings.SEEN) & (spread < 1.0)
    listed = zip(item.bare, values * item.sizes, spread * item.sizes, seen, strict=True)
    return [{"name": p.name, "value": float(v), "std": float(s), "unit": p.unit} for p, v, s, told in listed if told]
