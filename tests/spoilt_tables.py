"""Tables with a fault: a sound campaign, what spoils it, and the kind of fault that must be named."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation


def with_joints(campaign, change, *joints):
    q = np.array(campaign.q)
    q[:, joints] = change(q[:, joints])
    return replace(campaign, q=q)


def measured_at(campaign, rows):
    """The measurements of other rows."""
    turned = campaign.orientation
    return replace(
        campaign,
        position=campaign.position[rows],
        orientation=None if turned is None else turned[rows],
        rows=campaign.rows,
    )


def joints_read_at(campaign, shift):
    """Commands as they were some seconds away, where the arm goes straight from row to row."""
    time = campaign.covariates["time"]
    order = np.argsort(time)
    return replace(
        campaign, q=np.column_stack([np.interp(time + shift, time[order], column[order]) for column in campaign.q.T])
    )


def paired_late(campaign, rows):
    """Some rows measured at the pose of the row before them in time."""
    order = np.argsort(campaign.covariates["time"])
    before = np.arange(campaign.samples)
    before[order[1:]] = order[:-1]
    return measured_at(campaign, np.where(rows, before, np.arange(campaign.samples)))


def coupled(campaign, joint, other, sign):
    """The column of a joint holds it plus or minus another one."""
    q = np.array(campaign.q)
    q[:, joint] += sign * q[:, other]
    return replace(campaign, q=q)


def turned_by(campaign, change):
    """Orientations after a change of the SciPy rotations."""
    turns = change(Rotation.from_quat(campaign.orientation, scalar_first=True))
    return replace(campaign, orientation=turns.as_quat(scalar_first=True))


SPOILT = {
    "reversed joint": lambda c: with_joints(c, np.negative, 2),
    "reversed joints": lambda c: with_joints(c, np.negative, 0, 3),
    "coupled joints": lambda c: coupled(c, 2, 1, -1.0),
    "exchanged joints": lambda c: with_joints(c, lambda two: two[:, ::-1], 1, 2),
    "degrees read as rad": lambda c: with_joints(c, np.rad2deg, 1),
    "rad read as degrees": lambda c: with_joints(c, np.deg2rad, *range(c.robot.n)),
    "zero off by 90°": lambda c: with_joints(c, lambda angle: angle + np.pi / 2, 1),
    "zero off by 180°": lambda c: with_joints(c, lambda angle: angle + np.pi, 2),
    "metric unit": lambda c: replace(c, position=1000.0 * c.position),
    "inch": lambda c: replace(c, position=c.position / 25.4),
    "foot": lambda c: replace(c, position=c.position / 0.3048),
    "exchanged axes": lambda c: replace(c, position=c.position[:, [1, 0, 2]]),
    "mirrored axis": lambda c: replace(c, position=c.position * [1.0, 1.0, -1.0]),
    "quaternion order": lambda c: replace(c, orientation=np.roll(c.orientation, -1, axis=1)),
    "conjugate quaternion": lambda c: replace(c, orientation=c.orientation * [1.0, -1.0, -1.0, -1.0]),
    "shifted rows": lambda c: measured_at(c, np.roll(np.arange(c.samples), 1)),
    "clock offset": lambda c: joints_read_at(c, 9.0),
    "angles of orientations": lambda c: turned_by(c, lambda turns: Rotation.from_euler("XYZ", turns.as_euler("zyx"))),
    "angles in degrees": lambda c: turned_by(
        c, lambda turns: Rotation.from_euler("xyz", turns.as_euler("xyz") / 57.29578)
    ),
}


def _joints(campaign, rng, at_least=1):
    most = campaign.robot.n
    return sorted(rng.choice(most, rng.integers(at_least, most + 1), replace=False).tolist())


def _signs(campaign, rng, some):
    return with_joints(campaign, np.negative, *some), [campaign.robot.joint_names[j] for j in some]


def _coupling(campaign, rng):
    joint = int(rng.integers(campaign.robot.n))
    other = joint + int(rng.choice([k for k in (-1, 1) if 0 <= joint + k < campaign.robot.n]))
    sign, names = float(rng.choice([-1.0, 1.0])), campaign.robot.joint_names
    return coupled(campaign, joint, other, sign), [names[joint], names[other]]


def _exchange(campaign, rng):
    i, j = rng.choice(campaign.robot.n, 2, replace=False)
    return with_joints(campaign, lambda two: two[:, ::-1], i, j), [campaign.robot.joint_names[k] for k in (i, j)]


def _one_joint(change):
    """Of a joint between the first and the last, whose zeros the unknown frames take up."""

    def spoil(campaign, rng):
        joint = int(rng.integers(1, campaign.robot.n - 1))
        return with_joints(campaign, change(rng), joint), [campaign.robot.joint_names[joint]]

    return spoil


def _quarter(rng):
    by = rng.choice([-1, 1]) * np.pi / 2
    return lambda q: q + by


def _all_joints(change):
    return lambda campaign, rng: (with_joints(campaign, change, *range(campaign.robot.n)), ["all joints"])


def _sized(*factors):
    return lambda c, rng: (replace(c, position=c.position * rng.choice(factors)), [])


DRAWN = {
    "reversed joint": lambda c, rng: _signs(c, rng, [int(rng.integers(c.robot.n))]),
    "reversed joints": lambda c, rng: _signs(c, rng, _joints(c, rng, 2)),
    "coupled joints": _coupling,
    "exchanged joints": _exchange,
    "degrees read as rad": _all_joints(np.rad2deg),
    "rad read as degrees": _all_joints(np.deg2rad),
    "zero off by 90°": _one_joint(_quarter),
    "zero off by 180°": _one_joint(lambda rng: lambda q: q + np.pi),
    "metric unit": _sized(1e3, 1e-3, 1e2),
    "inch": _sized(25.4, 1 / 25.4, 1 / 0.0254),
    "exchanged axes": lambda c, rng: (replace(c, position=c.position[:, [1, 0, 2]]), []),
    "mirrored axis": lambda c, rng: (replace(c, position=c.position * rng.permutation([1.0, 1.0, -1.0])), []),
}
"""Faults of drawn joints and sizes: the table, and the words that must be said of it."""
