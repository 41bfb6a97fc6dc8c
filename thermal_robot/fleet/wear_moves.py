"""Bayesian change-point analysis: evidence of any combination of moves between campaigns, from Gram matrices alone.

In campaign k the parameters are θ_k = θ + Σ_i a_i s_i(k) e_i: a constant for all campaigns, and moves. In a move i,
parameter e_i changes with a shape s_i over time: a step after campaign j (a jump), or a straight line (a trend). A walk
is all steps of a parameter at once, the variance of each proportional to its time. With the whitened products of
campaign k, G_k = X'X and b_k = X'y, unknown frames projected out, everything follows from sums over k:

    V_ij = Σ s_i s_j G_k[e_i, e_j] − B_i A⁻¹ B_j',   g_i = Σ s_i b_k[e_i] − B_i A⁻¹ Σ b_k,

with A = Σ G_k + prior and B_i = Σ s_i G_k[e_i, :]: the information on moves with the constants projected out. For moves
of prior variances τ and overdispersion φ of the campaigns,

    log BF = −½ log|1 + √τ V √τ/φ²| + ½ g'(V + φ² τ⁻¹)⁻¹ g / φ².

φ and the common scale of τ are summed over a grid.

The chance of a false alarm is stated. The statistic of a single move, a jump on some day or a trend of one parameter,
beside what is known to move, is its squared significance z² = g²/V over the scatter of the campaigns that it leaves, (Q
− z²)/(ν − 1), where that is above 1. Nothing of a prior is in it. Without a change it follows F(1, ν − 1) or less. The
C moves that are looked at share the chance unevenly, with weights that add up to 1: alike among parameters, and within
one in inverse proportion to the information V, so that an amount is seen on the first day as on one in the middle,
where both sides are known well. The chance that any comes so far is at most tail/weight (Bonferroni), whatever their
correlations, and for small chances not much less.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtrc, logsumexp

from thermal_robot.arrays import Array
from thermal_robot.fleet import settings
from thermal_robot.inference.algebra import equations_of, whitener


class Move(NamedTuple):
    """Change of one parameter over time: its index, kind (jump, trend, walk), campaign before a jump (−1 without)."""

    parameter: int
    kind: str
    after: int = -1


Moves = tuple[Move, ...]


class Grid(NamedTuple):
    """Grid of prior scales and of overdispersion.

    (H,) each: prior variance of moves, in expected sizes squared; overdispersion φ² of the campaigns; log prior of the
    grid point plus log likelihood if nothing moves.
    """

    variance: Array
    inflation: Array
    log_base: Array


@dataclass(frozen=True, eq=False)
class Series:
    """Normal equations of K campaigns in the order of time, in the P parameters' expected sizes.

    ``matrices`` (K, P, P) and ``vectors`` (K, P) are whitened, frames projected out, zero for a parameter that a
    campaign does not have; ``times`` (K,) are days or numbers, not falling; ``followed`` (P,) tells which parameters
    may move.
    """

    matrices: Array
    vectors: Array
    times: Array
    followed: NDArray[np.bool_]

    @property
    def count(self) -> int:
        """Number of campaigns."""
        return len(self.times)

    @property
    def span(self) -> float:
        """Duration from the first to the last campaign; 1 where it is zero."""
        return float(self.times[-1] - self.times[0]) or 1.0

    @cached_property
    def shapes(self) -> Array:
        """Shapes (K moves, K campaigns): unit steps after each campaign but the last, then a line rising by 1."""
        k = np.arange(self.count)
        steps = (k[None, :] > k[:-1, None]).astype(float)
        return np.vstack([steps, (self.times - self.times.mean())[None] / self.span])

    @cached_property
    def constants(self) -> Array:
        """Posterior covariance (P, P), A⁻¹, of the constants if nothing moves."""
        total = self.matrices.sum(axis=0) + np.eye(len(self.followed)) / settings.WIDE**2
        return np.asarray(np.linalg.inv(total))

    @cached_property
    def crossed(self) -> Array:
        """Cross products (P K, P), B, of moves, parameter after parameter, with constants."""
        return equations_of(np.einsum("ik,kpq->piq", self.shapes, self.matrices))

    @cached_property
    def information(self) -> Array:
        """Information matrix (P K, P K), V, of the moves, constants projected out."""
        s, width = self.shapes, len(self.followed) * self.count
        own = np.einsum("ik,jk,kpq->piqj", s, s, self.matrices, optimize=True).reshape(width, width)
        return np.asarray(own - self.crossed @ self.constants @ self.crossed.T)

    @cached_property
    def pull(self) -> Array:
        """Right-hand side (P K,), g, of the moves, constants projected out."""
        own = (self.vectors.T @ self.shapes.T).ravel()
        return np.asarray(own - self.crossed @ self.constants @ self.vectors.sum(axis=0))

    @cached_property
    def scattered(self) -> tuple[float, float]:
        """Chi-square of the campaigns about common constants, and its degrees of freedom."""
        roots = [whitener(matrix) for matrix in self.matrices]
        distance = sum(float(((r.T @ b) ** 2).sum()) for r, b in zip(roots, self.vectors, strict=True))
        total, shared = self.vectors.sum(axis=0), whitener(self.matrices.sum(axis=0)).shape[1]
        degrees = sum(root.shape[1] for root in roots) - shared
        return max(distance - float(total @ self.constants @ total), 0.0), float(max(degrees, 1))

    @cached_property
    def grid(self) -> Grid:
        """Grid of all combinations of prior scale and overdispersion, with log prior and likelihood of no move."""
        scale, factor = np.array(settings.SCALES), np.array(settings.SCATTER)
        distance, degrees = self.scattered
        prior = -0.5 * (np.log(factor) / settings.SCATTER_SPREAD) ** 2 + np.log(np.gradient(np.log(factor)))
        base = prior - logsumexp(prior) - 0.5 * distance / factor**2 - degrees * np.log(factor)
        variance, inflation = np.meshgrid(scale**2, factor**2, indexing="ij")
        log_base = np.broadcast_to(base - np.log(len(scale)), variance.shape)
        return Grid(variance.ravel(), inflation.ravel(), log_base.ravel())

    @property
    def loose(self) -> Grid:
        """Grid of a single point: the largest prior variance, and no overdispersion (φ² = 1)."""
        return Grid(self.grid.variance.max(keepdims=True), np.ones(1), np.zeros(1))

    @cached_property
    def columns(self) -> NDArray[np.int64]:
        """Indices (C,) of the single moves that are tested: steps and line of each followed parameter."""
        return np.flatnonzero(np.repeat(self.followed, self.count))

    @property
    def middle(self) -> NDArray[np.int64]:
        """Indices (P,), among the moves' columns, of each parameter's step in the middle of the series."""
        return np.arange(len(self.followed)) * self.count + (self.count - 2) // 2

    def made_of(self, moves: Sequence[Move]) -> tuple[NDArray[np.int64], Array]:
        """Column indices (D,) of some moves, and the ratio (D,) of each one's prior variance to the common one."""
        columns: list[int] = []
        shares: list[float] = []
        for move in moves:
            first = move.parameter * self.count
            if move.kind == "walk":
                columns += range(first, first + self.count - 1)
                shares += np.maximum(np.diff(self.times) / self.span, 1e-6).tolist()
            else:
                columns.append(first + (move.after if move.kind == "jump" else self.count - 1))
                shares.append(1.0)
        return np.array(columns, dtype=np.int64), np.array(shares)


