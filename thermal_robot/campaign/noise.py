"""The instrument's noise where it is not the same in all rows: that of all, and each row's beside it."""

from __future__ import annotations

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.campaign.targets import Targets


def of_all(sigmas: Array, targets: Targets | None) -> tuple[float, float | None]:
    """Return one sigma of positions, m, and where several targets tell it of turns, rad: root mean squares over rows.

    Parameters
    ----------
    sigmas
        (N,) of a point in each row, m; of equal ones it is they themselves, to the last digit.
    targets
        Whose common frame is measured.
    """
    alike = bool(sigmas.min() == sigmas.max())
    whole = float(sigmas[0]) if alike else float(np.sqrt((sigmas**2).mean()))
    return told_by(whole, targets)


def told_by(sigma: float, targets: Targets | None) -> tuple[float, float | None]:
    """Return one sigma of positions, m, and where several targets tell it of turns, rad, from that of a point."""
    return (sigma, None) if targets is None else (sigma * float(targets.typical[0]), sigma * float(targets.typical[1]))


def of_a_point(sigma: float, targets: Targets | None) -> float:
    """Return one sigma of a point, m, from that of positions."""
    return sigma if targets is None else sigma / float(targets.typical[0])


def relative(sigmas: Array | None, whole: float | None, targets: Targets | None, turned: bool) -> Array | None:
    """(N, m) one sigma of each figure of a row over that of all rows; ``None`` where it is one for all.

    Parameters
    ----------
    sigmas
        (N,) of a point in each row, m; ``None`` where one holds for all.
    whole
        Of positions, of all rows, m.
    targets
        Whose common frame is measured.
    turned
        Whether orientations were measured, m being 6; their noise is the same in all rows unless targets tell it.
    """
    factor = np.ones(1) if sigmas is None or not whole else sigmas / of_a_point(whole, targets)
    if targets is not None:
        found = targets.spread / np.repeat(targets.typical, 3) * factor[:, None]
        found = found if turned else found[:, :3]
    elif bool((factor == 1.0).all()):
        return None
    else:
        found = np.column_stack([factor] * 3 + [np.ones(len(factor))] * (3 if turned else 0))
    return None if bool((found == 1.0).all()) else found
