"""What hangs on the fixed frames of a chain: the part of a body's mass that lies beyond each of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from thermal_robot.arrays import Array

_NO_MASS = 1e-12
"""kg; less is what rounding leaves of a body's mass once the links that are fixed to it are taken off."""


def hanging_masses(full: pin.Model, elements: Sequence[int], held: Array) -> tuple[Array, Array]:
    """Mass that each fixed element of a chain carries, up to the chain's next movable joint.

    Pinocchio lumps the links between two joints into one body; a frame in its midst carries those behind it only.

    Parameters
    ----------
    full
        Model of the whole URDF.
    elements
        Frames of the chain's URDF joints, from the root on.
    held
        Configuration at which joints outside the chain are held.

    Returns
    -------
    masses
        (K,) kg; zero for a movable joint.
    centres
        (K, 3) m: their centre in the frame of the element; zero where there is no mass.
    """
    data = full.createData()
    pin.framesForwardKinematics(full, data, held)
    place = {e: k for k, e in enumerate(elements)}
    masses, moments = np.zeros(len(elements)), np.zeros((len(elements), 3))
    for frame, mass, centre in _links(full, data):
        while frame:
            k = place.get(frame)
            if k is not None:
                if full.frames[frame].type == pin.FrameType.JOINT:
                    break
                masses[k] += mass
                moments[k] += mass * data.oMf[frame].actInv(centre)
            frame = full.frames[frame].parentFrame
    return masses, moments / np.where(masses > 0.0, masses, 1.0)[:, None]


def _links(full: pin.Model, data: pin.Data) -> list[tuple[int, float, Array]]:
    """Frame to which each link's mass is fixed, the mass (kg) and its centre in the world (m)."""
    found = []
    joined = np.zeros(full.njoints)
    moment = np.zeros((full.njoints, 3))
    for f, frame in enumerate(full.frames):
        # Pinocchio keeps the inertia of a link behind a fixed joint with that joint's frame, too
        if frame.type == pin.FrameType.FIXED_JOINT and frame.inertia.mass > 0.0:
            mass, centre = frame.inertia.mass, data.oMf[f].act(frame.inertia.lever)
            found.append((f, float(mass), np.asarray(centre)))
            joined[frame.parentJoint] += mass
            moment[frame.parentJoint] += mass * centre
    for f, frame in enumerate(full.frames):
        if frame.type == pin.FrameType.JOINT:
            j, body = frame.parentJoint, full.inertias[frame.parentJoint]
            mass = body.mass - joined[j]
            if mass > _NO_MASS:
                centre = (body.mass * data.oMi[j].act(body.lever) - moment[j]) / mass
                found.append((f, float(mass), np.asarray(centre)))
    return found
