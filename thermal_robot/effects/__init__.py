"""Effects: physical causes of the gap, their contract, and the library, extensible by entry points."""

from thermal_robot.effects.backlash import Backlash
from thermal_robot.effects.beam import ThermalBending
from thermal_robot.effects.catalogue import FRAMES, KINEMATIC, RANDOM, choose, library, named, random_effects
from thermal_robot.effects.compliance import BaseCompliance, LinkCompliance
from thermal_robot.effects.constant import BaseFrame, Geometric, InstrumentScale, JointOffset, ToolFrame
from thermal_robot.effects.drift import Drift
from thermal_robot.effects.effect import (
    Effect,
    Parameter,
    Response,
    at_base,
    at_instrument,
    at_joint,
    at_segment,
    at_tool,
)
from thermal_robot.effects.joint_compliance import JointCompliance
from thermal_robot.effects.position import JointGain, JointRipple, TransmissionError
from thermal_robot.effects.random_effect import EncoderResolution, ExcessRepeatability, RandomEffect
from thermal_robot.effects.thermal_elongation import ThermalElongation
from thermal_robot.effects.tracking_lag import TrackingLag

__all__ = [
    "FRAMES",
    "KINEMATIC",
    "RANDOM",
    "Backlash",
    "BaseCompliance",
    "BaseFrame",
    "Drift",
    "Effect",
    "EncoderResolution",
    "ExcessRepeatability",
    "Geometric",
    "InstrumentScale",
    "JointCompliance",
    "JointGain",
    "JointOffset",
    "JointRipple",
    "LinkCompliance",
    "Parameter",
    "RandomEffect",
    "Response",
    "ThermalBending",
    "ThermalElongation",
    "ToolFrame",
    "TrackingLag",
    "TransmissionError",
    "at_base",
    "at_instrument",
    "at_joint",
    "at_segment",
    "at_tool",
    "choose",
    "library",
    "named",
    "random_effects",
]
