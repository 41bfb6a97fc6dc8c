"""Tables of a diagnosis' page as text: sizes of the gap, outliers, frames, correlations."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.report import motion_words, units, words

if TYPE_CHECKING:
    from thermal_robot.diagnosis.result import Diagnosis
    from thermal_robot.diagnosis.values import Finding, HeldOut
    from thermal_robot.motion.result import MotionDiagnosis

Table = dict[str, Any]
"""``label``, ``heads``, ``rows`` of cells, and how many of the first columns hold ``words``, not numbers."""

Number = tuple[str, str, str, list[str]]
"""Kind of a figure in large letters, its heading, its value, and what stands below it."""

_MOST_ROWS = 0.95  # quantile of the gap that a table tells beside rms and largest
_MOST_OUTLIERS = 40
_STRONG = 0.5  # of a correlation: below it a third parameter changes little by what is known of another
_MOST_CORRELATIONS = 10
_FRAMES = {"base": "root frame of the robot, as the instrument sees it", "tool": "target, in the tool frame"}


def numbers(diagnosis: Diagnosis) -> list[Number]:
    """Rms gap before and after and held-out shrinkage: kind, heading, value and remark."""
    gap = diagnosis.gap
    before, after, floor = units.together((gap.rms_before, gap.rms_after, gap.noise_floor), "m")
    turned = ["", ""]
    if gap.orientation_before is not None:
        pair = units.together((gap.orientation_before, gap.orientation_after), "rad")
        turned = [f"orientation {value}" for value in pair]
    kinds = [f"noise floor, {k.kind} {units.quantity(k.noise_floor, k.unit)}" for k in gap.kinds]
    return [
        ("before", "Gap before, rms", before, [turned[0]]),
        ("after", "Gap after, rms", after, [turned[1], *([f"noise floor {floor}"] if len(kinds) < 2 else []), *kinds]),
        _shrinkage("rows", gap.held_out, "m"),
    ]


def motion_numbers(diagnosis: MotionDiagnosis) -> list[Number]:
    """Rms gap of all joints before and after and held-out shrinkage: kind, heading, value and remark."""
    noise = max((one.noise for one in diagnosis.joints.values()), default=0.0)
    before, after, floor = units.together((diagnosis.rms_before, diagnosis.rms_after, noise), diagnosis.unit)
    return [
        ("before", "Gap before, rms of all joints", before, []),
        ("after", "Gap after", after, [f"noise of a reading at most {floor}"]),
        _shrinkage("motions", diagnosis.held_out, diagnosis.unit),
    ]


def _shrinkage(of: str, held: HeldOut, unit: str) -> Number:
    pair = units.together((held.rms_before, held.rms_after), unit)
    bounds = f"95 % interval {units.interval(held.shrinkage_ci95)} %"
    return "held", f"Shrinkage on {of} held out", units.percent(held.shrinkage), [bounds, " → ".join(pair)]


def effects(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """Every effect with its status, probability, share, and what else is known of it, found ones first."""
    return [_effect(diagnosis, finding) for finding in words.by_status(diagnosis)]


def _effect(diagnosis: Diagnosis, finding: Finding) -> dict[str, Any]:
    before, known, after = words.described(finding, diagnosis)
    bounds = f" ({units.interval(finding.shrinkage_ci95)} %)" if finding.shrinkage_ci95 is not None else ""
    untestable = finding.status == "not_testable"
    return {
        "name": finding.name,
        "quiet": finding.status in ("not_found", "not_testable"),
        "open": bool(before or known or after),
        "needs": f"needs {words.needs(finding, diagnosis.joint_names)}" if untestable else None,
        "status": words.STATUS[words.displayed_status(finding)],
        "probability": units.probability(finding.probability),
        "share": f"{units.percent(finding.shrinkage)}{bounds}",
        "before": [line for line, _ in before],
        "known": known,
        "after": [line for line, _ in after],
    }


def motion_effects(diagnosis: MotionDiagnosis) -> list[dict[str, Any]]:
    """Every effect with its status, probability, share, and what it means, found ones first."""
    return [_motion_effect(diagnosis, finding) for finding in motion_words.effects(diagnosis)]


def _motion_effect(diagnosis: MotionDiagnosis, finding: Finding) -> dict[str, Any]:
    told = finding.status in motion_words.TOLD
    means = motion_words.MEANS.get(finding.name, "")
    moves = motion_words.places(diagnosis, finding.name) if told else ""
    rivals = f"These data cannot tell it from {', '.join(finding.confounded_with)}." if finding.confounded_with else ""
    known = motion_words.parameters(diagnosis, finding.name) if told else []
    return {
        "name": finding.name,
        "quiet": not told,
        "open": told and bool(known or means),
        "needs": motion_words.needed(diagnosis, finding) if finding.status == "not_testable" else None,
        "status": words.STATUS[words.displayed_status(finding)],
        "probability": units.probability(finding.probability),
        "share": units.percent(finding.shrinkage) if told else "",
        "before": list(filter(None, (means, rivals))),
        "known": known,
        "after": [f"moves {moves}"] if moves else [],
    }


def motion_gaps(diagnosis: MotionDiagnosis) -> Table:
    """Rms gap of each joint before, after and held out, and its noise."""
    heads, rows = motion_words.gaps(diagnosis)
    return {"label": "Rms gap of each joint", "heads": heads, "rows": rows}


def extremes(diagnosis: Diagnosis) -> Table:
    """Table of the distance measured to predicted, before and after: rms, 95 % quantile, maximum, rms along each axis.

    Rows set aside are left out. Of rows held out a diagnosis has distances alone.
    """
    rows = diagnosis.rows
    kept, sizes = ~rows.outliers, {}
    for name, gap in (("before", rows.gap), ("after", rows.remainder)):
        along = np.sqrt(np.mean(gap[kept, :3] ** 2, axis=0)) if kept.any() else ()
        sizes[f"all rows, {name}"] = (*_sizes(np.linalg.norm(gap[kept, :3], axis=1)), *along)
    for name, distance in (("before", rows.held_out_before), ("after", rows.held_out_after)):
        sizes[f"rows held out, {name}"] = _sizes(distance[np.isfinite(distance)])
    best = units.scale("m", max((size for line in sizes.values() for size in line), default=0.0))
    told = ("rms", "95 % below", "largest", "rms along x", "along y", "along z")
    return {
        "label": "The gap before and after: rms, 95 % quantile, largest, along each axis",
        "heads": ("", *(f"{size} ({best.unit})" for size in told)),
        "rows": [
            [name, *(units.number(size * best.factor) for size in line), *[""] * (6 - len(line))]
            for name, line in sizes.items()
            if line
        ],
    }


def _sizes(distance: Array) -> tuple[float, ...]:
    """Rms, 95 % quantile and maximum of distances; empty without any."""
    if not len(distance):
        return ()
    return float(np.sqrt(np.mean(distance**2))), float(np.quantile(distance, _MOST_ROWS)), float(distance.max())


def set_aside(diagnosis: Diagnosis) -> tuple[Table, int]:
    """Table of the outliers' distances before and after correction, and the number of those that it does not list."""
    rows = diagnosis.rows
    chosen = np.isin(rows.rows, diagnosis.outliers)
    before, after = (np.linalg.norm(part[chosen, :3], axis=1) for part in (rows.gap, rows.remainder))
    best = units.scale("m", max(before.max(initial=0.0), after.max(initial=0.0)))
    cells = best.factor * np.column_stack([before, after, rows.remainder[chosen, :3]])
    sizes = ("gap", "remainder", *(f"remainder {axis}" for axis in "xyz"))
    told = [
        [f"row {row}", *map(units.number, values)]
        for row, values in zip(rows.rows[chosen].tolist(), cells.tolist(), strict=True)
    ]
    table = {
        "label": "Rows that were set aside",
        "heads": ("in the file", *(f"{size} ({best.unit})" for size in sizes)),
        "rows": told[:_MOST_OUTLIERS],
    }
    return table, max(len(told) - _MOST_OUTLIERS, 0)


