"""The page's big numbers and tables."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from typing import TYPE_CHECKING

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.report import units
from thermal_robot.report.html_parts import row, table, wide
from thermal_robot.report.words import STATUS, by_status, in_joints, law, needs, parameters, places, rivals, told_as

if TYPE_CHECKING:
    from thermal_robot.diagnosis.parts import Finding
    from thermal_robot.diagnosis.result import Diagnosis


_MOST_OUTLIERS = 40
_MOST_ROWS = 0.95  # share of the rows below which a quantile tells their distance, as metrology asks for it


def numbers(diagnosis: Diagnosis) -> str:
    """Show the gap before, after, and the held-out shrinkage."""
    gap, held = diagnosis.gap, diagnosis.gap.held_out
    before, after, floor = units.together((gap.rms_before, gap.rms_after, gap.noise_floor), "m")
    turned = ("", "")
    if gap.orientation_before is not None:
        pair = units.together((gap.orientation_before, gap.orientation_after), "rad")
        turned = (f"orientation {pair[0]}", f"orientation {pair[1]}")
    held_before, held_after = units.together((held.rms_before, held.rms_after), "m")
    cards = (
        ("before", "Gap before, rms", before, (turned[0],)),
        ("after", "Gap after, rms", after, (turned[1], f"noise floor {floor}")),
        (
            "held",
            "Shrinkage on rows held out",
            units.percent(held.shrinkage),
            (f"95 % interval {units.interval(held.shrinkage_ci95)} %", f"{held_before} → {held_after}"),
        ),
    )
    shown = (
        f'<div class="tr-number tr-is-{kind}"><span>{heading}</span><b>{escape(value)}</b>'
        f"{''.join(f'<span>{_unbroken(line)}</span>' for line in lines if line)}</div>"
        for kind, heading, value, lines in cards
    )
    return f'<div class="tr-numbers">{"".join(shown)}</div>'


def _unbroken(line: str) -> str:
    return escape(line).replace(" %", "&nbsp;%")


def extremes_table(diagnosis: Diagnosis) -> str:
    """Show rms, 95 % quantile and maximum of the distance, and the rms along each axis, before and after.

    Rows set aside are left out. Rows held out have no axes of their own in a diagnosis: their distances are told.
    """
    rows = diagnosis.rows
    kept = ~rows.outliers
    linear = {"before": rows.gap[kept, :3], "after": rows.remainder[kept, :3]}
    held = {"before": rows.held_out_before, "after": rows.held_out_after}
    nothing = (float("nan"),) * 3
    told = {f"all rows, {name}": _sizes(np.linalg.norm(gap, axis=1)) + _along(gap) for name, gap in linear.items()}
    told |= {f"rows held out, {name}": _sizes(d[np.isfinite(d)]) + nothing for name, d in held.items()}
    shown = {name: sizes for name, sizes in told.items() if np.isfinite(sizes[0])}
    best = units.scale("m", float(np.nanmax(list(shown.values()), initial=0.0)))
    below = f"{100.0 * _MOST_ROWS:g} % below"
    heads = f"gap in {best.unit}", "rms", below, "largest", "rms along x", "along y", "along z"
    body = (
        row((name, *(units.number(v * best.factor) if np.isfinite(v) else "" for v in sizes)))
        for name, sizes in shown.items()
    )
    return wide(table(heads, body), "The gap before and after: rms, 95 % quantile, largest, along each axis")


def _sizes(distance: Array) -> tuple[float, ...]:
    """Return rms, 95 % quantile and maximum of distances; NaN without any."""
    if not len(distance):
        return (float("nan"),) * 3
    return float(np.sqrt(np.mean(distance**2))), float(np.quantile(distance, _MOST_ROWS)), float(distance.max())


def _along(gap: Array) -> tuple[float, ...]:
    return tuple(np.sqrt(np.mean(gap**2, axis=0)).tolist()) if len(gap) else (float("nan"),) * 3


def effects_table(diagnosis: Diagnosis) -> str:
    """Show every candidate: status, probability, share, and below it what is known of it."""
    heads = "effect", "status", "probability", "share of the gap, on rows held out (95 %)"
    return wide(table(heads, (_effect(f, diagnosis) for f in by_status(diagnosis)), words=2), "Every effect")


def _effect(finding: Finding, diagnosis: Diagnosis) -> str:
    quiet = finding.status in ("not_found", "not_testable")
    details = "".join(_known(finding, diagnosis))
    looks = " ".join([*(["tr-quiet"] if quiet else []), *(["tr-open"] if details else [])])
    cells = f"<td>{_span(finding.name, not quiet)}</td>"
    if finding.status == "not_testable":
        wanted = escape(needs(finding, diagnosis.joint_names))
        cells += f"<td class=tr-word>not testable</td><td colspan=2>needs {wanted}</td>"
    else:
        share = units.percent(finding.shrinkage)
        if finding.shrinkage_ci95 is not None:
            share += f" ({units.interval(finding.shrinkage_ci95)} %)"
        cells += f"<td class=tr-word>{STATUS[told_as(finding)]}</td>"
        cells += f"<td class=tr-n>{escape(units.probability(finding.probability))}</td>"
        cells += f"<td class=tr-n>{escape(share)}</td>"
    row = f'<tr class="{looks}">{cells}</tr>'
    return row + (f"<tr><td colspan=4 class=tr-details>{details}</td></tr>" if details else "")


def _span(name: str, found: bool) -> str:
    return f'<span class="tr-found">{escape(name)}</span>' if found else escape(name)


def _known(finding: Finding, diagnosis: Diagnosis) -> Iterator[str]:
    if told := rivals(finding, diagnosis):
        yield _line(told)
    if described := law(finding):
        yield _line(described)
    if finding.locations:
        yield _line(f"where: {places(finding)}")
    if sized := in_joints(finding):
        yield _line(sized)
    known = parameters(finding)
    if known.heading:
        yield _line(known.heading)
    if known.shown:
        yield f"<table><tbody>{''.join(row(map(escape, r), words=len(r)) for r in known.shown)}</tbody></table>"
    if known.more:
        yield _line(f"and {known.more} more, listed in the JSON")
    if known.undetermined:
        yield _line(f"not determined by these data: {known.undetermined}")
    if known.unseen:
        yield _line(known.unseen)


def _line(sentence: str) -> str:
    return f"<div>{escape(sentence)}</div>"


def outliers_table(diagnosis: Diagnosis) -> str:
    """Show the rows that were set aside: how far off they are, before and after."""
    rows = diagnosis.rows
    chosen = np.flatnonzero(np.isin(rows.rows, diagnosis.outliers))
    before = np.linalg.norm(rows.gap[chosen, :3], axis=1)
    after = np.linalg.norm(rows.remainder[chosen, :3], axis=1)
    best = units.scale("m", float(max(before.max(initial=0.0), after.max(initial=0.0))))
    sizes = ("gap", "remainder", *(f"remainder {a}" for a in "xyz"))
    heads = ("row in the file", *(f"{size} ({best.unit})" for size in sizes))
    body = []
    for k, i in enumerate(chosen[:_MOST_OUTLIERS]):
        cells = (before[k], after[k], *rows.remainder[i, :3])
        values = (units.number(float(v) * best.factor) for v in cells)
        body.append(row((str(int(rows.rows[i])), *values), words=0))
    more = len(chosen) - len(body)
    rest = f"<p class=tr-muted>and {more} more, listed in the JSON</p>" if more > 0 else ""
    return wide(table(heads, body, words=0), "Rows that were set aside") + rest
