"""Robust estimation: noise from the median of a residual, outliers, Huber weights."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.inference import settings
from thermal_robot.inference.problem import Linear, Whitening
from thermal_robot.observables import of_model, seen_components

Figures = int | NDArray[np.int64]
"""Number of measured components of every row, or (N,) of each row."""


@dataclass(frozen=True)
class Noise:
    """Standard deviation per axis of the instrument, m and rad; ``None`` where it is not stated.

    ``relative`` (N, m) is that of each figure of a row over it; ``None`` where all rows are alike. ``seen`` (N, m/3) is
    how many components of place and turn a row sees; ``None`` for all in all rows.
    """

    position: float | None = None
    orientation: float | None = None
    relative: Array | None = None
    seen: NDArray[np.int64] | None = None

    @classmethod
    def of(cls, campaign: Campaign) -> Noise:
        """Return the noise that a campaign states; for poses that a model computed, else the digits they have."""
        seen, place, turn = seen_components(campaign), campaign.noise_position, campaign.noise_orientation
        if of_model(campaign):  # what is computed has no noise: it is written to some digits
            place, turn = place or settings.WRITTEN_TO, turn or settings.WRITTEN_TO
        return cls(place, turn, campaign.relative_noise, seen)

    def figures(self, measures: int) -> NDArray[np.int64] | int:
        """Return the number of measured components of a row: (N,) where rows differ."""
        return measures if self.seen is None else np.maximum(self.seen.sum(axis=1), 1)

    def parts(self, measures: int) -> tuple[float | None, ...]:
        """Noise of positions, and with six components of orientations; at least rounding."""
        stated = (self.position, self.orientation)[: measures // 3]
        return tuple(None if sigma is None else max(sigma, settings.ROUNDING) for sigma in stated)


def distance_limit(measures: Figures, rows: int) -> Any:
    """Outlier limit of squared distances in units of the noise: a χ² quantile for so many rows, times a factor."""
    return settings.GROSS_FACTOR * chdtri(measures, settings.GROSS_LEVEL / max(rows, 1))


def robust_noise(
    remainder: Array,
    leverage: float = 0.0,
    relative: Array | None = None,
    seen: NDArray[np.int64] | None = None,
) -> Array:
    """One sigma per axis of positions and of orientations, from the median squared length of a residual.

    The ``leverage``, the share of the equations that the fit took up, has made the residual smaller: its square is
    divided by 1 − leverage. Where the noise of the figures differs, ``relative`` (N, m) is their relative noise; where
    rows see fewer components, ``seen`` (N, m/3) is their number.
    """
    remainder = remainder if relative is None else remainder / relative
    parts = remainder.reshape(len(remainder), -1, 3)
    squares = (parts**2).sum(axis=2)
    if seen is None:
        middle = np.median(squares, axis=0) / float(chdtri(3, 0.5))
    else:
        shares = squares / chdtri(np.maximum(seen, 1), 0.5)
        middle = np.array([np.median(own[some > 0]) for own, some in zip(shares.T, seen.T, strict=True)])
    return np.asarray(np.maximum(np.sqrt(middle / (1.0 - leverage)), settings.ROUNDING))


def noise_estimate(measured: Array, noise: Noise, measures: int) -> tuple[Array, float]:
    """Noise of each component, stated or else estimated from the residual, and the degrees of freedom of its prior."""
    stated = noise.parts(measures)
    sigma = np.array([m if g is None else g for g, m in zip(stated, measured, strict=True)])
    return np.repeat(sigma, 3), 0.0 if None in stated else settings.GIVEN_NOISE_DOF


def first_whitening(linear: Linear, noise: Noise) -> Whitening:
    """Start from unit weights, and noise as stated or robustly estimated from the gap, with no prior on it."""
    measured = robust_noise(linear.gap, relative=noise.relative, seen=noise.seen)
    sigma, _ = noise_estimate(measured, noise, linear.measures)
    return Whitening(np.ones(len(linear.gap)), sigma, 0.0, relative=noise.relative, seen=noise.seen)


def reweigh(remainder: Array, noise: Noise, leverage: float, measures: int) -> tuple[Whitening, NDArray[np.bool_]]:
    """Whitening with Huber weights at the residual's noise, and mask of outliers (N,), at most a quarter of the rows.

    Outliers are the farthest rows beyond :func:`distance_limit`; their weight is 0. ``leverage`` is the share of the
    equations that was fitted.
    """
    remainder = remainder if noise.relative is None else remainder / noise.relative
    rows, figures = len(remainder), noise.figures(measures)
    measured = robust_noise(remainder, leverage, seen=noise.seen)
    sigma, held, distance2 = judged(remainder, measured, noise, leverage, measures)
    aside = distance2 > distance_limit(figures, rows)
    aside &= np.isin(np.arange(rows), np.argsort(-distance2)[: int(settings.MOST_OUTLIERS * rows)])
    weights = np.where(aside, 0.0, huber_weight(distance2, figures))
    return Whitening(weights, sigma, held, relative=noise.relative, seen=noise.seen), aside


def judged(
    remainder: Array, measured: Array, noise: Noise, leverage: float, measures: int
) -> tuple[Array, float, Array]:
    """Noise and degrees of freedom as :func:`noise_estimate`, and squared distances (N,) in units of that noise.

    ``remainder`` (N, m) is scaled to equal noise; ``measured`` is its robust noise, one sigma for positions and one for
    orientations, which takes the place of a noise that is clearly smaller (:func:`outlier_scale`).
    """
    sigma, held = noise_estimate(measured, noise, measures)
    distance2 = ((remainder / outlier_scale(measured, sigma)) ** 2).sum(axis=1) / (1.0 - leverage)
    return sigma, held, distance2


def outlier_scale(measured: Array, sigma: Array) -> Array:
    """Scale (m,) of outlier distances: the noise, or the residual's robust noise where that is clearly larger."""
    return np.where(np.repeat(measured, 3) > settings.NOISE_SLACK * sigma, np.repeat(measured, 3), sigma)


def huber_weight(distance2: Array, measures: Figures) -> Array:
    """Huber weights (1964) of rows by squared distance in units of the noise: 1 up to a χ² quantile, then falling."""
    bend = chdtri(measures, settings.BEND_LEVEL)
    return np.asarray(np.minimum(1.0, np.sqrt(bend / np.maximum(distance2, settings.TINY))))
