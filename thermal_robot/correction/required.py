"""What samples must bring for a model to predict them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from thermal_robot.campaign import Campaign
from thermal_robot.errors import CampaignError

Array = NDArray[np.float64]


def require_needed(samples: Campaign, needs: Sequence[str], effects: Sequence[str], simulated: bool) -> None:
    """Refuse samples that lack a column, or a cell of it, that a model needs.

    Parameters
    ----------
    samples
        Commands and conditions.
    needs, effects
        Names of the columns, and of the model's effects.
    simulated
        Whether the model corrects the prediction of the user's own simulator.

    Raises
    ------
    CampaignError
        Naming the column, and the row of an empty cell.
    """
    reason = f"the model ({', '.join(effects)}) needs this column"
    for column in needs:
        if column not in samples.covariates:
            raise CampaignError(samples.name, reason, column=column, found="no such column", expected="numbers")
        gaps = np.flatnonzero(samples.missing.get(column, np.zeros(0, dtype=bool)))
        if gaps.size:
            row = int(samples.rows[gaps[0]])
            raise CampaignError(
                samples.name, reason, row=row, column=column, found="an empty cell", expected="a number"
            )
    if simulated and samples.simulated_position is None:
        raise CampaignError(
            samples.name,
            "the model corrects the prediction of your simulator",
            column="sim.x",
            found="no such column",
            expected="sim.x, sim.y, sim.z",
        )


def require_finite(samples: Campaign, position: Array) -> None:
    """Refuse positions (N, 3) that are not finite.

    Raises
    ------
    CampaignError
        Naming the first row.
    """
    wrong = np.flatnonzero(~np.isfinite(position).all(axis=1))
    if wrong.size:
        row = int(samples.rows[wrong[0]])
        raise CampaignError(samples.name, "the values of this row lead to no finite position", row=row)
