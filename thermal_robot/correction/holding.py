"""What each robot file holds of a model: its linear map from fitted parameters to joint zeros and placements.

A file of **placements** moves the frames of joints: it holds all that is constant (:mod:`.constant`). A file of
**zeros** moves what a controller calls zero: of geometry it holds the part that zeros can take. One of **ticks** holds
these zeros in whole steps of an encoder. What a file applies is linear in the fitted parameters θ but for the steps:
d = R θ, the displacement of joints and segments; where the weak parameters are left out, D, it is R T θ with T θ = θ −
C_D C_DD⁻¹ θ_D, the mean of the others given that these are zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.correction.constant import constant, determined, joint_zeros
from thermal_robot.correction.model import CorrectedModel
from thermal_robot.percents import percent
from thermal_robot.prediction import FileGap

PLACEMENTS, ZEROS, TICKS = "placements", "zeros", "ticks"
"""What a file can hold."""
TICK = 2.0 * np.pi / 4096.0
"""rad: a step of the 12-bit encoders of Feetech's STS and Dynamixel's X servos."""
WORTH = 2.0
"""Standard deviations from zero at which a parameter is worth applying: one in twenty that is nothing gets so far."""


class Format(NamedTuple):
    """Kind of robot file: its name, what it holds, and what constant errors it cannot hold."""

    title: str
    holds: str
    lacks: str = ""


FORMATS = {
    "urdf": Format("a URDF", PLACEMENTS),
    "mjcf": Format("an MJCF", PLACEMENTS),
    "joints": Format("joint parameters of a simulator", PLACEMENTS),
    "dh": Format("a table of Denavit and Hartenberg", PLACEMENTS),
    "ur_kinematics": Format("a kinematics.yaml", PLACEMENTS, "frames behind the last joint, the target"),
    "offsets": Format("a table of zeros", ZEROS, "bent or misplaced axes, lengths, the target"),
    "pal": Format("a master_calibration.yaml", ZEROS, "the torso's zero, bent or misplaced axes, lengths, the target"),
    "lerobot": Format("a calibration of LeRobot", TICKS, "bent or misplaced axes, lengths, the target, parts of ticks"),
}
"""Files that `thermal-robot correct` writes, by option."""


@dataclass(frozen=True, eq=False)
class Applied:
    """Linear map of P fitted parameters θ to the displacement in a file: d = ``matrix`` (n + 6 S, P) θ.

    It is rounded to multiples of ``step`` unless 0. ``left`` (P,): parameters left out as insignificant.
    """

    matrix: Array
    step: float
    left: NDArray[np.bool_]

    def displacement(self, parameters: Array) -> Array:
        """Displacement (…, n + 6 S) of joints and segments by parameters (…, P)."""
        moved = parameters @ self.matrix.T
        return np.asarray(np.round(moved / self.step) * self.step if self.step else moved)


def applied(model: CorrectedModel, min_sigma: float | None = None) -> dict[str, Applied]:
    """Linear map from a model's parameters to the displacement in a file, for placements, zeros and ticks each.

    At the temperature of the URDF's lengths; empty where the model has no constant part then.
    """
    kept, gone = (model, ()) if min_sigma is None else determined(model, min_sigma)
    known = constant(kept)
    if not known.responses[:, :-12].any():
        return {}
    names = {(told.effect, told.parameter) for told in gone}
    left = np.array([(told.effect, told.parameter) in names for told in known.parameters], dtype=bool)
    others = np.eye(len(left))
    if left.any() and model.spread is not None:
        covariance = model.spread.covariance[-len(left) :, -len(left) :]
        others[:, left] -= covariance[:, left] @ np.linalg.pinv(covariance[np.ix_(left, left)], hermitian=True)
    placed = known.responses[:, :-12].T @ others
    turned = np.zeros_like(placed)
    turned[: model.robot.n] = joint_zeros(kept).matrix @ others
    return {
        PLACEMENTS: Applied(placed, 0.0, left),
        ZEROS: Applied(turned, 0.0, left),
        TICKS: Applied(turned, TICK, left),
    }


def expectation(gaps: Sequence[FileGap], name: str, min_sigma: float | None, alone: bool = False) -> list[str]:
    """Sentences on the rms error of held-out rows before and after a file is applied; empty where it is unknown."""
    of_kind = {(gap.min_sigma, bool(gap.alone)): gap for gap in gaps if gap.holds == FORMATS[name].holds}
    asked = (None, True) if alone else (min_sigma, False)
    own = of_kind.pop(asked, None)
    if own is None:
        return []
    low, high = (100.0 * end for end in own.shrinkage_ci95)
    said = [
        f"Expected of this file alone, on rows held out, base and tool registered anew: {1e3 * own.rms_before:.3g} mm "
        f"→ {1e3 * own.rms_after:.3g} mm, shrinkage {percent(own.shrinkage)} (95 %: {low:.1f} to {high:.1f} %)."
    ]
    others = ", ".join(f"{_OTHER[key[1], key[0] is None]} {percent(gap.shrinkage)}" for key, gap in of_kind.items())
    return [*said, f"Otherwise: {others}."] if others else said


_OTHER = {
    (False, True): "with the weak parameters too (--min-sigma 0)",
    (False, False): f"without those below {WORTH:g} standard deviations",
    (True, True): "fitted without the rest of the model (--alone)",
}
"""By whether it was fitted alone, and with all parameters: another file of the kind, and how to ask for it."""