class Beside(NamedTuple):
    """Gaussian posterior of the amounts of some moves at every point of a grid.

    Log marginal likelihood with the grid's ``log_base`` (H,), mean (H, D), covariance (H, D, D), column indices (D,).
    """

    log_likelihood: Array
    mean: Array
    covariance: Array
    columns: NDArray[np.int64]

    @classmethod
    def of(cls, series: Series, moves: Sequence[Move], grid: Grid) -> Beside:
        """Compute the posterior of some moves at every grid point from the series' information and right-hand side."""
        columns, share = series.made_of(moves)
        own, pull = series.information[np.ix_(columns, columns)], series.pull[columns]
        deviation = np.sqrt(grid.variance[:, None] * share)
        inside = own * deviation[:, :, None] * deviation[:, None, :] / grid.inflation[:, None, None]
        tight = np.eye(len(columns)) + inside
        covariance = deviation[:, :, None] * np.linalg.inv(tight) * deviation[:, None, :]
        mean = covariance @ pull / grid.inflation[:, None]
        gain = 0.5 * (mean @ pull) / grid.inflation - 0.5 * np.linalg.slogdet(tight)[1]
        return cls(grid.log_base + gain, mean, covariance, columns)

    def left(self, series: Series, others: NDArray[np.int64], grid: Grid) -> tuple[Array, Array]:
        """Information (H, C) on other single moves given these, and right-hand side (H, C), before dividing by φ²."""
        cross = series.information[np.ix_(others, self.columns)]
        along = cross @ self.covariance
        own = series.information[others, others] - (along * cross).sum(axis=2) / grid.inflation[:, None]
        return np.maximum(own, 0.0), series.pull[others] - self.mean @ cross.T


