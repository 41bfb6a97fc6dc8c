"""How large a share is, as a colour."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from thermal_robot.viewer.settings import FULL_SHARE, LEAST_FULL, NO_SHARE

Colour = tuple[int, int, int]


def colours(shares: Mapping[tuple[str, str], float]) -> dict[tuple[str, str], Colour]:
    """Return the colour of each place: from grey, for no share, to purple, for the largest.

    Parameters
    ----------
    shares
        By place, kind and name: share of the gap's mean square, 0..1.

    Returns
    -------
    dict
        By place: red, green and blue, 0..255. Where even the largest share is small, all are pale.
    """
    full = max(LEAST_FULL, *shares.values()) if shares else LEAST_FULL
    return {place: between(share / full) for place, share in shares.items()}


def between(part: float) -> Colour:
    """Return the colour that lies so far on the way from no share, 0, to the largest, 1."""
    part = min(max(part, 0.0), 1.0)
    red, green, blue = (round(a + part * (b - a)) for a, b in zip(NO_SHARE, FULL_SHARE, strict=True))
    return red, green, blue


def linear(colours: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the light of colours, 0..255 of the brightest: what a screen makes of them (IEC 61966-2-1).

    Viser takes the colours of single objects as a screen does, and those of many copies of an object as light.

    Parameters
    ----------
    colours
        (..., 3) red, green and blue, 0..255, as a screen takes them.
    """
    given = np.asarray(colours, dtype=float) / 255.0
    light = np.where(given <= 0.04045, given / 12.92, ((given + 0.055) / 1.055) ** 2.4)
    return np.round(255.0 * light).astype(np.uint8)
