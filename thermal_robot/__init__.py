"""Diagnose the gap between a robot and its model: where it enters, which effect causes it, how far it shrinks.

Nothing is loaded before it is used: neither Pinocchio nor SciPy by ``import thermal_robot`` alone.
"""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from thermal_robot import report
from thermal_robot.renderer import register_renderer

if TYPE_CHECKING:
    from thermal_robot.campaign import (
        Campaign,
        campaign_from_table,
        describe,
        read_campaign,
        read_samples,
        write_campaign,
    )
    from thermal_robot.correction import CorrectedModel
    from thermal_robot.datasets import demo_campaign
    from thermal_robot.diagnosing import compare, diagnose
    from thermal_robot.diagnosis import Diagnosis
    from thermal_robot.diagnosis.calibration import Calibration, calibrate
    from thermal_robot.diagnosis.crash import Crash, after_crash
    from thermal_robot.effects import Effect
    from thermal_robot.errors import CampaignError, EffectError, EstimationError, RobotError, ThermalRobotError
    from thermal_robot.fleet.comparison import Comparison
    from thermal_robot.fleet.many import diagnose_many
    from thermal_robot.fleet.wear import wear
    from thermal_robot.motion import MotionLog, motion_from_table, read_motion
    from thermal_robot.motion.compare import MotionComparison
    from thermal_robot.motion.result import MotionDiagnosis
    from thermal_robot.observations import Observations, observe
    from thermal_robot.robot import Robot, load_robot
    from thermal_robot.simulation.simulate import simulate

register_renderer(report)
__version__ = "0.2.0"

_HOME = {
    "Comparison": "fleet.comparison",
    "compare": "diagnosing",
    "wear": "fleet.wear",
    "Calibration": "diagnosis.calibration",
    "Campaign": "campaign",
    "CampaignError": "errors",
    "CorrectedModel": "correction",
    "Diagnosis": "diagnosis",
    "Effect": "effects",
    "EffectError": "errors",
    "EstimationError": "errors",
    "MotionComparison": "motion.compare",
    "MotionDiagnosis": "motion.result",
    "MotionLog": "motion",
    "Observations": "observations",
    "Robot": "robot",
    "RobotError": "errors",
    "ThermalRobotError": "errors",
    "Crash": "diagnosis.crash",
    "after_crash": "diagnosis.crash",
    "calibrate": "diagnosis.calibration",
    "campaign_from_table": "campaign",
    "demo_campaign": "datasets",
    "describe": "campaign",
    "diagnose": "diagnosing",
    "diagnose_many": "fleet.many",
    "load_robot": "robot",
    "motion_from_table": "motion",
    "observe": "observations",
    "read_campaign": "campaign",
    "read_motion": "motion",
    "read_samples": "campaign",
    "simulate": "simulation",
    "write_campaign": "campaign",
}


def __getattr__(name: str) -> Any:
    if name in _HOME:
        found = getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
        globals()[name] = found  # asked for once
        return found
    if not name.startswith("_") and find_spec(f"{__name__}.{name}"):
        return import_module(f"{__name__}.{name}")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOME})


__all__ = [
    "Calibration",
    "Campaign",
    "CampaignError",
    "Comparison",
    "CorrectedModel",
    "Crash",
    "Diagnosis",
    "Effect",
    "EffectError",
    "EstimationError",
    "MotionComparison",
    "MotionDiagnosis",
    "MotionLog",
    "Observations",
    "Robot",
    "RobotError",
    "ThermalRobotError",
    "after_crash",
    "calibrate",
    "campaign_from_table",
    "compare",
    "demo_campaign",
    "describe",
    "diagnose",
    "diagnose_many",
    "load_robot",
    "motion_from_table",
    "observe",
    "read_campaign",
    "read_motion",
    "read_samples",
    "simulate",
    "wear",
    "write_campaign",
]
