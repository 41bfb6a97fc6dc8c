"""A calibration as plain text."""

from __future__ import annotations

from collections.abc import Iterator
from textwrap import fill
from typing import TYPE_CHECKING

from thermal_robot.report import units
from thermal_robot.report.words import in_words

if TYPE_CHECKING:
    from thermal_robot.diagnosis.calibration import Calibrated, Calibration

_WIDTH = 96


def calibration_text(calibration: Calibration) -> str:
    """Write a calibration for the person who measured.

    Parameters
    ----------
    calibration
        The result.

    Returns
    -------
    str
        Plain text without a newline at the end: how far the gap shrinks on the rows that were fitted, every parameter
        with one standard deviation, and what the data do not tell.
    """
    return "\n".join(_lines(calibration))


def _lines(found: Calibration) -> Iterator[str]:
    yield fill(
        f"{found.robot}, {found.tool_frame}: {found.samples} samples of {found.measures}, {len(found.outliers)} set "
        f"aside. Fitted as asked, not chosen: {in_words([effect.title for effect in found.effects])}.",
        _WIDTH,
    )
    yield _shrunk("gap, rms", found.rms_before, found.rms_after, "m")
    if found.turned_before is not None and found.turned_after is not None:
        yield _shrunk("turn, rms", found.turned_before, found.turned_after, "rad")
    yield f"noise, per axis {units.quantity(found.noise, 'm')}"
    if found.unexplained:
        yield fill(
            "What is left is not noise: something else is at work, and deviations are widened by what it may do. "
            "diagnose() says what it may be.",
            _WIDTH,
        )
    for effect in found.effects:
        yield ""
        yield from _effect(effect)
    for warning in found.warnings:
        yield fill(f"Note: {warning}", _WIDTH)


def _shrunk(name: str, before: float, after: float, unit: str) -> str:
    return f"{name:<16}{' → '.join(units.together([before, after], unit))} on the rows that were fitted"


def _effect(effect: Calibrated) -> Iterator[str]:
    part = f", a part of {effect.inside}" if effect.inside not in ("", effect.name) else ""
    yield f"{effect.title} ({effect.name}{part}), ± one standard deviation"
    known = [p for p in effect.parameters if p.identified]
    width = max((len(p.name) for p in known), default=0)
    for p in known:
        yield f"  {p.name:<{width}}  {units.estimate(p, known)}"
    hidden = [p.name for p in effect.parameters if not p.identified]
    for label, names in (("not determined", hidden), ("not seen apart from the others or the frames", effect.unseen)):
        if names:
            yield fill(f"{label}: {in_words(names, between='; ')}", _WIDTH, initial_indent="  ", subsequent_indent="  ")
