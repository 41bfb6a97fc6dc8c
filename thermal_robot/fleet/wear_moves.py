"""What may have moved between campaigns, and the evidence for any combination of moves, from products alone.

In campaign k the parameters are θ_k = θ + Σ_i a_i s_i(k) e_i: a constant for all campaigns, and moves. Of a move i,
parameter e_i changes with a shape s_i over time: a step after campaign j (a jump), or a straight line (a trend). A walk
is all steps of a parameter at once, the variance of each in proportion to the time that it took. With the whitened
products of campaign k, G_k = X'X and b_k = X'y, unknown frames projected out, everything follows from sums over k:

    V_ij = Σ s_i s_j G_k[e_i, e_j] − B_i A⁻¹ B_j',   g_i = Σ s_i b_k[e_i] − B_i A⁻¹ Σ b_k,

with A = Σ G_k + prior and B_i = Σ s_i G_k[e_i, :]: the information on moves that is left beside the constants. For
moves of prior variances τ, and a factor φ by which campaigns scatter more than their deviations say,

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

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtrc, logsumexp

from thermal_robot.arrays import Array
from thermal_robot.fleet import wear_settings as settings
from thermal_robot.inference.algebra import equations_of, whitener


class Move(NamedTuple):
    """A parameter by its number, how it moves, and after which campaign it jumps; −1 where it does not jump."""

    parameter: int
    kind: str
    after: int = -1


@dataclass(frozen=True, eq=False)
class Series:
    """K campaigns in the order of time, as products in units of the P parameters' expected sizes.

    Attributes
    ----------
    matrices, vectors
        (K, P, P) and (K, P): whitened, frames projected out. A parameter that a campaign does not have is zero in it.
    times
        (K,) not falling: days, or numbers.
    followed
        (P,) which parameters may move.
    """

    matrices: Array
    vectors: Array
    times: Array
    followed: NDArray[np.bool_]

    @property
    def count(self) -> int:
        """Campaigns."""
        return len(self.times)

    @property
    def span(self) -> float:
        """From the first campaign to the last; 1 where all were measured at once."""
        return float(self.times[-1] - self.times[0]) or 1.0

    @cached_property
    def shapes(self) -> Array:
        """(K, K) a step after each campaign but the last, of length 1, then the straight line, which rises by 1."""
        k = np.arange(self.count)
        steps = (k[None, :] > k[:-1, None]).astype(float)
        middle = self.times.mean()
        return np.vstack([steps, (self.times - middle)[None] / self.span])

    @cached_property
    def constants(self) -> Array:
        """(P, P) A⁻¹: covariance of the constants, were nothing to move."""
        total = self.matrices.sum(axis=0) + np.eye(len(self.followed)) / settings.WIDE**2
        return np.asarray(np.linalg.inv(total))

    @cached_property
    def crossed(self) -> Array:
        """(P K, P) B: products of moves, parameter after parameter, with constants."""
        found = np.einsum("ik,kpq->piq", self.shapes, self.matrices)
        return equations_of(found)

    @cached_property
    def information(self) -> Array:
        """(P K, P K) V."""
        s, width = self.shapes, len(self.followed) * self.count
        own = np.einsum("ik,jk,kpq->piqj", s, s, self.matrices, optimize=True).reshape(width, width)
        return np.asarray(own - self.crossed @ self.constants @ self.crossed.T)

    @cached_property
    def pull(self) -> Array:
        """(P K,) g."""
        own = (self.vectors.T @ self.shapes.T).ravel()
        return np.asarray(own - self.crossed @ self.constants @ self.vectors.sum(axis=0))

    @cached_property
    def scattered(self) -> tuple[float, float]:
        """Squared distance of the campaigns from what is common to all, in deviations, and its degrees of freedom."""
        distance, degrees = 0.0, 0
        for matrix, vector in zip(self.matrices, self.vectors, strict=True):
            root = whitener(matrix)
            distance += float(((root.T @ vector) ** 2).sum())
            degrees += root.shape[1]
        total = self.vectors.sum(axis=0)
        shared = whitener(self.matrices.sum(axis=0)).shape[1]
        return max(distance - float(total @ self.constants @ total), 0.0), float(max(degrees - shared, 1))

    @cached_property
    def columns(self) -> NDArray[np.int64]:
        """(C,) numbers of the single moves that are weighed: steps and the line of each parameter that is followed."""
        return np.flatnonzero(np.repeat(self.followed, self.count))

    def spans(self, move: Move) -> list[int]:
        """Return the columns that a move is made of."""
        first = move.parameter * self.count
        if move.kind == "walk":
            return list(range(first, first + self.count - 1))
        return [first + (move.after if move.kind == "jump" else self.count - 1)]

    def made_of(self, moves: Sequence[Move]) -> tuple[list[int], Array]:
        """Return the columns of some moves, and the prior variance of each over the common one."""
        walk = np.maximum(np.diff(self.times) / self.span, 1e-6)
        shares = [walk if move.kind == "walk" else np.ones(1) for move in moves]
        return [c for move in moves for c in self.spans(move)], np.concatenate([*shares, np.zeros(0)])


@dataclass(frozen=True, eq=False)
class Grid:
    """Scales of moves and factors of scatter, each with its prior and what the base of all explanations is worth.

    Attributes
    ----------
    variance, inflation
        (H,) common prior variance of moves, in expected sizes squared, and φ².
    log_base
        (H,) log prior, and log likelihood if nothing moves.
    """

    variance: Array
    inflation: Array
    log_base: Array

    @classmethod
    def of(cls, series: Series) -> Grid:
        """Return the grid of a series."""
        scale, factor = (np.array(each) for each in (settings.SCALES, settings.SCATTER))
        distance, degrees = series.scattered
        prior = -0.5 * (np.log(factor) / settings.SCATTER_SPREAD) ** 2 + np.log(np.gradient(np.log(factor)))
        base = prior - logsumexp(prior) - 0.5 * distance / factor**2 - degrees * np.log(factor)
        variance, inflation = np.meshgrid(scale**2, factor**2, indexing="ij")
        alike = np.broadcast_to(base - np.log(len(scale)), variance.shape)
        return cls(variance.ravel(), inflation.ravel(), alike.ravel())


def log_prior(move: Move, series: Series) -> float:
    """Return the log prior odds of one move against none: few change, and of many parameters each is less likely."""
    followed = max(int(series.followed.sum()), 1)
    one = 1.0 - (1.0 - settings.ANY_CHANGE) ** (1.0 / followed)
    days = series.count - 1 if move.kind == "jump" else 1
    return float(np.log(one / (1.0 - one)) + np.log(settings.KINDS[move.kind] / days))


@dataclass(frozen=True, eq=False)
class Beside:
    """Some moves at every point of the grid, and what is left of the others beside them.

    Attributes
    ----------
    log_likelihood
        (H,) with the base.
    mean, covariance
        (H, D) and (H, D, D) of the moves' columns.
    columns
        Their numbers.
    """

    log_likelihood: Array
    mean: Array
    covariance: Array
    columns: NDArray[np.int64]

    @classmethod
    def of(cls, series: Series, grid: Grid, moves: Sequence[Move]) -> Beside:
        """Solve for some moves."""
        listed, share = series.made_of(moves)
        columns = np.array(listed, dtype=np.int64)
        own, pull = series.information[np.ix_(columns, columns)], series.pull[columns]
        deviation = np.sqrt(grid.variance[:, None] * share)
        inside = own * deviation[:, :, None] * deviation[:, None, :] / grid.inflation[:, None, None]
        tight = np.eye(len(columns)) + inside
        whole = deviation[:, :, None] * np.linalg.inv(tight) * deviation[:, None, :]
        mean = whole @ pull / grid.inflation[:, None]
        gain = 0.5 * (mean @ pull) / grid.inflation - 0.5 * np.linalg.slogdet(tight)[1]
        return cls(grid.log_base + gain, mean, whole, columns)

    def left(self, series: Series, grid: Grid, others: NDArray[np.int64]) -> tuple[Array, Array]:
        """Return (H, C) information on other columns beside these, and their pull; φ² = 1 in its units."""
        cross = series.information[np.ix_(others, self.columns)]
        along = cross @ self.covariance
        own = series.information[others, others] - (along * cross).sum(axis=2) / grid.inflation[:, None]
        return np.maximum(own, 0.0), series.pull[others] - self.mean @ cross.T


Moves = tuple[Move, ...]


@dataclass(frozen=True, eq=False)
class Explanations:
    """All combinations of moves that were compared.

    Attributes
    ----------
    series, grid
        Of what.
    moves, probabilities
        Most probable first; an empty combination says that nothing moves.
    """

    series: Series
    grid: Grid
    moves: tuple[Moves, ...]
    probabilities: Array

    @property
    def best(self) -> Moves:
        """The most probable combination."""
        return self.moves[0]

    def of_parameter(self, parameter: int) -> dict[Move, float]:
        """Return the probability of each move of one parameter; what is left to 1 is that it stays."""
        found: dict[Move, float] = {}
        for moves, probability in zip(self.moves, self.probabilities, strict=True):
            for move in moves:
                if move.parameter == parameter:
                    found[move] = found.get(move, 0.0) + float(probability)
        return found


def explanations(series: Series) -> Explanations:
    """Compare combinations of moves: every single one, then each more beside those that are likeliest so far."""
    grid, known = Grid.of(series), {}
    nothing: Moves = ()
    known[frozenset(nothing)] = float(logsumexp(grid.log_base))
    beam: list[Moves] = [nothing]
    for _ in range(settings.MOST_MOVING):
        wider: dict[frozenset[Move], float] = {}
        for moves in beam:
            wider |= {frozenset((*moves, move)): value for move, value in _one_more(series, grid, moves).items()}
        known |= wider
        top = max(known.values())
        likely = sorted((v, sorted(m)) for m, v in wider.items() if v > top - settings.NEGLIGIBLE)
        beam = [tuple(moves) for _, moves in likely[::-1][: settings.BEAM]]
        if not beam:
            break
    ranked = sorted(known.items(), key=lambda item: (-item[1], sorted(item[0])))
    values = np.array([value for _, value in ranked])
    return Explanations(series, grid, tuple(tuple(sorted(m)) for m, _ in ranked), np.exp(values - logsumexp(values)))


def _one_more(series: Series, grid: Grid, moves: Moves) -> dict[Move, float]:
    """Return the log posterior of combinations of these moves and one more, of a parameter that stayed so far."""
    beside, taken = Beside.of(series, grid, moves), {move.parameter for move in moves}
    columns = np.array([c for c in series.columns if c // series.count not in taken], dtype=np.int64)
    if not len(columns):
        return {}
    before = sum(log_prior(move, series) for move in moves)
    own, pull = beside.left(series, grid, columns)
    inflation, variance = grid.inflation[:, None], grid.variance[:, None]
    share = variance * own / inflation
    gain = 0.5 * pull**2 * variance / (inflation**2 * (1.0 + share)) - 0.5 * np.log1p(share)
    single = logsumexp(beside.log_likelihood[:, None] + gain, axis=0)
    found = {}
    for column, value in zip(columns.tolist(), single.tolist(), strict=True):
        parameter, shape = divmod(column, series.count)
        move = Move(parameter, "jump", shape) if shape < series.count - 1 else Move(parameter, "trend")
        found[move] = value + before + log_prior(move, series)
    for parameter in dict.fromkeys((columns // series.count).tolist()):
        walk = Move(parameter, "walk")
        whole = Beside.of(series, grid, (*moves, walk)).log_likelihood
        found[walk] = float(logsumexp(whole)) + before + log_prior(walk, series)
    return found


@dataclass(frozen=True, eq=False)
class State:
    """Constants and moves together.

    Attributes
    ----------
    series
        Of which.
    columns
        Numbers of the D moves.
    mean, covariance
        (P + D,) and (P + D, P + D) constants, then moves, in expected sizes.
    """

    series: Series
    columns: tuple[int, ...]
    mean: Array
    covariance: Array

    @classmethod
    def of(cls, series: Series, grid: Grid, moves: Sequence[Move], free: int | None = None) -> State:
        """Solve for moves at the most probable scale and scatter, one parameter ``free`` as each campaign has it."""
        point = int(np.argmax(Beside.of(series, grid, moves).log_likelihood))
        inflation = float(grid.inflation[point])
        columns, share = series.made_of([move for move in moves if move.parameter != free])
        steps = [] if free is None else series.spans(Move(free, "walk"))
        variance = np.concatenate([grid.variance[point] * share, np.full(len(steps), settings.WIDE**2)])
        columns += steps
        own = series.information[np.ix_(columns, columns)] / inflation + np.diag(1.0 / variance)
        inner = np.linalg.inv(own)
        amounts = inner @ series.pull[columns] / inflation
        carried = series.constants @ series.crossed[columns].T
        mean = series.constants @ series.vectors.sum(axis=0) - carried @ amounts
        across = -carried @ inner
        whole = np.block([[inflation * series.constants - across @ carried.T, across], [across.T, inner]])
        return cls(series, tuple(columns), np.concatenate([mean, amounts]), whole)

    def over_time(self, parameter: int) -> tuple[Array, Array]:
        """(K,) value of a parameter in each campaign, and its deviation."""
        along = np.zeros((self.series.count, len(self.mean)))
        along[:, parameter] = 1.0
        for k, column in enumerate(self.columns):
            owner, shape = divmod(column, self.series.count)
            if owner == parameter:
                along[:, len(self.series.followed) + k] = self.series.shapes[shape]
        variance = np.einsum("ki,ij,kj->k", along, self.covariance, along)
        return along @ self.mean, np.sqrt(np.maximum(variance, 0.0))

    def amount(self, column: int) -> tuple[float, float]:
        """Return how far one move goes, and its deviation."""
        k = len(self.series.followed) + self.columns.index(column)
        return float(self.mean[k]), float(np.sqrt(self.covariance[k, k]))

    def line(self, parameter: int, column: int) -> tuple[Array, Array]:
        """(2,) value of a parameter in the last campaign and its rate, per unit of time; (2, 2) their covariance."""
        k, last = len(self.series.followed) + self.columns.index(column), self.series.shapes[-1, -1]
        along = np.zeros((2, len(self.mean)))
        along[0, parameter], along[0, k], along[1, k] = 1.0, last, 1.0 / self.series.span
        return along @ self.mean, along @ self.covariance @ along.T


def fieller(value: Array, covariance: Array, limit: float) -> tuple[float, float, float | None] | None:
    """Return when a straight line reaches ±limit: the expected time from now, and a 95 % interval (Fieller 1954).

    Parameters
    ----------
    value, covariance
        (2,) value now and rate; (2, 2).
    limit
        Of the absolute value.

    Returns
    -------
    tuple or None
        Its upper end is ``None`` where the line may as well never get there; ``None`` where it does not move at all.
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


