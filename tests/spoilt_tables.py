"""Tables with a fault: a sound campaign, what spoils it, and the kind of fault that must be named."""

from dataclasses import replace

import numpy as np


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


SPOILT = {
    "reversed joint": lambda c: with_joints(c, np.negative, 2),
    "exchanged joints": lambda c: with_joints(c, lambda two: two[:, ::-1], 1, 2),
    "degrees read as rad": lambda c: with_joints(c, np.rad2deg, 1),
    "rad read as degrees": lambda c: with_joints(c, np.deg2rad, *range(c.robot.n)),
    "zero off by 90°": lambda c: with_joints(c, lambda angle: angle + np.pi / 2, 1),
    "zero off by 180°": lambda c: with_joints(c, lambda angle: angle + np.pi, 2),
    "metric unit": lambda c: replace(c, position=1000.0 * c.position),
    "inch": lambda c: replace(c, position=c.position / 25.4),
    "exchanged axes": lambda c: replace(c, position=c.position[:, [1, 0, 2]]),
    "mirrored axis": lambda c: replace(c, position=c.position * [1.0, 1.0, -1.0]),
    "quaternion order": lambda c: replace(c, orientation=np.roll(c.orientation, -1, axis=1)),
    "conjugate quaternion": lambda c: replace(c, orientation=c.orientation * [1.0, -1.0, -1.0, -1.0]),
    "shifted rows": lambda c: measured_at(c, np.roll(np.arange(c.samples), 1)),
    "clock offset": lambda c: joints_read_at(c, 9.0),
}
