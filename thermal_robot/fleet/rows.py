"""A diagnosis as rows of a table, one for each effect, and the Parquet file that holds them; SI throughout.

A fleet cannot be judged by the parameters of the robots in which an effect was found: those are the large ones, and an
effect too small to be found in any robot may be at work in all. So every campaign tells every parameter of every effect
that it can test, beside the effects that were found and those that may be at work, as the data alone say it: with G the
products of the columns, the frames projected out, s the noise, and Λ the priors of the others,

    θ = (G/s² + Λ⁻¹)⁻¹ b/s²,

Λ⁻¹ next to nothing for the effect in question, and no parameter held positive. Such estimates scatter about the truth,
and their mean over a fleet does, too. What is not found but may be at work has its prior of expected size: left out,
it would be told as something else's, in all robots alike.

The table is read again in pieces, and of an effect only its own columns: the memory holds numbers of one effect alone.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from importlib import import_module
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.diagnosis import Diagnosis, Finding
from thermal_robot.diagnosis.values import jsonable
from thermal_robot.effects import choose, gate
from thermal_robot.errors import ThermalRobotError
from thermal_robot.files import whole
from thermal_robot.fleet import settings
from thermal_robot.inference.columns import Block, block
from thermal_robot.inference.evidence import Gram
from thermal_robot.inference.explain import Explanation
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.problem import Linear, contained, gram

if TYPE_CHECKING:
    import pyarrow as pa


CAMPAIGN, ROBOT = "campaign", "robot"
"""The column of a list that holds the paths, and the label that says which campaigns are of one robot."""
DIAGNOSED, UNUSABLE, FAILED = "diagnosed", "unusable", "failed"
"""Outcomes: a diagnosis; robot and table do not belong together; no diagnosis, and the reason."""
_PLACES = "list<struct<kind: string, name: string, share: double>>"
_VALUES = "list<struct<name: string, value: double, std: double, unit: string>>"
_OF_CAMPAIGN = {
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
}
_OF_EFFECT = {
    "effect": "string",
    "status": "string",
    "probability": "double",
    "shrinkage": "double",
    "shrinkage_low": "double",
    "shrinkage_high": "double",
    "quantity": "string",
    "shape": "string",
    "needs": "list<string>",
    "confounded_with": "list<string>",
    "places": _PLACES,
    "parameters": _VALUES,
    "free": _VALUES,
}
OWN = ("campaign", *_OF_CAMPAIGN, *_OF_EFFECT)
"""Columns that no label may be called; ``robot`` is one."""


def needed(module: str) -> Any:
    """Return a module of the extra ``fleet``.

    Raises
    ------
    ThermalRobotError
        If it is not installed; says how to.
    """
    try:
        return import_module(module)
    except ImportError as error:
        package = module.partition(".")[0]
        raise ThermalRobotError(
            f"a fleet needs {package}, which cannot be loaded ({error}); pip install 'thermal-robot[fleet]'"
        ) from error


def rows_of(found: Diagnosis) -> list[dict[str, Any]]:
    """Return the rows of a diagnosis, without the campaign's name and its labels.

    Returns
    -------
    list of dict
        One for each effect, in the diagnosis's order; one without an effect where it is not usable. ``parameters`` are
        those that the diagnosis tells and the data identify, ``free`` those of :func:`_free`.
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
    alone = {} if found.fit is None else _free(found.fit, refused)
    return [dict(jsonable({**campaign, **_of_effect(f, alone.get(f.name, ()))})) for f in found.effects]


def _of_effect(finding: Finding, alone: Sequence[Free]) -> dict[str, Any]:
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
        "free": [asdict(parameter) for parameter in alone],
    }


def failed(reason: str) -> list[dict[str, Any]]:
    """Return the one row of a campaign that could not be diagnosed."""
    return [{"outcome": FAILED, "reason": reason}]


