"""A diagnosis of motion as an HTML page that needs nothing beside itself, and as a piece for a notebook."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from thermal_robot.report import motion_plots as plots
from thermal_robot.report import motion_words as words
from thermal_robot.report import units
from thermal_robot.report.page import render
from thermal_robot.report.words import STATUS, displayed_status, one_sigma

if TYPE_CHECKING:
    from thermal_robot.diagnosis.values import Finding
    from thermal_robot.motion.result import MotionDiagnosis


def motion_html(
    diagnosis: MotionDiagnosis, generated: str | None = None, files: Mapping[str, str] | None = None
) -> str:
    """Write a diagnosis of motion as an HTML page that needs nothing beside itself and prints on A4.

    Parameters
    ----------
    diagnosis
        The result.
    generated, files
        As for :func:`~thermal_robot.report.page.html`.
    """
    title = f"Motion of {diagnosis.log.name or diagnosis.log.robot.name}"
    return render("motion.html", _shown(diagnosis), title=title, generated=generated, files=files)


def motion_fragment(diagnosis: MotionDiagnosis) -> str:
    """Write a diagnosis of motion as HTML for a notebook: verdict, numbers, gaps, effects."""
    return render("motion.html", _shown(diagnosis))


def _shown(d: MotionDiagnosis) -> dict[str, Any]:
    heads, rows = words.gaps(d)
    return {
        "d": d,
        "say": words,
        "drawn": plots,
        "numbers": _numbers(d),
        "gaps": {"label": "Rms gap of each joint", "heads": heads, "rows": rows},
        "effects": [_effect(d, one) for one in words.effects(d)],
        "one_sigma": one_sigma(d),
    }


def _numbers(d: MotionDiagnosis) -> list[tuple[str, str, str, list[str]]]:
    """Return the rms gap before and after and the shrinkage held out: kind, heading, value and what stands below it."""
    held, noise = d.held_out, max((one.noise for one in d.joints.values()), default=0.0)
    before, after, floor = units.together((d.rms_before, d.rms_after, noise), d.unit)
    bounds = f"95 % interval {units.interval(held.shrinkage_ci95)} %".replace(" %", "\N{NO-BREAK SPACE}%")
    pair = " → ".join(units.together((held.rms_before, held.rms_after), d.unit))
    return [
        ("before", "Gap before, rms of all joints", before, []),
        ("after", "Gap after", after, [f"noise of a reading at most {floor}"]),
        ("held", "Shrinkage on motions held out", units.percent(held.shrinkage), [bounds, pair]),
    ]


def _effect(d: MotionDiagnosis, one: Finding) -> dict[str, Any]:
    """Return the template fields of one effect for the table of all effects."""
    status = displayed_status(one)
    told = status in words.TOLD
    means, moves = words.MEANS.get(one.name, ""), words.places(d, one.name) if told else ""
    rivals = f"These data cannot tell it from {', '.join(one.confounded_with)}." if one.confounded_with else ""
    known = words.parameters(d, one.name) if told else []
    return {
        "name": one.name,
        "quiet": not told,
        "open": told and bool(known or means),
        "needs": words.needed(d, one) if one.status == "not_testable" else None,
        "status": STATUS[status],
        "probability": units.probability(one.probability),
        "share": units.percent(one.shrinkage) if told else "",
        "before": list(filter(None, (means, rivals))),
        "known": known,
        "after": [f"moves {moves}"] if moves else [],
    }
