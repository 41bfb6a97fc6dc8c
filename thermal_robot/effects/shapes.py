"""Basis functions of discovered laws: for each shape its functions, their names, and words.

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
from typing import Any, Literal

import numpy as np

from thermal_robot.arrays import Array

_SHORTEST = 1e-6  # of the range: what settles within less is settled at once

Marks = tuple[float, ...]
Curves = Callable[[Array, Marks, float, float], list[Any]]


@dataclass(frozen=True)
class Shape:
    """Basis functions φ of one shape of a discovered law (see the module's table), and the words for it.

    ``curves`` names its functions but for the one that stands ``beside`` them: a ``constant``, or for a share the
    ``rest`` of it. ``labels`` name those that do not belong to one of the marks ``each``; ``{start}`` and ``{range}``
    stand for origin and span, in the quantity's unit; in ``words`` ``{mark}`` stands for its first mark with the unit,
    ``{order}`` without. ``mark`` is ``sudden`` where moving it changes the functions only when it passes a row,
    ``gradual`` where smoothly, empty where it is not to be moved; ``width`` where the second mark is a width, to be
    refined, too. ``size`` is what the difference between its largest and its smallest value is called, ``noun`` a short
    name. ``of`` is what the functions are of: the (N,) ``quantity``; the (N, K) ``strains`` of elements of slips as
    marked; the (N, 1) time since the ``run`` began, or since each of the ``runs`` began, infinite in the others (N, R).
    """

    curves: str
    labels: tuple[str, ...]
    words: str
    beside: Literal["constant", "rest", ""] = "constant"
    mark: Literal["", "sudden", "gradual"] = ""
    width: bool = False
    each: bool = False
    size: str = "range"
    noun: str = "an error"
    of: Literal["quantity", "strains", "run", "runs"] = "quantity"

    def functions(self, x: Array, marks: Marks, origin: float, span: float) -> Array:
        """Basis functions (N, K) of the argument of the shape, (N,) or (N, K)."""
        curves = np.column_stack([np.empty((len(x), 0)), *_CURVES[self.curves](x, marks, origin, span)])
        first = {"constant": np.ones((len(x), 1)), "rest": 1.0 - curves, "": curves[:, :0]}[self.beside]
        return np.hstack([first, curves])


def _splines(x: Array, knots: Marks, origin: float, span: float) -> list[Array]:
    from scipy.interpolate import CubicSpline

    at, u = (np.array(knots) - origin) / span, (x - origin) / span
    spline = CubicSpline(at, np.eye(len(at)), bc_type="natural")
    inside, slope = spline(np.clip(u, at[0], at[-1])), spline(at[[0, -1]], 1)
    beyond = np.minimum(u - at[0], 0.0)[:, None] * slope[0] + np.maximum(u - at[-1], 0.0)[:, None] * slope[1]
    return [inside + beyond]


_CURVES: dict[str, Curves] = {
    "constant": lambda x, m, o, s: [],
    "ramp": lambda x, m, o, s: [(x - o) / s],
    "quadratic": lambda x, m, o, s: [(x - o) / s, ((x - o) / s) ** 2],
    "step": lambda x, m, o, s: [x > m[0]],
    "run": lambda x, m, o, s: [(x > m[0]) & (x < m[1])],
    "slide": lambda x, m, o, s: [0.5 * (1.0 + np.tanh((x - m[0]) / m[1]))],
    "hinge": lambda x, m, o, s: [np.maximum(m[1] * (x - m[0]), 0.0) / s],
    "bump": lambda x, m, o, s: [np.exp(-0.5 * ((x - m[0]) / m[1]) ** 2)],
    "drag": lambda x, m, o, s: [x / s, np.sign(x)],
    "harmonic": lambda x, m, o, s: [np.sin(m[0] * x), np.cos(m[0] * x)],
    "product": lambda x, m, o, s: [x / s],
    "hysteresis": lambda x, m, o, s: [x],
    "relaxing": lambda x, m, o, s: [np.exp(-x / max(abs(m[0]), _SHORTEST * s))],
    "levels": lambda x, m, o, s: [np.eye(len(m))[np.abs(x[:, None] - np.array(m)).argmin(axis=1)]],
    "apart": lambda x, m, o, s: [x == m[0]],
    "smooth": _splines,
}
"""Functions of x, (N,) or (N, K), the marks, origin and span."""
_BEFORE, _THERE, _ONE = ("before", "after"), ("elsewhere", "there"), "constant"
_SETTLES = "it settles within {mark} of each start"

SHAPES: dict[str, Shape] = {
    "constant": Shape("constant", (_ONE,), "constant", noun="a constant error"),
    "ramp": Shape("ramp", ("at {start}", "rise over {range}"), "in proportion"),
    "quadratic": Shape("quadratic", (_ONE, "linear", "quadratic"), "quadratic"),
    "step": Shape("step", _BEFORE, "a step at {mark}", "rest", "sudden", size="step", noun="a step"),
    "run": Shape("run", _THERE, "another value for a while", "rest", size="step", noun="a step"),
    "slide": Shape(
        "slide", _BEFORE, "a smooth step at {mark}", "rest", "gradual", width=True, size="step", noun="a step"
    ),
    "hinge": Shape("hinge", (_ONE, "slope beyond, over {range}"), "a bend at {mark}", mark="gradual"),
    "bump": Shape("bump", (_ONE, "height"), "a bump at {mark}", mark="gradual", width=True, size="bump", noun="a bump"),
    "drag": Shape("drag", (_ONE, "slope over {range}", "of its sign"), "its slope and its sign"),
    "harmonic": Shape(
        "harmonic", (_ONE, "sine", "cosine"), "harmonic of order {order:g}", size="peak to peak", noun="a wave"
    ),
    "product": Shape("product", (_ONE, "at the largest product"), "in proportion to the product"),
    "hysteresis": Shape("hysteresis", (_ONE,), "springs that slip", each=True, of="strains"),
    "relaxing": Shape("relaxing", (_ONE, "at the start"), _SETTLES, mark="gradual", of="run"),
    "relaxing each": Shape("relaxing", (_ONE,), _SETTLES, mark="gradual", of="runs"),
    "levels": Shape("levels", (), "a value at each of its levels", "", each=True, size="difference"),
    "apart": Shape("apart", _THERE, "one apart from the others", "rest", size="difference", noun="an offset"),
    "smooth": Shape("smooth", (), "smooth", "", each=True),
}
"""Every shape by its name."""
