"""Self-contained HTML pages of results: Jinja2 templates, figures as SVG."""

from __future__ import annotations

import re
from base64 import b64encode
from collections.abc import Iterator, Mapping
from functools import cache
from hashlib import sha256
from html import escape
from importlib.metadata import PackageNotFoundError, version
from importlib.resources import files as shipped
from io import StringIO
from typing import TYPE_CHECKING, Any

import numpy as np
from jinja2 import Environment, PackageLoader
from markupsafe import Markup
from matplotlib.transforms import Bbox

from thermal_robot.arrays import Array
from thermal_robot.report import drawing, motion_words, plots, tables, text_campaigns, units, words

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from thermal_robot.diagnosis.result import Diagnosis
    from thermal_robot.fleet.wear_result import Wear
    from thermal_robot.motion.result import MotionDiagnosis
    from thermal_robot.shapes import Arm

Plain = Mapping[str, Any]
_OPTION = re.compile(r"(?<![\w-])--[a-z][a-z-]*")  # of the command line


def _bound(value: Any) -> Any:
    """Escape text, bind numbers to units (:func:`words.bound`) and mark options as code; what is markup stays."""
    if type(value) is not str:
        return value
    return Markup(_OPTION.sub(r"<code>\g<0></code>", escape(words.bound(value))))


@cache
def _environment() -> Environment:
    loader = PackageLoader(__package__)
    made = Environment(loader=loader, autoescape=True, trim_blocks=True, lstrip_blocks=True, finalize=_bound)
    made.policies["json.dumps_kwargs"] = {"separators": (",", ":"), "allow_nan": False}
    made.filters["svg"] = svg
    made.globals.update(campaigns=text_campaigns, plots=plots, tables=tables, units=units, words=words)
    made.globals["motion_words"] = motion_words
    macros = made.get_template("parts.html").module
    made.globals.update({name: macro for name, macro in vars(macros).items() if not name.startswith("_")})
    made.globals["meaning"] = made.get_template("meanings.html").module
    return made


def render(
    template: str,
    shown: Plain,
    *,
    title: str = "",
    generated: str | None = None,
    files: Mapping[str, str] | None = None,
    script: str = "",
) -> str:
    """Render a Jinja2 template as an HTML page, or a piece for a notebook, with a strict Content-Security-Policy.

    Parameters
    ----------
    template
        Name of a file that extends ``base.html``.
    shown
        Variables of the template by name.
    title
        For the browser's bar; a piece for a notebook, not a page, where empty.
    generated
        When it was made, for the footer; nothing is said where absent, so that equal results give equal pages.
    files
        Names of the files that it was made from, with the SHA-256 of each, for the footer.
    script
        JavaScript that ships with this room.
    """
    runs = f"'sha256-{b64encode(sha256(script.encode()).digest()).decode()}'" if script else "'none'"
    told = {"title": title, "files": files, "signature": signature(generated)}
    code = {"runs": Markup(runs), "script": Markup(script)}
    made = _environment().get_template(template).render(**told, **code, **shown)
    return made if title else _with_styled_cells(made)


_IN_A_CELL = "background: none; border: 0; vertical-align: top; line-height: 1.5"
_PLAIN_CELL = f"{_IN_A_CELL}; text-align: left; white-space: normal"
_STYLES = {
    "table": "table-layout: auto; width: 100%; border: 0; border-collapse: collapse; margin: 0.8rem 0",
    "tr": "background: none",
    "th": f"{_PLAIN_CELL}; padding: 0.4rem 0.9rem 0.4rem 0",
    "td": f"{_PLAIN_CELL}; padding: 0.4rem 0.9rem 0.4rem 0",
    "th tr-n": "text-align: right",
    "td tr-n": "text-align: right; white-space: nowrap",
    "td tr-word": "white-space: nowrap",
    "td tr-details": "padding: 0 0 0.7rem 1.2rem",
    "table inside": "width: auto; margin: 0.2rem 0 0",
    "td inside": "padding: 0 0.9rem 0 0",
}
"""Style of a part of a table by its tag, then by its class or by its being inside of a cell, which add to it.

It stands in the tags themselves, as the style sheets of JupyterLab and VS Code win over that of a piece, and neither
keeps that of a notebook that it does not trust.
"""
_PART = re.compile(r"<(/?)(table|tr|th|td)\b([^>]*)>")


