"""A model without the constants that the data do not determine: the others take the values that they have then.

To take a parameter out alone would leave those that were fitted beside it where they are, and what two of them do
together would be half done. So each is set to zero as a piece of knowledge. What the posterior of frames and
parameters, N(m, C), says of the others once θ_k = 0 is their conditional mean m − C_k m_k / C_kk and covariance
C − C_k C_kᵀ / C_kk: what a fit without θ_k finds, as far as the model is linear in its errors. The least significant
goes first, and significance is judged anew each time: of two of which only the sum is known, one stays.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.correction.constant import Told, constant, rows_of_every_kind
from thermal_robot.correction.model import CorrectedModel
from thermal_robot.errors import CampaignError
from thermal_robot.inference import settings
from thermal_robot.inference.columns import frame_columns
from thermal_robot.inference.frames import moved
from thermal_robot.prediction import moves


def determined(
    model: CorrectedModel, min_sigma: float, temperature: float | None = None
) -> tuple[CorrectedModel, tuple[Told, ...]]:
    """Leave out of a model the constants that the data do not determine.

    Parameters
    ----------
    model
        The corrected model; what is not constant in it is kept, whatever is known of it.
    min_sigma
        A constant is kept if it is so many standard deviations away from zero.
    temperature
        °C, as for :func:`~thermal_robot.correction.constant.constant`.

    Returns
    -------
    CorrectedModel
        The same effects; those parameters are zero, frames and other parameters what they are without them.
    tuple of Told
        What was left out, as it was fitted.

    Raises
    ------
    CampaignError
        If the model does not say how far its parameters may be off, or ``min_sigma`` is no number of deviations.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> from thermal_robot.correction import determined
    >>> model, left_out = determined(tr.diagnose(tr.demo_campaign()).model, min_sigma=2.0)
    >>> left_out
    ()
    """
    if not 0.0 <= min_sigma < np.inf:
        raise CampaignError(
            "min_sigma", "is no number of standard deviations", found=f"{min_sigma:g}", expected="a number such as 2"
        )
    known, spread = constant(model, temperature), model.spread
    frames = frame_columns(rows_of_every_kind(model))[1]
    names = tuple(name for name, own in zip(frames, moves(frames), strict=True) if own)
    if spread is None or len(spread.covariance) != len(names) + len(known.parameters):
        raise CampaignError(
            "min_sigma", "the model does not say how sure its parameters are", expected="one of this version: diagnose"
        )
    state = np.concatenate([np.zeros(len(names)), [told.value for told in known.parameters]])
    covariance, wider = spread.covariance, spread.wider
    left, gone = (len(names) + np.flatnonzero(known.held)).tolist(), []
    while left:
        std = np.sqrt(np.maximum(covariance.diagonal(), settings.TINY))
        weakest = min(left, key=lambda k: abs(state[k]) / std[k])
        if abs(state[weakest]) >= min_sigma * std[weakest]:
            break
        left.remove(weakest)
        gone.append(weakest)
        wider = None if wider is None else _known(state, wider, weakest)[1]
        state, covariance = _known(state, covariance, weakest)
    ends = np.cumsum([len(names), *(len(values) for _, values in model.effects)])
    kept = replace(
        model,
        effects=tuple((e, state[a:b]) for (e, _), a, b in zip(model.effects, ends, ends[1:], strict=False)),
        frames=moved(model.frames, state[: len(names)], names),
        spread=replace(spread, covariance=covariance, wider=wider),
    )
    return kept, tuple(known.parameters[k - len(names)] for k in sorted(gone))


def _known(state: Array, covariance: Array, k: int) -> tuple[Array, Array]:
    """Return mean (K,) and covariance (K, K) once one parameter is known to be zero."""
    variance, along = covariance[k, k], covariance[:, k]
    share = along / variance if variance > 0.0 else np.zeros(len(along))
    mean, rest = state - share * state[k], covariance - np.outer(share, along)
    mean[k], rest[k], rest[:, k] = 0.0, 0.0, 0.0
    return mean, rest
