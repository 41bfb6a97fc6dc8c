"""Cross-validation of a linear model under any scheme of folds, with any of its effects left out; Shapley shares.

Frames and parameters are fitted without a fold and predict its rows, from sums of products alone: a fold, or an effect
left out, costs one small solution. Neighbouring rows are alike in time, temperature and place, so that folds of
consecutive rows favour a fit that only follows the course of the campaign (Roberts et al., *Ecography* 40, 2017, on
blocked cross-validation); other schemes show whether it extrapolates.

The uncertainty of a figure is the jackknife's over blocks of consecutive rows (Efron and Stein, *Annals of Statistics*
9, 1981): the whole cross-validation is repeated without one block, fits included. A fit without a fold and a block is
found to first order: θ(−fold, −block) = θ(−fold) + θ(−block) − θ.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from itertools import combinations, pairwise
from math import comb

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.campaign.turning import moves
from thermal_robot.diagnosis import settings as diagnosis_settings
from thermal_robot.diagnosis.values import FoldScheme, HeldOut
from thermal_robot.effects.law_words import is_event
from thermal_robot.errors import EstimationError
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import equations_of, ridge, whitener
from thermal_robot.inference.columns import block as columns
from thermal_robot.inference.explain import Explanation
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.grouping import STAND, Labels, blocks, each, held_out_groups, neighbourhoods
from thermal_robot.inference.kernels import chunks
from thermal_robot.inference.problem import Linear, Whitening

Rows = NDArray[np.bool_]
Share = tuple[float, tuple[float, float]]


@dataclass(frozen=True, eq=False)
class Model:
    """Ridge regression of frames and K parameters on any subset of the rows.

    ``scales``: prior standard deviation of each block's parameters, in expected sizes; one for all, or (P,), tiny for
    those held at zero. ``variance`` of the noise in squares of the whitening noise. ``kept`` (N,): rows that count
    in the score; ``block`` (N,): block of consecutive rows, 0..B−1. ``apart``: positions and orientations are weighted
    by their own residuals, as in a registration, and not by their noise. ``near``: prior standard deviation of the
    frames about those of all rows, m and rad.
    """

    linear: Linear
    scales: tuple[Array | float, ...]
    whitening: Whitening
    variance: float
    kept: Rows
    block: Labels
    apart: bool = False
    near: float = diagnosis_settings.FOLD_FRAMES

    @classmethod
    def of(cls, explanation: Explanation, block: Labels, further: Mapping[int, float] | None = None) -> Model:
        """Model of an explanation without its outliers; ``further`` blocks with their scales come last."""
        e = explanation
        own = {b: e.held(b) / e.linear.blocks[b].sizes for b in e.best.blocks}
        scales: dict[int, Array | float] = {**own, **(further or {})}
        linear = Linear(e.linear.gap, e.linear.frames, tuple(e.linear.blocks[b] for b in scales))
        return cls(linear, tuple(scales.values()), e.whitening, e.best.noise**2, ~e.outliers, block)

    def partial(self, nominal: Linear, values: Sequence[Array] = ()) -> Model:
        """Model for fits of subsets of the effects: linearised at the nominal robot, a block for each effect.

        The prior size of each is that of its ``values`` in the whole model. Rows count as independent, and the residual
        of each fit as noise. At the corrected robot, effects that the frames absorb exactly would seem separable.
        """
        pairs = list(zip(values, nominal.blocks, strict=True))
        sizes = [float(np.sqrt(np.mean((v / b.sizes) ** 2))) for v, b in pairs]
        scales = tuple(max(size, settings.LEAST_HELD) * b.kept(v) for size, (v, b) in zip(sizes, pairs, strict=True))
        return replace(self, linear=nominal, scales=scales, whitening=replace(self.whitening, smooth=None), apart=True)

    @cached_property
    def flat(self) -> int:
        """Number of columns of the frames; they have no prior."""
        return int(self.linear.frames.shape[2])

    @cached_property
    def spans(self) -> tuple[NDArray[np.int64], ...]:
        """Column numbers of the parameters of each block of effects; those of the frames come first."""
        ends = self.flat + np.cumsum([0, *(len(b.sizes) for b in self.linear.blocks)])
        return tuple(np.arange(a, b) for a, b in pairwise(ends))

    @cached_property
    def prior_precision(self) -> Array:
        """Prior precision (K − flat,) of each parameter, SI."""
        own = [(b.sizes * scale) ** -2.0 for b, scale in zip(self.linear.blocks, self.scales, strict=True)]
        return np.concatenate([*own, np.zeros(0)])

    @cached_property
    def _cached_products(self) -> dict[bytes, Array]:
        return {}

    @cached_property
    def _used(self) -> Rows:
        return np.asarray(self.whitening.weights > 0)

    def products(self, rows: Rows) -> Array:
        """Gram matrices (G, K + 1, K + 1) Xᵀ V⁻¹ X of columns and gap over some rows with covariance V; cached.

        G is two where positions and orientations count apart, else one. Where rows have a discrepancy in common,
        V = 1 + U d Uᵀ with U on these rows alone (Woodbury).
        """
        key = rows.tobytes()
        if key not in self._cached_products:
            used, smooth = rows & self._used, self.whitening.smooth
            # the sums over most rows are those over all less those over the others
            most = 2 * used.sum() > self._used.sum()
            products = self._of_all - self._summed(self._used & ~rows) if most else self._summed(used)
            if smooth is not None:
                which = np.flatnonzero(self._used)
                products = products - smooth.reduction(
                    used[which], lambda n: self._white(which[n]), settings.KERNEL_FLOOR
                )
            hidden = np.flatnonzero(~self._touched[used].any(axis=0))  # a difference of sums leaves rounding there
            products[:, hidden], products[:, :, hidden] = 0.0, 0.0
            self._cached_products[key] = products
        return self._cached_products[key]

    @cached_property
    def _touched(self) -> Rows:
        """Mask (N, flat) of the rows in which each column of the frames is not zero."""
        return np.asarray((self.linear.frames != 0.0).any(axis=1))

    def own_artefacts(self, test: Rows) -> NDArray[np.int64]:
        """Return the indices of the frames' columns that are zero in all but the held-out rows: own artefacts."""
        others = self._touched[~test & self._used].any(axis=0)
        return np.flatnonzero(self._touched[test].any(axis=0) & ~others)

    def test_columns(self, test: Rows) -> Array:
        """Columns and gap (n, m, K + 1) of held-out rows, with their own artefacts projected out.

        The place of an instrument's stand is no property of the robot: a held-out stand is judged by its scatter.
        """
        found, own = self.linear.stack[test], self.own_artefacts(test)
        if not len(own):
            return found
        root = np.sqrt(self.whitening.weights[test])[:, None, None] / self.whitening.sigma(test)[:, :, None]
        white = equations_of(found * root)
        return found - found[:, :, own] @ np.linalg.lstsq(white[:, own], white, rcond=settings.ALIAS)[0]

    @cached_property
    def _of_all(self) -> Array:
        return self._summed(self._used)

    def _white(self, rows: NDArray[np.int64]) -> Array:
        """Whitened columns and gap (r, m, K + 1) of some rows, as if rows were independent."""
        root = np.sqrt(self.whitening.weights[rows])[:, None] / self.whitening.sigma(rows)
        return np.asarray(self.linear.stack[rows] * root[:, :, None])

    def _summed(self, rows: Rows) -> Array:
        numbers, size = np.flatnonzero(rows), self.linear.stack.shape[2]
        groups = self.linear.measures // 3 if self.apart else 1
        found = np.zeros((groups, size, size))
        for chunk in chunks(len(numbers)):
            for own, some in zip(found, np.split(self._white(numbers[chunk]), groups, axis=1), strict=True):
                flat = equations_of(some)
                own += flat.T @ flat
        return found

    @cached_property
    def whole(self) -> Array:
        """Gram matrices (G, K + 1, K + 1) over all rows."""
        return self.products(np.ones(len(self.block), dtype=bool))

    def determines(self, rows: Rows) -> bool:
        """Tell whether the frames have full rank in training rows, but for the held-out rows' own artefacts."""
        some, every = (whitener(p.sum(axis=0)[: self.flat, : self.flat]) for p in (self.products(rows), self.whole))
        return bool(some.shape[1] + len(self.own_artefacts(~rows)) >= every.shape[1])

    def columns(self, chosen: Sequence[int]) -> NDArray[np.int64]:
        """Numbers (k + 1,) of the columns of the frames, of some blocks and of the gap."""
        gap = np.array([self.whole.shape[1] - 1])
        return np.concatenate([np.arange(self.flat), *(self.spans[b] for b in chosen), gap])

    def fits(self, rows: Sequence[Rows], chosen: Sequence[int]) -> Array:
        """Ridge estimates θ on each of S subsets of rows, as (S, k + 1) rows −θ, 1; the noise is that of all rows."""
        picked = self.columns(chosen)
        tight = self.prior_precision[picked[self.flat : -1] - self.flat]
        own = (slice(None), picked[:, None], picked)
        whole = self.whole[own]
        equations = max(int(self._used.sum()) * self.linear.measures - self.whitening.unseen, 1) / len(whole)
        # the gap of the nominal robot is what registration leaves
        variance = np.maximum(whole[:, -1, -1] / equations if self.apart else 0.0, np.full(len(whole), self.variance))
        for _ in range(settings.FOLD_ROUNDS):
            signed = self._signed(whole, variance, tight)
            variance = np.maximum(np.einsum("i,gij,j->g", signed, whole, signed) / equations, self.variance)
        different = {used.tobytes(): used for used in rows}
        solved = {key: self._signed(self.products(r)[own], variance, tight) for key, r in different.items()}
        return np.stack([solved[used.tobytes()] for used in rows])

    def _signed(self, products: Array, variance: Array, tight: Array) -> Array:
        # in units of the first variance, so that one kind alone is not rescaled
        weighted = np.einsum("g,gij->ij", variance[0] / variance, products)
        weighted.ravel()[: self.flat * len(weighted) : len(weighted) + 1] += variance[0] / self.near**2
        return np.append(-ridge(weighted, self.flat, variance[0] * tight), 1.0)