def log_prior(move: Move, series: Series) -> float:
    """Log prior odds of one move: the probability of any change, shared among parameters, kinds, and days of a jump."""
    followed = max(int(series.followed.sum()), 1)
    one = 1.0 - (1.0 - settings.ANY_CHANGE) ** (1.0 / followed)
    days = series.count - 1 if move.kind == "jump" else 1
    return float(np.log(one / (1.0 - one)) + np.log(settings.KINDS[move.kind] / days))


def explanations(series: Series) -> dict[Moves, float]:
    """Return combinations of moves with their posterior probabilities, most probable first, by beam search.

    ``()`` is no move. Every single move is compared, then every further one added to the likeliest combinations so far.
    """
    known: dict[Moves, float] = {(): float(logsumexp(series.grid.log_base))}
    beam: list[Moves] = [()]
    for _ in range(settings.MOST_MOVING):
        wider: dict[Moves, float] = {}
        for moves in beam:
            wider |= _one_more(series, moves)
        known |= wider
        top = max(known.values())
        likely = sorted((v, m) for m, v in wider.items() if v > top - settings.NEGLIGIBLE)
        beam = [moves for _, moves in likely[::-1][: settings.BEAM]]
    ranked = sorted(known.items(), key=lambda item: (-item[1], item[0]))
    weights = np.exp(np.array([value for _, value in ranked]) - logsumexp(list(known.values())))
    return {moves: float(weight) for (moves, _), weight in zip(ranked, weights, strict=True)}


def moves_of(found: Mapping[Moves, float], parameter: int) -> dict[Move, float]:
    """Posterior probability of each move of one parameter; what is missing to 1 is that it stays constant."""
    own: dict[Move, float] = {}
    for moves, probability in found.items():
        for move in moves:
            if move.parameter == parameter:
                own[move] = own.get(move, 0.0) + probability
    return own


