"""Say where the gap between a robot and its model lies, which effect causes it, and how far it shrinks."""

from thermal_robot import report
from thermal_robot.campaign import Campaign, campaign_from_table, describe, read_campaign, read_samples, write_campaign
from thermal_robot.correction import CorrectedModel
from thermal_robot.datasets import demo_campaign
from thermal_robot.diagnosis import Diagnosis, diagnose
from thermal_robot.diagnosis.result import told_by
from thermal_robot.effects import Effect
from thermal_robot.errors import CampaignError, EffectError, EstimationError, RobotError, ThermalRobotError
from thermal_robot.fleet.compare import compare
from thermal_robot.fleet.comparison import Comparison, compared_by
from thermal_robot.observations import Observations, observe
from thermal_robot.robot import Robot, load_robot
from thermal_robot.simulation import simulate

told_by(report)
compared_by(report)
__version__ = "0.2.0"

__all__ = [
    "Campaign",
    "CampaignError",
    "Comparison",
    "CorrectedModel",
    "Diagnosis",
    "Effect",
    "EffectError",
    "EstimationError",
    "Observations",
    "Robot",
    "RobotError",
    "ThermalRobotError",
    "campaign_from_table",
    "compare",
    "demo_campaign",
    "describe",
    "diagnose",
    "load_robot",
    "observe",
    "read_campaign",
    "read_samples",
    "simulate",
    "write_campaign",
]
