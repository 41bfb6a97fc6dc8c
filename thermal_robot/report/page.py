"""A diagnosis as HTML: a page to hand on, and a piece of a notebook."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from html import escape
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.report import units
from thermal_robot.report.drawing import thinned
from thermal_robot.report.html_parts import (
    bullets,
    checksums,
    css,
    document,
    figure,
    paragraph,
    row,
    signature,
    table,
    wide,
)
from thermal_robot.report.plots import (
    exaggeration,
    mapped,
    overview,
    plot_how_far,
    plot_map,
    plot_remainder,
    plot_where,
    plot_which,
)
from thermal_robot.report.words import (
    STATUS,
    by_status,
    described,
    details,
    facts,
    hardest,
    laws,
    needs,
    noise_of,
    one_sigma,
    sentences,
    told_as,
    turned,
    with_aside,
)

if TYPE_CHECKING:
    from thermal_robot.diagnosis.result import Diagnosis
    from thermal_robot.diagnosis.values import Finding
    from thermal_robot.shapes.arm import Arm


def html(diagnosis: Diagnosis, generated: str | None = None, files: Mapping[str, str] | None = None) -> str:
    """Write a diagnosis as a page that needs nothing beside itself and prints on A4.

    Of a table that does not fit the robot it says what is wrong with it and what to do, and nothing of the robot.

    Parameters
    ----------
    diagnosis
        The result.
    generated
        When it was made, in the words that shall stand in the footer; nothing is said where absent, so that equal
        diagnoses give equal pages.
    files
        Names of the files that the diagnosis was made from, with the SHA-256 of each, for the footer.

    Returns
    -------
    str
        A complete HTML document.
    """
    name, arm = diagnosis.campaign or diagnosis.robot, arm_figure(diagnosis)
    body = "\n".join(_whole(diagnosis, arm, checksums(files or {}) + escape(signature(generated))))
    return document(f"Diagnosis of {name}", body, script() if arm else "")


def fragment(diagnosis: Diagnosis) -> str:
    """Write a diagnosis as a piece of HTML for a notebook: verdict, numbers, one figure, effects.

    Of a table that does not fit the robot it says what is wrong with it and what to do, and nothing of the robot.

    Returns
    -------
    str
        One ``<div>`` with its own style, which touches nothing around it.
    """
    body = "\n".join(
        (
            *map(paragraph, turned(diagnosis)),
            paragraph(diagnosis.summary, strong=True),
            *(_in_short(diagnosis) if diagnosis.usable else (paragraph(diagnosis.advice), _facts(diagnosis))),
            *(['<p class="tr-kicker">Warnings</p>', bullets(diagnosis.warnings)] if diagnosis.warnings else []),
        )
    )
    return f'<div class="thermal-robot">\n<style>\n{css("page.css")}</style>\n{body}\n</div>'


def _in_short(diagnosis: Diagnosis) -> Iterator[str]:
    """Yield what a notebook shows of a robot between the verdict and the warnings."""
    yield from map(paragraph, details(diagnosis))
    yield numbers(diagnosis)
    yield figure(overview(diagnosis, headline=False), f"Overview: {diagnosis.summary}")
    yield effects_table(diagnosis)
    yield '<p class="tr-kicker">Unexplained</p>'
    yield from _unexplained(diagnosis)


def _whole(diagnosis: Diagnosis, arm: str, footer: str) -> Iterator[str]:
    yield '<header><div class="tr-kicker">Where the gap lies, what causes it, how far it shrinks</div>'
    yield from map(paragraph, turned(diagnosis))
    yield f"<h1>{escape(diagnosis.summary)}</h1>"
    yield from map(paragraph, details(diagnosis))
    yield _facts(diagnosis)
    yield (numbers(diagnosis) if diagnosis.usable else "") + "</header>"
    if diagnosis.usable:
        yield from _of_the_robot(diagnosis, arm)
    yield from _next(diagnosis)
    if diagnosis.usable and diagnosis.outliers:
        yield f"<section><h2>Set aside</h2>{outliers_table(diagnosis)}</section>"
    if diagnosis.warnings:
        yield f"<section><h2>Warnings</h2>{bullets(diagnosis.warnings)}</section>"
    yield f"<footer>{footer}</footer>"


def _of_the_robot(diagnosis: Diagnosis, arm: str) -> Iterator[str]:
    """Yield the sections that hold only where robot and table describe the same motion."""
    yield "<section><h2>How far</h2>"
    held = diagnosis.gap.held_out
    yield paragraph(
        "The gap is the distance between measured and predicted pose. Shrinkage is the share of its mean square that "
        f"the correction removes on rows that were not used for the fit ({held.scheme}, {held.folds} folds). "
        "Figures of rows held out have the noise of these rows in them."
    )
    if told := with_aside(diagnosis):
        yield paragraph(f"The gap on rows held out {told}.")
    if told := hardest(diagnosis):
        yield paragraph(f"Rows held out in the hardest way: {told}.")
    yield paragraph(f"Noise alone would leave {noise_of(diagnosis)}.")
    yield figure(plot_how_far(diagnosis), "Distribution of the gap before and after") + extremes_table(diagnosis)
    yield "</section><section><h2>Which</h2>"
    yield figure(plot_which(diagnosis), "Share of the gap and probability of every effect")
    yield effects_table(diagnosis)
    yield (paragraph(told) if (told := one_sigma(diagnosis)) else "") + "</section>"
    yield f"<section><h2>Where</h2>{arm}"
    yield figure(plot_where(diagnosis), "Shares of the gap along the chain, by axis and by quantity")
    yield figure(plot_map(diagnosis), "The gap as arrows at the positions of the tool") + "</section>"
    yield "<section><h2>Unexplained</h2>"
    yield from _unexplained(diagnosis)
    yield figure(plot_remainder(diagnosis), "The remainder in the order of measurement")
    if diagnosis.fit is not None:
        for law in laws(diagnosis):
            yield figure(diagnosis.explain(law.name), f"{law.name}: the error there against what it follows")
    yield "</section>"
    yield from model_section(diagnosis)
    yield from criteria_section(diagnosis)


def _facts(diagnosis: Diagnosis) -> str:
    return f"<dl>{''.join(f'<dt>{k}</dt><dd>{escape(v)}</dd>' for k, v in facts(diagnosis).items())}</dl>"


def _unexplained(diagnosis: Diagnosis) -> Iterator[str]:
    said = "".join(paragraph(s) for s in sentences(diagnosis))
    yield f'<div class="tr-flag">{said}</div>' if diagnosis.unexplained.flagged else said


def _next(diagnosis: Diagnosis) -> Iterator[str]:
    apart = [f"to tell apart: {', '.join(group)}" for group in (diagnosis.separates if diagnosis.usable else ())]
    if not diagnosis.advice and not apart:
        return
    advice = paragraph(diagnosis.advice) if diagnosis.advice else ""
    yield f"<section><h2>Next</h2>{advice}{bullets(apart)}</section>"


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
    before, shown, after = described(finding, diagnosis)
    yield from (_line(told) for told, _ in before)
    if shown:
        yield f"<table><tbody>{''.join(row(map(escape, r), words=len(r)) for r in shown)}</tbody></table>"
    yield from (_line(told) for told, _ in after)


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


_STRONG = 0.5  # of a correlation: below it a third parameter changes little by what is known of another
_MOST_CORRELATIONS = 10
_FRAMES = {"base": "root frame of the robot, as the instrument sees it", "tool": "target, in the tool frame"}


def model_section(diagnosis: Diagnosis) -> Iterator[str]:
    """Yield fitted frames and strongest correlations; nothing without a fit."""
    if not diagnosis.usable or diagnosis.fit is None:
        return
    yield f"<section><h2>The model</h2>{frames_table(diagnosis)}"
    yield (correlations_table(diagnosis) if diagnosis.model.spread is not None else "") + "</section>"


def frames_table(diagnosis: Diagnosis) -> str:
    """Show where the robot stands and where the target sits: mm, and roll, pitch and yaw in degrees."""
    heads = "frame", "x (mm)", "y (mm)", "z (mm)", "roll (°)", "pitch (°)", "yaw (°)"
    rows = []
    for name, pose in diagnosis.frames.iterrows():
        told = [_fixed(1e3 * v, 3) for v in pose[["x", "y", "z"]]]
        told += [_fixed(np.degrees(v), 4) if np.isfinite(v) else "" for v in pose[["roll", "pitch", "yaw"]]]
        rows.append(row((_FRAMES[str(name)], *told)))
    return wide(table(heads, rows), "Fitted frames")


def _fixed(value: float, digits: int) -> str:
    """Write a figure with so many decimals; what rounds to zero has no sign."""
    return f"{round(value, digits) + 0.0:.{digits}f}".replace("-", "−")


def correlations_table(diagnosis: Diagnosis) -> str:
    """Show the strongest correlations between the parameters, at most ten; in words how many are not shown."""
    covariance = diagnosis.covariance
    if len(covariance) < 2:
        return ""
    std = np.sqrt(covariance.to_numpy().diagonal())
    correlation = covariance.to_numpy() / np.outer(std, std)
    first, second = np.triu_indices(len(std), 1)
    size = np.abs(correlation[first, second])
    order = np.argsort(-size, kind="stable")
    strong = [k for k in order if size[k] > _STRONG]
    if not strong:
        return paragraph(f"No two parameters have a correlation beyond ±{_STRONG}.")
    rows = []
    for k in strong[:_MOST_CORRELATIONS]:
        pair = (escape(_called(covariance.index[i])) for i in (first[k], second[k]))
        rows.append(row((*pair, _fixed(correlation[first[k], second[k]], 2)), words=2))
    heads = "parameter", "known only together with", "correlation"
    hidden = len(strong) - min(len(strong), _MOST_CORRELATIONS)
    more = f" and {hidden} beyond ±{_STRONG}" if hidden else ""
    rest = paragraph(f"Not shown: {len(size) - len(strong)} correlations within ±{_STRONG}{more}.")
    return wide(table(heads, rows, words=2), "Strongest correlations of the parameters") + rest


def _called(name: tuple[str, str]) -> str:
    return f"{name[1]} ({name[0]})"


def criteria_section(diagnosis: Diagnosis) -> Iterator[str]:
    """Yield a table for each kind of criterion, and what a reader must know of them; nothing without repeats."""
    found = diagnosis.performance
    if found is None:
        return
    yield f"<section><h2>ISO 9283</h2>{paragraph(f'{found.summary}.')}"
    for shown in found.tables:
        yield f'<p class="tr-caption">{escape(shown.heading)}</p>'
        yield wide(table(shown.head, (row((escape(label), *cells)) for label, *cells in shown.rows)), shown.heading)
        yield paragraph(f"{shown.rest}.") if shown.rest else ""
    yield f"{bullets(found.notes)}</section>"


_ROWS = 150  # of a long campaign that are drawn: their postures are most of what the drawing weighs
_WORTH = 0.005  # share of the gap from which on a place is named in the drawing
_LONGEST = 0.12  # of the workspace's extent, for an arrow of the gap's 95th percentile: there are arrows of all rows
_TURN = '<span class="tr-screen">Drag to turn. </span>'  # paper cannot be turned
_DECIMALS = 4  # of m: a tenth of a millimetre is less than a pixel


def script() -> str:
    """Return the page's one script, which ships with this room."""
    return files(__package__).joinpath("arm.js").read_text(encoding="utf-8")