def chances(series: Series, grid: Grid, moves: tuple[Move, ...]) -> Array:
    """(P,) bound on the chance that a series without change shows a move as clear as the clearest of each parameter.

    Parameters
    ----------
    series, grid
        The campaigns.
    moves
        The best explanation: each parameter is judged beside the moves of the others.

    Returns
    -------
    numpy.ndarray
        1 for parameters that are not followed.
    """
    found = np.ones(len(series.followed))
    moving, columns = {move.parameter for move in moves}, series.columns
    shared = _chances(series, grid, moves) if len(columns) else np.zeros(0)
    for parameter in np.flatnonzero(series.followed).tolist():
        rest = tuple(move for move in moves if move.parameter != parameter)
        single = _chances(series, grid, rest) if parameter in moving else shared
        found[parameter] = min(float(single[columns // series.count == parameter].min()), 1.0)
    return found


def scatter(series: Series, grid: Grid, moves: tuple[Move, ...]) -> float:
    """Return φ² as the campaigns show it beside some moves, not less than 1."""
    distance, degrees = _left(series, grid, moves)
    return max(distance / degrees, 1.0)


def _left(series: Series, grid: Grid, moves: tuple[Move, ...]) -> tuple[float, float]:
    """Return Q and ν: the squared distance of the campaigns from what some moves say, and its degrees of freedom."""
    distance, degrees = series.scattered
    beside = Beside.of(series, _wide(grid), moves)
    if len(beside.columns):
        distance -= float(beside.mean[0] @ series.pull[beside.columns])
    return max(distance, 0.0), max(degrees - len(beside.columns), 2.0)


def _chances(series: Series, grid: Grid, moves: tuple[Move, ...]) -> Array:
    """(C,) bound on the chance of each single move beside others, which are taken as wide as the grid has them."""
    own, pull = Beside.of(series, _wide(grid), moves).left(series, _wide(grid), series.columns)
    seen = own[0] > settings.HIDDEN * np.diag(series.information)[series.columns]
    square = np.where(seen, pull[0] ** 2 / np.where(seen, own[0], 1.0), 0.0)
    distance, degrees = _left(series, grid, moves)
    rest = np.maximum(distance - square, 0.0) / (degrees - 1.0)
    tail = fdtrc(1.0, degrees - 1.0, square / np.maximum(rest, 1.0))
    return np.asarray(np.where(seen, tail, 1.0) / _weights(series))


def _weights(series: Series) -> Array:
    """(C,) share of each single move in the chance."""
    information = np.diag(series.information)[series.columns]
    inverse = 1.0 / np.maximum(information, settings.HIDDEN * max(float(information.max()), settings.HIDDEN))
    owner = series.columns // series.count
    return np.asarray(inverse / np.bincount(owner, inverse)[owner] / len(np.unique(owner)))


def _wide(grid: Grid) -> Grid:
    """Return the one point of a grid at which moves are held least, and campaigns scatter as they say."""
    return Grid(grid.variance.max(keepdims=True), np.ones(1), np.zeros(1))
