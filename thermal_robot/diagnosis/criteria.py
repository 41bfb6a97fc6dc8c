"""Criteria of ISO 9283 beside a diagnosis: AP before the correction and after it, of poses that were held out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from thermal_robot.diagnosis.held_out import Shrinkage
from thermal_robot.inference.fit import Fit
from thermal_robot.iso9283 import Performance, performance
from thermal_robot.iso9283.groups import repeats
from thermal_robot.kinematics import exp3, quaternion_to_rotation, rotation_to_quaternion

_HELD_OUT = "Corrected figures are of rows held out: the model was fitted without the poses that they are told of."


def criteria(fit: Fit, shrinkage: Shrinkage) -> Performance | None:
    """Compute the criteria of a campaign with repeats.

    The frames are those that the gap is told in. AP after the correction is told of rows while they were held out: all
    repeats of a pose are held out together, so that no figure is of a pose that the model was fitted to. Every cycle
    counts, those set aside as outliers, too, as the standard has it.

    Returns
    -------
    Performance
        ``None`` where nothing is repeated.
    """
    campaign = fit.campaign
    if not repeats(campaign)[0]:
        return None
    frames, left = fit.nominal.frames, shrinkage.left
    base = frames.base[:3, :3]
    position = np.asarray(campaign.position) - left[:, :3] @ base.T
    orientation = None
    if campaign.orientation is not None:
        back = base @ exp3(-fit.corrected.in_root_axes(np.nan_to_num(left[:, 3:]))) @ base.T
        orientation = rotation_to_quaternion(back @ quaternion_to_rotation(campaign.orientation))
    found = performance(campaign, frames=frames, predicted=(position, orientation))
    return replace(found, notes=(*found.notes, _HELD_OUT))