def arm_figure(diagnosis: Diagnosis) -> str:
    """Return the drawing as HTML: a canvas, its controls, its values; :func:`script` draws it.

    Empty where nothing is known of places, or no two places with a gap are left.
    """
    shown = mapped(diagnosis)
    factor = exaggeration(diagnosis, shown, _LONGEST)
    chosen = shown[thinned(len(shown), _ROWS)]
    arm = diagnosis.arm(chosen) if factor is not None else None
    if arm is None or factor is None:
        return ""
    values = _values(diagnosis, arm, chosen) | {"factor": factor}
    left = len(diagnosis.rows.rows) - len(shown)
    return (
        '<figure id="tr-arm" class="tr-arm">'
        '<canvas tabindex="0" role="img" aria-label="The arm and its gap in space; arrow keys turn it"></canvas>'
        f"{_controls(len(chosen), len(shown), left)}{_key(arm)}"
        "<noscript><p>This drawing needs JavaScript; the figures below show the same without it.</p></noscript>"
        f'</figure>\n<script type="application/json" id="tr-arm-data">{as_data(values)}</script>'
    )


def as_data(values: Any) -> str:
    """Return values as JSON that no name in it can end: within a page it holds neither ``<`` nor ``/``."""
    plain = json.dumps(values, separators=(",", ":"), allow_nan=False)
    return plain.replace("<", r"\u003c").replace(">", r"\u003e").replace("&", r"\u0026").replace("/", r"\/")


