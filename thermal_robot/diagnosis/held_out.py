"""How far the gap shrinks, on rows that were not used for the fit."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import factorial

import numpy as np
from numpy.typing import NDArray

from thermal_robot.diagnosis.parts import HeldOut
from thermal_robot.errors import EstimationError
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import ridge
from thermal_robot.inference.explain import explain, log_priors
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.problem import Linear, Whitening, frame_step
from thermal_robot.inference.robust import Noise
from thermal_robot.inference.rows import folds

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Shrinkage:
    """Held-out shrinkage of the gap, overall and per effect.

    Attributes
    ----------
    overall
        Rms before and after on held-out rows; :func:`held_out` says what is fitted anew in each fold.
    before, after
        (N,) distance of each row while it was held out, m; NaN where it was set aside.
    shares
        By effect: share of the gap's mean square with its 95 % interval. For an effect of the fit it is the Shapley
        value; for another the gain from adding it to the fit.
    """

    overall: HeldOut
    before: Array
    after: Array
    shares: dict[str, tuple[float, tuple[float, float]]]


def held_out(fit: Fit, progress: Callable[[str], None] = lambda _: None) -> Shrinkage:
    """Cross-validate in blocks of consecutive measurements.

    In each fold, frames, outliers, prior scales and the choice of effects come from the training rows alone. The point
    of linearisation and the settings of nonlinear arguments are those of all rows. A held-out row is left out as an
    outlier only if both the model of its fold and the whole diagnosis call it one.

    Raises
    ------
    EstimationError
        If all rows repeat one pose, so that there is only one fold.
    """
    campaign, explanation = fit.campaign, fit.explanation
    fold, block = folds(campaign)
    count = int(fold.max()) + 1
    if count < 2:
        raise EstimationError("all rows repeat one pose: nothing can be held out, and nothing told about the robot")
    noise = Noise(campaign.noise_position, campaign.noise_orientation)
    linear, families, priors, start = _in_question(fit)
    before, after = np.full(campaign.samples, np.nan), np.full(campaign.samples, np.nan)
    for k in range(count):
        progress(f"held out: fold {k + 1} of {count}")
        train, test = fold != k, fold == k
        found = explain(
            linear,
            noise,
            rows=train,
            families=families,
            starts=[start],
            log_prior=priors,
            forms=[f for f in explanation.forms if f is explanation.discrepancy.form],
        )
        plain = Whitening((train & ~found.outliers).astype(float), found.whitening.noise, 0.0)
        step = frame_step(fit.before, plain, fit.before.gap)
        left = fit.before.gap - fit.before.frames @ step
        gross = test & explanation.outliers & found.far(test)
        kept = test & ~gross
        before[kept] = np.linalg.norm(left[kept, :3], axis=1)
        after[kept] = np.linalg.norm(found.remainder[kept, :3], axis=1)
    draws = _draws(block, ~np.isnan(before))
    squares = np.stack([_sums(before**2, block), _sums(after**2, block)])
    overall = HeldOut(
        "blocked",
        count,
        float(np.sqrt(np.nanmean(before**2))),
        float(np.sqrt(np.nanmean(after**2))),
        _share(squares.sum(axis=1)),
        _interval(np.array([_share(squares @ d) for d in draws])),
    )
    return Shrinkage(overall, before, after, _shares(fit, fold, block, draws))


def _in_question(fit: Fit) -> tuple[Linear, tuple[str, ...], list[float], tuple[int, ...]]:
    """Leave out effects whose posterior probability on all rows is negligible; folds need not consider them.

    Returns the reduced problem, its families, and the blocks at which the search starts.
    """
    e = fit.explanation
    best = set(e.best.blocks)
    kept = [b for b in range(len(fit.families)) if b in best or e.probability([b]) > settings.EXCLUDED]
    linear = Linear(e.linear.gap, e.linear.frames, tuple(e.linear.blocks[b] for b in kept))
    prior = log_priors([b.effect for b in e.linear.blocks])
    return (
        linear,
        tuple(fit.families[b] for b in kept),
        [prior[b] for b in kept],
        tuple(kept.index(b) for b in e.best.blocks),
    )


def _sums(values: Array, block: NDArray[np.int64]) -> Array:
    return np.bincount(block, np.nan_to_num(values), int(block.max()) + 1).astype(float)


def _share(squares: Array) -> float:
    return float(1.0 - squares[1] / squares[0]) if squares[0] > 0 else 0.0


def _interval(values: Array) -> tuple[float, float]:
    low, high = np.quantile(values, settings.INTERVAL)
    return float(low), float(high)


def _draws(block: NDArray[np.int64], kept: NDArray[np.bool_]) -> Array:
    """(R, B) counts of each block in each bootstrap resample; blocks without rows are never drawn."""
    count = int(block.max()) + 1
    filled = np.flatnonzero(np.bincount(block[kept], minlength=count))
    rng = np.random.default_rng(settings.BOOTSTRAP_SEED)
    drawn = np.zeros((settings.RESAMPLES, count))
    drawn[:, filled] = rng.multinomial(len(filled), np.full(len(filled), 1.0 / len(filled)), size=settings.RESAMPLES)
    return drawn


class _Subsets:
    """Cross-validated fits of any subset of effects, from sums of squares and products alone."""

    def __init__(self, fit: Fit, fold: NDArray[np.int64], block: NDArray[np.int64]) -> None:
        e = fit.explanation
        linear, whitening, measures = e.linear, e.whitening, e.linear.measures
        self.block_fold = [int(fold[block == b][0]) for b in range(int(block.max()) + 1)]
        used = np.flatnonzero(whitening.weights > 0)
        root = np.sqrt(whitening.weights[used])[:, None] / whitening.noise
        flat = linear.frames[used] * root[:, :, None]
        columns = [flat]
        self.slices, start = [], flat.shape[2]
        for item, basis in zip(linear.blocks, e.problem.bases, strict=True):
            columns.append((item.columns[used] @ (item.sizes[:, None] * basis)) * root[:, :, None])
            self.slices.append(slice(start, start + basis.shape[1]))
            start += basis.shape[1]
        design = np.concatenate([*columns, (linear.gap[used] * root)[:, :, None]], axis=2)
        self.frames = flat.shape[2]
        self.whole = np.empty((len(self.block_fold), design.shape[2], design.shape[2]))
        self.position = np.empty_like(self.whole)
        metres = whitening.noise[0] ** 2
        for b in range(len(self.block_fold)):
            rows = design[block[used] == b]
            both = rows.reshape(-1, design.shape[2])
            place = rows[:, :3].reshape(-1, design.shape[2])
            self.whole[b] = both.T @ both
            self.position[b] = place.T @ place * metres if measures == 6 else self.whole[b] * metres
        self.total = self.whole.sum(axis=0)
        self.equations = len(used) * measures
        self.variance = e.best.noise**2 * (1.0 + e.discrepancy.tau**2)

    def squares(self, scales: dict[int, float]) -> Array:
        """(B,) sums of squared held-out distances of each block of rows, m², with effects at the given scales."""
        spans = [np.arange(self.slices[b].start, self.slices[b].stop) for b in scales]
        index = np.concatenate([np.arange(self.frames), *spans]).astype(int)
        tight = np.repeat([1.0 / v**2 for v in scales.values()], [len(span) for span in spans])
        picked = np.concatenate([index, [-1]])
        result = np.zeros(len(self.block_fold))
        for k in set(self.block_fold):
            mine = [b for b, f in enumerate(self.block_fold) if f == k]
            train = self.total - self.whole[mine].sum(axis=0)
            signed = self._fit(train[np.ix_(picked, picked)], tight)
            for b in mine:
                result[b] = signed @ self.position[b][np.ix_(picked, picked)] @ signed
        return result

    def _fit(self, train: Array, tight: Array) -> Array:
        """Return (−θ, 1) with θ the ridge solution; what the subset does not explain counts as noise."""
        variance = self.variance
        for _ in range(settings.FOLD_ROUNDS):
            signed = np.concatenate([-ridge(train, self.frames, variance * tight), [1.0]])
            left = float(signed @ train @ signed) / max(self.equations, 1)
            variance = max(left, self.variance)
        return signed


def _shares(
    fit: Fit, fold: NDArray[np.int64], block: NDArray[np.int64], draws: Array
) -> dict[str, tuple[float, tuple[float, float]]]:
    explanation, subsets = fit.explanation, _Subsets(fit, fold, block)
    best = explanation.best
    players = best.blocks
    nothing = subsets.squares({})
    worth: dict[frozenset[int], Array] = {}

    def gain(chosen: Sequence[int]) -> Array:
        key = frozenset(chosen)
        if key not in worth:
            worth[key] = nothing - subsets.squares({b: best.scales[b] for b in sorted(key)})
        return worth[key]

    shares = {}
    base = nothing.sum(), draws @ nothing
    for player in players:
        others = [p for p in players if p != player]
        value = np.zeros(len(nothing))
        for size in range(len(others) + 1):
            weight = factorial(size) * factorial(len(others) - size) / factorial(len(players))
            for chosen in combinations(others, size):
                value += weight * (gain((*chosen, player)) - gain(chosen))
        shares[fit.families[player]] = _relative(value, base, draws)
    scales = {c.blocks: c.scales for c in explanation.combinations}
    for family in dict.fromkeys(fit.families):
        if family in shares:
            continue
        own = [b for b, f in enumerate(fit.families) if f == family]
        added = [tuple(sorted((*players, b))) for b in own]
        tried = [blocks for blocks in added if blocks in scales]
        values = [nothing - subsets.squares(scales[blocks]) - gain(players) for blocks in tried]
        value = max(values, key=lambda v: float(v.sum()), default=np.zeros(len(nothing)))
        shares[family] = _relative(value, base, draws)
    return shares


def _relative(value: Array, base: tuple[float, Array], draws: Array) -> tuple[float, tuple[float, float]]:
    if base[0] <= 0:
        return 0.0, (0.0, 0.0)
    return float(value.sum() / base[0]), _interval((draws @ value) / np.maximum(base[1], settings.TINY))