def schema(labels: Sequence[str]) -> pa.Schema:
    """Return the columns of the table: the campaign, its labels as text, what was diagnosed, and of each effect."""
    pa = needed("pyarrow")
    kinds = {"string": pa.string(), "int64": pa.int64(), "double": pa.float64(), "bool": pa.bool_()}
    kinds["list<string>"] = pa.list_(pa.string())
    place = {"kind": pa.string(), "name": pa.string(), "share": pa.float64()}
    value = {"name": pa.string(), "value": pa.float64(), "std": pa.float64(), "unit": pa.string()}
    kinds[_PLACES], kinds[_VALUES] = pa.list_(pa.struct(place)), pa.list_(pa.struct(value))
    known = {**_OF_CAMPAIGN, **_OF_EFFECT}
    texts = [(name, pa.string()) for name in ("campaign", *labels)]
    return pa.schema([*texts, *((name, kinds[kind]) for name, kind in known.items())])


def write_rows(path: Path, labels: Sequence[str], rows: Iterable[dict[str, Any]]) -> None:
    """Write the table, whole or not at all, holding few rows at a time; equal rows give equal bytes.

    Raises
    ------
    OSError
        As :func:`~thermal_robot.files.whole`.
    """
    pa, columns, left = needed("pyarrow"), schema(labels), iter(rows)
    parquet = needed("pyarrow.parquet")
    with whole(path) as place, parquet.ParquetWriter(place, columns, compression="zstd") as writer:
        while some := list(islice(left, settings.ROWS_AT_ONCE)):
            writer.write_table(pa.Table.from_pylist(some, schema=columns))


@dataclass(frozen=True)
class Free:
    """A parameter, free of its prior: name, SI value, one sigma, unit."""

    name: str
    value: float
    std: float
    unit: str


def _free(fit: Fit, names: Iterable[str] = ()) -> dict[str, tuple[Free, ...]]:
    """Return by effect its parameters as the data alone tell them, beside the others that are or may be at work.

    Of every effect that was tried, also of ``names`` that were taken out again, in all its places; of its parameters
    those alone of which the data know more than the expected size says.
    """
    e, likely = fit.explanation, _likely(fit)
    own = {name: _everywhere(fit, name) for name in dict.fromkeys(fit.families)}
    further = _further(fit, [name for name in names if name not in own])
    linear, problem = e.linear, e.problem
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
    """Return the block of an effect in all its places; where none is among those that were compared, the first."""
    blocks = fit.blocks_of(name)
    return next((b for b in blocks if not fit.explanation.linear.blocks[b].effect.places), blocks[0])


def _further(fit: Fit, names: Iterable[str]) -> list[Block]:
    """Return the columns of effects that are no longer part of the problem, in the setting that is first looked for."""
    known = {effect.name: effect for effect in choose()}
    settings_of = (gate.variants(known[name], fit.nominal) for name in names if name in known)
    return [block(fit.corrected, variants[0]) for variants in settings_of if variants]


def _likely(fit: Fit) -> dict[str, int]:
    """Return by name the effects that were not found but may be at work: the most probable setting of each."""
    e = fit.explanation
    found = {fit.families[b] for b in e.best.blocks}
    others = [name for name in dict.fromkeys(fit.families) if name not in found]
    may_be = [name for name in others if fit.probability(name) >= settings.MAY_BE]
    return {name: max(fit.blocks_of(name), key=lambda b: e.probability([b])) for name in may_be}


def _alone(e: Explanation, linear: Linear, problem: Gram, blocks: Sequence[int]) -> tuple[Free, ...]:
    """Return the parameters of the first of some blocks, free of its prior, the others held to theirs."""
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
    seen = np.einsum("pi,pi->p", basis, basis) > settings.SEEN
    listed = zip(item.bare, item.sizes, values, spread, seen & (spread < 1.0), strict=True)
    return tuple(Free(p.name, float(v * size), float(s * size), p.unit) for p, size, v, s, told in listed if told)


MODEL = "model"
"""The robot's type, as its description names it: a label of every campaign."""
Codes = NDArray[np.int64]


@dataclass
class Labels:
    """One label of all campaigns: a number each, and what the numbers stand for."""

    codes: list[int] = field(default_factory=list)
    values: dict[str, int] = field(default_factory=dict)

    def add(self, value: str) -> None:
        """Label the next campaign."""
        self.codes.append(self.values.setdefault(value, len(self.values)))


