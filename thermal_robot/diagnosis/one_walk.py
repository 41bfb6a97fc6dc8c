"""One walk over folds: what a linear model leaves on rows held out, with any of its effects left out.

A fold is any set of rows. Frames and parameters are fitted to the other rows, and predict those of the fold. Everything
comes from sums of products of the model's columns, so that a fold, or an effect left out, costs one small solution.

What a figure of held-out rows may be off by is told by the jackknife over blocks of consecutive rows (Efron and Stein,
*Annals of Statistics* 9, 1981): the whole walk is repeated without one block, fits included. A fit without a fold and a
block is found to first order: θ(−fold, −block) = θ(−fold) + θ(−block) − θ.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from thermal_robot.arrays import Array
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import equations_of, ridge
from thermal_robot.inference.explain import Explanation
from thermal_robot.inference.problem import Linear, Whitening
from thermal_robot.inference.rows import each
from thermal_robot.inference.stack import chunks

Labels = NDArray[np.int64]
Rows = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Model:
    """A linear model whose frames and K parameters can be fitted to any rows.

    ``scales``: prior standard deviation of each block's parameters, in expected sizes; one for all, or (P,), next to
    none where held at zero. ``variance`` of the noise in squares of the whitening noise, against which priors count; a
    fit to some rows whitens those alone. ``kept`` (N,): rows on which it is judged; ``block`` (N,): block of
    consecutive rows, 0..B−1. ``apart``: positions and orientations count by what is left of each, as where frames are
    registered, not in the ratio of their noise. ``seen``: sums of products by their rows.
    """

    linear: Linear
    scales: tuple[Array | float, ...]
    whitening: Whitening
    variance: float
    kept: Rows
    block: Labels
    apart: bool = False
    seen: dict[bytes, Array] = field(default_factory=dict, repr=False)

    @classmethod
    def of(cls, explanation: Explanation, block: Labels, further: Mapping[int, float] | None = None) -> Model:
        """Return the model of an explanation, not judged by outliers; ``further`` blocks with scales come last."""
        e = explanation
        own = {b: e.held(b) / e.linear.blocks[b].sizes for b in e.best.blocks}
        scales: dict[int, Array | float] = {**own, **(further or {})}
        linear = Linear(e.linear.gap, e.linear.frames, tuple(e.linear.blocks[b] for b in scales))
        return cls(linear, tuple(scales.values()), e.whitening, e.best.noise**2, ~e.outliers, block)

    def partial(self, nominal: Linear, values: Sequence[Array]) -> Model:
        """Return the model for fits of a part of its effects: linearised at the nominal robot, with a block for each.

        Each is held to the size of its ``values`` in the whole model. Such a fit leaves much, and whatever it is counts
        as noise: a smooth discrepancy is small beside it, and how positions compare with orientations is not what the
        noise says. At the corrected robot frames that are aliases could seem apart, and would stretch without measure.
        """
        pairs = list(zip(values, nominal.blocks, strict=True))
        sizes = [float(np.sqrt(np.mean((v / b.sizes) ** 2))) for v, b in pairs]
        scales = tuple(max(size, settings.LEAST_HELD) * b.kept(v) for size, (v, b) in zip(sizes, pairs, strict=True))
        whitening = replace(self.whitening, smooth=None)
        return replace(self, linear=nominal, scales=scales, whitening=whitening, apart=True, seen={})

    def bare(self, nominal: Linear) -> Model:
        """Return the model of the nominal robot: its frames alone."""
        return self.partial(Linear(nominal.gap, nominal.frames, ()), ())

    @cached_property
    def flat(self) -> int:
        """Number of columns of the frames; they have no prior."""
        return int(self.linear.frames.shape[2])

    @cached_property
    def spans(self) -> tuple[NDArray[np.int64], ...]:
        """Per block: the numbers of its columns."""
        ends = self.flat + np.cumsum([0, *(len(b.sizes) for b in self.linear.blocks)])
        return tuple(np.arange(a, b) for a, b in pairwise(ends))

    @cached_property
    def tight(self) -> Array:
        """(K − flat,) one over the prior variance of each parameter, SI."""
        own = [(b.sizes * scale) ** -2.0 for b, scale in zip(self.linear.blocks, self.scales, strict=True)]
        return np.concatenate([*own, np.zeros(0)])

    def products(self, rows: Rows) -> Array:
        """(G, K + 1, K + 1) Xᵀ V⁻¹ X of the columns and the gap over some rows, V their own covariance; computed once.

        G is two where positions and orientations count apart, else one. Where rows have a smooth discrepancy in common,
        V = 1 + U d Uᵀ with U on these rows alone (Woodbury).
        """
        key = rows.tobytes()
        if key not in self.seen:
            used = self.whitening.weights > 0
            products, smooth = self._as_if_apart(rows & used), self.whitening.smooth
            if smooth is not None:
                which = np.flatnonzero(used)
                products = products - smooth.taken(rows[used], lambda some: self._white(which[some]), settings.UNHEARD)
            self.seen[key] = products
        return self.seen[key]

    def _white(self, rows: NDArray[np.int64]) -> Array:
        """(r, m, K + 1) columns and gap of some rows, whitened as if independent."""
        root = np.sqrt(self.whitening.weights[rows])[:, None] / self.whitening.sigma(rows)
        return np.asarray(self.linear.stack[rows] * root[:, :, None])

    def _as_if_apart(self, rows: Rows) -> Array:
        """(G, K + 1, K + 1) XᵀX over some rows with weight; those of most rows are of all less those of the others."""
        if 2 * rows.sum() > (self.whitening.weights > 0).sum():
            return self._all_apart - self._summed(~rows & (self.whitening.weights > 0))
        return self._summed(rows)

    @cached_property
    def _all_apart(self) -> Array:
        return self._summed(self.whitening.weights > 0)

    def _summed(self, rows: Rows) -> Array:
        numbers, size = np.flatnonzero(rows), self.linear.stack.shape[2]
        groups = self.linear.measures // 3 if self.apart else 1
        found = np.zeros((groups, size, size))
        for chunk in chunks(len(numbers)):
            white = self._white(numbers[chunk])
            for own, some in zip(found, np.split(white, groups, axis=1), strict=True):
                flat = equations_of(some)
                own += flat.T @ flat
        return found

    @cached_property
    def whole(self) -> Array:
        """(G, K + 1, K + 1) the same over all rows."""
        return self.products(np.ones(len(self.block), dtype=bool))

    def determines(self, rows: Rows) -> bool:
        """Tell whether some rows determine as much of the frames as all rows do."""
        return self._rank(self.products(rows)) >= self._rank(self.whole)

    def _rank(self, products: Array) -> int:
        frames = products.sum(axis=0)[: self.flat, : self.flat]
        # a column of the rows held out alone leaves a rounding error of either sign
        length = np.sqrt(np.maximum(np.diag(frames), 0.0)) + np.sqrt(settings.TINY)
        value = np.linalg.eigvalsh(frames / np.outer(length, length)) if self.flat else np.zeros(0)
        return int((value > settings.FRAME_DETERMINED).sum())

    def columns(self, chosen: Sequence[int]) -> NDArray[np.int64]:
        """(k + 1,) numbers of the columns of the frames and of some blocks, and of the gap."""
        return np.concatenate(
            [np.arange(self.flat), *(self.spans[b] for b in chosen), [self.whole.shape[1] - 1]]
        ).astype(np.int64)

    def fits(self, rows: Sequence[Rows], chosen: Sequence[int]) -> list[Array]:
        """Fit frames and some blocks to each set of rows: (k + 1,) −θ and 1; what all rows leave is noise to priors."""
        picked = self.columns(chosen)
        tight = self.tight[picked[self.flat : -1] - self.flat]
        own = (slice(None), picked[:, None], picked)
        whole = self.whole[own]
        equations = max(int((self.whitening.weights > 0).sum()) * self.linear.measures, 1) / len(whole)
        # the gap of the nominal robot is what registration leaves
        begin = whole[:, -1, -1] / equations if self.apart else 0.0
        variance = np.maximum(begin, np.full(len(whole), self.variance))
        for _ in range(settings.FOLD_ROUNDS):
            signed = _signed(whole, variance, self.flat, tight)
            variance = np.maximum(np.einsum("i,gij,j->g", signed, whole, signed) / equations, self.variance)
        solved: dict[bytes, Array] = {}
        for used in rows:
            if used.tobytes() not in solved:
                solved[used.tobytes()] = _signed(self.products(used)[own], variance, self.flat, tight)
        return [solved[used.tobytes()] for used in rows]


def _signed(products: Array, variance: Array, flat: int, tight: Array) -> Array:
    # in units of the first variance, so that one kind alone is not rescaled
    weighted = np.einsum("g,gij->ij", variance[0] / variance, products)
    return np.append(-ridge(weighted, flat, variance[0] * tight), 1.0)


@dataclass(frozen=True, eq=False)
class Squares:
    """Sums of squared distances of rows held out, m²: over all, and (B,) of the walk repeated without each block."""

    total: float
    without: Array

    def __add__(self, other: Squares) -> Squares:
        """Add two sums over the same walk."""
        return Squares(self.total + other.total, self.without + other.without)

    def __sub__(self, other: Squares) -> Squares:
        """Take the sums of another model from these: what it gains."""
        return self + -1.0 * other

    def __rmul__(self, factor: float) -> Squares:
        """Weigh the sums."""
        return Squares(factor * self.total, factor * self.without)


@dataclass(frozen=True, eq=False)
class Walk:
    """A model fitted without each fold, and what it leaves there; ``tests`` are (N,) the rows that each holds out."""

    model: Model
    tests: tuple[Rows, ...]

    @classmethod
    def over(cls, model: Model, tests: Sequence[Rows]) -> Walk:
        """Walk over folds; left out are those without rows, and those without which the frames are not determined."""
        kept = [t for t in tests if (t & model.kept).any() and (~t).sum() > 1]
        return cls(model, tuple(t for t in kept if model.determines(~t)))

    @property
    def rows(self) -> int:
        """How many rows are held out, one in two folds counted twice."""
        return int(sum((test & self.model.kept).sum() for test in self.tests))

    @property
    def rows_without(self) -> NDArray[np.int64]:
        """(B,) how many without each block."""
        held = np.sum(self.tests, axis=0) * self.model.kept
        return np.asarray(held.sum() - np.bincount(self.model.block, held))

    @cached_property
    def _blocks(self) -> list[Rows]:
        return each(self.model.block)

    @cached_property
    def _shared(self) -> Array:
        """(F, B) share of each block's rows on which the fit of each fold rests."""
        return np.array([[(own & ~test).sum() / own.sum() for own in self._blocks] for test in self.tests])

    def squares(self, chosen: Sequence[int]) -> Squares:
        """Return the sums of squares that a model with some of the blocks leaves on the rows held out."""
        model, picked, folds = self.model, self.model.columns(chosen), len(self.tests)
        every = np.ones(len(model.block), dtype=bool)
        rows = [*(~test for test in self.tests), *(~own for own in self._blocks), every]
        found = np.stack(model.fits(rows, chosen))
        fits, moved = found[:folds], found[folds:-1] - found[-1]
        total, without = 0.0, np.zeros(len(moved))
        for test, fit, shared in zip(self.tests, fits, self._shared, strict=True):
            judged = test & model.kept
            place = model.linear.stack[judged, :3][:, :, picked]
            total += float(((place @ fit) ** 2).sum())
            each_without = ((place @ (fit + shared[:, None] * moved).T) ** 2).sum(axis=1)
            each_without[np.arange(len(each_without)), model.block[judged]] = 0.0
            without += each_without.sum(axis=0)
        return Squares(total, without)

    def residuals(self, chosen: Sequence[int]) -> Array:
        """(H, m) what is left of each row held out by a model with some of the blocks, fold after fold, m and rad."""
        picked = self.model.columns(chosen)
        fits = self.model.fits([~test for test in self.tests], chosen)
        stack = self.model.linear.stack
        left = [stack[test][:, :, picked] @ fit for test, fit in zip(self.tests, fits, strict=True)]
        return np.concatenate(left)

    @property
    def numbers(self) -> NDArray[np.int64]:
        """(H,) the number of each row held out, fold after fold, outliers too."""
        return np.concatenate([np.flatnonzero(test) for test in self.tests])


