"""How large a share is, as a colour."""

from __future__ import annotations

from collections.abc import Mapping

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
