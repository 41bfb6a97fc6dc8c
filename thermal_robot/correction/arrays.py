"""Samples to predict from arrays and conditions, in the place of a table."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from thermal_robot.campaign import Campaign, Settings, names
from thermal_robot.errors import CampaignError
from thermal_robot.robot import Robot

NAME = "<conditions>"
"""What such samples are called in messages."""


def of_arrays(
    robot: Robot, settings: Settings, q: Any, conditions: Mapping[str, ArrayLike], needs: Collection[str] = ()
) -> Campaign:
    """Return samples to predict.

    Parameters
    ----------
    robot, settings
        Of the campaign that a model was fitted to.
    q
        (N, n) joint positions, rad or m; (n,) counts as one row.
    conditions
        By column name, one value for all rows or (N,), SI.
    needs
        Columns that the model needs: what an effect of the user's own reads may have any name.

    Raises
    ------
    CampaignError
        If an array does not fit, or a value is none; if nothing knows a condition's name.
    """
    _require_known(robot, conditions, needs)
    given = {}
    try:
        rows = np.atleast_2d(np.asarray(q, dtype=float))
        for key, value in conditions.items():
            given[key] = np.broadcast_to(np.asarray(value, dtype=float), len(rows)).copy()
    except (TypeError, ValueError) as error:
        what = f"an array (N, {robot.n}), and for each condition one number or N"
        raise CampaignError(NAME, "these are no rows of numbers", found=str(error), expected=what) from error
    return Campaign(name=NAME, robot=robot, q=rows, covariates=given, **settings.of_rows())


def _require_known(robot: Robot, conditions: Mapping[str, ArrayLike], needs: Collection[str]) -> None:
    """Refuse a condition that neither the model needs nor any campaign has."""
    known = dict.fromkeys(needs) | names.conditions(robot.joint_names, robot.urdf_links)
    for name in conditions:
        if name not in known:
            raise CampaignError(
                NAME,
                f"nothing has this name{names.did_you_mean(str(name), known)}",
                column=str(name),
                expected=", ".join(needs) or "none, as the model needs no condition",
            )
