"""Further rows of a campaign: read as the campaign was; rows of another robot or kind are refused."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from thermal_robot.campaign.campaign import Campaign, read_alike
from thermal_robot.campaign.read import build_campaign
from thermal_robot.campaign.table import table_from_frame
from thermal_robot.errors import CampaignError, require

if TYPE_CHECKING:
    import pandas as pd

SAME_PLACE = 1e-9  # m: by which the tool frame differs between readings of one URDF at most


def more_rows(old: Campaign, rows: Campaign | pd.DataFrame, needs: tuple[str, ...]) -> Campaign:
    """Further rows, a campaign or a table of the old one's columns and units, as a campaign to append.

    Raises :class:`CampaignError` if they are of another robot or kind, or lack a column that is needed.
    """
    if not isinstance(rows, Campaign):
        import pandas as pd

        expected = "a campaign of the same robot, or a pandas DataFrame of its columns"
        require("update(), rows", rows, (pd.DataFrame,), expected)
        rows = build_campaign(table_from_frame(rows, "<rows>"), old.settings, old.robot, name="rows")
    _require_same_robot(old, rows)
    theirs = _stated(rows)
    for what, mine in _stated(old).items():
        if mine != theirs[what]:
            expected = f"{mine}, as of {old.name}"
            raise CampaignError(rows.name, f"another {what}", found=str(theirs[what]), expected=expected)
    if old.targets is not None or rows.targets is not None:
        expected = "rows of one target; diagnose all rows together"
        raise CampaignError(rows.name, "several targets of each pose, whose places all rows tell", expected=expected)
    rows = read_alike(rows, old.robot, old.turned)
    for column in needs:
        if column not in rows.covariates:
            raise CampaignError(rows.name, "lacks what the chosen effects read", column=column, expected="this column")
    return rows


def _stated(campaign: Campaign) -> dict[str, object]:
    """Return the declarations that old and new rows must share, by name."""
    own = campaign.simulated_position is not None
    return {
        "kind of measurement": campaign.measures,
        "base frame": "known" if campaign.base_known else "unknown",
        "tool frame": "known" if campaign.tool_known else "unknown",
        "target": campaign.target.tolist(),
        "noise of positions": campaign.noise_position if campaign.noise_of_rows is None else "of each row",
        "noise of orientations": campaign.noise_orientation,
        "reference temperature": campaign.reference_temperature,
        "prediction": "of the user's simulator" if own else "of the URDF",
    }


def _require_same_robot(old: Campaign, rows: Campaign) -> None:
    """Refuse rows of another chain: other joints, or another forward kinematics."""
    mine, theirs = old.robot, rows.robot
    if theirs is mine:
        return
    if theirs.joint_names != mine.joint_names:
        found, expected = ", ".join(theirs.joint_names), ", ".join(mine.joint_names)
        raise CampaignError(rows.name, "another robot: its joints differ", found=found, expected=expected)
    q = np.array([np.zeros(mine.n), *np.eye(mine.n), np.ones(mine.n)])
    if np.abs(theirs.forward(q) - mine.forward(q)).max() > SAME_PLACE:
        raise CampaignError(rows.name, "another nominal model", expected="the same URDF and tool frame")
