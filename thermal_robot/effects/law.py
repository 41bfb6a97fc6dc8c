"""Semiparametric law: an error at one place that follows one quantity, discovered in a residual."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pprint import pformat
from textwrap import fill
from typing import TYPE_CHECKING, Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign.names import CLOCK
from thermal_robot.campaign.turning import strained
from thermal_robot.campaign.units import SI
from thermal_robot.effects import gate
from thermal_robot.effects.arguments import Count, NotNegative
from thermal_robot.effects.catalogue import restored
from thermal_robot.effects.effect import (
    TWIST,
    UNSOURCED,
    Driver,
    Effect,
    Parameter,
    Response,
    at_base,
    at_joint,
    at_segment,
    at_tool,
    in_words,
)
from thermal_robot.effects.fading import Fading, ends, left_at
from thermal_robot.effects.quantities import TURN, driving, quantity, unit
from thermal_robot.effects.shapes import SHAPES
from thermal_robot.schema import word

if TYPE_CHECKING:
    from thermal_robot.observations import Observations


PREFIX = "discovered."
_ALONG = tuple(f"{how} {axis}" for how in ("along", "about") for axis in "xyz")  # components of a twist
_IN_A_JOINT, _ELSEWHERE = 3e-4, 1e-4  # rad; m and rad
_SHIFTED = 0.04  # of the range: how far a mark is moved to refine it, by a factor of two


@dataclass(frozen=True)
class Discovered(Fading):
    """Discovered law f(x) = Σ_k c_k φ_k(x) of one quantity x, by which one place errs.

    The functions φ_k belong to its shape (:mod:`thermal_robot.effects.shapes`), with the ``marks`` that it asks for. In
    a joint f is an angle (or a displacement); at the base, the tool or a segment (``link`` and the name of the joint at
    its end) it is a twist, six such laws in the place's own frame. Expected size 0.3 mrad in a joint, 0.1 mm and
    0.1 mrad elsewhere. ``quantity`` is a column, joint or derived quantity, ``origin`` and ``span`` those in the
    campaign where it was found.

    A law may depend on a second quantity y (``by``): then φ_k·v is added to each φ_k, with v = (y − by_origin) /
    by_span, so that a straight law holds 1, u, v and u·v. It may be the size of a known effect (``of``, with arguments
    as JSON text) that follows x: then the φ_k multiply the unit response of each of the effect's parameters in that
    joint, of the effect's own expected size.

    ``turns``: orientation was measured: without it a turn of the tool shows nothing. ``labels``: names of the levels,
    where the quantity is a label such as the session. ``runs``: sessions between which it steps in time, or in each of
    which it relaxes anew; ``starts``: when those began in which it relaxes, s, one where there are no sessions.
    ``tried``: among how many laws it was picked.
    """

    title: ClassVar[str] = "an unlisted law"
    size_spread: ClassVar[float] = UNSOURCED
    name: str = PREFIX + "1"  # type: ignore[misc]
    kind: Annotated[str, word(("joint", "link", "base", "tool"))] = "joint"
    place: str = ""
    quantity: str = ""
    shape: Annotated[str, word(SHAPES)] = "smooth"
    marks: tuple[float, ...] = ()
    origin: float = 0.0
    span: NotNegative = 1.0
    unit: str = ""
    turns: bool = True
    labels: tuple[str, ...] = ()
    runs: tuple[str, ...] = ()
    starts: tuple[float, ...] = ()
    by: str = ""
    by_origin: float = 0.0
    by_span: NotNegative = 1.0
    of: str = ""
    of_arguments: str = "{}"
    tried: Count = 1.0

    @property
    def share(self) -> float:
        """Prior probability of one law among all that were tried, 1/``tried``."""
        return 1.0 / self.tried

    @property
    def sides(self) -> tuple[Discovered, ...]:
        """The law itself; for a hinge also the law with the other side of the bend sloping."""
        return (self, replace(self, marks=(self.marks[0], -self.marks[1]))) if self.shape == "hinge" else (self,)

    @property
    def follows(self) -> str:
        """Name of the quantity that the law follows, or of the product of two, as a diagnosis reports it."""
        return f"{self.quantity} * {self.by}" if self.by else self.quantity

    @property
    def modulated(self) -> Effect | None:
        """Known effect that the quantity modulates, in the law's joint; ``None`` without, or if it has a ``share``."""
        known = restored(self.of, self.of_arguments) if self.of else None
        return None if known is None or known.share is not None else gate.placed(known, (self.place,))

    def missing(self, observations: Observations) -> tuple[str, ...]:
        """Columns that the campaign lacks for the law, or for the effect that it modulates."""
        lacking: tuple[str, ...] = () if self.values(observations) is not None else (self.quantity,)
        if self.by and self._read(observations, self.by) is None:
            lacking += (self.by,)
        return lacking + (gate.missing(self.modulated, observations) if self.modulated else ())

    def reads(self, observations: Observations) -> tuple[str, ...]:
        """Columns of the quantity, of the order of moves, and of the modulated effect."""
        names = [self.quantity, self.by]
        if self.quantity.startswith(TURN):
            names += [name for name in CLOCK if name in observations.covariates][:1]
        if self.modulated:
            names += gate.reads(self.modulated, observations)
        return tuple(name for name in dict.fromkeys(names) if name in observations.covariates)

    def values(self, observations: Observations) -> Array | None:
        """Values (N,) of the quantity (labels by number), or for a ``product`` of both; ``None`` if it is lacking."""
        first = self._first(observations)
        if self.shape != "product" or first is None:
            return first
        second = self._read(observations, self.by)
        return None if second is None else first * second

    def _first(self, observations: Observations) -> Array | None:
        campaign = observations.campaign
        if self.shape == "constant":
            return np.zeros(campaign.samples)
        if self.labels and (self.quantity in campaign.labels or not campaign.measured):
            number = {label: float(k) for k, label in enumerate(self.labels)}
            rows = campaign.labels.get(self.quantity, np.full(campaign.samples, ""))
            return np.array([number.get(label, np.nan) for label in rows])
        return self._read(observations, self.quantity)

    def _read(self, observations: Observations, name: str) -> Array | None:
        """Values (N,) of a quantity; for rows to be predicted without ``order``, that of the campaign's end."""
        campaign = observations.campaign
        if name == "order" and name not in observations.covariates and not campaign.measured:
            ends = (self.origin, self.span) if name == self.quantity else (self.by_origin, self.by_span)
            return np.full(campaign.samples, sum(ends))  # after the campaign
        return quantity(observations, name)

    def _followed(self, observations: Observations) -> Array | None:
        """Argument of the basis functions at the rows: quantity, strains of stop operators, or time since a start.

        It is (N,) or (N, K); ``None`` where the campaign lacks it.
        """
        of, clock = SHAPES[self.shape].of, self.values(observations)
        if of == "quantity" or clock is None:
            return clock
        if of == "strains":  # of each element over what makes it slip, −1 to 1
            past, joint = observations.campaign.since_turn, self.quantity.removeprefix(TURN)
            return np.column_stack([past[strained(joint, slip)] / slip for slip in self.marks])
        since, run = self._since_start(observations, clock)
        if of == "run":
            return since[:, None]
        new = run[:, None] < 0
        # of a session that was not there it starts with the mean of all: exp(−ln R) = 1 / R
        since = since[:, None] + new * abs(self.marks[0]) * np.log(len(self.runs))
        return np.where((run[:, None] == np.arange(len(self.runs))) | new, since, np.inf)

    def _since_start(self, observations: Observations, clock: Array) -> tuple[Array, NDArray[np.int64]]:
        """Time (N,) since the row's session began, and the number of that session.

        A session unknown to the law begins with its first row and has the number −1; a row without a session belongs to
        the last one begun.
        """
        starts, rows = np.array(self.starts), observations.campaign.labels.get("session")
        run = np.clip(np.searchsorted(np.sort(starts), clock, side="right") - 1, 0, len(starts) - 1)
        run = np.argsort(starts)[run]
        began = starts[run]
        for label in np.unique(rows) if rows is not None and self.runs else ():
            own = rows == label
            known = label in self.runs
            run[own] = self.runs.index(label) if known else -1
            began[own] = starts[run[own]] if known else clock[own].min()
        return np.maximum(clock - began, 0.0), run

    def functions(self, values: Array) -> tuple[Array, tuple[str, ...]]:
        """Basis functions φ, (N, K), at arguments of the shape, and a name for each."""
        shape, clock = SHAPES[self.shape], self.quantity in CLOCK
        start = "the start" if clock else f"{self.quantity} {self._marked(self.origin)}"
        over = "the campaign" if clock else f"{self._marked(self.span)} of {self.quantity}"
        labels = [label.format(start=start, range=over) for label in shape.labels]
        if shape.each and self.labels:
            labels += [f"at {self.labels[int(mark)]}" for mark in self.marks]
        elif shape.each:  # as many digits as tell the marks apart
            digits = next(d for d in range(3, 18) if len({f"{m:.{d}g}" for m in self.marks}) == len(set(self.marks)))
            labels += [f"at {self._marked(mark, digits)}" for mark in self.marks]
        labels += [f"at the start of {run}" for run in self.runs if shape.of == "runs"]
        return shape.functions(values, self.marks, self.origin, self.span), tuple(labels)

    def at_rows(self, observations: Observations) -> tuple[Array, tuple[str, ...]] | None:
        """Basis functions (N, K) at the rows, and a name for each; ``None`` where the campaign lacks them.

        They fade outside the range where they were found. At an unknown label they are the mean over the known ones.
        """
        values, two = self._followed(observations), bool(self.by) and self.shape != "product"
        second = self._read(observations, self.by) if two else None
        if values is None or (two and second is None):
            return None
        if ranges := self._ranges:
            values = np.clip(values, *ranges[0])
        functions, labels = self.functions(values)
        if self.labels and np.isnan(values).any():
            functions[np.isnan(values)] = self.functions(np.arange(float(len(self.labels))))[0].mean(axis=0)
        if second is not None:
            v = ((np.clip(second, *ranges[1]) if ranges else second) - self.by_origin) / self.by_span
            functions = np.column_stack([functions, functions * v[:, None]])
            labels = (*labels, *(f"{name}, × {self.by}" for name in labels))
        return self.faded(functions, self._left(observations)), labels

    @property
    def _ranges(self) -> list[tuple[float, float]]:
        return list(zip(self.found[::2], self.found[1::2], strict=True))

    def _left(self, observations: Observations) -> Array:
        """Fading factor (N,) of the law, the product over its drivers; 1 along time, as what has changed stays."""
        left = np.ones(observations.campaign.samples)
        for (name, driver), (low, high) in zip(self._driven(observations), self._ranges, strict=False):
            left = left if name in CLOCK else left * left_at(driver, low, high)
        return left

    def _driven(self, observations: Observations) -> list[tuple[str, Array]]:
        """Quantities, by name, whose ranges bound the fading: the first, the second, and sum and difference of both."""
        first, values = self._first(observations), self.values(observations)
        if self.labels or SHAPES[self.shape].of != "quantity" or self.shape == "constant" or first is None:
            return []
        second = self._read(observations, self.by) if self.by else None
        if second is None or values is None:
            return [(self.quantity, first)]
        if self.shape == "product":
            return [(self.quantity, values), (self.by, second), (self.quantity, first)]
        u, v = (first - self.origin) / self.span, (second - self.by_origin) / self.by_span
        both = self.quantity if self.quantity in CLOCK else self.by
        return [(self.quantity, first), (self.by, second), (both, u + v), (both, u - v)]

    def delivered(self, observations: Observations) -> Effect:
        """Copy for prediction, with the ranges where it was found and the means there; its modulated effect, too."""
        law, rows = self, self.at_rows(observations)
        if self.modulated is not None:
            kept = gate.arguments(gate.delivered(self.modulated, observations))
            law = replace(self, of_arguments=json.dumps({k: v for k, v in kept.items() if k != "places"}))
        if rows is None or not (driven := self._driven(observations)):
            return law
        means = tuple(rows[0].mean(axis=0).tolist())
        return replace(law, found=tuple(end for _, values in driven for end in ends(values)), means=means)

    def parameters(self, observations: Observations) -> tuple[Parameter, ...]:
        """One parameter for each function and component; rad or m, or the unit of the modulated effect."""
        rows = self.at_rows(observations)
        if rows is None:
            return ()
        own, found = self._own(observations), []
        for function, label in zip(rows[0].T, rows[1], strict=True):
            for p in own:
                rows_of = {"joint": function}
                responses = tuple(
                    replace(r, values=r.values * rows_of.get(r.channel, function[:, None])) for r in p.responses
                )
                name = f"{p.label}, {label}" if p.label else label
                found.append(replace(p, label=name, responses=responses, positive=False))
        return self.registered(found, [self._left(observations)] * len(found))

    def _own(self, observations: Observations) -> tuple[Parameter, ...]:
        """Parameters that a function multiplies: those of the modulated effect, or one for each component."""
        robot = observations.robot
        if self.modulated is not None:
            return gate.checked(self.modulated, observations)
        if self.kind == "joint":
            response, own = at_joint(robot.joint_names.index(self.place), 1.0), unit(robot, self.place)
            return (Parameter("", own, _IN_A_JOINT, "joint", self.place, (response,)),)
        respond: Callable[[Array], Response] = at_base if self.kind == "base" else at_tool
        where = self.kind
        if self.kind == "link":
            s, segment = next((s, own) for s, own in enumerate(robot.segments) if own.name == self.place)
            respond, where = (lambda twist: at_segment(s, twist)), segment.parent_link
        shown = zip(_ALONG, TWIST, np.eye(6)[: 6 if self.turns or self.kind != "tool" else 3], strict=False)
        return tuple(
            Parameter(along, measured, _ELSEWHERE, self.kind, where, (respond(twist),))
            for along, (_, measured), twist in shown
        )

    def nearby(self, factor: float) -> tuple[Effect, ...]:
        """Return the law itself, and copies with its mark shifted either way by part of the range, or width scaled."""
        shape = SHAPES[self.shape]
        if not shape.mark:
            return (self,)
        shift = (factor - 1.0) * _SHIFTED * self.span
        widths = (factor, 1.0 / factor) if shape.width else ()
        wider = (replace(self, marks=(self.marks[0], self.marks[1] * f)) for f in widths)
        return self, self.shifted(shift), self.shifted(-shift), *wider

    def shifted(self, by: float) -> Discovered:
        """Copy with its first mark shifted; a step loses its session labels, a time constant stays positive."""
        if self.starts:
            return replace(self, marks=(abs(self.marks[0] + by), *self.marks[1:]))
        return replace(self, marks=(self.marks[0] + by, *self.marks[1:]), runs=())

    def driver(self, observations: Observations, parameters: Sequence[Parameter], error: Array) -> Driver | None:
        """Quantity that it follows."""
        return driving(observations, self.quantity)

    def to_source(self, values: Array, name: str = "my_effect") -> str:
        """Write the law as a Python file of an effect; the fitted values (P,), SI, stand in it as a comment."""
        fields = {key: value for key, value in self.arguments().items() if key != "name"}
        what = self.describe()
        return _SOURCE.format(
            title="".join(part.capitalize() for part in name.split("_")),
            name=name,
            lines="\n".join(f"    {key}: Any = {pformat(value, width=100)}" for key, value in fields.items()),
            values=fill(", ".join(f"{v:.4g}" for v in values), 100, initial_indent="    ", subsequent_indent="    "),
            what=what[:1].upper() + what[1:],
        )

    def describe(self) -> str:
        """Describe in a few words where the error enters and what it follows."""
        at = {"joint": in_words("joint", self.place), "link": f"the placement of {self.place}"}.get(
            self.kind, f"the {self.kind}"
        )
        mark, zero, step = self.marks[0] if self.marks else 0.0, self.kind == "joint", self.shape == "step"
        how = SHAPES[self.shape].words.format(mark=self._marked(mark), order=mark)
        if self.shape == "harmonic" and self.unit == SI.length:
            how = f"a wave of {2.0 * np.pi / mark:.4g} {self.unit}"
        follows = "its position" if zero and self.place == self.quantity else self.quantity
        if self.modulated is not None:
            return f"{self.modulated.singular} in {at} that changes with {follows} ({how})"
        if self.shape == "constant":
            return f"a constant error at {at}"
        if self.labels and not self.by:
            return f"{f'the zero of {at} is another' if zero else f'{at} stands elsewhere'} {self._when()}"
        if not zero and self.runs and step:
            return f"{at} stands elsewhere from session {self.runs[1]} on"
        if zero and step and not self.by and self.quantity in CLOCK:
            between = f", between session {self.runs[0]} and {self.runs[1]}" if self.runs else ""
            when = (f"{mark:.0f}" if abs(mark) >= 1000.0 else f"{mark:.4g}").replace("-", "−")  # without an exponent
            return f"the zero of {at} jumped at {self.quantity} {when} {self.unit}".rstrip() + between
        if self.by:
            follows = f"{follows} times {self.by}"
        elif self.quantity.startswith(TURN):
            follows = "how far it has gone since it last turned round"
        return f"an error at {at} that follows {follows} ({how})"

    def _when(self) -> str:
        """Labels at which it differs from elsewhere, in words."""
        if self.shape == "apart":
            return f"in {self.quantity} {self.labels[int(self.marks[0])]}"
        if len(self.labels) == 2:
            return f"in {self.quantity} {self.labels[1]} than in {self.labels[0]}"
        return f"in each {self.quantity}"

    def _marked(self, mark: float, digits: int = 3) -> str:
        return f"{mark:.{digits}g} {self.unit}".rstrip().replace("-", "−")


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
