"""Densities of a small problem from dense linear algebra: what evidences are held against."""

import numpy as np
from scipy.linalg import null_space
from scipy.stats import multivariate_normal

from thermal_robot.inference import settings


def away_of(linear, whitening):
    """Orthonormal basis of what the frames do not take up of the rows in use, and the factor that whitens each row."""
    used = whitening.weights > 0
    root = np.sqrt(whitening.weights[used])[:, None, None] / whitening.noise[:, None]
    return null_space((linear.frames[used] * root).reshape(used.sum() * 3, -1).T), root


def seen_of(linear, whitening, blocks, noise=1.0):
    """Gap and each block's columns without what the frames take up, in units of the noise, of the prior sizes."""
    used = whitening.weights > 0
    away, root = away_of(linear, whitening)
    gap = away.T @ (linear.gap[used][:, :, None] * root).ravel()
    items = (linear.blocks[b] for b in blocks)
    return gap / noise, [away.T @ (i.columns[used] * root * i.sizes).reshape(used.sum() * 3, -1) / noise for i in items]


def alike(linear, found):
    """(B, B) prior covariance of the logarithms of all scales, of which each is a robot's coarseness and its own."""
    return np.diag([linear.blocks[b].spread ** 2 for b in found.blocks]) + settings.COARSENESS**2


def direct(linear, whitening, found, log_prior, scales=None, noise=None, beside=None):
    """The log evidence from the multivariate normal density of the gap, the frames projected out.

    Differs from it by a constant: that of the density, and those of the priors of noise and scales. ``beside`` is the
    covariance of a discrepancy of the rows in use, in units of the noise.
    """
    scales, noise = scales or found.scales, noise or found.noise
    gap, columns = seen_of(linear, whitening, found.blocks)
    covariance = np.eye(len(gap))
    if beside is not None:
        away, _ = away_of(linear, whitening)
        covariance = covariance + away.T @ beside @ away
    covariance = noise**2 * covariance
    for b, own in zip(found.blocks, columns, strict=True):
        covariance += scales[b] ** 2 * own @ own.T
    density = multivariate_normal(cov=covariance).logpdf(gap)
    density -= 0.5 * whitening.held * (np.log(noise**2) + 1.0 / noise**2)
    log = np.log([scales[b] for b in found.blocks])
    return density - 0.5 * log @ np.linalg.solve(alike(linear, found), log) + sum(log_prior[b] for b in found.blocks)


def volume(linear, whitening, found, beside=None):
    """What a parabola through the density's peak over the logarithms of all scales adds, over that of their prior.

    Its curvature is measured on the density itself, by differences of sixth order; NaN where there is no peak.
    """
    count, step = len(found.blocks), 0.05
    none = [0.0] * len(linear.blocks)

    def at(move):
        scales = {b: found.scales[b] * np.exp(m) for b, m in zip(found.blocks, move, strict=True)}
        return direct(linear, whitening, found, none, scales=scales, beside=beside)

    def along(way):
        weights = {0: -49 / 18, 1: 3 / 2, 2: -3 / 20, 3: 1 / 90}
        return -sum(w * (at(k * step * way) + (at(-k * step * way) if k else 0.0)) for k, w in weights.items())

    axes = np.eye(count)
    bend = np.array([[0.25 * (along(a + b) - along(a - b)) / step**2 for b in axes] for a in axes]).reshape(
        count, count
    )
    root = np.linalg.cholesky(alike(linear, found))
    curvature = np.linalg.eigvalsh(root.T @ bend @ root)
    return -0.5 * np.log(curvature).sum() if (curvature > 0.0).all() else np.nan


def dense(kernel, noise):
    """(N m, N m) covariance of what the form moves, in units of the noise, with a mean of one on its diagonal."""
    count = len(kernel.functions)
    moves = np.broadcast_to(kernel.moves, (count, *kernel.moves.shape[-2:])) / noise[:, None]
    columns = (kernel.functions[:, None, :, None] * moves[:, :, None, :]).reshape(count * len(noise), -1)
    whole = columns @ columns.T
    return whole / np.diag(whole).mean()
