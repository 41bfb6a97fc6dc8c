"""Robust estimation: noise from the median of a residual, outliers, Huber weights."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.inference import settings
from thermal_robot.inference.problem import Linear, Whitening


@dataclass(frozen=True)
class Noise:
    """Standard deviation per axis of the instrument, m and rad; ``None`` where it is not stated.

    ``relative`` (N, m) is that of each figure of a row over it; ``None`` where all rows are alike.
    """

    position: float | None = None
    orientation: float | None = None
    relative: Array | None = None

    @classmethod
    def of(cls, campaign: Campaign) -> Noise:
        """Noise that a campaign states."""
        return cls(campaign.noise_position, campaign.noise_orientation, campaign.relative_noise)

    def parts(self, measures: int) -> tuple[float | None, ...]:
        """Noise of positions, and with six components of orientations; at least rounding."""
        stated = (self.position, self.orientation)[: measures // 3]
        return tuple(None if sigma is None else max(sigma, settings.ROUNDING) for sigma in stated)


def distance_limit(measures: int, rows: int) -> float:
    """χ² quantile: the squared distance, in units of the noise, beyond which one of so many rows is a gross error."""
    return settings.GROSS_FACTOR * float(chdtri(measures, settings.GROSS_LEVEL / max(rows, 1)))


def robust_noise(remainder: Array, leverage: float = 0.0, relative: Array | None = None) -> Array:
    """Robust standard deviation per axis, of positions and of orientations, from the median squared residual.

    Corrected for the ``leverage``, the share of the equations that was fitted. ``relative`` (N, m) is the relative
    noise of each component, if it differs.
    """
    remainder = remainder if relative is None else remainder / relative
    parts = remainder.reshape(len(remainder), -1, 3)
    middle = np.median((parts**2).sum(axis=2), axis=0) / float(chdtri(3, 0.5))
    return np.asarray(np.maximum(np.sqrt(middle / (1.0 - leverage)), settings.ROUNDING))


def settled_noise(measured: Array, noise: Noise, measures: int) -> tuple[Array, float]:
    """Noise of each component, stated or else estimated from the residual, and the degrees of freedom of its prior."""
    stated = noise.parts(measures)
    sigma = np.array([m if g is None else g for g, m in zip(stated, measured, strict=True)])
    return np.repeat(sigma, 3), 0.0 if None in stated else settings.GIVEN_NOISE_DOF


def first_whitening(linear: Linear, noise: Noise, use: NDArray[np.bool_]) -> Whitening:
    """Equal weights of all rows in use, and the noise from the median of the gap."""
    own = None if noise.relative is None else noise.relative[use]
    sigma, held = settled_noise(robust_noise(linear.gap[use], relative=own), noise, linear.measures)
    return Whitening(use.astype(float), sigma, held, relative=noise.relative)


def reweigh(
    remainder: Array, noise: Noise, use: NDArray[np.bool_], leverage: float, measures: int
) -> tuple[Whitening, NDArray[np.bool_]]:
    """Huber weights at the residual's noise, and outliers (N,), at most a quarter of the rows.

    ``leverage`` is the share of the equations that was fitted.
    """
    remainder = remainder if noise.relative is None else remainder / noise.relative
    sigma, held, distance2 = judged(remainder, robust_noise(remainder[use], leverage), noise, leverage, measures)
    aside = use & (distance2 > distance_limit(measures, int(use.sum())))
    worst = np.argsort(np.where(use, -distance2, np.inf))[: int(settings.MOST_OUTLIERS * use.sum())]
    aside &= np.isin(np.arange(len(use)), worst)
    weights = np.where(use & ~aside, tail_weight(distance2, measures), 0.0)
    return Whitening(weights, sigma, held, relative=noise.relative), aside


def judged(
    remainder: Array, measured: Array, noise: Noise, leverage: float, measures: int
) -> tuple[Array, float, Array]:
    """Noise and degrees of freedom as :func:`settled_noise`, and squared distances (N,) of rows in its units.

    ``remainder`` (N, m) is scaled to equal noise; ``measured`` is its robust noise, one sigma for positions and one for
    orientations.
    """
    sigma, held = settled_noise(measured, noise, measures)
    distance2 = ((remainder / far_scale(measured, sigma)) ** 2).sum(axis=1) / (1.0 - leverage)
    return sigma, held, distance2


def far_scale(measured: Array, sigma: Array) -> Array:
    """Scale (m,) of outlier distances: the noise, or the residual's median where that is larger."""
    return np.where(np.repeat(measured, 3) > settings.NOISE_SLACK * sigma, np.repeat(measured, 3), sigma)


def tail_weight(distance2: Array, measures: int) -> Array:
    """Huber weight (1964) of rows at a squared distance in units of the noise."""
    bend = float(chdtri(measures, settings.BEND_LEVEL))
    return np.asarray(np.minimum(1.0, np.sqrt(bend / np.maximum(distance2, settings.TINY))))
