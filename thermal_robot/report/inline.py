"""A figure as a piece of a page: SVG that refers to nothing outside and takes the page's colours."""

from __future__ import annotations

import re
from hashlib import sha256
from html import escape
from io import StringIO
from typing import TYPE_CHECKING

from thermal_robot.report.drawing import AFTER, BEFORE, FAINT, INK, MUTED, PAPER, THIRD

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_PIXELS = 106.0  # per inch at most, so that letters are equally large in all figures of a page
_NAMES = {
    INK: "ink",
    MUTED: "muted",
    FAINT: "faint",
    PAPER: "paper",
    BEFORE: "before",
    AFTER: "after",
    THIRD: "third",
}


def svg(figure: Figure, label: str) -> str:
    """Return a figure as an ``<svg>`` element for an HTML page.

    Parameters
    ----------
    figure
        The figure; its own background is left out.
    label
        What it shows, for those who cannot see it.

    Returns
    -------
    str
        Equal for equal figures; no identifier clashes with that of another figure on the page.
    """
    stream = StringIO()
    figure.savefig(stream, format="svg", transparent=True, dpi=200, metadata={"Date": None})
    text = stream.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    # HTML knows these two namespaces by itself; without their addresses the page holds no address at all
    text = re.sub(r'\sxmlns(:xlink)?="[^"]*"', "", text)
    text = re.sub(r"\s*\n\s*", "\n", text)
    for colour, name in _NAMES.items():
        text = text.replace(colour, f"var(--tr-{name},{colour})")
    width = f"max-width:{figure.get_figwidth() * _PIXELS:.0f}px"
    shown = f'<svg role="img" aria-label="{escape(label)}" class="tr-figure" style="{width}"'
    return _own_names(text).replace("<svg", shown, 1).strip()


def _own_names(text: str) -> str:
    """Replace identifiers, which Matplotlib draws at random, by the content's hash and a number."""
    found = list(dict.fromkeys(re.findall(r'\bid="([^"]+)"', text)))
    numbers = {name: str(k) for k, name in enumerate(found)}
    pattern = re.compile(r'(\bid="|href="#|url\(#)([^")]+)')
    text = pattern.sub(lambda m: m[1] + "@" + numbers.get(m[2], m[2]), text)
    return text.replace("@", f"f{sha256(text.encode()).hexdigest()[:8]}-")