@dataclass(frozen=True, eq=False)
class CrossValidation:
    """Leave-one-fold-out fits and their residuals on the fold; ``tests`` are masks (N,) of the rows of each fold."""

    model: Model
    tests: tuple[Rows, ...]

    @classmethod
    def over(cls, model: Model, tests: Sequence[Rows]) -> CrossValidation:
        """Cross-validate over all folds that have rows and whose other rows determine the frames."""
        kept = [t for t in tests if (t & model.kept).any() and (~t).sum() > 1]
        return cls(model, tuple(t for t in kept if model.determines(~t)))

    @property
    def counts(self) -> NDArray[np.int64]:
        """Numbers (1 + B,) of held-out rows, one in two folds counted twice: of all, and without each block of rows."""
        held = np.sum(self.tests, axis=0) * self.model.kept
        return np.append(held.sum(), held.sum() - np.bincount(self.model.block, held)).astype(np.int64)

    def squares(self, chosen: Sequence[int]) -> Array:
        """Held-out sums of squares (1 + B,), m², of a model with some blocks: of all rows, and without each block."""
        model, picked, own = self.model, self.model.columns(chosen), each(self.model.block)
        every = np.ones(len(model.block), dtype=bool)
        fits = model.fits([*(~rows for rows in (*self.tests, *own)), every], chosen)
        fits, moved = fits[: len(self.tests)], fits[len(self.tests) : -1] - fits[-1]
        # share of each block's rows on which the fit of each fold rests
        shared = 1.0 - np.stack(self.tests) @ np.stack(own, axis=1).astype(float) / np.sum(own, axis=1)
        total = np.zeros(1 + len(own))
        for test, fit, resting in zip(self.tests, fits, shared, strict=True):
            judged = test & model.kept
            left = (
                model.test_columns(test)[judged[test], :3][:, :, picked]
                @ np.vstack([fit, fit + resting[:, None] * moved]).T
            )
            squares = (left**2).sum(axis=1)
            squares[np.arange(len(squares)), 1 + model.block[judged]] = 0.0
            total += squares.sum(axis=0)
        return total

    def residuals(self, chosen: Sequence[int]) -> Array:
        """Held-out residuals (H, m) of a model with some of the blocks, fold after fold, m and rad."""
        picked, stack = self.model.columns(chosen), self.model.test_columns
        fits = self.model.fits([~test for test in self.tests], chosen)
        return np.concatenate([stack(test)[:, :, picked] @ fit for test, fit in zip(self.tests, fits, strict=True)])

    @property
    def numbers(self) -> NDArray[np.int64]:
        """Row numbers (H,) of the held-out residuals, fold after fold, outliers included."""
        return np.concatenate([np.flatnonzero(test) for test in self.tests])


