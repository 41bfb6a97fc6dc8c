"""Laws that were printed: which of them are right, and how often one that was sure of itself was."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from thermal_robot.blind.judged import LAW, Plain, Record, is_right_law, said
from thermal_robot.blind.rate import Rate, rate

SURE = 0.9


def laws(record: Record) -> Iterator[Plain]:
    """Yield the laws of a diagnosis that have a probability, found or not."""
    for effect in said(record)["effects"]:
        if effect["name"].startswith(LAW) and effect["probability"] is not None:
            yield effect


def sure_laws(records: Sequence[Record]) -> Rate:
    """Count laws printed at 0.9 or more in all records but real ones, and which of them are right.

    A law where all that is at work is in the library is wrong.
    """
    told = [(record, law) for record in records if record["kind"] != "real" for law in laws(record)]
    return rate(is_right_law(record, law) for record, law in told if law["probability"] >= SURE)
