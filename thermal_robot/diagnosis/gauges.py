"""Gauge freedoms: directions of the model that no reading observes, found by the rank of the columns."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.campaign.names import listed
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import equations_of, orthonormal, without
from thermal_robot.inference.columns import frame_columns, hidden_joints
from thermal_robot.inference.fit import Fit
from thermal_robot.kinematics import point_jacobian


def unseen(fit: Fit) -> Iterator[str]:
    """Yield a sentence for each gauge freedom: unobservable motion of the root, scale, and joint zeros.

    A direction is unobservable where its column lies, to rounding, in the span of the columns of frames and artefacts.
    Nothing is yielded for an instrument with a frame of its own, whose frames are reported elsewhere.
    """
    campaign, seen = fit.campaign, fit.nominal  # corrected, what varies may part what is alike
    if campaign.position is not None:
        return
    basis = orthonormal(equations_of(frame_columns(seen)[0]))
    measures = seen.gap.shape[1]

    def hidden(columns: Array, size: Array) -> list[int]:
        left = np.linalg.norm(without(equations_of(columns[:, :measures]), basis), axis=0)
        return [k for k in range(len(size)) if left[k] <= settings.ALIAS * size[k]]

    twists = np.linalg.norm(point_jacobian(seen.position), axis=(0, 1))
    if campaign.base_known and hidden(seen.base_sensitivity, twists):
        yield (
            "nothing but the arm says where its root stands: place and direction of the base are not observable, and "
            "predictions are in the frame of the commands"
        )
    if alike := hidden_joints(seen):
        yield f"the zero of {listed(alike)} is not observable: what rows share, or the tool, takes it up"
    places = np.concatenate([seen.position, np.zeros_like(seen.position)], axis=1)[:, :, None]
    if hidden(seen.sight.sees(places), np.array([np.linalg.norm(seen.position)])):
        yield (
            "no length was measured: the scale of the robot is not observable, and lengths hold relative to those of "
            "the URDF; a known distance of two sockets, or a draw wire, would tell it"
        )