def jackknife(values: Array) -> Array:
    """Jackknife covariance (K, K) of K figures, or variance of one, from (G, K) or (G,) leave-one-group-out values."""
    apart = values - values.mean(axis=0)
    return np.asarray((len(values) - 1) / len(values) * (apart.T @ apart))


def share(part: Array, whole: Array) -> Share:
    """Ratio of two sums of squares (1 + B,), of all rows and without each block, with its 95 % jackknife interval.

    The interval is that of Student's law about ln(1 − part/whole), with the jackknife's variance: one minus a share is
    a ratio of mean squares, so that its logarithm is nearly normal. It is not exact for a handful of blocks. The ratio
    is 0 where the second sum is 0.
    """
    if whole[0] <= 0.0:
        return 0.0, (0.0, 0.0)
    value, without = float(part[0] / whole[0]), part[1:] / np.maximum(whole[1:], settings.TINY)
    if len(without) < 2:
        return value, (-np.inf, 1.0)
    if value >= 1.0 or without.max() >= 1.0:
        half = _half_width(without)
        return value, (value - half, value + half)
    wider = float(np.expm1(_half_width(np.log1p(-without))))
    return value, (value - (1.0 - value) * wider, value + (1.0 - value) * wider / (1.0 + wider))


def _half_width(values: Array) -> float:
    """Half width of the 95 % jackknife interval of a figure from its (B,) leave-one-block-out values.

    Degrees of freedom by Satterthwaite (*Biometrics Bulletin* 2, 1946): a variance from B values of kurtosis κ has
    2 B/(κ − 1), about B for normal values, few where one or two blocks make up most of the variance.
    """
    count, apart = len(values), (values - values.mean()) ** 2
    if not apart.any():
        return 0.0
    apart /= apart.max()
    kurtosis = count * float((apart**2).sum()) / float(apart.sum()) ** 2
    freedom = min(count - 1.0, 2.0 * count / max(kurtosis - 1.0, settings.TINY))
    return float(stdtrit(freedom, settings.INTERVAL[1]) * np.sqrt(jackknife(values)))


