"""A share in per cent, the same in every message, report and page."""

from __future__ import annotations

from math import copysign, isfinite

MISSING = "–"
_ALL = 1e-9  # less that is left of a whole is rounding
_FAR = 10.0  # times the whole: how far a bound lies beyond says nothing more
_MOST = 4  # decimals: a share that is still rounded to all with them is told as more than that


def percent(share: float | None, decimals: int = 1) -> str:
    """Format a share in per cent, as ``96.0 %``; less than 1 never becomes 100 %, more than ±10 only ``> 1000 %``.

    Parameters
    ----------
    share
        1 for all; ``None`` and what is not finite is a dash.
    decimals
        At least so many; more where fewer would round to 100 %.

    Examples
    --------
    >>> from thermal_robot.percents import percent
    >>> percent(0.96), percent(0.9996), percent(-0.0003), percent(1.0, 0), percent(-36730.473)
    ('96.0 %', '99.96 %', '0.0 %', '100 %', '< −1000 %')
    """
    if share is None or not isfinite(share):
        return MISSING
    if abs(share) > _FAR:
        return f"{'>' if share > 0.0 else '<'} {percent(copysign(_FAR, share), 0)}"
    if 1.0 - _ALL > share >= 1.0 - 0.5 * 10.0 ** (-2 - decimals):
        return percent(share, decimals + 1) if decimals < _MOST else f"> {100.0 - 10.0**-_MOST:.{_MOST}f} %"
    return f"{round(100.0 * share, decimals) + 0.0:.{decimals}f} %".replace("-", "−")
