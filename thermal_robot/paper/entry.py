"""One row of the ledger, and how its verdict follows from what is printed and what is computed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

AGREES = "agrees"
TRUNCATED = "agrees when truncated"
PARTLY = "agrees in part"
ERRATUM = "erratum"
NOT_REPRODUCIBLE = "not reproducible"
ONLY_BOUNDED = "only bounded"
NEGLECTED = "neglected"
NOT_PRINTED = "not printed"

VERDICTS = {
    AGREES: "the printed figures are the computed ones, rounded, or lie within what the inputs' rounding leaves open",
    TRUNCATED: "the printed figures are the computed ones with the further digits cut off",
    PARTLY: "the claim holds in a part of the cases for which it is made",
    ERRATUM: "what the paper itself prints determines the figure, and it is another",
    NOT_REPRODUCIBLE: "no model or data in the paper lead to the figure",
    ONLY_BOUNDED: "what is printed leaves a range open that reaches zero",
    NEGLECTED: "the paper leaves it out; the consequence is computed",
    NOT_PRINTED: "the paper prints no figure to compare with",
}
"""What each verdict means."""

_SLACK = 1e-9
# Of a printed digit: what binary fractions may be off a decimal one.


@dataclass(frozen=True)
class Printed:
    """Figures as the paper prints them: as text, in SI units, and one unit of the last digit, of all or of each."""

    text: str
    values: tuple[float, ...]
    digits: float | tuple[float, ...]


@dataclass(frozen=True)
class Entry:
    """One row of the ledger.

    Parameters
    ----------
    quantity
        What is compared.
    where
        Section, table or equation of the paper.
    printed, computed
        As text, with units.
    values
        The computed numbers, SI units, in the order of ``computed``; more of them where that text is short.
    verdict
        One of :data:`VERDICTS`.
    why
        What lies behind the verdict.
    depends
        Fields of :class:`~thermal_robot.paper.PaperInputs` that were read to compute the row.
    """

    quantity: str
    where: str
    printed: str
    computed: str
    values: tuple[float, ...]
    verdict: str
    why: str
    depends: tuple[str, ...] = ()


def rounds_to(printed: Printed, low: ArrayLike, high: ArrayLike | None = None) -> bool:
    """Whether every printed figure is a rounding of some value between ``low`` and ``high``."""
    bottom = np.ravel(np.asarray(low, dtype=float))
    top = bottom if high is None else np.ravel(np.asarray(high, dtype=float))
    values, half = np.array(printed.values), np.broadcast_to(printed.digits, len(printed.values)) * (0.5 + _SLACK)
    return bool(np.all((bottom <= values + half) & (top >= values - half)))


def truncates_to(printed: Printed, computed: ArrayLike) -> bool:
    """Whether every printed figure is a computed one with the further digits cut off."""
    exact, values = np.ravel(np.asarray(computed, dtype=float)), np.array(printed.values)
    digits = np.broadcast_to(printed.digits, len(values))
    beyond = np.abs(exact) - np.abs(values)
    return bool(np.all((exact * values >= 0.0) & (beyond >= -_SLACK * digits) & (beyond < digits)))


def judge(
    printed: Printed,
    computed: ArrayLike,
    *,
    otherwise: str,
    low: ArrayLike | None = None,
    high: ArrayLike | None = None,
) -> str:
    """Return the verdict on printed figures, all together, beside as many computed numbers, SI.

    ``otherwise`` where neither rounding nor truncation leads to them: ``ERRATUM`` where the paper's own numbers
    determine the figure, ``NOT_REPRODUCIBLE`` where they do not. ``low``, ``high``: range of each computed number over
    the rounding of the inputs, where that is to count.
    """
    if rounds_to(printed, computed) or (low is not None and high is not None and rounds_to(printed, low, high)):
        return AGREES
    return TRUNCATED if truncates_to(printed, computed) else otherwise


def numbers(values: ArrayLike, decimals: int = 1, *, factor: float = 1.0) -> str:
    """Write numbers side by side, rows (..., n) parted by a stroke; a true minus sign."""
    rows = np.atleast_2d(np.asarray(values, dtype=float) * factor)
    said = (" ".join(f"{value:.{decimals}f}" for value in row) for row in rows)
    return " / ".join(said).replace("-", "−")


def floats(*values: ArrayLike) -> tuple[float, ...]:
    """Join numbers and arrays into one tuple."""
    return tuple(float(v) for array in values for v in np.ravel(np.asarray(array, dtype=float)))