def share(part: Squares, whole: Squares) -> tuple[float, tuple[float, float]]:
    """Return what part a sum of squares is of another, 0 of nothing, with a 95 % interval.

    The interval is that of Student's law about ln(1 − part/whole), with the jackknife's variance: one minus a share is
    a ratio of mean squares, so that its logarithm is nearly normal. It is not exact for a handful of blocks.
    """
    if whole.total <= 0.0:
        return 0.0, (0.0, 0.0)
    value = part.total / whole.total
    each = part.without / np.maximum(whole.without, settings.TINY)
    count = len(each)
    if count < 2:
        return value, (-np.inf, 1.0)
    if value >= 1.0 or each.max() >= 1.0:
        half = _half(each)
        return value, (value - half, value + half)
    half = _half(np.log1p(-each))
    wider = float(np.expm1(half))
    return value, (value - (1.0 - value) * wider, value + (1.0 - value) * wider / (1.0 + wider))


def _half(values: Array) -> float:
    """Return half the width of a 95 % interval of a figure from its (B,) values without each block.

    Degrees of freedom by Satterthwaite (*Biometrics Bulletin* 2, 1946): a variance told by B values of kurtosis κ has
    2 B/(κ − 1). A normal law's are about B; where a block or two make up most of the variance, few.
    """
    count, apart = len(values), (values - values.mean()) ** 2
    if not apart.any():
        return 0.0
    apart /= apart.max()
    kurtosis = count * float((apart**2).sum()) / float(apart.sum()) ** 2
    freedom = min(count - 1.0, 2.0 * count / max(kurtosis - 1.0, settings.TINY))
    return float(stdtrit(freedom, settings.INTERVAL[1])) * deviation(values)


def deviation(values: Array) -> float:
    """Return the standard deviation of a figure from its (B,) values without each block (jackknife)."""
    count = len(values)
    return float(np.sqrt((count - 1) / count * ((values - values.mean()) ** 2).sum()))
