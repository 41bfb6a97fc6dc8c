"""A campaign as pandas and notebooks show it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from thermal_robot.campaign.campaign import Campaign
from thermal_robot.campaign.describe import described_html
from thermal_robot.campaign.write import table_columns

if TYPE_CHECKING:
    import pandas as pd


def frame(campaign: Campaign) -> pd.DataFrame:
    """Return the table as :func:`~thermal_robot.campaign.write.write_table` would write it.

    Its ``attrs`` hold the units, so that :func:`~thermal_robot.campaign_from_table` need not be told them.
    """
    import pandas as pd

    labels = {name: labels.astype(object) for name, labels in campaign.labels.items()}
    shown = pd.DataFrame({**dict(table_columns(campaign)), **labels}, index=pd.Index(campaign.rows, name="row"))
    shown.attrs = {"angle_unit": campaign.units.angle, "length_unit": campaign.units.length}
    return shown


def html(campaign: Campaign) -> str:
    """Return robot, frames, joints, conditions and warnings as tables."""
    return described_html(campaign)