def _with_styled_cells(piece: str) -> str:
    """Return a piece of HTML whose tables carry their style in their own tags."""
    depth = 0

    def styled(part: re.Match[str]) -> str:
        nonlocal depth
        closes, tag, given = part.groups()
        depth += (tag == "table") * (-1 if closes else 1)
        if closes:
            return part[0]
        own = [tag, *(f"{tag} {name}" for name in (*re.findall(r"[\w-]+", given), *["inside"] * (depth > 1)))]
        return f'<{tag}{given} style="{"; ".join(_STYLES[name] for name in own if name in _STYLES)}">'

    return _PART.sub(styled, piece)


def signature(generated: str | None) -> str:
    """Text of a page's footer: versions of the program and its libraries, and when it was made, if given."""
    made_by = []
    for package in ("thermal-robot", "pin", "numpy", "scipy"):
        try:
            made_by.append(f"{package} {version(package)}")
        except PackageNotFoundError:  # run from a source tree that is not installed
            made_by += [package] if not made_by else []
    return ", ".join(filter(None, (*made_by, generated)))


_PIXELS = 106.0  # per inch at most, so that letters are equally large in all figures of a page


def svg(figure: Figure, label: str) -> Markup:
    """Convert a Matplotlib figure to inline SVG (Scalable Vector Graphics), byte for byte reproducible.

    Its colours are those of the page, and its identifiers clash with no other figure's. ``label`` says what it shows,
    for those who cannot see it. Where panels stand beside each other, views of the same drawing follow, a column each,
    which a telephone shows below each other in its place.
    """
    stream = StringIO()
    figure.savefig(stream, format="svg", transparent=True, dpi=200, metadata={"Date": None})
    text = stream.getvalue()
    text = re.sub(r"<metadata>.*?</metadata>", "", text[text.index("<svg") :], flags=re.DOTALL)
    # HTML knows these two namespaces by itself; without their addresses the page holds no address at all
    text = re.sub(r'\sxmlns(:xlink)?="[^"]*"', "", text)
    text = re.sub(r"\s*\n\s*", "\n", text)
    for name in ("ink", "muted", "faint", "paper", "before", "after", "third"):
        colour = getattr(drawing, name.upper())
        text = text.replace(colour, f"var(--tr-{name},{colour})")
    # Matplotlib draws identifiers at random: numbers take their places, with the content's hash before them
    numbers = {name: str(k) for k, name in enumerate(dict.fromkeys(re.findall(r'\bid="([^"]+)"', text)))}
    text = re.sub(r'(\bid="|href="#|url\(#)([^")]+)', lambda m: m[1] + "@" + numbers.get(m[2], m[2]), text)
    name = f"f{sha256(text.encode()).hexdigest()[:8]}-"
    text = text.replace("@", name)
    views = "".join(_view(box, name) for box in _columns(figure))
    width = f"max-width:{figure.get_figwidth() * _PIXELS:.0f}px"
    large = " tr-large" if figure.get_figwidth() > drawing.NARROW else ""
    kind = "tr-figure tr-broad" if views else f"tr-figure{large}"
    shown = f'<svg role="img" aria-label="{escape(label)}" class="{kind}" style="{width}"'
    return Markup(text.replace("<svg", shown, 1).strip() + views)


_EDGE = 0.04  # inches about what a view shows


def _columns(figure: Figure) -> list[tuple[float, float, float, float]]:
    """Left, top, width and height (points) of title, columns of panels, legends; empty with fewer than two columns."""
    beside: dict[int, list[Any]] = {}
    for axes in figure.axes:
        place = axes.get_subplotspec()
        if place is not None and (axes.axison or axes.texts):
            beside.setdefault(place.colspan.start, []).append(axes)
    if len(beside) < 2:
        return []
    parts = [[figure._suptitle]] if figure._suptitle else []  # type: ignore[attr-defined]
    parts += [*(beside[k] for k in sorted(beside)), *([legend] for legend in figure.legends)]
    return [_box(figure, part) for part in parts]


