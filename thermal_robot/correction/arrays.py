"""Samples to predict from arrays and conditions, in the place of a table."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from thermal_robot.campaign import Campaign, Settings
from thermal_robot.campaign.names import PER_JOINT, PER_LINK, PLAIN_COVARIATES, did_you_mean
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
    return Campaign(
        name=NAME,
        robot=robot,
        q=rows,
        covariates=given,
        base_known=settings.base_known,
        tool_known=settings.tool_known,
        target=np.array(settings.target),
        payload_com=np.array(settings.payload_com),
        moves=settings.moves,
        reference_temperature=settings.reference_temperature,
        gears=settings.gears,
        units=settings.units,
    )


def _require_known(robot: Robot, conditions: Mapping[str, ArrayLike], needs: Collection[str]) -> None:
    """Refuse a condition that neither the model needs nor any campaign has."""
    known = dict.fromkeys((*needs, *PLAIN_COVARIATES))
    known |= dict.fromkeys(f"{column}.{joint}" for column in PER_JOINT for joint in robot.joint_names)
    known |= dict.fromkeys(f"{column}.{link}" for column in PER_LINK for link in robot.urdf_links)
    known |= dict.fromkeys(f"tilt.{link}.{axis}" for link in robot.urdf_links for axis in "xy")
    for name in conditions:
        if name not in known:
            raise CampaignError(
                NAME,
                f"nothing has this name{did_you_mean(str(name), known)}",
                column=str(name),
                expected=", ".join(needs) or "none, as the model needs no condition",
            )
