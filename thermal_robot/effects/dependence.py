"""What an effect as it was fitted depends on: it may read more, for joints and links that it does not sit in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.effects import gate
from thermal_robot.effects.effect import Effect, Parameter
from thermal_robot.errors import ThermalRobotError

if TYPE_CHECKING:
    from thermal_robot.campaign import Campaign
    from thermal_robot.observations import Observations


def depends_on(effect: Effect, observations: Observations) -> tuple[str, ...]:
    """Columns of :func:`gate.reads` without which, or with other values of which, a fitted effect does something else.

    A column counts where the effect's own parameters change as it is left out, or takes other values: one that equals
    another column here need not do so elsewhere. Raises :class:`EffectError` if the effect breaks the contract.
    """
    campaign, own = observations.campaign, gate.checked(effect, observations)
    read = gate.reads(effect, observations)

    def same(columns: Sequence[str], other: Mapping[str, Array]) -> bool:
        covariates = {name: values for name, values in campaign.covariates.items() if name not in columns}
        try:
            changed = replace(campaign, covariates={**covariates, **other})
            return _alike(own, gate.checked(effect, replace(observations, campaign=changed)))
        except ThermalRobotError:  # such rows cannot be: nothing says that they would not matter
            return False

    spare = [c for c in read if same([c], {}) and any(same([c], {c: other}) for other in _others(campaign, c))]
    return tuple(c for c in read if c not in spare) if same(spare, {}) else read


def _others(campaign: Campaign, column: str) -> tuple[Array, ...]:
    """Return other values that a column may have: those of other rows, or one more and one less where all are one."""
    values = campaign.covariates[column]
    moved = np.roll(values, 1)
    return (moved,) if np.any(moved != values) else (values - 1.0, values + 1.0)


def _alike(some: Sequence[Parameter], others: Sequence[Parameter]) -> bool:
    """Tell whether parameters have the same names and responses."""
    if [(p.name, len(p.responses)) for p in some] != [(p.name, len(p.responses)) for p in others]:
        return False
    return all(
        (a.channel, a.index) == (b.channel, b.index) and np.array_equal(a.values, b.values)
        for p, q in zip(some, others, strict=True)
        for a, b in zip(p.responses, q.responses, strict=True)
    )
