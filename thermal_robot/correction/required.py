"""What samples must bring for a model to predict them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.effects import Effect
from thermal_robot.effects.apply import depends_on
from thermal_robot.errors import CampaignError, EffectError
from thermal_robot.observations import Observations, observe


def require_needed(samples: Campaign, needs: Sequence[str], effects: Sequence[Effect], simulated: bool) -> None:
    """Refuse samples that lack a column, or a cell of it, that a model needs.

    Parameters
    ----------
    samples
        Commands and conditions.
    needs
        Names of the columns.
    effects
        Of the model.
    simulated
        Whether the model corrects the prediction of the user's own simulator.

    Raises
    ------
    CampaignError
        Naming the column, and the row of an empty cell.
    """
    for column in needs:
        if column not in samples.covariates:
            reason = _reason(samples, needs, effects, column)
            raise CampaignError(samples.name, reason, column=column, found="no such column", expected="numbers")
        gaps = np.flatnonzero(samples.missing.get(column, np.zeros(0, dtype=bool)))
        if gaps.size:
            row, reason = int(samples.rows[gaps[0]]), _reason(samples, needs, effects, column)
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


def _reason(samples: Campaign, needs: Sequence[str], effects: Sequence[Effect], column: str) -> str:
    """Say which effects of the model need a column."""
    # what they read is asked of rows that have all columns; any possible values will do
    whole = {name: np.ones(samples.samples) for name in needs}
    seen = observe(replace(samples, covariates=whole, missing={}))
    own = [effect.name for effect in effects if _depends(effect, seen, column)]
    return f"the model ({', '.join(own or [effect.name for effect in effects])}) needs this column"


def _depends(effect: Effect, seen: Observations, column: str) -> bool:
    try:
        return column in depends_on(effect, seen)
    except EffectError:  # it may refuse such values: then it reads them
        return True


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