def _one_more(series: Series, moves: Moves) -> dict[Moves, float]:
    """Log posterior (unnormalised) of each combination of these moves and one more, of a parameter not moving yet."""
    grid, taken = series.grid, {move.parameter for move in moves}
    columns = np.array([c for c in series.columns if c // series.count not in taken], dtype=np.int64)
    beside = Beside.of(series, moves, grid)
    own, pull = beside.left(series, columns, grid)
    inflation, variance = grid.inflation[:, None], grid.variance[:, None]
    share = variance * own / inflation
    gain = 0.5 * pull**2 * variance / (inflation**2 * (1.0 + share)) - 0.5 * np.log1p(share)
    single = logsumexp(beside.log_likelihood[:, None] + gain, axis=0)
    found = {}
    for column, value in zip(columns.tolist(), single.tolist(), strict=True):
        parameter, shape = divmod(column, series.count)
        found[Move(parameter, "jump", shape) if shape < series.count - 1 else Move(parameter, "trend")] = value
    for parameter in dict.fromkeys((columns // series.count).tolist()):
        walk = Move(parameter, "walk")
        found[walk] = float(logsumexp(Beside.of(series, (*moves, walk), grid).log_likelihood))
    before = sum(log_prior(move, series) for move in moves)
    return {tuple(sorted((*moves, m))): value + before + log_prior(m, series) for m, value in found.items()}


@dataclass(frozen=True, eq=False)
class State:
    """Gaussian posterior of P constants, then D moves, in expected sizes: mean (P + D,), covariance (P + D, P + D)."""

    series: Series
    columns: NDArray[np.int64]
    mean: Array
    covariance: Array

    @classmethod
    def of(cls, series: Series, moves: Sequence[Move], free: int | None = None) -> State:
        """Compute the posterior at the most probable grid point; the parameter ``free`` gets a value per campaign."""
        grid = series.grid
        point = int(np.argmax(Beside.of(series, moves, grid).log_likelihood))
        inflation = float(grid.inflation[point])
        columns, share = series.made_of([move for move in moves if move.parameter != free])
        steps, _ = series.made_of([] if free is None else [Move(free, "walk")])
        variance = np.concatenate([grid.variance[point] * share, np.full(len(steps), settings.WIDE**2)])
        columns = np.concatenate([columns, steps])
        own = series.information[np.ix_(columns, columns)] / inflation + np.diag(1.0 / variance)
        inner = np.linalg.inv(own)
        amounts = inner @ series.pull[columns] / inflation
        carried = series.constants @ series.crossed[columns].T
        mean = series.constants @ series.vectors.sum(axis=0) - carried @ amounts
        across = -carried @ inner
        whole = np.block([[inflation * series.constants - across @ carried.T, across], [across.T, inner]])
        return cls(series, columns, np.concatenate([mean, amounts]), whole)

    def path(self, parameter: int) -> Array:
        """Design matrix (K, P + D) of a parameter's value in each campaign."""
        owner, shape = np.divmod(self.columns, self.series.count)
        along = np.zeros((self.series.count, len(self.mean)))
        along[:, parameter] = 1.0
        along[:, len(self.series.followed) :] = np.where(owner == parameter, self.series.shapes[shape].T, 0.0)
        return along

    def combinations(self, along: Array) -> tuple[Array, Array]:
        """Values (R,) of linear combinations (R, P + D), and their covariance (R, R)."""
        return along @ self.mean, along @ self.covariance @ along.T


def fieller(value: Array, covariance: Array, limit: float) -> tuple[float, float, float | None] | None:
    """Time from now at which a straight line reaches ± limit, with a 95 % confidence interval (Fieller 1954).

    ``value`` (2,) is its value now and its rate, with their covariance (2, 2). The upper end is ``None`` where the rate
    may be zero, so that the line may never get there; the result is ``None`` where the rate is zero.
    """
    now, rate = float(value[0]), float(value[1])
    if rate == 0.0:
        return None
    z2, distance = settings.CROSSING**2, np.copysign(limit, rate) - now
    square = rate**2 - z2 * covariance[1, 1]
    middle = rate * distance + z2 * covariance[0, 1]
    rest = distance**2 - z2 * covariance[0, 0]
    root = np.sqrt(max(middle**2 - square * rest, 0.0))
    if square <= 0.0:  # the rate may be zero, or of the other sign
        ends = [(middle - root) / square, (middle + root) / square] if square else [rest / (2.0 * middle)]
        later = [end for end in ends if end > 0.0]
        return distance / rate, (min(later) if later and rest > 0.0 else 0.0), None
    return distance / rate, max((middle - root) / square, 0.0), max((middle + root) / square, 0.0)


def chances(series: Series, moves: Moves) -> Array:
    """Bonferroni bound (P,) on the false-alarm probability of each parameter's most significant single move.

    Each parameter is tested given the ``moves`` of the others; 1 for one that is not followed.
    """
    found, owner = np.ones(len(series.followed)), series.columns // series.count
    moving = {move.parameter for move in moves}
    shared = _chances(series, moves)
    for parameter in np.flatnonzero(series.followed).tolist():
        rest = tuple(move for move in moves if move.parameter != parameter)
        single = _chances(series, rest) if parameter in moving else shared
        found[parameter] = min(float(single[owner == parameter].min()), 1.0)
    return found


def scatter(series: Series, moves: Moves) -> float:
    """Overdispersion φ²: reduced chi-square of the campaigns about constants and some moves, at least 1."""
    distance, degrees = _left(series, Beside.of(series, moves, series.loose))
    return max(distance / degrees, 1.0)


def _left(series: Series, beside: Beside) -> tuple[float, float]:
    """Chi-square Q of the campaigns about constants and some moves, and its degrees of freedom ν, at least 2."""
    distance, degrees = series.scattered
    distance -= float(beside.mean[0] @ series.pull[beside.columns])
    return max(distance, 0.0), max(degrees - len(beside.columns), 2.0)


def _chances(series: Series, moves: Moves) -> Array:
    """P-value (F test) over Bonferroni weight (C,) of each single move given ``moves``, at the grid's widest prior."""
    if not len(series.columns):
        return np.zeros(0)
    beside, information = Beside.of(series, moves, series.loose), np.diag(series.information)[series.columns]
    own, pull = beside.left(series, series.columns, series.loose)
    seen = own[0] > settings.HIDDEN * information
    square = np.where(seen, pull[0] ** 2 / np.where(seen, own[0], 1.0), 0.0)
    distance, degrees = _left(series, beside)
    rest = np.maximum(distance - square, 0.0) / (degrees - 1.0)
    tail = fdtrc(1.0, degrees - 1.0, square / np.maximum(rest, 1.0))
    inverse = 1.0 / np.maximum(information, settings.HIDDEN * max(float(information.max()), settings.HIDDEN))
    owner = series.columns // series.count
    weights = inverse / np.bincount(owner, inverse)[owner] / len(np.unique(owner))
    return np.asarray(np.where(seen, tail, 1.0) / weights)
