"""The score of a blind trial as the table of the README."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from thermal_robot.blind.report.words import count, facts, interval, kind, question
from thermal_robot.report import units


def markdown(score: Mapping[str, Any]) -> str:
    """Write the table of the README.

    Parameters
    ----------
    score
        Of the format ``thermal-robot/blind/1``.

    Returns
    -------
    str
        Markdown without a newline at the end: one row for each kind of case, then the figures that stand alone.
    """
    lines = ["| case | number | right means | right | share | 95 % interval |", "|---|--:|---|--:|--:|--:|"]
    for of in score["kinds"]:
        asked = of["headline"]
        rate = of["rates"][asked]
        cells = (kind(of["kind"]), str(of["cases"]), question(asked, of["kind"]), count(rate))
        lines.append(f"| {' | '.join((*cells, units.percent(rate['value']), interval(rate)))} |")
    rest = [f"- {name[:1].upper()}{name[1:]}: {value}" for name, value in facts(score)]
    if score["failed"]:
        rest.append(f"- Diagnoses that failed, and count as wrong: {score['failed']}")
    return "\n".join((*lines, "", *rest) if rest else lines)
