"""Every effect in a file of its own; the library of all of them, and the user's own through entry points."""

from thermal_robot.effects.backlash import Backlash
from thermal_robot.effects.base_compliance import BaseCompliance
from thermal_robot.effects.base_frame import BaseFrame
from thermal_robot.effects.catalogue import KINEMATIC, RANDOM, choose, library, named, random_effects
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
from thermal_robot.effects.encoder_resolution import EncoderResolution
from thermal_robot.effects.excess_repeatability import ExcessRepeatability
from thermal_robot.effects.geometric import Geometric
from thermal_robot.effects.instrument_scale import InstrumentScale
from thermal_robot.effects.joint_compliance import JointCompliance
from thermal_robot.effects.joint_gain import JointGain
from thermal_robot.effects.joint_offset import JointOffset
from thermal_robot.effects.joint_ripple import JointRipple
from thermal_robot.effects.link_compliance import LinkCompliance
from thermal_robot.effects.random_effect import RandomEffect
from thermal_robot.effects.thermal_bending import ThermalBending
from thermal_robot.effects.thermal_elongation import ThermalElongation
from thermal_robot.effects.tool_frame import ToolFrame
from thermal_robot.effects.tracking_lag import TrackingLag
from thermal_robot.effects.transmission_error import TransmissionError

__all__ = [
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