@dataclass(frozen=True, eq=False)
class Shrinkage:
    """Held-out shrinkage of the gap, overall and per effect; the noise of the held-out rows is included.

    ``overall``: rms before and after. ``before`` and ``after`` (N,): distance of each row while it was held out, m, NaN
    where set aside. ``shares`` of the gap's mean square, with 95 % intervals: for an effect of the fit the Shapley
    value (these sum to the overall shrinkage), for another the gain from adding it. ``left`` (N, m): what the model
    left of each row, root frame, m and rad, NaN where never held out.
    """

    overall: HeldOut
    before: Array
    after: Array
    shares: dict[str, Share]
    left: Array


def held_out(fit: Fit, progress: Callable[[str], None] = lambda _: None) -> Shrinkage:
    """Leave-one-block-out cross-validation, blocks being consecutive measurements.

    Frames and parameters are refitted to the training rows. The selection stays that of all rows: effects, laws,
    constants, prior scales, linearisation point, noise, outliers. The estimate is then that of the saved model; an
    effect selected from noise alone seems to gain a little:
    :func:`~thermal_robot.diagnosis.prune.held_out_tests` requires more. The intervals are those of fresh rows of the
    same kind under the saved model, noise included. Raises
    :class:`EstimationError` if all rows repeat one pose.
    """
    block, scheme = held_out_groups(fit.campaign)
    count = int(block.max()) + 1
    if count < 2:
        raise EstimationError("all rows repeat one pose: nothing can be held out, and nothing told about the robot")
    progress(f"held out: {count} blocks, one at a time")
    before = replace(fit.before, blocks=tuple(columns(fit.nominal, effect) for effect, _ in fit.effects))
    return shrinkage(fit.explanation, before, fit.families, block, scheme)


