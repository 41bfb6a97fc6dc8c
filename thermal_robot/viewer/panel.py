"""What the panel beside the robot says: of a row, of the places, of the colours."""

from __future__ import annotations

from html import escape

import numpy as np
from numpy.typing import NDArray

from thermal_robot.effects.effect import in_words
from thermal_robot.report.units import percent, quantity
from thermal_robot.viewer.scene import Scene, longest
from thermal_robot.viewer.settings import ASIDE, CHOSEN, CHOSEN_AFTER, GAP, REMAINDER, TOLD, Colour, colours

_BOX = "display:inline-block;width:0.8em;height:0.8em;border-radius:0.2em;margin-right:0.5em;background:rgb{}"
_PART = "margin:0 0.8em 0.7em 0.8em;font-size:0.85em;line-height:1.5"


def of_campaign(scene: Scene) -> str:
    """Return the name of the campaign and what is said of it, as HTML."""
    return f'<div style="{_PART}"><b>{escape(scene.title)}</b><br>{escape(scene.summary)}</div>'


def of_row(scene: Scene, row: int, magnification: float) -> str:
    """Return what is measured in one row, 0..N − 1, as HTML."""
    gap = scene.gap[row]
    along = ", ".join(f"{axis} {quantity(part, 'm')}" for axis, part in zip("xyz", gap.tolist(), strict=True))
    aside = ", set aside as an outlier" if scene.aside[row] else ""
    lines = [
        f"<b>row {scene.rows[row]}</b> of the file{aside}",
        f"{_mark(CHOSEN)}gap {_length(gap)}",
        f"<span style='opacity:0.7'>{along}</span>",
    ]
    if scene.remainder is not None:
        lines.append(f"{_mark(CHOSEN_AFTER)}after correction {_length(scene.remainder[row])}")
    cut = longest(scene.size)
    if magnification * np.linalg.norm(gap) > cut:
        lines.append(f"its arrow is cut at {quantity(cut, 'm')}")
    lines.append(f"drawn {magnification:g} times as long: 100 µm as {quantity(1e-4 * magnification, 'm')}")
    return f'<div style="{_PART}">{"<br>".join(lines)}</div>'


def of_places(scene: Scene) -> str:
    """Return the places with their colours and shares, largest first, as HTML."""
    lines = [
        f"{_mark(colour)}{escape(in_words(*place))}<span style='float:right'>{percent(scene.shares[place])}</span>"
        for place, colour in colours(scene.shares).items()
        if scene.shares[place] >= TOLD
    ]
    if not lines:
        return ""
    return f'<div style="{_PART}"><b>Share of the gap by place</b><br>{"<br>".join(lines)}</div>'


def of_arrows(scene: Scene) -> str:
    """Return what the colours of the arrows mean, as HTML."""
    lines = [f"{_mark(CHOSEN)}{_mark(GAP)}gap: measured − predicted, this row and others"]
    if scene.remainder is not None:
        lines.append(f"{_mark(CHOSEN_AFTER)}{_mark(REMAINDER)}after correction: measured − fitted")
    if scene.aside.any():
        lines.append(f"{_mark(ASIDE)}row set aside")
    return f'<div style="{_PART}">{"<br>".join(lines)}</div>'


def names(scene: Scene) -> dict[tuple[str, str], str]:
    """Return what is written at each place that is named: ``joint_3 37.7 %``."""
    return {place: f"{in_words(*place)} {percent(s)}" for place, s in scene.shares.items() if s >= TOLD}


def _length(vector: NDArray[np.float64]) -> str:
    return quantity(float(np.linalg.norm(vector)), "m")


def _mark(colour: Colour) -> str:
    return f'<span style="{_BOX.format(tuple(colour))}"></span>'
