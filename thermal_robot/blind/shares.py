"""Shares on fresh rows: what each effect of a model takes away of the gap, where nothing of it was fitted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from math import factorial

import numpy as np


def shares(
    predicted: Mapping[str, Sequence[Sequence[float]]], true: Sequence[Sequence[float]], noise: float
) -> dict[str, float]:
    """Return each effect's share of the gap's mean square: the Shapley value of what it takes away.

    Parameters
    ----------
    predicted
        By names joined with ``+``, every subset: (M, 3) m, with the frames and this subset fitted to the given rows.
    true
        (M, 3) where the target really is, m.
    noise
        One sigma per axis, m: the gap that is shared has it in it, as in the claim.

    Returns
    -------
    dict
        By effect; the sum is what all of them together take away. Empty without subsets.
    """
    left = {
        frozenset(name.split("+")) if name else frozenset(): float(
            ((np.asarray(rows) - np.asarray(true)) ** 2).sum(axis=1).mean()
        )
        for name, rows in predicted.items()
    }
    players = sorted(frozenset[str]().union(*left))
    found = {}
    for player in players:
        others = [name for name in players if name != player]
        value = 0.0
        for size in range(len(players)):
            weight = factorial(size) * factorial(len(others) - size) / factorial(len(players))
            for chosen in map(frozenset, combinations(others, size)):
                value += weight * (left[chosen] - left[chosen | {player}])
        found[player] = value / (left[frozenset()] + 3.0 * noise**2)
    return found
