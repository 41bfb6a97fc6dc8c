"""Effects of a servo: what each is called, which number of the servo model it moves, how large it can be, its units.

Values fitted as a torque over the servo's stiffness are multiplied by the stiffness for a data sheet.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import exp, inf, log

from thermal_robot.arrays import Array
from thermal_robot.diagnosis.values import Estimate
from thermal_robot.motion import settings
from thermal_robot.motion.log import Servo

SOURCED, UNSOURCED = 1.0, 1.5
"""Standard deviation of the logarithm of an expected size: from logs of real servos, and where nobody knows."""


@dataclass(frozen=True)
class ServoEffect:
    """One number of the servo model, or of the torque channel's, that may differ from what the maker states.

    ``size`` is the prior's standard deviation in ``unit``; with ``of_limit`` in shares of torque limit over stiffness,
    rad, or of the limit, N·m, with ``of_speed`` over the fastest speed; no value is below ``least`` or above ``most``.
    A dead zone below zero is a starting force: at any error the drive gives so much more, to overcome friction.
    ``torque``: name and unit times the stiffness.
    """

    name: str
    title: str
    singular: str
    label: str
    number: str
    unit: str
    size: float
    of_limit: bool = False
    of_speed: bool = False
    spread: float = SOURCED
    least: float = 0.0
    most: float = inf
    torque: tuple[str, str] | None = None


EFFECTS = (
    ServoEffect("zero", "zeros of the joints", "the zero", "zero", "zero", "rad", 20e-3, least=-inf),
    ServoEffect("gain", "gain of the command", "the command's gain", "gain", "gain", "", 10e-3, least=-1.0),
    ServoEffect("delay", "delay of the command", "a delay of the command", "delay", "delay", "s", 10e-3,
                spread=UNSOURCED),
    ServoEffect("lag", "lag of the servos", "the servo's lag", "time constant", "lag", "s", 80e-3),
    ServoEffect("armature", "inertia of the drives", "the drive's inertia", "inertia over stiffness", "inertia", "s²",
                5e-3, of_limit=True, torque=("inertia", "kg·m²")),
    ServoEffect("droop", "droop under load", "droop under load", "compliance", "droop", "rad/(N·m)", 0.07),
    ServoEffect("kp", "stiffness of the servos", "the servo's stiffness", "logarithm of its ratio", "kp", "", 0.2,
                least=-log(settings.SOFTER)),
    ServoEffect("coulomb", "Coulomb friction", "Coulomb friction", "half width", "coulomb", "rad", 0.02, of_limit=True,
                torque=("torque", "N·m")),
    ServoEffect("load_friction", "friction that grows with load", "friction that grows with load",
                "share of the load", "load_friction", "", 0.15, most=settings.SELF_LOCKING,
                torque=("share of the load", "")),
    ServoEffect("stribeck", "Stribeck friction", "Stribeck friction", "breakaway", "stribeck", "rad", 0.01,
                of_limit=True, spread=UNSOURCED, torque=("breakaway torque", "N·m")),
    ServoEffect("dead_zone", "dead zone, play or starting force",
                "a dead zone, play or starting force", "half width", "dead_zone", "rad", 5e-3,
                least=-inf),
    ServoEffect("torque_limit", "saturation of the servos", "the servo's saturation", "inverse of the limit",
                "saturation", "1/rad", 5.0),
    ServoEffect("speed_limit", "speed limits of the servos", "the servo's speed limit", "inverse of the speed",
                "slew", "s/rad", 0.2),
    ServoEffect("acceleration_limit", "acceleration limits of the servos", "the servo's acceleration limit",
                "inverse of the acceleration", "ramp", "s²/rad", 0.03),
    ServoEffect("low_stop", "lower end stops", "a lower end stop", "below which it stops", "low", "rad", 0.5,
                spread=UNSOURCED),
    ServoEffect("high_stop", "upper end stops", "an upper end stop", "above which it stops", "high", "rad", 0.5,
                spread=UNSOURCED),
)  # fmt: skip
TORQUE_EFFECTS = (
    *(replace(one, label=one.torque[0], unit=one.torque[1]) for one in EFFECTS if one.torque),
    ServoEffect("offset", "offsets of the torque channel", "the torque channel's offset", "offset", "offset", "N·m",
                0.02, of_limit=True, least=-inf),
    ServoEffect("viscous", "viscous friction", "viscous friction", "damping", "viscous", "N·m·s/rad", 0.02,
                of_limit=True, of_speed=True, spread=UNSOURCED),
    ServoEffect("torque_constant", "the torque channel's constant", "the torque channel's constant",
                "change of the torque constant", "torque_constant", "", 0.1, least=-1.0),
)  # fmt: skip
"""Effects that a torque channel shows, in its units."""

ABRUPT = ("contact", "torque_limit", "speed_limit", "acceleration_limit", "low_stop", "high_stop")
"""Effects that do nothing until they are reached, so that one motion alone may tell them."""
SIMULATOR = ("step", "creep")
"""Effects of a simulator that made a log, which are told of no robot: its time step, its soft friction."""
TITLES = {effect.name: effect.title for effect in EFFECTS}
SHARED_TITLES = {
    "payload": "payload",
    "contact": "contact of the tool with a plane",
    "masses": "masses of the links",
}
TORQUE_TITLES = {effect.name: effect.title for effect in TORQUE_EFFECTS if effect.name not in TITLES}
_TIMES_STIFFNESS = {(effect.name, effect.unit): effect.torque for effect in EFFECTS if effect.torque}
_INVERSE = {"speed_limit": ("speed", "rad/s"), "acceleration_limit": ("acceleration", "rad/s²")}
_SHARES = {"gain", "load_friction", "torque_constant", "masses"}


def size(effect: ServoEffect, servo: Servo) -> float:
    """Return the prior standard deviation of an effect in a joint; ``of_limit``: times torque limit over stiffness."""
    if not effect.of_limit:
        return effect.size
    return effect.size * (servo.limit or settings.TORQUE_LIMIT) / (servo.kp or settings.STIFFNESS)


def physical(effect: str, estimate: Estimate, servo: Servo, commanded: Array) -> Estimate:
    """Return a parameter in the units of a data sheet: SI, but shares in per cent and less than a kilogram in grams.

    Parameters
    ----------
    effect
        Whose parameter it is.
    estimate
        As it was fitted: torques over the servo's stiffness, a limit inverse, stops from where the command ends.
    servo
        Of the joint, as far as it is stated.
    commanded
        (N,) positions that were commanded, rad.
    """
    label, _, joint = estimate.name.rpartition(", ")
    place = f", {joint}" if label else ""
    value, std = estimate.value or 0.0, estimate.std or 0.0
    if effect == "kp":
        ratio = exp(value)
        return replace(estimate, name=f"change{place}", value=100.0 * (ratio - 1.0), std=100.0 * ratio * std, unit="%")
    if effect in _SHARES and estimate.unit == "":
        return replace(estimate, value=100.0 * value, std=100.0 * std, unit="%")
    if effect == "dead_zone" and value < 0.0 and not servo.dead_band:
        unit, factor = ("N·m", servo.kp) if servo.kp else ("rad", 1.0)
        return replace(estimate, name=f"starting force{place}", value=-factor * value, std=factor * std, unit=unit)
    if (effect, estimate.unit) in _TIMES_STIFFNESS and servo.kp:
        name, unit = _TIMES_STIFFNESS[effect, estimate.unit]
        return replace(estimate, name=name + place, value=servo.kp * value, std=servo.kp * std, unit=unit)
    if estimate.unit == "kg" and abs(value) < 1.0:
        return replace(estimate, value=1e3 * value, std=1e3 * std, unit="g")
    if effect == "torque_limit" and value > 0.0:
        name, unit, factor = ("torque", "N·m", servo.kp) if servo.kp else ("error from which it saturates", "rad", 1.0)
        limit = servo.saturation(factor, value)
        return replace(estimate, name=name + place, value=limit, std=std * limit**2 / factor, unit=unit)
    if effect in _INVERSE and value > 0.0:
        name, unit = _INVERSE[effect]
        return replace(estimate, name=name + place, value=1.0 / value, std=std / value**2, unit=unit)
    if effect in ("low_stop", "high_stop") and len(commanded):
        at = commanded.min() + value if effect == "low_stop" else commanded.max() - value
        return replace(estimate, name=f"stops at{place}", value=float(at))
    return estimate