def _values(diagnosis: Diagnosis, arm: Arm, chosen: NDArray[np.int64]) -> dict[str, Any]:
    rows = diagnosis.rows
    links = [_place(name, share) for name, share in zip(arm.links, arm.link_shares, strict=True)]
    joints = [
        _place(name, share) | {"moves": int(link)}
        for name, share, link in zip(arm.joints, arm.joint_shares, arm.moves, strict=True)
    ]
    index = {name: k for k, name in enumerate(arm.links)}
    shapes = [
        {"link": index[s.link], "corners": _short(s.corners), "faces": s.faces.ravel().tolist()} for s in arm.hulls
    ]
    postures = [
        {
            "poses": _short(arm.poses[k, :, :3]),
            "at": _short(rows.position[i]),
            "before": _digits(rows.gap[i, :3]),
            "after": _digits(rows.remainder[i, :3]),
            "told": _row_told(diagnosis, int(i)),
        }
        for k, i in enumerate(chosen)
    ]
    ends = {"base": _place("base", arm.base_share), "tool": _place("tool", arm.tool_share)}
    return {"links": links, "joints": joints, "solids": shapes, "rows": postures, **ends}


def _place(name: str, share: float) -> dict[str, Any]:
    named = f"{name} {units.percent(share)}" if share >= _WORTH else ""
    return {"share": round(float(share), 4), "named": named}