def shrinkage(
    explanation: Explanation, before: Linear, families: Sequence[str], block: Labels, scheme: str = "blocked"
) -> Shrinkage:
    """Cross-validate an explanation, linearised at the corrected model; see :func:`held_out`.

    ``before`` is the problem at the nominal robot with the blocks of the best combination, in their order; rows of one
    ``block`` (N,) are held out together.
    """
    best, beside = explanation.best.blocks, _outside_model(explanation, families)
    model, players = Model.of(explanation, block, beside), frozenset(range(len(best)))
    parts = model.partial(before, [explanation.values[b][0] for b in best])
    part, whole = (CrossValidation.over(m, each(block)) for m in (parts, model))

    def validation(chosen: frozenset[int]) -> CrossValidation:
        return whole if chosen and players <= chosen else part

    @cache
    def squares(chosen: frozenset[int]) -> Array:
        return validation(chosen).squares(sorted(chosen))

    def left(chosen: frozenset[int]) -> Array:
        own = validation(chosen)
        found = np.full(explanation.linear.gap.shape, np.nan)
        found[own.numbers] = own.residuals(sorted(chosen))
        return found

    none, kept, after = squares(frozenset()), ~explanation.outliers, left(players)
    shares = {families[b]: share(_shapley(k, players, squares), none) for k, b in enumerate(best)}
    added = {families[b]: squares(players) - squares(players | {k}) for k, b in enumerate(beside, len(best))}
    shares |= {name: share(added.get(name, 0.0 * none), none) for name in dict.fromkeys(families) if name not in shares}
    far, near = (np.linalg.norm(of[:, :3], axis=1) for of in (left(frozenset()), after))
    before_all, after_all, before_kept, after_kept = (
        float(np.sqrt(np.nanmean(of**2))) for of in (far, near, far[kept], near[kept])
    )
    value, interval = share(none - squares(players), none)
    folds = int(block.max()) + 1
    overall = HeldOut(scheme, folds, before_kept, after_kept, value, interval, before_all, after_all)
    far[~kept] = near[~kept] = np.nan
    return Shrinkage(overall, far, near, shares, after)


def _outside_model(explanation: Explanation, families: Sequence[str]) -> dict[int, float]:
    """For each effect outside the model, the block that the likeliest model with one block more adds, and its scale."""
    best = explanation.best.blocks
    found: dict[int, float] = {}
    for rival in sorted(explanation.combinations, key=lambda c: -c.log_evidence):
        more = set(rival.blocks) - set(best)
        if len(more) == 1 and len(rival.blocks) == len(best) + 1:
            (b,) = more
            if families[b] not in {families[known] for known in found}:
                found[b] = rival.scales[b]
    return found


def _shapley(player: int, players: frozenset[int], squares: Callable[[frozenset[int]], Array]) -> Array:
    """Shapley value (1 + B,) of an effect: mean reduction of held-out squares over all orders in which effects join."""
    others, value = sorted(players - {player}), np.zeros_like(squares(players))
    for size in range(len(players)):
        weight = 1.0 / (len(players) * comb(len(others), size))
        for chosen in map(frozenset, combinations(others, size)):
            value += weight * (squares(chosen) - squares(chosen | {player}))
    return value


def worst_folds(fit: Fit) -> tuple[FoldScheme, ...]:
    """Cross-validate by time, session, temperature, region, reach and range; sorted by rms, the largest first.

    The first need not have the smallest shrinkage, as the gap before may be larger on its rows, too. A scheme is left
    out if the campaign lacks its column; a fold if its training rows do not determine the frames.
    """
    model = Model.of(fit.explanation, blocks(fit.campaign))
    plain = model.partial(fit.before)
    rest = _events_known(fit, plain, model)
    found = []
    for name, words, tests in schemes(fit):
        bare, full = (plain, model) if name == "time" else rest
        validation = CrossValidation.over(full, tests)
        if validation.tests:
            before = CrossValidation(bare, validation.tests).squares(())
            after = validation.squares(range(len(full.spans))) if full.spans else before
            found.append(_scheme(name, words, validation, before, after))
    return tuple(sorted(found, key=lambda f: -f.rms_after))


