"""The shapes of laws that nobody wrote down, one entry each: functions of a quantity, their names, their words.

========== ======================================================= ==========================
shape      φ_k(x), with u = (x − origin) / span                    marks
========== ======================================================= ==========================
constant   1
ramp       1, u
quadratic  1, u, u²
step       x ≤ m, x > m                                            where it steps
run        outside, m₁ < x < m₂                                    where it begins and ends
slide      ½ (1 ∓ tanh((x − m) / w))                               middle, width
hinge      1, max(x − m, 0) / span, or on the other side           where it bends, side ±1
bump       1, exp(−½ ((x − m) / w)²)                               middle, width
drag       1, x / span, sign(x)                                    of a quantity with a sign
harmonic   1, sin(k x), cos(k x)                                   order k
product    1, x / span                                             x the product of two quantities
hysteresis 1, x_k: how far elements are strained, −1 to 1          how far each goes till it slips
levels     x = m_k                                                 the levels
apart      x ≠ m, x = m                                            the level that is apart
relaxing   1, exp(−x / τ), x the time since each session began    τ
relaxing   1, the same for each session with a size of its own     τ
each
smooth     natural cubic splines that are 1 at one knot, 0 at all  the knots
           others
========== ======================================================= ==========================

Splines: Hastie, Tibshirani and Friedman, *The Elements of Statistical Learning*, 2009, 5.2.1; beyond the outer knots
they run straight. Hysteresis: stop operators of Prandtl and Ishlinskii (:mod:`thermal_robot.campaign.turning`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from thermal_robot.arrays import Array

_SHORTEST = 1e-6  # of the range: what settles within less is settled at once

Functions = Callable[[Array, tuple[float, ...], float, float], Array]
"""(N, K) of what the shape is of, (N,) or (N, K), the marks, origin and span."""


@dataclass(frozen=True)
class Shape:
    """One shape of a law: its functions φ of the table above, and its words.

    ``labels`` name those that do not belong to one of the marks ``each``; ``{start}`` and ``{range}`` stand for origin
    and span, in the quantity's unit; in ``words`` ``{mark}`` stands for its first mark with the unit, ``{order}``
    without. ``mark`` is ``sudden`` where moving it changes the functions only when it passes a row, ``gradual`` where
    smoothly, empty where it is not to be moved; ``width`` where the second mark is a width, to be refined, too.
    ``size`` is what the difference between its largest and its smallest value is called, ``noun`` a short name. ``of``
    is what the functions are of: the (N,) ``quantity``; the (N, K) ``strains`` of elements of slips as marked; the
    (N, 1) time since the ``run`` began, or since each of the ``runs`` began, infinite in the others (N, R).
    """

    functions: Functions
    labels: tuple[str, ...]
    words: str
    mark: Literal["", "sudden", "gradual"] = ""
    width: bool = False
    each: bool = False
    size: str = "range"
    noun: str = "an error"
    of: Literal["quantity", "strains", "run", "runs"] = "quantity"


def _constant(x: Array, marks: tuple[float, ...], origin: float, span: float) -> Array:
    return np.ones((len(x), 1))


def _ramp(x: Array, marks: tuple[float, ...], origin: float, span: float) -> Array:
    return np.column_stack([np.ones_like(x), (x - origin) / span])


def _quadratic(x: Array, marks: tuple[float, ...], origin: float, span: float) -> Array:
    u = (x - origin) / span
    return np.column_stack([np.ones_like(u), u, u**2])


def _step(x: Array, marks: tuple[float, ...], origin: float, span: float) -> Array:
    late = x > marks[0]
    return np.column_stack([~late, late]).astype(float)


def _run(x: Array, marks: tuple[float, ...], origin: float, span: float) -> Array:
    inside = (x > marks[0]) & (x < marks[1])
    return np.column_stack([~inside, inside]).astype(float)


def _slide(x: Array, marks: tuple[float, ...], origin: float, span: float) -> Array:
    middle, width = marks
    late = 0.5 * (1.0 + np.tanh((x - middle) / width))
    return np.column_stack([1.0 - late, late])


def _hinge(x: Array, marks: tuple[float, ...], origin: float, span: float) -> Array:
    mark, side = marks
    return np.column_stack([np.ones_like(x), np.maximum(side * (x - mark), 0.0) / span])


def _bump(x: Array, marks: tuple[float, ...], origin: float, span: float) -> Array:
    middle, width = marks
    return np.column_stack([np.ones_like(x), np.exp(-0.5 * ((x - middle) / width) ** 2)])


def _drag(x: Array, marks: tuple[float, ...], origin: float, span: float) -> Array:
    return np.column_stack([np.ones_like(x), x / span, np.sign(x)])


def _harmonic(x: Array, marks: tuple[float, ...], origin: float, span: float) -> Array:
    return np.column_stack([np.ones_like(x), np.sin(marks[0] * x), np.cos(marks[0] * x)])


def _hysteresis(x: Array, marks: tuple[float, ...], origin: float, span: float) -> Array:
    return np.column_stack([np.ones(len(x)), x])


def _relaxing(x: Array, marks: tuple[float, ...], origin: float, span: float) -> Array:
    return np.column_stack([np.ones(len(x)), np.exp(-x / max(abs(marks[0]), _SHORTEST * span))])


def _product(x: Array, marks: tuple[float, ...], origin: float, span: float) -> Array:
    return np.column_stack([np.ones_like(x), x / span])


def _levels(x: Array, marks: tuple[float, ...], origin: float, span: float) -> Array:
    return np.asarray(np.eye(len(marks))[np.abs(x[:, None] - np.array(marks)).argmin(axis=1)])


def _apart(x: Array, marks: tuple[float, ...], origin: float, span: float) -> Array:
    there = x == marks[0]
    return np.column_stack([~there, there]).astype(float)


def _smooth(x: Array, marks: tuple[float, ...], origin: float, span: float) -> Array:
    from scipy.interpolate import CubicSpline

    knots = (np.array(marks) - origin) / span
    u = (x - origin) / span
    spline = CubicSpline(knots, np.eye(len(knots)), bc_type="natural")
    inside = spline(np.clip(u, knots[0], knots[-1]))
    slope = spline(knots[[0, -1]], 1)
    beyond = np.minimum(u - knots[0], 0.0)[:, None] * slope[0] + np.maximum(u - knots[-1], 0.0)[:, None] * slope[1]
    return np.asarray(inside + beyond)


SHAPES: dict[str, Shape] = {
    "constant": Shape(_constant, ("constant",), "constant", noun="a constant error"),
    "ramp": Shape(_ramp, ("at {start}", "rise over {range}"), "in proportion"),
    "quadratic": Shape(_quadratic, ("constant", "linear", "quadratic"), "quadratic"),
    "step": Shape(_step, ("before", "after"), "a step at {mark}", "sudden", size="step", noun="a step"),
    "run": Shape(_run, ("elsewhere", "there"), "another value for a while", size="step", noun="a step"),
    "slide": Shape(
        _slide, ("before", "after"), "a smooth step at {mark}", "gradual", width=True, size="step", noun="a step"
    ),
    "hinge": Shape(_hinge, ("constant", "slope beyond, over {range}"), "a bend at {mark}", "gradual"),
    "bump": Shape(_bump, ("constant", "height"), "a bump at {mark}", "gradual", width=True, size="bump", noun="a bump"),
    "drag": Shape(_drag, ("constant", "slope over {range}", "of its sign"), "its slope and its sign"),
    "harmonic": Shape(
        _harmonic, ("constant", "sine", "cosine"), "harmonic of order {order:g}", size="peak to peak", noun="a wave"
    ),
    "product": Shape(_product, ("constant", "at the largest product"), "in proportion to the product"),
    "hysteresis": Shape(_hysteresis, ("constant",), "springs that slip", each=True, of="strains"),
    "relaxing": Shape(
        _relaxing, ("constant", "at the start"), "it settles within {mark} of each start", "gradual", of="run"
    ),
    "relaxing each": Shape(_relaxing, ("constant",), "it settles within {mark} of each start", "gradual", of="runs"),
    "levels": Shape(_levels, (), "a value at each of its levels", each=True, size="difference"),
    "apart": Shape(_apart, ("elsewhere", "there"), "one apart from the others", size="difference", noun="an offset"),
    "smooth": Shape(_smooth, (), "smooth", each=True),
}
"""Every shape by its name."""