def _box(figure: Figure, part: list[Any]) -> tuple[float, float, float, float]:
    seen = Bbox.union([one.get_tightbbox() for one in part]).transformed(figure.dpi_scale_trans.inverted())
    left, right = max(seen.x0 - _EDGE, 0.0), min(seen.x1 + _EDGE, figure.get_figwidth())
    top, bottom = (figure.get_figheight() - y for y in (seen.y1 + _EDGE, seen.y0 - _EDGE))
    return 72.0 * left, 72.0 * top, 72.0 * (right - left), 72.0 * (bottom - top)


def _view(box: tuple[float, float, float, float], name: str) -> str:
    left, top, width, height = (f"{side:.1f}" for side in box)
    most = f"max-width:{box[2] / 72.0 * _PIXELS:.0f}px"
    drawn = f'<use href="#{name}0"/>'  # the outermost group of all that is drawn
    return f'<svg class="tr-figure tr-part" style="{most}" viewBox="{left} {top} {width} {height}">{drawn}</svg>'


def html(diagnosis: Diagnosis, generated: str | None = None, files: Mapping[str, str] | None = None) -> str:
    """Self-contained HTML page of a diagnosis, for A4.

    If robot and table do not match, the page says why and what to do.

    Parameters
    ----------
    diagnosis
        The result.
    generated
        When it was made, for the footer; nothing is said where absent, so that equal diagnoses give equal pages.
    files
        Names of the files that the diagnosis was made from, with the SHA-256 of each, for the footer.
    """
    drawn = arm_drawing(diagnosis)
    script = shipped(__package__).joinpath("templates/arm.js").read_text(encoding="utf-8") if drawn else ""
    title = f"Diagnosis of {diagnosis.campaign or diagnosis.robot}"
    shown = {"d": diagnosis, "arm": drawn}
    return render("diagnosis.html", shown, title=title, generated=generated, files=files, script=script)


def fragment(diagnosis: Diagnosis) -> str:
    """HTML of a diagnosis for a notebook, one ``<div>`` with its own style: verdict, numbers, figure, effects.

    If robot and table do not match, it says why and what to do.
    """
    return render("diagnosis.html", {"d": diagnosis})


def motion_html(
    diagnosis: MotionDiagnosis, generated: str | None = None, files: Mapping[str, str] | None = None
) -> str:
    """Self-contained HTML page of a diagnosis of motion, for A4.

    Parameters
    ----------
    diagnosis
        The result.
    generated, files
        As for :func:`html`.
    """
    title = f"Motion of {diagnosis.log.name or diagnosis.log.robot.name}"
    return render("motion.html", {"d": diagnosis}, title=title, generated=generated, files=files)


def motion_fragment(diagnosis: MotionDiagnosis) -> str:
    """HTML of a diagnosis of motion for a notebook, one ``<div>``: verdict, numbers, gaps, effects."""
    return render("motion.html", {"d": diagnosis})


_ROWS = 150  # of a long campaign that are drawn: their postures are most of what the drawing weighs
_WORTH = 0.005  # share of the gap from which on a place is named in the drawing
_LONGEST = 0.12  # of the workspace's extent, for an arrow of the gap's 95th percentile: there are arrows of all rows
_DECIMALS = 4  # of m: a tenth of a millimetre is less than a pixel


def arm_drawing(diagnosis: Diagnosis) -> dict[str, Any] | None:
    """Return data of the page's three-dimensional drawing: links, joints, their shares of the gap, poses of the rows.

    ``None`` where the shares of places are unknown, or no rows with a gap at different positions are left.
    """
    shown = plots.mapped(diagnosis)
    factor = plots.exaggeration(diagnosis, shown, _LONGEST)
    chosen = shown[drawing.thinned(len(shown), _ROWS)]
    arm = diagnosis.arm(chosen) if factor is not None else None
    if arm is None:
        return None
    left = len(diagnosis.rows.rows) - len(shown)
    some = f"{len(chosen)} of {len(shown)} rows are drawn" if len(chosen) < len(shown) else ""
    aside = f"{left} set aside {'is' if left == 1 else 'are'} not drawn" if left else ""
    most = float(max((*arm.link_shares, *arm.joint_shares, arm.base_share, arm.tool_share)))
    return {
        "data": {**_places(arm), "rows": [*_postures(diagnosis, arm, chosen.tolist())], "factor": factor},
        "said": "; ".join(filter(None, (some, aside))),
        "most": units.percent(most) if most >= _WORTH else "",
        "beside": units.percent(arm.instrument_share) if arm.instrument_share >= _WORTH else "",
    }


