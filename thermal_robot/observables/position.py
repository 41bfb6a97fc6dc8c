"""Position and pose by an instrument: a tracker, a camera system; the base and the tool frame are their nuisance."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.campaign import names
from thermal_robot.kinematics import log3, quaternion_to_rotation
from thermal_robot.observables.observable import Observable, Seen


class Position(Observable):
    """Position of a target in the frame of an instrument (tracker, photogrammetry), m."""

    kind: ClassVar[str] = "position"
    says: ClassVar[str] = "position"
    locates: ClassVar[bool] = True

    def gap(self, seen: Seen, artefacts: Mapping[str, Any]) -> Array:
        """(n, 3) measured − predicted position, less the instrument's own displacement, root frame axes, m."""
        whole = seen.campaign.position
        shift = (seen.readings(*names.POSITION) if whole is None else seen.own(whole)) - seen.where
        if seen.instrument is not None:
            shift = shift - seen.instrument
        return seen.in_root(shift)

    def sees(self, seen: Seen, artefacts: Mapping[str, Any], twists: Array) -> Array:
        """Return the twists (n, 6, K) unchanged; a row reads their displacement, and not their rotation."""
        return twists


class Pose(Position):
    """Pose of a target in the frame of an instrument: position, m, and orientation, rad."""

    kind: ClassVar[str] = "pose"
    says: ClassVar[str] = "position and orientation"
    turns: ClassVar[bool] = True

    def gap(self, seen: Seen, artefacts: Mapping[str, Any]) -> Array:
        """(n, 6) measured − predicted: displacement, m, rotation vector, rad; about own axes if of several targets."""
        whole = seen.campaign.orientation
        quaternions = seen.readings(*names.ORIENTATION) if whole is None else seen.own(whole)
        linear = super().gap(seen, artefacts)
        measured = seen.base[:3, :3].T @ quaternion_to_rotation(quaternions)
        turn = log3(measured @ seen.rotation.transpose(0, 2, 1))
        return self.sees(seen, artefacts, np.hstack([linear, turn])[:, :, None])[:, :, 0]

    def sees(self, seen: Seen, artefacts: Mapping[str, Any], twists: Array) -> Array:
        """(n, 6, K) twists with rotations about the target's own axes where several targets give its pose.

        There the noise of the turn differs by these axes; else they stay about those of the root frame.
        """
        if seen.campaign.targets is None:
            return twists
        turned = seen.rotation.transpose(0, 2, 1) @ twists[:, 3:]
        return np.concatenate([twists[:, :3], turned], axis=1)


class Controller(Pose):
    """Pose that the controller itself reports of its joints: forward kinematics by another model.

    Nothing was measured: what differs is its model, its tool or its frames, and no robot.
    """

    kind: ClassVar[str] = "controller"
    says: ClassVar[str] = "the controller's own pose"
    locates: ClassVar[bool] = False
    of_model: ClassVar[bool] = True
