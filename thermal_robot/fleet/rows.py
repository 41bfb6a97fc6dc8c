"""A diagnosis as rows of a table, one for each effect, and the Parquet file that holds them; SI throughout."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from thermal_robot.diagnosis import Diagnosis, Finding
from thermal_robot.diagnosis.parts import jsonable
from thermal_robot.files import whole
from thermal_robot.fleet import settings
from thermal_robot.fleet.extra import needed
from thermal_robot.fleet.free import Free, free

if TYPE_CHECKING:
    import pyarrow as pa

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


def rows_of(found: Diagnosis) -> list[dict[str, Any]]:
    """Return the rows of a diagnosis, without the campaign's name and its labels.

    Returns
    -------
    list of dict
        One for each effect, in the diagnosis's order; one without an effect where it is not usable. ``parameters`` are
        those that the diagnosis tells and the data identify, ``free`` those of :func:`~thermal_robot.fleet.free.free`.
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


def _of_effect(finding: Finding, alone: Sequence[Free]) -> dict[str, Any]:
    low, high = finding.shrinkage_ci95 or (None, None)
    told = [
        {"name": p.name, "value": p.value, "std": p.std, "unit": p.unit} for p in finding.parameters if p.identified
    ]
    return {
        "effect": finding.name,
        "status": finding.status,
        "probability": finding.probability,
        "shrinkage": finding.shrinkage,
        "shrinkage_low": low,
        "shrinkage_high": high,
        "quantity": finding.quantity,
        "shape": finding.shape,
        "needs": finding.needs,
        "confounded_with": finding.confounded_with,
        "places": [asdict(place) for place in finding.locations],
        "parameters": told,
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
    pa, columns = needed("pyarrow"), schema(labels)
    parquet = needed("pyarrow.parquet")
    with whole(path) as place, parquet.ParquetWriter(place, columns, compression="zstd") as writer:
        for some in _batches(rows):
            writer.write_table(pa.Table.from_pylist(some, schema=columns))


def _batches(rows: Iterable[dict[str, Any]]) -> Iterator[list[dict[str, Any]]]:
    batch: list[dict[str, Any]] = []
    for row in rows:
        batch.append(row)
        if len(batch) == settings.ROWS_AT_ONCE:
            yield batch
            batch = []
    if batch:
        yield batch
