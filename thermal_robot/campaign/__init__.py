"""Campaigns: measurement files, units and tables, read and validated here only."""

from thermal_robot.campaign.campaign import Campaign, describe
from thermal_robot.campaign.read import campaign_from_table, read_campaign, read_samples
from thermal_robot.campaign.settings import Settings
from thermal_robot.campaign.table import read_table
from thermal_robot.campaign.units import Units, unit_of
from thermal_robot.campaign.write import with_commands, with_prediction, write_campaign, write_predictions, write_table

__all__ = [
    "Campaign", "Settings", "Units", "campaign_from_table", "describe", "read_campaign", "read_samples", "read_table",
    "unit_of", "with_commands", "with_prediction", "write_campaign", "write_predictions", "write_table",
]  # fmt: skip