def _scheme(name: str, words: str, validation: CrossValidation, before: Array, after: Array) -> FoldScheme:
    rows, *without = validation.counts
    far, near = (float(np.sqrt(of[0] / rows)) for of in (before, after))
    shrinkage = float(1.0 - after[0] / before[0]) if before[0] > 0.0 else 0.0
    uncertainty = float(np.sqrt(jackknife(np.sqrt(after[1:] / np.maximum(without, 1.0)))))
    return FoldScheme(name, words, len(validation.tests), int(rows), far, near, shrinkage, uncertainty)


def _events_known(fit: Fit, plain: Model, model: Model) -> tuple[Model, Model]:
    """Models of the frames alone and of a fit, with the fitted events subtracted from the gap.

    A displacement throughout a held-out session or region cannot be predicted from other rows; in use it is removed by
    a new registration.
    """
    e = fit.explanation
    events = [(b, effect) for b, (effect, _) in zip(e.best.blocks, fit.effects, strict=True) if is_event(effect)]
    if not events:
        return plain, model
    before = fit.before.gap - sum(columns(fit.nominal, effect).columns @ e.values[b][0] for b, effect in events)
    after = e.linear.gap - sum(e.linear.contribution(b, e.values[b][0]) for b, _ in events)
    rest = [k for k, (effect, _) in enumerate(fit.effects) if not is_event(effect)]
    bare = replace(plain.linear, gap=before)
    linear = replace(model.linear, gap=after, blocks=tuple(model.linear.blocks[k] for k in rest))
    return replace(plain, linear=bare), replace(model, linear=linear, scales=tuple(model.scales[k] for k in rest))


def hardest(schemes: Sequence[FoldScheme], average: HeldOut) -> FoldScheme | None:
    """Scheme with the largest held-out rms if that exceeds the ``average`` by a factor ``HARDER``; else ``None``."""
    return next((s for s in schemes[:1] if s.rms_after > settings.HARDER * average.rms_after), None)


def harmed(schemes: Sequence[FoldScheme]) -> FoldScheme | None:
    """First scheme, by session or region, in which the correction increases the held-out rms; ``None`` without one."""
    return next((s for s in schemes if s.name in ("session", "region") and s.shrinkage < 0.0), None)


def schemes(fit: Fit) -> Iterator[tuple[str, str, list[Rows]]]:
    """Yield name, description and held-out rows, a mask (N,) a fold, of each scheme; first that of :func:`held_out`."""
    campaign = fit.campaign
    if held_out_groups(campaign)[1] == STAND:
        yield STAND, "one stand after the other", each(held_out_groups(campaign)[0])
    yield "time", "blocks of consecutive rows", each(blocks(campaign))
    session = campaign.labels.get("session")
    if session is not None and len(set(session.tolist())) > 1:
        yield "session", "one session after the other", each(np.unique(session, return_inverse=True)[1])
    temperature = _temperature(campaign)
    if temperature is not None and np.ptp(temperature) > 0.0:
        yield "temperature", "the coldest fifth, and the warmest", _ends(temperature)
    yield "region", "neighbourhoods of joint positions", each(neighbourhoods(campaign, settings.FOLDS))
    reach = np.linalg.norm(fit.nominal.position, axis=1)
    yield "reach", "the fifth that reaches out furthest", _ends(reach)[1:]
    # where few positions repeat, an end may hold most of the rows
    ends = [end for position in campaign.q[:, moves(campaign.q)].T for end in _ends(position) if end.mean() < 0.5]
    yield "range", "the lowest and the highest fifth of a joint's positions", ends


def _ends(values: Array) -> list[Rows]:
    """Return masks (N,) of the fifths of the rows with the lowest and with the highest values."""
    low, high = np.quantile(values, (1.0 / settings.FOLDS, 1.0 - 1.0 / settings.FOLDS))
    return [values <= low, values >= high]


def _temperature(campaign: Campaign) -> Array | None:
    """Temperature (N,) of the robot, or the mean of its links, °C; ``None`` if not recorded."""
    recorded = campaign.covariates
    names = ["temperature"] if "temperature" in recorded else [c for c in recorded if c.startswith("temperature.")]
    return np.mean([recorded[c] for c in names], axis=0) if names else None