def _places(arm: Arm) -> dict[str, Any]:
    joints = zip(arm.joints, arm.joint_shares, arm.moves.tolist(), strict=True)
    solids = [
        {"link": arm.links.index(link), "corners": _short(hull.vertices), "faces": hull.faces.ravel().tolist()}
        for link, hull in arm.hulls
    ]
    return {
        "links": [_place(*link) for link in zip(arm.links, arm.link_shares, strict=True)],
        "joints": [{**_place(name, share), "moves": link} for name, share, link in joints],
        "solids": solids,
        "base": _place("base", arm.base_share),
        "tool": _place("tool", arm.tool_share),
    }


def _place(name: str, share: float) -> dict[str, Any]:
    named = f"{name} {units.percent(share)}" if share >= _WORTH else ""
    return {"share": round(float(share), 4), "named": named}


def _postures(diagnosis: Diagnosis, arm: Arm, chosen: list[int]) -> Iterator[dict[str, Any]]:
    rows = diagnosis.rows
    for row, poses in zip(chosen, arm.poses, strict=True):
        gaps = rows.gap[row, :3], rows.remainder[row, :3]
        before, after = units.together([float(np.linalg.norm(gap)) for gap in gaps], "m")
        told = f"row {rows.rows[row]}: gap {before} before, {after} after"
        # three significant digits are more than a screen shows
        ends = {key: [float(f"{v:.3g}") for v in gap] for key, gap in zip(("before", "after"), gaps, strict=True)}
        yield {"poses": _short(poses[:, :3]), "at": _short(rows.position[row]), **ends, "told": told}


def _short(values: Array) -> list[float]:
    return np.round(values, _DECIMALS).ravel().tolist()


def comparison_html(comparison: Plain, generated: str | None = None, files: Mapping[str, str] | None = None) -> str:
    """Self-contained HTML page of a comparison of campaigns, for A4.

    Parameters
    ----------
    comparison
        Of the format ``thermal-robot/comparison/1``.
    generated, files
        As for :func:`html`.
    """
    shown = {"comparison": comparison, "headline": text_campaigns.comparison_headline(comparison)}
    return render("comparison.html", shown, title="Comparison of campaigns", generated=generated, files=files)


def comparison_fragment(comparison: Plain) -> str:
    """HTML of a comparison for a notebook: one ``<div>`` with its own style."""
    headline = text_campaigns.comparison_headline(comparison)
    return render("comparison.html", {"comparison": comparison, "headline": headline})


def fleet_html(summary: Plain, generated: str | None = None) -> str:
    """Self-contained HTML page of a fleet's summary, for A4.

    Parameters
    ----------
    summary
        Of the format ``thermal-robot/fleet/1``.
    generated
        When it was made, for the footer; nothing is said where absent.
    """
    shown = {"summary": summary, "headline": text_campaigns.fleet_headline(summary)}
    return render("fleet.html", shown, title="Fleet", generated=generated)


def wear_html(wear: Wear, generated: str | None = None, files: Mapping[str, str] | None = None) -> str:
    """Self-contained HTML page of a robot over time, for A4.

    Parameters
    ----------
    wear
        The result.
    generated, files
        As for :func:`html`.
    """
    shown = {"wear": wear, "headline": re.sub(r"(?<=\d)-(?=\d)", "\u2011", wear.summary)}  # dates do not break
    return render("wear.html", shown, title=f"{wear.robot} over time", generated=generated, files=files)


def wear_fragment(wear: Wear) -> str:
    """HTML of a robot over time for a notebook: one ``<div>`` with its own style."""
    return render("wear.html", {"wear": wear, "headline": wear.summary})
