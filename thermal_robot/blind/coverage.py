"""Whether 95 % intervals hold the truth in 95 %: of parameters, of the shrinkage, of shares."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from thermal_robot.blind.judged import Record, at_work, corrects, failed, found, unexplained
from thermal_robot.blind.rate import Rate, rate

SIGMAS = 1.959963984540054
"""Half the width of a normal law's central 95 %, in standard deviations."""


@dataclass(frozen=True)
class Coverage:
    """How often the truth lay inside.

    Attributes
    ----------
    parameters
        Where exactly what is at work was found, and nothing is unexplained: of a wrong model no parameter is right.
        Every parameter that is called identified and whose true value is in the record; normal, from its standard
        deviation. Those of one effect do not err independently: the rate's own interval is too narrow.
    shrinkage
        Where something is named that a correction takes away: the held-out shrinkage, against that on fresh rows. Both
        have the noise in them; fresh rows are many, so that their own scatter hardly counts.
    shares
        Of each effect in the model that is named: its held-out share, against the Shapley value on fresh rows with
        frames and each subset of the effects fitted to the given rows (:mod:`thermal_robot.blind.refitted`).
    """

    parameters: Rate
    shrinkage: Rate
    shares: Rate


def coverage(records: Sequence[Record]) -> Coverage:
    """Count intervals of all records but real ones, of which nobody knows the truth."""
    told = [r for r in records if not failed(r) and r["kind"] != "real"]
    return Coverage(
        rate(inside for r in told for inside in _parameters(r)),
        rate(inside for r in told for inside in _shrinkage(r)),
        rate(inside for r in told for inside in _shares(r)),
    )


def _parameters(record: Record) -> Iterator[bool]:
    if found(record) != frozenset(at_work(record)) or unexplained(record):
        return
    true = record["truth"].get("parameters", {})
    for effect in record["said"]["effects"]:
        for told in effect["parameters"]:
            value = true.get(effect["name"], {}).get(told["name"])
            if value is not None and effect["name"] in found(record) and told["identified"]:
                yield abs(told["value"] - value) <= SIGMAS * told["std"]


def _shrinkage(record: Record) -> Iterator[bool]:
    fresh, held = record.get("fresh"), record["said"]["gap"]["held_out"]
    if not fresh or record.get("noise") is None or not corrects(record):
        return
    noise2 = 3.0 * float(record["noise"]) ** 2
    real = 1.0 - (fresh["rms_after"] ** 2 + noise2) / (fresh["rms_before"] ** 2 + noise2)
    low, high = held["shrinkage_ci95"]
    yield low <= real <= high


def _shares(record: Record) -> Iterator[bool]:
    real = (record.get("fresh") or {}).get("shares") or {}
    for effect in record["said"]["effects"]:
        if effect["name"] in real and effect["name"] in found(record) and effect.get("shrinkage_ci95"):
            low, high = effect["shrinkage_ci95"]
            yield low <= real[effect["name"]] <= high
