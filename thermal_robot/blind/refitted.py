"""What each part of a model would predict if it had been fitted alone: from this the shares on fresh rows follow."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.correction import CorrectedModel
from thermal_robot.diagnosis import Diagnosis
from thermal_robot.inference.columns import block, frame_columns
from thermal_robot.inference.frames import register
from thermal_robot.observations import Observations, observe

MOST = 6
"""Effects of which every subset is fitted: 64 fits."""
_ROUNDS = 3  # after which noise and fit agree to a per cent


def refitted(found: Diagnosis, campaign: Campaign, samples: Campaign) -> dict[str, Array]:
    """Predict samples with every subset of the effects of a model, frames and effects fitted anew for each.

    Of a part of the effects linear about the nominal robot, by least squares on the rows that were not set aside, with
    the settings of the whole diagnosis (time constants, places, quantities) and each effect's parameters held to the
    size that they have in it, the more so the more a subset leaves: what it leaves counts as noise, of positions and of
    orientations apart. So the held-out shares of a diagnosis are defined, too. All effects together are the model.

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
    kept = ~np.isin(campaign.rows, found.rows.rows[found.rows.outliers])
    frames = register(campaign, kept)
    given = observe(campaign, frames)
    asked = observe(_measured(samples, model), frames)
    columns, fresh, tight, slices = _design(model, given, asked)
    columns, gap, left = columns[kept], given.gap[kept], found.rows.remainder[kept]
    noise = np.maximum(np.sqrt((left.reshape(len(left), -1, 3) ** 2).mean(axis=(0, 2))), 1e-9)
    nominal, base = asked.predicted_position, frames.base[:3, :3]
    predicted = {"+".join(effect.name for effect, _ in model.effects): model.predict(samples)[0]}
    for size in range(len(slices)):
        for chosen in combinations(range(len(slices)), size):
            used = np.concatenate([np.arange(slices[0].start), *(np.r_[slices[k]] for k in chosen)]).astype(int)
            fitted = _ridge(columns[:, :, used], gap, noise, tight[used])
            names = "+".join(model.effects[k][0].name for k in chosen)
            predicted[names] = nominal + fresh[:, :, used] @ fitted @ base.T
    return predicted


def _measured(samples: Campaign, model: CorrectedModel) -> Campaign:
    """Pretend that samples were measured, so that their columns are those of the campaign."""
    count = samples.samples
    turned = np.tile([1.0, 0.0, 0.0, 0.0], (count, 1)) if model.measures == "pose" else None
    read = {name: values for name, values in samples.covariates.items() if name in model.needs}
    return replace(samples, covariates=read, position=np.zeros((count, 3)), orientation=turned)


def _design(
    model: CorrectedModel, given: Observations, asked: Observations
) -> tuple[Array, Array, Array, tuple[slice, ...]]:
    """(N, m, K) and (M, 3, K) columns of frames and effects, (K,) one over what holds each, and each effect's columns.

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
    columns, fresh = np.concatenate(here, axis=2), np.concatenate(there, axis=2)[:, :3]
    return columns, fresh, np.concatenate(tight), tuple(slices)


def _ridge(columns: Array, gap: Array, noise: Array, tight: Array) -> Array:
    """Least squares with a row for each parameter that is held; noise and remainder of each kind found together.

    (N, m, K) columns and (N, m) gap; (m/3,) noise of positions and orientations, m and rad.
    """
    rows = np.diag(tight)[tight > 0]
    level = np.maximum(np.sqrt((gap.reshape(len(gap), -1, 3) ** 2).mean(axis=(0, 2))), noise)
    for _ in range(_ROUNDS):
        each = np.repeat(level, 3)
        both = np.vstack([(columns / each[:, None]).reshape(gap.size, columns.shape[2]), rows])
        size = np.linalg.norm(both, axis=0)
        size[size == 0.0] = 1.0
        padded = np.concatenate([(gap / each).ravel(), np.zeros(len(rows))])
        fitted = np.linalg.lstsq(both / size, padded, rcond=1e-10)[0] / size
        left = (gap - columns @ fitted).reshape(len(gap), -1, 3)
        level = np.maximum(np.sqrt((left**2).mean(axis=(0, 2))), noise)
    return np.asarray(fitted)
