"""Which moves the campaigns speak for: none, or those of one, two … parameters, each combination with a probability."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from thermal_robot.arrays import Array
from thermal_robot.fleet import wear_settings as settings
from thermal_robot.fleet.wear_moves import Beside, Grid, Move, Series, log_prior

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
