"""Other hold-out schemes, which show whether the fit extrapolates.

Neighbouring rows are alike in time, temperature and place. Folds of consecutive rows therefore favour a fit that only
follows the course of the campaign (Roberts et al., *Ecography* 40, 2017, on blocked cross-validation). Effects, prior
scales and outliers are those of the diagnosis; frames and parameters are fitted anew in each fold.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from thermal_robot.campaign import Campaign
from thermal_robot.diagnosis.parts import FoldScheme
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import ridge
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.rows import folds, neighbourhoods

Array = NDArray[np.float64]
Labels = NDArray[np.int64]


def worst_folds(fit: Fit) -> tuple[FoldScheme, ...]:
    """Hold rows out by time, session, temperature, region and reach; the least favourable scheme comes first.

    The least favourable scheme has the largest rms after. Its shrinkage need not be the smallest, as the gap before may
    be larger on its rows, too.

    Parameters
    ----------
    fit
        The fit, with or without effects.

    Returns
    -------
    tuple of FoldScheme
        In order of rms_after, the largest first. A scheme is left out if the campaign lacks its column; a fold is left
        out if its training rows do not determine the frames.
    """
    problem, kept = _problem(fit), ~fit.explanation.outliers
    found = [_judged(problem, kept, *scheme) for scheme in _schemes(fit)]
    return tuple(sorted((f for f in found if f is not None), key=lambda f: -f.rms_after))


def worse_elsewhere(narrow: Fit, wider: Fit) -> bool:
    """Tell whether a wider explanation is worse on held-out regions of joint space.

    It then overfits: large contributions cancel where poses were measured and not between them.
    """
    kept = ~(narrow.explanation.outliers | wider.explanation.outliers)
    tests = _each(neighbourhoods(narrow.campaign, settings.FOLDS))
    left = [_judged(_problem(fit), kept, "region", "", tests) for fit in (narrow, wider)]
    return (
        left[0] is not None and left[1] is not None and left[1].rms_after > settings.WORSE_ELSEWHERE * left[0].rms_after
    )


def _problem(fit: Fit) -> _Problem:
    explanation = fit.explanation
    best = explanation.best
    blocks = [explanation.linear.blocks[b] for b in best.blocks]
    scaled = [b.columns * (b.sizes * best.scales[k]) for b, k in zip(blocks, best.blocks, strict=True)]
    return _Problem(
        np.concatenate([explanation.linear.frames, *scaled], axis=2),
        explanation.linear.gap,
        explanation.linear.frames.shape[2],
        explanation.whitening.weights,
        explanation.whitening.noise * best.noise * np.hypot(1.0, explanation.discrepancy.tau),
    )


def _schemes(fit: Fit) -> Iterator[tuple[str, str, list[NDArray[np.bool_]]]]:
    """Yield name and description of each scheme, and a mask (N,) of the rows that each of its folds holds out."""
    campaign = fit.campaign
    yield "time", "blocks of consecutive rows", _each(folds(campaign)[0])
    session = campaign.labels.get("session")
    if session is not None and len(set(session.tolist())) > 1:
        yield "session", "one session after the other", _each(np.unique(session, return_inverse=True)[1])
    temperature = _temperature(campaign)
    if temperature is not None and np.ptp(temperature) > settings.COLDEST:
        cold, warm = (np.quantile(temperature, share) for share in (1.0 / settings.FOLDS, 1.0 - 1.0 / settings.FOLDS))
        yield "temperature", "the coldest fifth, and the warmest", [temperature <= cold, temperature >= warm]
    yield "region", "neighbourhoods of joint positions", _each(neighbourhoods(campaign, settings.FOLDS))
    reach = np.linalg.norm(fit.nominal.position, axis=1)
    yield "reach", "the fifth that reaches out furthest", [reach >= np.quantile(reach, 1.0 - 1.0 / settings.FOLDS)]


def _each(labels: NDArray[np.int64]) -> list[NDArray[np.bool_]]:
    return [labels == label for label in np.unique(labels)]


def _temperature(campaign: Campaign) -> Array | None:
    """(N,) temperature of the robot, or the mean of its links, °C; ``None`` if not recorded."""
    recorded = campaign.covariates
    columns = ["temperature"] if "temperature" in recorded else [c for c in recorded if c.startswith("temperature.")]
    return np.mean([recorded[c] for c in columns], axis=0) if columns else None


class _Problem:
    """The linear problem, fitted to any rows from sums of products."""

    def __init__(self, design: Array, gap: Array, flat: int, weights: Array, noise: Array) -> None:
        self.design, self.gap, self.flat = design, gap, flat
        root = np.sqrt(weights)[:, None] / noise
        self.whole = np.concatenate([design, gap[:, :, None]], axis=2) * root[:, :, None]
        self.total = self._products(np.ones(len(gap), dtype=bool))
        self.rank = self._rank(self.total)

    def _products(self, rows: NDArray[np.bool_]) -> Array:
        used = self.whole[rows].reshape(-1, self.whole.shape[2])
        return np.asarray(used.T @ used)

    def _rank(self, products: Array) -> int:
        frames = products[: self.flat, : self.flat]
        # a column of the rows held out alone leaves a rounding error of either sign
        length = np.sqrt(np.maximum(np.diag(frames), 0.0)) + np.sqrt(settings.TINY)
        value = np.linalg.eigvalsh(frames / np.outer(length, length)) if self.flat else np.zeros(0)
        return int((value > settings.FRAME_DETERMINED).sum())

    def left(self, test: NDArray[np.bool_]) -> tuple[Array, Array] | None:
        """(n,) distances of the held-out rows, m: before, after; ``None`` if the others do not determine the frames."""
        train = self.total - self._products(test)
        if self._rank(train) < self.rank or (~test).sum() < 2 or not test.any():
            return None
        return self._distance(train, test, self.flat), self._distance(train, test, len(train) - 1)

    def _distance(self, train: Array, test: NDArray[np.bool_], columns: int) -> Array:
        """(n,) distances of the held-out rows, m, with the first columns of the design fitted to the others."""
        picked = np.concatenate([np.arange(columns), [-1]])
        # a unit of an effect's column is one sigma of its prior
        solution = ridge(train[np.ix_(picked, picked)], self.flat, np.ones(columns - self.flat))
        left = self.gap[test, :3] - self.design[test][:, :3, :columns] @ solution
        return np.asarray(np.linalg.norm(left, axis=1))


def _judged(
    problem: _Problem, kept: NDArray[np.bool_], name: str, held_out: str, tests: Sequence[NDArray[np.bool_]]
) -> FoldScheme | None:
    judged = [pair for test in tests if (pair := problem.left(test & kept)) is not None]
    if not judged:
        return None
    before, after = (np.concatenate([pair[k] for pair in judged]) for k in (0, 1))
    whole, rest = float((before**2).mean()), float((after**2).mean())
    return FoldScheme(
        name,
        held_out,
        len(judged),
        len(before),
        float(np.sqrt(whole)),
        float(np.sqrt(rest)),
        1.0 - rest / whole if whole > 0.0 else 0.0,
        float(np.std(after**2) / np.sqrt(len(after)) / (2.0 * np.sqrt(rest))) if rest > 0.0 else 0.0,
    )
