"""At which poses to measure, so that the elongations come out best."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal_robot.arrays import Array
from thermal_robot.assembly.thermal.elongation import segment_names
from thermal_robot.errors import EstimationError
from thermal_robot.kinematics import elongation_jacobian
from thermal_robot.robot import Robot

Axes: TypeAlias = "str | Sequence[str]"
"""Letters among x, y and z that are measured at every pose, or a word of them for each pose."""

RANK_TOLERANCE = 1e-9
"""Singular values below this share of the largest are zero: between rounding and any geometry that can be built."""


_LEAST_SHARE = 1e-6
# Of an unknown in what the system cannot see: a millimetre there would be a nanometre here.


def axes_of(axes: Axes, count: int) -> tuple[str, ...]:
    """Write the measured axes as a word for each of ``count`` poses.

    Raises
    ------
    EstimationError
        If a letter is not x, y or z, a word is empty, or there is not one word a pose.
    """
    words = (axes,) * count if isinstance(axes, str) else tuple(axes)
    if len(words) != count:
        raise EstimationError(f"measured axes are given for {len(words)} poses, but there are {count}")
    for word in words:
        if not word or set(word) - set("xyz") or len(set(word)) != len(word):
            raise EstimationError(f"the axes measured at a pose are some of the letters x, y and z, not {word!r}")
    return words


def measured(words: Sequence[str]) -> NDArray[np.bool_]:
    """Whether each component was measured, (N, 3)."""
    return np.array([[letter in word for letter in "xyz"] for word in words], dtype=bool).reshape(-1, 3)


def visible(right_vectors: Array, rank: int) -> NDArray[np.bool_]:
    """Whether each unknown is determined alone: no combination that the system cannot see holds it."""
    unseen = np.sqrt(np.sum(right_vectors[rank:] ** 2, axis=0))
    return np.asarray(unseen < _LEAST_SHARE)


def rank_of(singular: Array) -> int:
    """Return how many singular values, largest first, are not zero."""
    return int(np.sum(singular > RANK_TOLERANCE * singular[0])) if len(singular) and singular[0] > 0.0 else 0


_CANDIDATES = 2000
_SWEEPS = 30


@dataclass(frozen=True, eq=False)
class BestPoses:
    """Poses at which to measure, from :func:`best_poses`.

    Parameters
    ----------
    q
        (count, n) rad or m.
    axes
        The components to measure at each pose.
    names
        S names of the segments with a length.
    errors
        (S,) standard error of each elongation for a standard deviation of 1 of every component: times σ in m it is
        in m. NaN where the poses do not determine it.
    condition
        Condition number of the system; infinite where something is not determined.
    """

    q: Array
    axes: tuple[str, ...]
    names: tuple[str, ...]
    errors: Array
    condition: float


def best_poses(
    robot: Robot,
    count: int,
    *,
    candidates: ArrayLike | int = _CANDIDATES,
    criterion: Literal["D", "A", "E"] = "D",
    axes: Axes = "xyz",
    seed: int = 0,
) -> BestPoses:
    """Choose poses greedily, then exchange them one at a time until no exchange is better.

    Parameters
    ----------
    robot
        The robot.
    count
        Number of poses.
    candidates
        (M, n) configurations to choose from, of which those outside the joint limits are left out; or how many to draw
        evenly within the limits (±π where there is none).
    criterion
        ``"D"``: the smallest volume of the confidence region; ``"A"``: the smallest mean variance; ``"E"``: the
        smallest variance of the worst combination. What no candidate determines is left out of all three.
    axes
        What is measured: letters for all poses, or a word for each, as for
        :func:`~thermal_robot.assembly.thermal.identify_elongations`.
    seed
        Of the draw.

    Returns
    -------
    BestPoses
        Different poses, except that one may come twice with different axes.

    Raises
    ------
    EstimationError
        If there are fewer candidates within the limits than poses, or the criterion or the axes are unknown.
    """
    if criterion not in ("D", "A", "E"):
        raise EstimationError(f"the criterion is D, A or E, not {criterion!r}")
    words, pool = axes_of(axes, count), _pool(robot, candidates, seed)
    if not 0 < count <= len(pool):
        raise EstimationError(f"{count} poses cannot be chosen from {len(pool)} candidates within the joint limits")
    jacobian = elongation_jacobian(robot, pool)
    basis = _determinable(jacobian, words)
    information = {word: _information(jacobian[:, measured([word])[0]] @ basis) for word in set(words)}
    chosen = _greedy(information, words)
    _exchange(information, words, chosen, criterion)
    picked = np.array(chosen)
    system = jacobian[picked][measured(words)]
    errors, condition = _quality(system)
    return BestPoses(pool[picked], words, segment_names(robot), errors, condition)


def _pool(robot: Robot, candidates: ArrayLike | int, seed: int) -> Array:
    if isinstance(candidates, int):
        low, high = (np.where(np.isfinite(x), x, y) for x, y in ((robot.lower, -np.pi), (robot.upper, np.pi)))
        return np.random.default_rng(seed).uniform(low, high, (candidates, robot.n))
    rows = np.atleast_2d(np.asarray(candidates, dtype=float))
    if rows.ndim != 2 or rows.shape[1] != robot.n:
        raise EstimationError(f"candidates of shape {rows.shape} do not fit: expected (M, {robot.n})")
    return rows[np.all((rows >= robot.lower) & (rows <= robot.upper), axis=1)]


def _determinable(jacobian: Array, words: tuple[str, ...]) -> Array:
    """Orthonormal basis (S, r) of the combinations that some candidate shows."""
    seen = jacobian[:, measured(words).any(axis=0)].reshape(-1, jacobian.shape[2])
    _, singular, right = np.linalg.svd(seen, full_matrices=False)
    return np.asarray(right[: rank_of(singular)].T)


def _information(rows: Array) -> Array:
    return np.asarray(np.swapaxes(rows, 1, 2) @ rows)


def _greedy(information: dict[str, Array], words: tuple[str, ...]) -> list[int]:
    """Add one pose after the other; by determinant, which alone tells half-determined systems apart."""
    size = next(iter(information.values())).shape[1]
    total, chosen = 1e-6 * np.eye(size), list[int]()
    for slot, word in enumerate(words):
        best = int(np.argmax(_scores(total, information[word], "D", _taken(words, chosen, slot))))
        chosen.append(best)
        total = total + information[word][best]
    return chosen


def _exchange(information: dict[str, Array], words: tuple[str, ...], chosen: list[int], criterion: str) -> None:
    size = next(iter(information.values())).shape[1]
    for _ in range(_SWEEPS):
        before = list(chosen)
        for slot, word in enumerate(words):
            # A little of everything keeps the criteria finite where fewer components than unknowns are measured.
            total = 1e-9 * np.eye(size)
            for other, c in enumerate(chosen):
                if other != slot:
                    total = total + information[words[other]][c]
            scores = _scores(total, information[word], criterion, _taken(words, chosen, slot))
            best = int(np.argmax(scores))
            if scores[best] > scores[chosen[slot]] + 1e-12 * abs(scores[best]):
                chosen[slot] = best
        if chosen == before:
            return


def _taken(words: tuple[str, ...], chosen: list[int], slot: int) -> list[int]:
    return [c for other, c in enumerate(chosen) if other != slot and words[other] == words[slot]]


def _scores(total: Array, added: Array, criterion: str, taken: list[int]) -> NDArray[np.floating[Any]]:
    """How good each candidate is, (M,); the larger, the better."""
    with_each = total + added
    scores: NDArray[np.floating[Any]]
    if criterion == "D":
        scores = np.linalg.slogdet(with_each)[1]
    elif criterion == "A":
        scores = -np.trace(np.linalg.inv(with_each), axis1=1, axis2=2)
    else:
        scores = np.linalg.eigvalsh(with_each)[:, 0]
    scores[taken] = -np.inf
    return scores


def _quality(system: Array) -> tuple[Array, float]:
    _, singular, right = np.linalg.svd(system, full_matrices=True)
    rank = rank_of(singular)
    known: NDArray[np.bool_] = visible(right, rank)
    errors = np.sqrt(np.sum((right[:rank].T / singular[:rank]) ** 2, axis=1))
    whole = rank == system.shape[1]
    return np.where(known, errors, np.nan), float(singular[0] / singular[-1]) if whole else np.inf
