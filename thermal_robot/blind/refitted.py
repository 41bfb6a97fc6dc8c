"""What each part of a model would predict if it had been fitted alone: from this the shares on fresh rows follow."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from thermal_robot.campaign import Campaign
from thermal_robot.correction import CorrectedModel
from thermal_robot.diagnosis import Diagnosis
from thermal_robot.effects.apply import displacement
from thermal_robot.inference.columns import block, frame_columns
from thermal_robot.observations import Observations, observe

Array = NDArray[np.float64]

MOST = 6
"""Effects of which every subset is fitted: 64 fits."""
_ROUNDS = 3  # after which noise and fit agree to a per cent


def refitted(found: Diagnosis, campaign: Campaign, samples: Campaign) -> dict[str, Array]:
    """Predict samples with every subset of the effects of a model, frames and effects fitted anew for each.

    Linear about the corrected model, by least squares on the positions of the rows that were not set aside, with the
    settings of the whole diagnosis (time constants, places, quantities) and each effect's parameters held to the size
    that they have in it, the more so the more a subset leaves: what it leaves counts as noise. So the held-out shares
    of a diagnosis are defined, too.

    Parameters
    ----------
    found
        The diagnosis.
    campaign
        What it was made from.
    samples
        Commands and conditions.

    Returns
    -------
    dict
        By names joined with ``+``: (M, 3) positions in the measurement frame, m. Empty where there are more than
        :data:`MOST` effects, or none.
    """
    model = found.model
    if not 0 < len(model.effects) <= MOST:
        return {}
    given, asked = _corrected(model, campaign), _corrected(model, _measured(samples, model))
    kept = ~np.isin(campaign.rows, found.rows.rows[found.rows.outliers])
    noise = max(found.gap.noise_floor, 1e-9) / np.sqrt(3.0)
    columns, fresh, tight, slices = _design(model, given, asked)
    flat = columns[kept].reshape(-1, columns.shape[2])
    values = np.concatenate([np.zeros(slices[0].start), *(v for _, v in model.effects)])
    whole = given.gap[kept, :3].ravel() + flat @ values
    best, base = _position(asked), asked.frames.base[:3, :3]
    predicted = {}
    for size in range(len(slices) + 1):
        for chosen in combinations(range(len(slices)), size):
            used = np.concatenate([np.arange(slices[0].start), *(np.r_[slices[k]] for k in chosen)]).astype(int)
            fitted = np.zeros(len(values))
            fitted[used] = _ridge(flat[:, used], whole, noise, tight[used])
            names = "+".join(model.effects[k][0].name for k in chosen)
            predicted[names] = best + (fresh @ (fitted - values)) @ base.T
    return predicted


def _corrected(model: CorrectedModel, campaign: Campaign) -> Observations:
    """Observe with the whole model; only what the model reads is there to be read."""
    moved, instrument = displacement(observe(campaign, model.frames), model.effects)
    return observe(campaign, model.frames, displacement=moved, instrument=instrument)


def _measured(samples: Campaign, model: CorrectedModel) -> Campaign:
    """Pretend that samples were measured, so that their columns are those of the campaign."""
    count = samples.samples
    turned = np.tile([1.0, 0.0, 0.0, 0.0], (count, 1)) if model.measures == "pose" else None
    read = {name: values for name, values in samples.covariates.items() if name in model.needs}
    return replace(samples, covariates=read, position=np.zeros((count, 3)), orientation=turned)


def _position(observed: Observations) -> Array:
    shift = 0.0 if observed.instrument is None else observed.instrument
    return np.asarray(observed.predicted_position + shift)


def _design(
    model: CorrectedModel, given: Observations, asked: Observations
) -> tuple[Array, Array, Array, tuple[slice, ...]]:
    """(N, 3, K) and (M, 3, K) columns of frames and effects, (K,) one over what holds each, and each effect's columns.

    A parameter is held to the rms of its effect's parameters, in units of their expected sizes.
    """
    frames = frame_columns(given)[0]
    here, there, tight, slices = [frames], [frame_columns(asked)[0]], [np.zeros(frames.shape[2])], []
    start = frames.shape[2]
    for effect, values in model.effects:
        own = block(given, effect)
        here.append(own.columns)
        there.append(block(asked, effect).columns)
        scale = np.sqrt(np.mean((values / own.sizes) ** 2)) if len(values) else 1.0
        tight.append(1.0 / (own.sizes * max(scale, 1e-6)))
        slices.append(slice(start, start + len(values)))
        start += len(values)
    columns, fresh = np.concatenate(here, axis=2)[:, :3], np.concatenate(there, axis=2)[:, :3]
    return columns, fresh, np.concatenate(tight), tuple(slices)


def _ridge(columns: Array, gap: Array, noise: float, tight: Array) -> Array:
    """Least squares with a row for each parameter that is held, noise and remainder found together."""
    rows = np.diag(tight)[tight > 0]
    level = noise
    for _ in range(_ROUNDS):
        both = np.vstack([columns, level * rows])
        size = np.linalg.norm(both, axis=0)
        size[size == 0.0] = 1.0
        padded = np.concatenate([gap, np.zeros(len(rows))])
        fitted = np.linalg.lstsq(both / size, padded, rcond=1e-10)[0] / size
        level = max(float(np.sqrt(np.mean((gap - columns @ fitted) ** 2))), noise)
    return np.asarray(fitted)