def _short(values: Array) -> list[float]:
    return np.round(values, _DECIMALS).ravel().tolist()


def _digits(gap: Array) -> list[float]:
    """Three significant digits are more than a screen shows."""
    return [float(f"{v:.3g}") for v in gap]


def _row_told(diagnosis: Diagnosis, row: int) -> str:
    sizes = (float(np.linalg.norm(gap[row, :3])) for gap in (diagnosis.rows.gap, diagnosis.rows.remainder))
    before, after = units.together(tuple(sizes), "m")
    return f"row {int(diagnosis.rows.rows[row])}: gap {before} before, {after} after"


def _controls(drawn: int, rows: int, left: int) -> str:
    some = f"{drawn} of {rows} rows are drawn" if drawn < rows else ""
    aside = f"{left} set aside {'is' if left == 1 else 'are'} not drawn" if left else ""
    said = f"({'; '.join(filter(None, (some, aside)))})" if some or aside else ""
    return (
        '<div class="tr-controls">'
        f'<label class="tr-screen">row <input data-tr="row" type="range" min="0" max="{drawn - 1}" value="0"></label>'
        f'<output data-tr="told"></output><span>{escape(said)}</span>'
        '<label><input data-tr="before" type="checkbox" checked><i class="tr-is-before"></i>gap before</label>'
        '<label><input data-tr="after" type="checkbox" checked><i class="tr-is-after"></i>after</label>'
        '<label>arrows <input data-tr="longer" type="range" min="0.25" max="4" step="0.25" value="1"></label>'
        '<output data-tr="times"></output>'
        '<button type="button" data-tr="nearer" aria-label="nearer">+</button>'
        '<button type="button" data-tr="farther" aria-label="farther">−</button>'
        '<button type="button" data-tr="reset">reset</button></div>'
    )


def _key(arm: Arm) -> str:
    every = (*arm.link_shares, *arm.joint_shares, arm.base_share, arm.tool_share)
    most, seen = float(max(every)), arm.instrument_share
    beside = f" At the instrument: {units.percent(seen)}, not drawn." if seen >= _WORTH else ""
    if most < _WORTH:
        return f"<figcaption>{_TURN}No place on the arm carries a share of the gap.{beside}</figcaption>"
    ramp = f'0 % <i class="tr-ramp"></i> {escape(units.percent(most))} of the gap enters there'
    return (
        f"<figcaption>{_TURN}Links, joints, the base (plate) and the tool (line from its frame to the target): "
        f"{ramp}.{escape(beside)}</figcaption>"
    )
