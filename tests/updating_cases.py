"""A robot with zero offsets and play, simulated by the program's exact model, and rows as an update takes them."""

from dataclasses import replace

import numpy as np

import thermal_robot as tr
from thermal_robot.diagnosis.sequential import WeightedRows

OLD, ALL, NOISE = 900, 1100, 2e-5
EFFECTS = {"joint_offset": {"joint_3": 5e-4, "joint_4": -4e-4}, "backlash": {"joint_2": 3e-4, "joint_3": 2e-4}}


def measured(rows, seed=0, gross=0.0, effects=None, **how):
    """A campaign with unknown frames; a share of its rows is off by a millimetre."""
    rng = np.random.default_rng([5, seed])
    found = tr.simulate(
        "builtin:rv_m2",
        effects or EFFECTS,
        tool_frame="tool0",
        rows=rows,
        noise=NOISE,
        base=np.eye(4),
        tool=np.eye(4),
        seed=seed,
        conditions={"time": np.arange(float(rows)), "temperature": 22.0 + rng.normal(size=rows)},
        **how,
    )
    off = (rng.uniform(size=rows) < gross)[:, None] * 1e-3 * rng.normal(size=(rows, 3))
    return replace(found, position=found.position + off)


def in_full(campaign):
    """Rows as they come, before they are weighed."""
    return WeightedRows(campaign, np.ones(campaign.samples), np.zeros(campaign.samples, dtype=bool))


def far(one, other):
    """How many deviations two fits of the same choice are apart, at most."""
    return float(np.abs((one.point.values - other.point.values) / other.deviations).max())
