"""The arm on the page, drawn from its URDF and turned by the mouse: places coloured by share, the gap as arrows."""

from __future__ import annotations

import json
from html import escape
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.report import units
from thermal_robot.report.drawing import thinned
from thermal_robot.report.plots_map import exaggeration, mapped

if TYPE_CHECKING:
    from thermal_robot.diagnosis.explained import Arm
    from thermal_robot.diagnosis.result import Diagnosis


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
            "told": _told(diagnosis, int(i)),
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


def _told(diagnosis: Diagnosis, row: int) -> str:
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
