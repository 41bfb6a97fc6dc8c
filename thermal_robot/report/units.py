"""Formatting of quantities: SI to display units, significant digits, uncertainty."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import floor, isfinite, log10
from typing import TYPE_CHECKING

from thermal_robot.percents import MISSING as MISSING
from thermal_robot.percents import percent as percent

if TYPE_CHECKING:
    from thermal_robot.diagnosis.values import Estimate

# leading unit: (smallest size in SI, what it is multiplied by, what it is then called), largest first
_LADDERS: dict[str, tuple[tuple[float, float, str], ...]] = {
    "m": ((1e1, 1.0, "m"), (1e-3, 1e3, "mm"), (0.0, 1e6, "µm")),
    "rad": ((1e0, 1.0, "rad"), (1e-4, 1e3, "mrad"), (0.0, 1e6, "µrad")),
    "s": ((1e0, 1.0, "s"), (1e-3, 1e3, "ms"), (0.0, 1e6, "µs")),
    "1": ((1e-2, 1e2, "%"), (0.0, 1e6, "ppm")),
    "1/K": ((0.0, 1e6, "µm/(m·K)"),),
}


@dataclass(frozen=True)
class Scale:
    """Factor from SI, and the display unit."""

    factor: float
    unit: str


def scale(unit: str, size: float) -> Scale:
    """Choose the display unit, such as µm, mm or m, and its factor for values of about ``size`` in an SI ``unit``."""
    if unit in _LADDERS:
        lead, rest = unit, ""
    else:
        cut = next((k for k, c in enumerate(unit) if c in "/·"), len(unit))
        lead, rest = unit[:cut], unit[cut:]
    if lead not in _LADDERS or (rest and lead not in ("m", "rad", "s")):
        return Scale(1.0, unit)
    # rounding must not show 1000 µm where 1.00 mm is meant
    step = next(s for s in _LADDERS[lead] if abs(size) >= 0.9995 * s[0])
    return Scale(step[1], step[2] + rest)


def _decimals(value: float, digits: int) -> int:
    if value == 0.0 or not isfinite(value):
        return 0
    rounded = float(f"{value:.{digits - 1}e}")  # 0.9999 needs the decimals of 1
    return max(0, digits - 1 - floor(log10(abs(rounded))))


def number(value: float, digits: int = 3) -> str:
    """Format a number with so many significant digits, in exponent form below 1e-4 and from 1e6 on."""
    if not isfinite(value):
        return MISSING
    if value != 0.0 and not 1e-4 <= abs(value) < 1e6:
        return f"{value:.{digits - 1}e}".replace("-", "−")
    return f"{value:.{_decimals(value, digits)}f}".replace("-", "−")


def quantity(value: float | None, unit: str) -> str:
    """Format one SI value in its display unit: ``412 µm``."""
    if value is None or not isfinite(value):
        return MISSING
    best = scale(unit, value)
    return f"{number(value * best.factor)} {best.unit}".rstrip()


def together(values: Iterable[float | None], unit: str) -> list[str]:
    """Format values for comparison: one unit, equal decimals.

    The largest decides the unit; the smallest keeps two significant digits where four decimals suffice.
    """
    wanted = list(values)
    known = [abs(v) for v in wanted if v is not None and isfinite(v) and v != 0.0]
    best = scale(unit, max(known, default=0.0))
    decimals = 0
    if known:
        decimals = max(_decimals(max(known) * best.factor, 3), _decimals(min(known) * best.factor, 2))
    shown = [v if v is not None and isfinite(v) else None for v in wanted]
    told = [MISSING if v is None else f"{v * best.factor:.{min(decimals, 4)}f} {best.unit}" for v in shown]
    return [each.replace("-", "−") for each in told]


def estimate(parameter: Estimate, beside: Iterable[Estimate] = ()) -> str:
    """Format a parameter with its standard deviation, in the display unit that suits it and those ``beside`` it.

    What the data do not determine is never written as a number.
    """
    if not parameter.identified or parameter.value is None or not isfinite(parameter.value):
        return "not determined by these data"
    alike = [parameter, *(p for p in beside if p.unit == parameter.unit)]
    best = scale(parameter.unit, max(max(abs(p.value or 0.0), p.std or 0.0) for p in alike))
    return _spread(parameter.value, parameter.std or 0.0, best)


def measured(value: float, std: float, unit: str) -> str:
    """Format an SI value with its standard deviation: ``0.42 ± 0.03 mm``."""
    return _spread(value, std, scale(unit, max(abs(value), std)))


def _spread(value: float, std: float, best: Scale) -> str:
    unit = "" if best.unit in ("", "1") else f" {best.unit}"
    value, std = value * best.factor, std * best.factor
    if std <= 0.0 or not isfinite(std):
        return f"{number(value)}{unit}"
    largest = max(abs(value), std)
    if not 1e-3 <= largest < 1e6:
        return f"{number(value)} ± {number(std, 2)}{unit}"
    decimals = min(_decimals(std, 2), _decimals(largest, 6))
    return f"{value:.{decimals}f} ± {std:.{decimals}f}{unit}".replace("-", "−")


def interval(bounds: tuple[float, float] | None) -> str:
    """Format a 95 % interval of shares as ``94.0 to 97.0``, without the per cent sign."""
    if bounds is None:
        return ""
    return " to ".join(percent(b).removesuffix(" %") for b in bounds)


def probability(value: float | None) -> str:
    """Format a probability in per cent; it is never 0 or 100 %."""
    if value is None or not isfinite(value):
        return MISSING
    if value > 0.999:
        return "> 99.9 %"
    return "< 0.1 %" if value < 0.001 else percent(value)


def p_value(value: float) -> str:
    """Format a p-value: ``p = 0.012``, ``p = 3e-7``, and ``p < 1e-12`` for what is smaller."""
    if not isfinite(value):
        return "p unknown"
    if value < 1e-12:
        return "p < 1e-12"
    if value < 1e-3:
        mantissa, exponent = f"{value:.0e}".split("e")
        return f"p = {mantissa}e{int(exponent)}"
    return f"p = {value:.2g}"


def round_down(value: float) -> float:
    """Largest 1, 2 or 5 times a power of ten not above a positive value."""
    power = 10.0 ** floor(log10(value))
    return float(next(s * power for s in (5.0, 2.0, 1.0) if s * power <= value * (1.0 + 1e-9)))
