"""Expected shrinkage of the gap by a robot file alone, by cross-validation.

Without each fold frames and parameters are fitted; the file applies what it holds of these parameters
(:mod:`thermal_robot.correction.holding`), base and tool are registered anew to the same rows with the file in use, and
both predict the fold. Which parameters are too weak to be applied is decided once, on all rows, as the choice of
effects is.

Parameters of a file were fitted together with others that it lacks. Used without the rest of the model a file does
better whose parameters are fitted **alone**: the constant effects without the others, or zeros without anything. The
same folds say how much.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.correction.constant import constant
from thermal_robot.correction.holding import PLACEMENTS, TICK, TICKS, WORTH, ZEROS, applied
from thermal_robot.correction.model import CorrectedModel
from thermal_robot.diagnosis.cross_validation import CrossValidation, Model, Rows, share
from thermal_robot.effects import Effect, JointOffset
from thermal_robot.effects.settings import SIZE_MOST
from thermal_robot.inference.algebra import whitener
from thermal_robot.inference.columns import Block, block
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.grouping import each, held_out_groups
from thermal_robot.inference.problem import Linear
from thermal_robot.prediction import FileGap


def file_gaps(fit: Fit, model: CorrectedModel) -> tuple[FileGap, ...]:
    """Return the held-out rms gap with each robot file: all parameters, without weak ones, and parameters fitted alone.

    Empty where nothing can be held out, the model has no uncertainty, or no parameter of it fits in a file.
    """
    if model.spread is None or not constant(model).responses[:, :-12].any():
        return ()
    e = fit.explanation
    labels, _ = held_out_groups(fit.campaign)
    whole = Model.of(e, labels)
    validation = CrossValidation.over(whole, each(labels)) if labels.max(initial=0) else None
    if validation is None or not validation.tests:
        return ()
    fitted = -whole.fits([~test for test in validation.tests], range(len(whole.spans)))[:, whole.flat : -1]
    moved = _Moved.of(fit, whole)
    rows, before = moved.squares(validation, np.zeros((len(validation.tests), moved.width)))

    def gap(holds: str, min_sigma: float | None, displacements: Array, alone: Sequence[float] = ()) -> FileGap:
        _, after = moved.squares(validation, displacements)
        far, near = (float(np.sqrt(squares[0] / rows)) for squares in (before, after))
        return FileGap(holds, min_sigma, far, near, *share(before - after, before), tuple(alone))

    files = {least: applied(model, least) for least in (None, WORTH)}
    own = [gap(h, least, f.displacement(fitted)) for least, some in files.items() for h, f in some.items()]
    return *own, *(gap(h, None, d[:-1], d[-1].tolist()) for h, d in _alone(fit, model, whole, validation).items())


def _alone(fit: Fit, model: CorrectedModel, whole: Model, validation: CrossValidation) -> dict[str, Array]:
    """Displacements (F + 1, n + 6 S), by kind of file, of parameters fitted alone without each fold and to all rows."""
    known, robot = constant(model), fit.campaign.robot
    ends = np.cumsum([0, *(len(values) for _, values in model.effects)])
    own = [k for k in range(len(model.effects)) if known.responses[ends[k] : ends[k + 1], :-12].any()]
    rows = [*(~test for test in validation.tests), np.ones(len(whole.block), dtype=bool)]
    picked = np.concatenate([np.arange(ends[k], ends[k + 1]) for k in own])
    # at the nominal robot: at the corrected one what frames take up would seem apart from them
    held = [(fit.effects[k][0], fit.effects[k][1]) for k in own]
    placed = _fits(fit, whole, held, rows) @ known.responses[picked, :-12]
    turned = np.zeros_like(placed)
    zeros = JointOffset(), SIZE_MOST * block(fit.nominal, JointOffset()).sizes
    turned[:, : robot.n] = _fits(fit, whole, [zeros], rows)
    return {PLACEMENTS: placed, ZEROS: turned, TICKS: np.round(turned / TICK) * TICK}


def _fits(fit: Fit, whole: Model, held: Sequence[tuple[Effect, Array]], rows: Sequence[Rows]) -> Array:
    """Ridge estimates (S, P) of effects beside the frames, on S subsets of rows; given values set the prior sizes."""
    linear = replace(fit.before, blocks=tuple(block(fit.nominal, effect).held for effect, _ in held))
    part = whole.partial(linear, [values for _, values in held])
    return np.asarray(-part.fits(rows, range(len(held)))[:, part.flat : -1])


class _Moved(Model):
    """Linear model of the nominal robot, with the displacements of all joints and segments as its columns."""

    @classmethod
    def of(cls, fit: Fit, whole: Model) -> _Moved:  # type: ignore[override]
        """Build it from the Jacobians of a fit's nominal robot, weighted as in the fit, but with independent rows."""
        seen, measures = fit.nominal, fit.before.measures
        segments = seen.segment_sensitivity[:, :measures]
        columns = np.concatenate([seen.joint_sensitivity[:, :measures], segments.reshape(*segments.shape[:2], -1)], 2)
        sizes = np.ones(columns.shape[2])
        linear = Linear(fit.before.gap, fit.before.frames, (Block(fit.effects[0][0], (), columns, sizes),))
        return cls(linear, (1.0,), replace(whole.whitening, smooth=None), whole.variance, whole.kept, whole.block)

    @property
    def width(self) -> int:
        """Number of displacements, n + 6 S."""
        return len(self.linear.blocks[0].sizes)

    def squares(self, validation: CrossValidation, displacements: Array) -> tuple[int, Array]:
        """Return the number of held-out rows and their squared residuals (1 + F,), m²: of all folds, and without each.

        In each fold its displacements (F, n + 6 S) are applied, and frames are fitted to the other rows.
        """
        each_fold, rows = [], 0
        for test, own in zip(validation.tests, displacements, strict=True):
            products, flat = self.products(~test)[0], self.flat
            known = whitener(products[:flat, :flat])
            frames = known @ (known.T @ (products[:flat, -1] - products[:flat, flat:-1] @ own))
            left = self.test_columns(test)[self.kept[test]]
            each_fold.append(float(((left[:, :3] @ np.concatenate([-frames, -own, [1.0]])) ** 2).sum()))
            rows += len(left)
        total = np.sum(each_fold)
        return rows, np.append(total, total - each_fold)
