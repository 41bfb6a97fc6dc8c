"""Variance components: the noise of each kind of measurement, estimated by the fit itself.

Where no noise is stated, metres of a wire and of a tracker have nothing in common, and a least-squares fit that weighs
them alike is as bad as its noisiest kind. The variance of each kind k follows from its own residuals v_k,

    s_k² = |v_k|² / r_k ,   r_k = n_k − tr H_k ,

with n_k equations, H_k their part of the fit's projection and r_k their redundancy: what the fit takes up of a kind is
no noise of it (Helmert 1907; Förstner, *Zeitschrift für Vermessungswesen* 104, 1979). The mean is a median here, robust
as everywhere else. The linear fit and the noise of the kinds alternate until they stay, at the effects, prior sizes and
robust weights of an explanation; with these weights it is then sought anew.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import equations_of
from thermal_robot.inference.explain import Explanation
from thermal_robot.inference.weights import robust_noise
from thermal_robot.observables import kinds_of


def reweighted(campaign: Campaign, explanation: Explanation) -> Campaign:
    """Return the campaign with the noise of its kinds as an explanation leaves them; itself where they stay.

    It is the campaign itself, too, where noise is stated, or rows are of one kind. A kind with a redundancy that tells
    its noise less well than a data sheet would, such as a single distance of two sockets, keeps that of all.
    """
    if len(campaign.kinds) == 1 or campaign.noise_position is not None:
        return campaign
    e = explanation
    sigma = np.broadcast_to(e.whitening.sigma() * e.best.noise, e.linear.gap.shape).copy()
    known, seen = dict[str, float](), e.whitening.seen
    for _ in range(settings.EVIDENCE_STEPS):
        left, leverage, before = *weighted_fit(e, sigma), known
        known = {}
        for own, rows in kinds_of(campaign):
            figures, taken = own.places * len(left[rows]), float(leverage[rows].sum())
            # rows set aside are in it: many may be so for a noise that was too small
            if figures - taken >= settings.GIVEN_NOISE_DOF:
                places = None if seen is None else seen[rows, :1]
                known[own.kind] = float(robust_noise(left[rows, :3], taken / figures, seen=places)[0])
                sigma[rows, :3] = known[own.kind]
        if not known or _apart(known, before) < 1.0 + settings.EVIDENCE_SETTLED:
            break
    if not known:
        return campaign
    counts = [int((campaign.labels["kind"] == kind).sum()) for kind in known]
    whole = float(np.sqrt(np.average(np.square([*known.values()]), weights=counts)))
    ratios = {kind: own / whole for kind, own in known.items()}
    stays = _apart(ratios, campaign.noise_of_kinds or dict.fromkeys(ratios, 1.0)) < settings.SAME_NOISE
    return campaign if stays else replace(campaign, noise_of_kinds=ratios)


def _apart(one: Mapping[str, float], other: Mapping[str, float]) -> float:
    """Return the largest ratio of two estimates of a kind's noise; infinite where a kind is in one of them alone."""
    if one.keys() != other.keys():
        return float("inf")
    return max(max(one[kind] / other[kind], other[kind] / one[kind]) for kind in one)


def weighted_fit(explanation: Explanation, sigma: Array) -> tuple[Array, Array]:
    """Residual (N, m) of an explanation's effects and frames, fitted anew at the noise (N, m), and leverages (N,).

    The leverage of a row is the trace of its part of H = X (XᵀX + Λ⁻¹)⁻¹ Xᵀ, with X the whitened columns and Λ the
    prior variances, infinite of frames; 0 where it is set aside.
    """
    e = explanation
    own = [e.linear.blocks[b] for b in e.best.blocks]
    columns = np.concatenate([e.linear.frames, *(block.columns for block in own)], axis=2)
    root = np.sqrt(e.whitening.weights)[:, None] / sigma
    design, gap = equations_of(columns * root[:, :, None]), (e.linear.gap * root).ravel()
    free = np.zeros(e.linear.frames.shape[2])
    tight = np.concatenate([free, *(e.held(b) ** -2.0 for b in e.best.blocks)])
    scale = np.sqrt((design**2).sum(axis=0) + tight)
    scale[scale == 0.0] = 1.0
    design /= scale
    inverse = np.linalg.pinv(design.T @ design + np.diag(tight / scale**2), rcond=settings.SEEN, hermitian=True)
    values = inverse @ (design.T @ gap) / scale
    leverage = ((design @ inverse) * design).sum(axis=1).reshape(root.shape).sum(axis=1)
    return e.linear.gap - columns @ values, leverage