_HOLDS = {"placements": "places of joints", "zeros": "zeros of joints", "ticks": "zeros in ticks of an encoder"}


def files(diagnosis: Diagnosis) -> Table:
    """Shrinkage that is expected of each kind of robot file alone, and what it leaves, by how the file is written."""
    ways: dict[str, dict[str, str]] = {}
    kinds: dict[str, str] = {}
    sizes = units.together((told.rms_after for told in diagnosis.files), "m")
    for told, left in zip(diagnosis.files, sizes, strict=True):
        way = "fitted alone (--alone)" if told.alone else "all parameters (--min-sigma 0)"
        if told.min_sigma is not None:
            way = f"beyond {told.min_sigma:g} σ (as written)"
        options = ", ".join(name.replace("_", "-") for name in told.files)
        kinds[told.holds] = f"{_HOLDS[told.holds]}: {options}"
        bounds = f"{units.percent(told.shrinkage)} ({units.interval(told.shrinkage_ci95)} %)"
        ways.setdefault(way, {})[told.holds] = f"{bounds}, {left}"
    order = sorted(ways, key=lambda way: "as written" not in way)
    return {
        "label": "Expected of a robot file alone: shrinkage on rows held out (95 %), and what is left",
        "heads": ("file", *order),
        "rows": [[kinds[holds], *(ways[way].get(holds, "") for way in order)] for holds in kinds],
    }