@dataclass(frozen=True, eq=False)
class Overview:
    """The campaigns of a table.

    Attributes
    ----------
    numbers
        Of the campaigns, by name.
    robots
        Which robot each is of.
    labels
        The others, by name, the robot's type included.
    outcomes
        How many campaigns had each outcome.
    excused
        Some of those that have no diagnosis: name, outcome, reason.
    """

    numbers: dict[str, int]
    robots: Labels
    labels: dict[str, Labels]
    outcomes: dict[str, int]
    excused: list[tuple[str, str, str]]

    def robot_of(self) -> Codes:
        """(C,) number of each campaign's robot."""
        return np.array(self.robots.codes, dtype=np.int64)

    def label_of(self, name: str) -> Codes:
        """(R,) number of each robot's label: that of its first campaign."""
        first = np.unique(self.robot_of(), return_index=True)[1]
        return np.array(self.labels[name].codes, dtype=np.int64)[first]


def overview(table: Path, names: Sequence[str]) -> Overview:
    """Read who is in a table, and what became of each.

    Parameters
    ----------
    table
        The file.
    names
        Of the labels.
    """
    groups = [name for name in (*names, MODEL) if name != ROBOT]
    found = Overview({}, Labels(), {name: Labels() for name in groups}, {}, [])
    for row in _records(table, [CAMPAIGN, *names, MODEL, "outcome", "reason"]):
        name, outcome = row[CAMPAIGN], row["outcome"]
        if name in found.numbers:
            continue
        found.numbers[name] = len(found.numbers)
        found.robots.add(row.get(ROBOT) or name)
        for group in groups:
            found.labels[group].add(row[group] or "")
        found.outcomes[outcome] = found.outcomes.get(outcome, 0) + 1
        if row["reason"] and len(found.excused) < settings.MOST_LISTED:
            found.excused.append((name, outcome, row["reason"]))
    return found


def findings(table: Path) -> Iterator[dict[str, Any]]:
    """Yield the row of every effect of every campaign that has one: what is needed to count it."""
    columns = [
        CAMPAIGN,
        "rms_before",
        "rms_after",
        "effect",
        "status",
        "probability",
        "shrinkage",
        "quantity",
        "places",
        "confounded_with",
        "unexplained",
    ]
    return (row for row in _records(table, columns) if row["effect"] is not None)


@dataclass(frozen=True, eq=False)
class Told:
    """One parameter as the campaigns tell it: numbers of the campaigns, values, one sigma, SI; and its unit."""

    effect: str
    parameter: str
    unit: str
    campaigns: Codes
    values: NDArray[np.float64]
    deviations: NDArray[np.float64]


def told(table: Path, effect: str, numbers: dict[str, int]) -> Iterator[Told]:
    """Yield the parameters of one effect, each as all campaigns tell it."""
    parquet, compute = needed("pyarrow.parquet"), needed("pyarrow.compute")
    read = parquet.read_table(table, columns=[CAMPAIGN, "free"], filters=[("effect", "==", effect)])
    owners = np.array([numbers[name] for name in read[CAMPAIGN].to_pylist()], dtype=np.int64)
    which = compute.list_parent_indices(read["free"]).to_numpy()
    flat = compute.list_flatten(read["free"])
    if not len(flat):
        return
    names = compute.struct_field(flat, "name").to_pylist()
    units = compute.struct_field(flat, "unit").to_pylist()
    values = compute.struct_field(flat, "value").to_numpy()
    deviations = compute.struct_field(flat, "std").to_numpy()
    keys = dict.fromkeys(zip(names, units, strict=True))
    number = {key: k for k, key in enumerate(keys)}
    code = np.array([number[key] for key in zip(names, units, strict=True)])
    for key, k in number.items():
        own = code == k
        yield Told(effect, *key, owners[which[own]], values[own], deviations[own])


def _records(table: Path, columns: Sequence[str]) -> Iterator[dict[str, Any]]:
    parquet = needed("pyarrow.parquet")
    with parquet.ParquetFile(table) as file:
        for batch in file.iter_batches(settings.ROWS_AT_ONCE, columns=list(dict.fromkeys(columns))):
            yield from batch.to_pylist()
