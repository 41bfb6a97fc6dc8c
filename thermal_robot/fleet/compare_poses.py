"""Predicted poses of two models where both were measured, frames aligned: their difference against what they state.

The cross-validation of mrcal (D. Kogan, *mrcal*: cross-validation of calibrations): two solutions of the same thing
differ by noise, whose size each states. Where they differ by more than twice that, a model is wrong. Base and tool of
each campaign are its own, so that a base twist and a shift of the target that make the two alike mean nothing and are
fitted away, in the difference and in the deviations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.campaign.settings import STILL
from thermal_robot.correction import CorrectedModel
from thermal_robot.diagnosis.result import Diagnosis
from thermal_robot.effects.apply import displacement
from thermal_robot.fleet import compare_settings
from thermal_robot.fleet.compare_model import Known, observed, poses
from thermal_robot.fleet.comparison import Predicted
from thermal_robot.inference.algebra import equations_of, orthonormal
from thermal_robot.observations import Observations
from thermal_robot.prediction import sensitivity


def predicted(found: Sequence[Diagnosis | Known], names: Sequence[str]) -> tuple[Predicted, ...]:
    """Compare the models of every two campaigns.

    Parameters
    ----------
    found
        Their diagnoses, or models.
    names
        What the campaigns are called.
    """
    pairs = combinations(range(len(found)), 2)
    return tuple(_pair(found[a], found[b], (names[a], names[b])) for a, b in pairs)


def _pair(a: Diagnosis | Known, b: Diagnosis | Known, names: tuple[str, str]) -> Predicted:
    nothing = Predicted(names, 0, 0.0, 0.0, 0.0, True)
    if a.model.simulated or b.model.simulated:
        return replace(nothing, note="predictions of a simulator stand in the place of the model's own")
    if a.model.spread is None or b.model.spread is None:
        return replace(nothing, note="a model does not state how far its predictions may be off")
    q = _measured(a, b)
    common = _common(a.model, b.model)
    joints = a.model.robot.joint_names
    low, high = (np.array([common[name][end] for name in joints]) for end in (0, 1))
    q = q[((q >= low - STILL) & (q <= high + STILL)).all(axis=1)]
    if len(q) < compare_settings.TRIED:
        return replace(nothing, note="the two did not measure a common part of the workspace")
    at = [observed(found.model, q, common) for found in (a, b)]
    gauge = _gauge(a.model, b.model, at[0])
    gap = _left(_points(a.model, at[0]) - _points(b.model, at[1]), gauge)
    variance = sum(_variance(found.model, one, gauge) for found, one in zip((a, b), at, strict=True))
    distance, stated = np.sqrt((gap**2).sum(axis=1)), np.sqrt(np.asarray(variance).sum(axis=1))
    rms, deviation = float(np.sqrt((distance**2).mean())), float(np.sqrt((stated**2).mean()))
    far = float((distance > compare_settings.TWICE * stated).mean())
    return Predicted(names, len(q), rms, deviation, far, rms <= compare_settings.TWICE * deviation)


def _measured(a: Diagnosis | Known, b: Diagnosis | Known) -> Array:
    """(N, n) poses: those that were measured; where neither has its rows, poses in the ranges that both measured."""
    rows = [_some(found.rows.q) for found in (a, b) if not isinstance(found, Known)]
    if rows:
        return np.concatenate(rows)
    common = _common(a.model, b.model)
    low, high = (np.array([common[name][end] for name in a.model.robot.joint_names]) for end in (0, 1))
    return poses(a.model.robot, common) if (low <= high).all() else np.zeros((0, len(low)))


def _some(q: Array) -> Array:
    """Return rows spread evenly over all."""
    count = min(len(q), compare_settings.POSES)
    return np.asarray(q[np.linspace(0, len(q) - 1, count).astype(int)])


def _common(a: CorrectedModel, b: CorrectedModel) -> dict[str, tuple[float, float]]:
    """Return the range that both measured of each joint and column; where one alone has the column, its own."""
    first, second = (model.spread.ranges if model.spread else {} for model in (a, b))
    found = {}
    for name in (*a.robot.joint_names, *dict.fromkeys((*first, *second))):
        ends = [ranges[name] for ranges in (first, second) if name in ranges]
        low, high = max(low for low, _ in ends), min(high for _, high in ends)
        held = name in a.robot.joint_names and high < low <= high + STILL
        found[name] = (high, low) if held else (low, high)
    return found


def _points(model: CorrectedModel, at: Observations) -> Array:
    """(N, 3) the predicted target in the root frame, m."""
    _, instrument = displacement(at, model.effects)
    point = at.predicted_position + (0.0 if instrument is None else instrument)
    return np.asarray((point - model.frames.base[:3, 3]) @ model.frames.base[:3, :3])


def _gauge(a: CorrectedModel, b: CorrectedModel, at: Observations) -> Array:
    """(3 N, g) orthonormal columns of what aligning the unknown frames of either does."""
    parts = []
    if not (a.settings.base_known and b.settings.base_known):
        parts.append(at.base_sensitivity[:, :3, :])
    if not (a.settings.tool_known and b.settings.tool_known):
        parts.append(at.tool_sensitivity[:, :3, :3])
    if not parts:
        return np.zeros((3 * len(at.q), 0))
    columns = np.concatenate(parts, axis=2)
    return orthonormal(equations_of(columns))


def _left(values: Array, gauge: Array) -> Array:
    """Return columns (N, 3) or (N, 3, K) without what the gauge does."""
    flat = values.reshape(gauge.shape[0], -1)
    return np.asarray(flat - gauge @ (gauge.T @ flat)).reshape(values.shape)


def _variance(model: CorrectedModel, at: Observations, gauge: Array) -> Array:
    """(N, 3) stated variance per axis of the prediction, root frame, m²."""
    spread = model.spread
    assert spread is not None
    turned = model.frames.base[:3, :3]
    moved = sensitivity(at, [effect for effect, _ in model.effects])
    moved = _left(np.einsum("ji,njk->nik", turned, moved), gauge)
    told = ((moved @ spread.covariance) * moved).sum(axis=2)
    beyond = (turned.T**2) @ spread.beyond**2
    return np.asarray(np.maximum(told, 0.0) + beyond)
