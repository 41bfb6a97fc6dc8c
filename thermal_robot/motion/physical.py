"""Parameters of the servo model as a data sheet gives them: what was fitted over a stiffness, times the stiffness."""

from __future__ import annotations

from dataclasses import replace

from thermal_robot.arrays import Array
from thermal_robot.diagnosis.values import Estimate
from thermal_robot.motion.log import Servo

_TIMES_STIFFNESS = {
    ("coulomb", "rad"): ("torque", "N·m"),
    ("stribeck", "rad"): ("breakaway torque", "N·m"),
    ("armature", "s²"): ("inertia", "kg·m²"),
}
"""Name and unit of a parameter, by effect and the unit in which it was fitted, once it is multiplied by a stiffness."""
_SHARES = {"gain", "kp", "load_friction", "torque_constant", "masses"}


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
    if effect in _SHARES and estimate.unit == "":
        return replace(estimate, value=100.0 * value, std=100.0 * std, unit="%")
    if (effect, estimate.unit) in _TIMES_STIFFNESS and servo.kp:
        name, unit = _TIMES_STIFFNESS[effect, estimate.unit]
        return replace(estimate, name=name + place, value=servo.kp * value, std=servo.kp * std, unit=unit)
    if estimate.unit == "kg" and abs(value) < 1.0:
        return replace(estimate, value=1e3 * value, std=1e3 * std, unit="g")
    if effect == "torque_limit" and value > 0.0:
        name, unit, factor = ("torque", "N·m", servo.kp) if servo.kp else ("error from which it saturates", "rad", 1.0)
        return replace(estimate, name=name + place, value=factor / value, std=factor * std / value**2, unit=unit)
    if effect in ("low_stop", "high_stop") and len(commanded):
        at = commanded.min() + value if effect == "low_stop" else commanded.max() - value
        return replace(estimate, name=f"stops at{place}", value=float(at))
    return estimate