def frames(diagnosis: Diagnosis) -> Table:
    """Table of the fitted poses of base and target: mm, and roll, pitch and yaw in degrees."""
    rows = []
    for name, pose in diagnosis.frames.iterrows():
        turns = pose[["roll", "pitch", "yaw"]]
        told = [_fixed(1e3 * value, 3) for value in pose[["x", "y", "z"]]]
        told += [_fixed(np.degrees(value), 4) if np.isfinite(value) else "" for value in turns]
        rows.append([_FRAMES[str(name)], *told])
    heads = ("frame", "x (mm)", "y (mm)", "z (mm)", "roll (°)", "pitch (°)", "yaw (°)")
    return {"label": "Fitted frames", "heads": heads, "rows": rows}


def _fixed(value: float, digits: int) -> str:
    """Format a number with fixed decimals; what rounds to zero has no sign."""
    return f"{round(value, digits) + 0.0:.{digits}f}".replace("-", "−")


def correlations(diagnosis: Diagnosis) -> tuple[Table, str]:
    """Table of the ten strongest correlations of parameters beyond ±0.5, and a sentence on those not shown."""
    covariance = diagnosis.covariance
    std = np.sqrt(covariance.to_numpy().diagonal())
    first, second = np.triu_indices(len(std), 1)
    correlation = (covariance.to_numpy() / np.outer(std, std))[first, second]
    order = np.argsort(-np.abs(correlation), kind="stable")
    strong = [k for k in order if abs(correlation[k]) > _STRONG]
    names = [f"{parameter} ({effect})" for effect, parameter in covariance.index]
    rows = [[names[first[k]], names[second[k]], _fixed(correlation[k], 2)] for k in strong[:_MOST_CORRELATIONS]]
    heads = ("parameter", "known only together with", "correlation")
    table = {"label": "Strongest correlations of the parameters", "heads": heads, "rows": rows, "words": 2}
    if not strong:
        return table, f"No two parameters have a correlation beyond ±{_STRONG}." if len(order) else ""
    hidden = len(strong) - len(rows)
    more = f" and {hidden} beyond ±{_STRONG}" if hidden else ""
    return table, f"Not shown: {len(order) - len(strong)} correlations within ±{_STRONG}{more}."
