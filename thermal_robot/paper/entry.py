"""Rows of the ledger, and the verdict on printed against computed numbers."""

from __future__ import annotations

import re
from dataclasses import dataclass
from decimal import Decimal
from string import Formatter
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

VERDICTS = {
    "agrees": "the printed figures are the computed ones, rounded, or lie within what the inputs' rounding leaves open",
    "agrees when truncated": "the printed figures are the computed ones with the further digits cut off",
    "agrees in part": "the claim holds in a part of the cases for which it is made",
    "erratum": "what the paper itself prints determines the figure, and it is another",
    "not reproducible": "no model or data in the paper lead to the figure",
    "only bounded": "what is printed leaves a range open that reaches zero",
    "neglected": "the paper leaves it out; the consequence is computed",
    "not printed": "the paper prints no figure to compare with",
}
"""What each verdict means."""

_SLACK = 1e-9
# Of a printed digit: what binary fractions may be off a decimal one.
_UNITS = {"µm": -6, "mm": -3, "%": -2}


@dataclass(frozen=True)
class Printed:
    """Numbers as the paper prints them: text, SI values, and the size of each one's last printed digit, SI."""

    text: str
    values: tuple[float, ...]
    digits: tuple[float, ...]

    @classmethod
    def of(cls, text: str, digit: float | None = None) -> Printed:
        """Parse numbers and convert to SI: parts between semicolons have a unit each, squared for 1e-n numbers.

        ``digit`` overrides the size of the last digit.
        """
        values, digits = [], []
        for part in text.replace("−", "-").split(";"):
            exponent = next((power for unit, power in _UNITS.items() if unit in part), 0)
            for number in re.findall(r"[-+]?\d*\.?\d+(?:e-?\d+)?", part):
                value = Decimal(number).scaleb(exponent * (2 if "e" in number else 1))
                values.append(float(value))
                digits.append(float(Decimal(1).scaleb(int(value.as_tuple().exponent))) if digit is None else digit)
        return cls(text, tuple(values), tuple(digits))


@dataclass(frozen=True)
class Entry:
    """One row of the ledger: a printed figure of the paper, the recomputed one, and the verdict.

    Parameters
    ----------
    quantity
        Quantity that is compared.
    where
        Section, table or equation of the paper.
    printed, computed
        As text, with units.
    values
        The computed numbers, SI units, in the order of ``computed``; more of them where that text is short.
    verdict
        One of :data:`VERDICTS`.
    why
        Reason of the verdict.
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


def rounds_to(printed: Printed, low: ArrayLike, high: ArrayLike) -> bool:
    """Whether every printed figure is a rounding of some value between ``low`` and ``high``."""
    bottom, top = (np.ravel(np.asarray(v, dtype=float)) for v in (low, high))
    values, half = np.array(printed.values), np.array(printed.digits) * (0.5 + _SLACK)
    return bool(np.all((bottom <= values + half) & (top >= values - half)))


def truncates_to(printed: Printed, computed: ArrayLike) -> bool:
    """Whether every printed number is the computed one with its further digits cut off (rounded towards zero)."""
    exact, values, digits = np.ravel(np.asarray(computed, float)), np.array(printed.values), np.array(printed.digits)
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
    """Verdict on printed numbers against computed ones, SI: rounding, else truncation, else ``otherwise``.

    ``otherwise`` where neither rounding nor truncation leads to them: ``"erratum"`` where the paper's own numbers
    determine the figure, ``"not reproducible"`` where they do not. ``low``, ``high``: range of each computed number
    over the rounding of the inputs, where that is to count.
    """
    ranges = [(computed, computed)] if low is None or high is None else [(computed, computed), (low, high)]
    if any(rounds_to(printed, *ends) for ends in ranges):
        return "agrees"
    return "agrees when truncated" if truncates_to(printed, computed) else otherwise


def numbers(values: ArrayLike, decimals: int = 1, *, factor: float = 1.0) -> str:
    """Format numbers (n,) or (m, n) times ``factor``: spaces within a row, " / " between rows, a true minus sign."""
    rows = np.atleast_2d(np.asarray(values, dtype=float) * factor)
    said = (" ".join(f"{value:.{decimals}f}" for value in row) for row in rows)
    return " / ".join(said).replace("-", "−")


class Words(Formatter):
    """Formatter of the ledger's texts: ``{x:2u}`` has two decimals, times 1e6 (``m``: 1e3, ``c``: 100 for %)."""

    def format_field(self, value: Any, format_spec: str) -> str:
        """Format by :func:`numbers` where the spec begins with a digit, its decimals; else as Python does."""
        factor = {"u": 1e6, "m": 1e3, "c": 1e2}.get(format_spec[-1:], 1.0)
        if format_spec[:1].isdigit():
            return numbers(value, int(format_spec[0]), factor=factor)
        return format(value * factor, "g") if format_spec[:1] == "g" else format(value, format_spec)
