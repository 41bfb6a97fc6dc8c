"""A law that nobody wrote down: an error of one place that follows one quantity, found in a remainder."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from textwrap import fill
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from thermal_robot.effects.effect import Effect, Parameter, Response, at_base, at_joint, at_segment, at_tool
from thermal_robot.effects.quantities import quantity

if TYPE_CHECKING:
    from thermal_robot.observations import Observations

Array = NDArray[np.float64]
Shape = Literal[
    "constant", "ramp", "quadratic", "step", "slide", "hinge", "bump", "drag", "harmonic", "levels", "smooth"
]

PREFIX = "discovered."
_IN_WORDS = {"ramp": "in proportion", "drag": "its slope and its sign", "levels": "a value at each of its levels"}
COMPONENTS = ("along x", "along y", "along z", "about x", "about y", "about z")


@dataclass(frozen=True)
class Discovered(Effect):
    """An error enters at one place and follows one quantity x by a law f(x) = Σ_k c_k φ_k(x).

    ========= ======================================================= ==========================
    shape     φ_k(x), with u = (x − origin) / span                    marks
    ========= ======================================================= ==========================
    constant  1
    ramp      1, u
    quadratic 1, u, u²
    step      x ≤ m, x > m                                            where it steps
    slide     ½ (1 ∓ tanh((x − m) / w))                               middle, width
    hinge     1, max(x − m, 0) / span, or on the other side           where it bends, side ±1
    bump      1, exp(−½ ((x − m) / w)²)                               middle, width
    drag      1, u, sign(x)                                           of a quantity with a sign
    harmonic  1, sin(k x), cos(k x)                                   order k
    levels    x = m_k                                                 the levels
    smooth    natural cubic splines that are 1 at one knot, 0 at all  the knots
    ========= ======================================================= ==========================

    In a joint f is an angle (or a displacement); at the base, the tool or a segment it is a twist, six such laws in the
    place's own frame. Splines: Hastie, Tibshirani and Friedman, *The Elements of Statistical Learning*, 5.2.1. Expected
    size 0.3 mrad in a joint, 0.1 mm and 0.1 mrad elsewhere.

    Attributes
    ----------
    name
        ``discovered.1`` and so on.
    kind, place
        ``joint`` and its name; ``link`` and the name of the joint at the segment's end; ``base``; ``tool``.
    quantity
        Column, joint or derived quantity that it follows.
    shape, marks
        See above.
    origin, span
        Of the quantity in the campaign that it was found in.
    unit
        Of the quantity, for words; empty where it has none.
    turns
        Whether orientation was measured: without it a turn of the tool shows nothing.
    labels
        Names of the levels, where the quantity is a label such as the session.
    """

    name: str = PREFIX + "1"  # type: ignore[misc]
    kind: str = "joint"
    place: str = ""
    quantity: str = ""
    shape: Shape = "smooth"
    marks: tuple[float, ...] = ()
    origin: float = 0.0
    span: float = 1.0
    unit: str = ""
    turns: bool = True
    labels: tuple[str, ...] = ()

    def missing(self, observations: Observations) -> tuple[str, ...]:
        """Return the quantity unless the campaign has it."""
        return () if self.values(observations) is not None else (self.quantity,)

    def reads(self, observations: Observations) -> tuple[str, ...]:
        """Return the column that it follows."""
        return (self.quantity,) if self.quantity in observations.covariates else ()

    def values(self, observations: Observations) -> Array | None:
        """Return the (N,) quantity, as this law counts it."""
        campaign = observations.campaign
        if self.shape == "constant":
            return np.zeros(campaign.samples)
        if self.labels and self.quantity in campaign.labels:
            number = {label: float(k) for k, label in enumerate(self.labels)}
            # of a session that was not there nothing is known: it is taken for the last
            return np.array([number.get(label, len(self.labels) - 1.0) for label in campaign.labels[self.quantity]])
        if self.quantity == "order" and self.quantity not in observations.covariates and campaign.position is None:
            # what is to be predicted without a clock comes after the campaign
            return np.full(campaign.samples, self.origin + self.span)
        return quantity(observations, self.quantity)

    def functions(self, values: Array) -> tuple[Array, tuple[str, ...]]:
        """Return (N, K) the functions φ at values of the quantity, and a name for each."""
        return _SHAPES[self.shape](self, values)

    def parameters(self, observations: Observations) -> tuple[Parameter, ...]:
        """Return one parameter a function and component; rad or m."""
        robot, values = observations.robot, self.values(observations)
        if values is None:
            return ()
        functions, labels = self.functions(values)
        found = []
        if self.kind == "joint":
            j = robot.joint_names.index(self.place)
            unit = "m" if robot.joint_types[j] == "prismatic" else "rad"
            for function, label in zip(functions.T, labels, strict=True):
                found.append(Parameter(label, unit, 3e-4, "joint", self.place, (at_joint(j, function),)))
            return tuple(found)
        respond, where = self._responder(observations)
        components = COMPONENTS[: 6 if self.turns or self.kind != "tool" else 3]
        for function, label in zip(functions.T, labels, strict=True):
            for c, component in enumerate(components):
                twist = function[:, None] * np.eye(6)[c]
                unit = "m" if c < 3 else "rad"
                found.append(Parameter(f"{component}, {label}", unit, 1e-4, self.kind, where, (respond(twist),)))
        return tuple(found)

    def nearby(self, factor: float) -> tuple[Effect, ...]:
        """Return the same law with its mark a little lower and higher: by a share of the range."""
        if self.shape not in ("step", "slide", "hinge", "bump"):
            return (self,)
        shift = (factor - 1.0) * 0.04 * self.span
        moved = [replace(self, marks=(self.marks[0] + s, *self.marks[1:])) for s in (0.0, shift, -shift)]
        if self.shape in ("slide", "bump"):
            moved += [replace(self, marks=(self.marks[0], self.marks[1] * f)) for f in (factor, 1.0 / factor)]
        return tuple(moved)

    def to_source(self, values: Array, name: str = "my_effect") -> str:
        """Write the law as an effect file that can be named, kept and put under ``thermal_robot.effects``.

        Parameters
        ----------
        values
            What was fitted; stands in the file as a comment, as an effect holds no values.
        name
            Of the effect.
        """
        fields = {k: v for k, v in self.arguments().items() if k != "name"}
        lines = "\n".join(f"    {key}: Any = {_literal(value)}" for key, value in fields.items())
        title = "".join(part.capitalize() for part in name.split("_"))
        found = fill(", ".join(f"{v:.4g}" for v in values), 100, initial_indent="    ", subsequent_indent="    ")
        what = self.describe()
        return _SOURCE.format(title=title, name=name, lines=lines, values=found, what=what[:1].upper() + what[1:])

    def describe(self) -> str:
        """Say in a few words where the error enters and what it follows."""
        at = {"joint": f"joint {self.place}", "link": f"the placement of {self.place}"}.get(
            self.kind, f"the {self.kind}"
        )
        if self.shape == "constant":
            return f"a constant error at {at}"
        how = {"step": "a step", "slide": "a smooth step", "hinge": "a bend", "bump": "a bump"}.get(self.shape, "")
        shape = f"{how} at {self._marked(self.marks[0])}" if how else _IN_WORDS.get(self.shape, self.shape)
        shape += f" of order {self.marks[0]:g}" if self.shape == "harmonic" else ""
        return f"an error at {at} that follows {self.quantity} ({shape})"

    def _marked(self, mark: float) -> str:
        return f"{mark:.3g} {self.unit}".rstrip().replace("-", "−")

    def _responder(self, observations: Observations) -> tuple[Callable[[Array], Response], str]:
        if self.kind == "base":
            return at_base, "base"
        if self.kind == "tool":
            return at_tool, "tool"
        segments = observations.robot.segments
        s = next(s for s, segment in enumerate(segments) if segment.name == self.place)
        return lambda twist: at_segment(s, twist), segments[s].parent_link


def _literal(value: object) -> str:
    if isinstance(value, tuple) and value:
        return "(\n" + "".join(f"        {item!r},\n" for item in value) + "    )"
    return repr(value)


def _constant(law: Discovered, x: Array) -> tuple[Array, tuple[str, ...]]:
    return np.ones((len(x), 1)), ("constant",)


def _ramp(law: Discovered, x: Array) -> tuple[Array, tuple[str, ...]]:
    u = (x - law.origin) / law.span
    return np.column_stack([np.ones_like(u), u]), ("at the start", "rise over the campaign")


def _quadratic(law: Discovered, x: Array) -> tuple[Array, tuple[str, ...]]:
    u = (x - law.origin) / law.span
    return np.column_stack([np.ones_like(u), u, u**2]), ("constant", "linear", "quadratic")


def _step(law: Discovered, x: Array) -> tuple[Array, tuple[str, ...]]:
    late = x > law.marks[0]
    return np.column_stack([~late, late]).astype(float), ("before", "after")


def _slide(law: Discovered, x: Array) -> tuple[Array, tuple[str, ...]]:
    middle, width = law.marks
    late = 0.5 * (1.0 + np.tanh((x - middle) / width))
    return np.column_stack([1.0 - late, late]), ("before", "after")


def _hinge(law: Discovered, x: Array) -> tuple[Array, tuple[str, ...]]:
    mark, side = law.marks
    bent = np.maximum(side * (x - mark), 0.0) / law.span
    return np.column_stack([np.ones_like(x), bent]), ("constant", "slope beyond, over the range")


def _bump(law: Discovered, x: Array) -> tuple[Array, tuple[str, ...]]:
    middle, width = law.marks
    return np.column_stack([np.ones_like(x), np.exp(-0.5 * ((x - middle) / width) ** 2)]), ("constant", "height")


def _drag(law: Discovered, x: Array) -> tuple[Array, tuple[str, ...]]:
    return np.column_stack([np.ones_like(x), x / law.span, np.sign(x)]), (
        "constant",
        "slope over the range",
        "of its sign",
    )


def _harmonic(law: Discovered, x: Array) -> tuple[Array, tuple[str, ...]]:
    order = law.marks[0]
    return np.column_stack([np.ones_like(x), np.sin(order * x), np.cos(order * x)]), ("constant", "sine", "cosine")


def _levels(law: Discovered, x: Array) -> tuple[Array, tuple[str, ...]]:
    nearest = np.abs(x[:, None] - np.array(law.marks)).argmin(axis=1)
    if law.labels:
        return np.eye(len(law.marks))[nearest], tuple(f"at {law.labels[int(m)]}" for m in law.marks)
    return np.eye(len(law.marks))[nearest], tuple(f"at {law._marked(m)}" for m in law.marks)


def _smooth(law: Discovered, x: Array) -> tuple[Array, tuple[str, ...]]:
    from scipy.interpolate import CubicSpline

    knots = (np.array(law.marks) - law.origin) / law.span
    u = (x - law.origin) / law.span
    spline = CubicSpline(knots, np.eye(len(knots)), bc_type="natural")
    inside = spline(np.clip(u, knots[0], knots[-1]))
    # beyond the outer knots a natural spline runs straight
    slope = spline(knots[[0, -1]], 1)
    beyond = np.minimum(u - knots[0], 0.0)[:, None] * slope[0] + np.maximum(u - knots[-1], 0.0)[:, None] * slope[1]
    return inside + beyond, tuple(f"at {law._marked(m)}" for m in law.marks)


_SOURCE = '''"""{what}.

Found in a campaign by thermal_robot, named by hand.
"""

from dataclasses import dataclass
from typing import Any

from thermal_robot.effects.law import Discovered


@dataclass(frozen=True)
class {title}(Discovered):
    """{what}.

    In the campaign where it was found its values were, in SI:

{values}
    """

    name: Any = "{name}"
{lines}
'''

_SHAPES: dict[str, Callable[[Discovered, Array], tuple[Array, tuple[str, ...]]]] = {
    "constant": _constant,
    "ramp": _ramp,
    "quadratic": _quadratic,
    "step": _step,
    "slide": _slide,
    "hinge": _hinge,
    "bump": _bump,
    "drag": _drag,
    "harmonic": _harmonic,
    "levels": _levels,
    "smooth": _smooth,
}
