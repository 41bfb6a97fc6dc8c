"""As many rows of a fit as a scan for laws needs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from thermal_robot.inference import settings
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.gauss_newton import corrected_observations
from thermal_robot.inference.problem import Linear
from thermal_robot.inference.rows import in_a_row
from thermal_robot.inference.target import Target
from thermal_robot.observations import Observations


@dataclass(frozen=True, eq=False)
class Thin:
    """As many rows of a fit as a scan needs: all of them, or some drawn at random where there are very many.

    ``changed`` (M,): rows that were set aside and follow each other in time.
    """

    observations: Observations
    linear: Linear
    changed: NDArray[np.bool_]

    @classmethod
    def of(cls, fit: Fit) -> Thin:
        """Return the rows of a fit."""
        e = fit.explanation
        if fit.campaign.samples <= settings.ENOUGH_ROWS:
            return cls(fit.corrected, e.linear, in_a_row(fit.campaign, e.outliers))
        drawn = np.random.default_rng(settings.DRAW_SEED).choice(
            fit.campaign.samples, settings.ENOUGH_ROWS, replace=False
        )
        rows = np.sort(drawn)
        return cls(
            corrected_observations(fit.campaign.take(rows), fit.corrected.frames, fit.effects),
            Linear(
                e.linear.gap[rows],
                e.linear.frames[rows],
                tuple(replace(b, source=b.columns[rows]) for b in e.linear.blocks),
            ),
            in_a_row(fit.campaign, e.outliers)[rows],
        )

    def target(self, blocks: Iterable[int], *, sound: bool = False) -> Target:
        """Return the residual once the frames and some blocks are projected out.

        Rows far from the rest weigh little, unless they follow each other, or all but the farthest few are taken for
        ``sound``: what is large in few rows looks like gross errors until its law is known.
        """
        columns = [self.linear.blocks[b].columns for b in blocks]
        design = np.concatenate([self.linear.frames, *columns], axis=2)
        relative = self.observations.campaign.relative_noise
        first = Target.of(self.linear.gap, design, self.changed, relative)
        if not sound:
            return first
        distance = np.linalg.norm(first.white.reshape(first.root.shape) / first.root, axis=1)
        near = distance <= np.quantile(distance, 1.0 - settings.FEW_ASIDE)
        return Target.of(self.linear.gap, design, near | self.changed, relative)
