"""What each robot file holds of a model: its linear map from fitted parameters to joint zeros and placements.

A file of **placements** moves the frames of joints: it holds all that is constant (:mod:`.constant`). A file of
**zeros** moves what a controller calls zero: of geometry it holds the part that zeros can take. One of **ticks** holds
these zeros in whole steps of an encoder. What a file applies is linear in the fitted parameters θ but for the steps:
d = R θ, the displacement of joints and segments; where the weak parameters are left out, D, it is R T θ with T θ = θ −
C_D C_DD⁻¹ θ_D, the mean of the others given that these are zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.correction.constant import constant, determined, joint_zeros
from thermal_robot.correction.model import CorrectedModel
from thermal_robot.effects.apply import displacement
from thermal_robot.inference.algebra import equations_of, orthonormal, rms, without
from thermal_robot.inference.columns import frame_columns
from thermal_robot.observations import observe
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


def at_poses(model: CorrectedModel, samples: Campaign) -> tuple[FileGap, ...]:
    """Return the expected rms gap at given poses with each robot file alone: the model stands for the real robot.

    Base and tool are registered anew in these poses; what the model leaves where rows are held out, and the
    instrument's noise, is added. There is no interval: what the model errs by where nothing was measured is unknown.
    """
    if not model.files or model.spread is None:
        return ()
    seen = observe(samples, model.frames)
    real = observe(samples, model.frames, displacement=displacement(seen, model.effects)[0]).position - seen.position
    segments = seen.segment_sensitivity[:, :3].reshape(len(real), 3, -1)
    columns = np.concatenate([seen.joint_sensitivity[:, :3], segments], axis=2)
    frames = orthonormal(equations_of(frame_columns(seen)[0][:, :3]))
    left = float((model.spread.beyond**2 + model.spread.noise**2).sum())
    values = np.concatenate([values for _, values in model.effects])
    files = {least: applied(model, least) for least in {gap.min_sigma for gap in model.files}}

    def square(moved: Array) -> float:
        return left + rms(without(moved.ravel(), frames).reshape(-1, 3)) ** 2

    def told(gap: FileGap) -> FileGap:
        own = np.asarray(gap.alone) if gap.alone else files[gap.min_sigma][gap.holds].displacement(values)
        before, after = square(real), square(real - columns @ own)
        return replace(gap, rms_before=before**0.5, rms_after=after**0.5, shrinkage=1.0 - after / before)

    return tuple(map(told, model.files))


def expectation(
    gaps: Sequence[FileGap], name: str, min_sigma: float | None, alone: bool = False, poses: str = ""
) -> list[str]:
    """Sentences on the rms error before and after a file is applied, on held-out rows; empty where it is unknown.

    ``poses`` names those that :func:`at_poses` was asked about.
    """
    of_kind = {(gap.min_sigma, bool(gap.alone)): gap for gap in gaps if gap.holds == FORMATS[name].holds}
    own = of_kind.pop((None, True) if alone else (min_sigma, False), None)
    if own is None:
        return []
    said = f"{1e3 * own.rms_before:.3g} mm → {1e3 * own.rms_after:.3g} mm, shrinkage {percent(own.shrinkage)}"
    others = ", ".join(f"{_OTHER[key[1], key[0] is None]} {percent(gap.shrinkage)}" for key, gap in of_kind.items())
    otherwise = [f"Otherwise: {others}."] if others else []
    if poses:
        return [f"At the poses of {poses}, as the model predicts it: {said}.", *otherwise]
    low, high = (100.0 * end for end in own.shrinkage_ci95)
    told = f"Expected of this file alone, on rows held out, base and tool registered anew: {said}"
    return [f"{told} (95 %: {low:.1f} to {high:.1f} %).", *otherwise]


_OTHER = {
    (False, True): "with the weak parameters too (--min-sigma 0)",
    (False, False): f"without those below {WORTH:g} standard deviations",
    (True, True): "fitted without the rest of the model (--alone)",
}
"""By whether it was fitted alone, and with all parameters: another file of the kind, and how to ask for it."""
