"""Chosen numbers of the viewer, each with its unit and reason; lengths are shares of the scene."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

Colour = tuple[int, int, int]
"""Red, green and blue, 0..255."""

HOST = "127.0.0.1"
"""The only address that is served: what a company measured on its robots stays on the machine."""
PORT = 8080
"""Where a viewer is looked for by default; viser's own choice, which its users know."""

MOST_ARROWS = 1000
"""Rows whose gap is drawn at once, evenly spread over the file: more hide each other and slow a browser down."""
MOST_POSES = 500
"""Rows from which the size of the scene is taken: their hull is that of all within a few per cent."""

LONG_ARROW = 0.08
"""Length of a large gap as it is drawn at first: seen at once, and hides no robot."""
LARGE_GAP = 0.9
"""Quantile of the gaps that is drawn so long: gross errors must not shrink all others to nothing."""
LONGEST_ARROW = 0.2
"""Length at which an arrow is cut: a gross error of millimetres would be a pole of several metres."""
STRONGER = 10.0
"""How many times further the slider of the magnification goes than where it stands at first."""

SHAFT_RADIUS = 0.4
"""Of an arrow, as a share of the radius of its head."""
HEAD_RADIUS, HEAD_LENGTH = 0.06, 0.3
"""Of an arrow as shares of its length: slender, and the tip is still seen where a hundred stand side by side."""
WIDEST, NARROWEST = 0.006, 0.0015
"""Bounds of the radius of an arrow's head."""
THICKER = 2.5
"""How many times as thick as the others the arrows of the row are that is shown."""

STICK, KNOT, POINTER = 0.012, 0.018, 0.004
"""Radii of a link that has no shape, of its origin, and of the line to the measured point."""
RING, RING_TUBE = 0.045, 0.005
"""Radii of the ring about a joint's axis: larger than the housings of most arms."""

LEAST_FULL = 0.10
"""Share of the gap from which on the largest is drawn in full colour: below, all places are pale."""
TOLD = 0.005
"""Share of the gap above which a place is named: what is less is shown as 0 % in the list."""

NO_SHARE, FULL_SHARE = (205, 210, 216), (140, 20, 110)
"""Colours of a place with no share and with the largest: grey to purple, which no arrow has, of different brightness
for those who see no colours."""
GAP, REMAINDER, ASIDE = (230, 159, 0), (31, 111, 181), (150, 158, 166)
"""Colours of the arrows: before and after the correction as in the figures of the report, and rows set aside."""
CHOSEN, CHOSEN_AFTER = (194, 62, 0), (10, 55, 110)
"""Colours of the arrows of the row that is shown, before and after: the same, darker."""

ASIDE_OF, BACK_BY, ABOVE = 0.58, 0.20, 0.25
"""Where the eye is from the middle of the scene: across the arm, towards where it reaches, and upwards. All of the
scene is in sight, and the arm does not point at the eye."""
SMALL_REACH = 0.05
"""Of the mean of all measured points from the axis upwards: less is no direction."""
GRID = 3.0
"""Width of the floor."""
SKY = 0.4
"""Of viser's light from all sides, which pales colours until they are no longer those of the list beside them."""
FAINT = (225, 229, 233)
"""Colour of the floor's lines, 0.5 m apart: seen, and no more."""


def colours(shares: Mapping[tuple[str, str], float]) -> dict[tuple[str, str], Colour]:
    """Colours on a linear scale from grey, for no share, to purple, for the largest.

    Parameters
    ----------
    shares
        By place, kind and name: share of the gap's mean square, 0..1. Where even the largest is small, all are pale.
    """
    full = max(LEAST_FULL, *shares.values()) if shares else LEAST_FULL
    return {place: _between(min(max(share / full, 0.0), 1.0)) for place, share in shares.items()}


def _between(part: float) -> Colour:
    red, green, blue = (round(a + part * (b - a)) for a, b in zip(NO_SHARE, FULL_SHARE, strict=True))
    return red, green, blue


def linear(colours: ArrayLike) -> NDArray[np.uint8]:
    """Linear light of sRGB colours (..., 3), both 0..255: inverse transfer function of IEC 61966-2-1.

    Viser takes the colours of single objects as a screen does, and those of many copies of an object as light.
    """
    given = np.asarray(colours, dtype=float) / 255.0
    light = np.where(given <= 0.04045, given / 12.92, ((given + 0.055) / 1.055) ** 2.4)
    return np.round(255.0 * light).astype(np.uint8)
