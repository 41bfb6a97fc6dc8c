"""Campaigns of one small arm for the tests of comparisons; each is diagnosed once a process."""

from functools import cache

import numpy as np

import thermal_robot as tr
from thermal_robot.effects import ThermalElongation
from thermal_robot.kinematics import exp6
from thermal_robot.observations import observe

ONLY = ("joint_offset", "joint_gain")
OFFSETS = (1e-3, 8e-4, -1.2e-3, 5e-4, 3e-4)
NOISE = 3e-5
FRAMES = {
    "here": (np.eye(4), np.eye(4)),
    "there": (exp6(np.array([0.4, -0.2, 0.1, 0.3, -0.5, 1.1])), exp6(np.array([0.02, 0.01, 0.08, 0.0, 0.0, 0.0]))),
}


def campaign(seed, offsets=OFFSETS, gains=0.0, frame="here", noise=NOISE, rows=50):
    """A campaign of the small arm; base and target are unknown."""
    base, tool = FRAMES[frame]
    effects = {"joint_offset": np.array(offsets), "joint_gain": gains}
    robot = tr.load_robot("builtin:rv_m2", "tool0")
    return tr.simulate(robot, effects, rows=rows, noise=noise, base=base, tool=tool, seed=seed)


@cache
def diagnosed(seed, offsets=OFFSETS, gains=0.0, frame="here", noise=NOISE, rows=50, only=ONLY):
    """Its diagnosis."""
    return tr.diagnose(campaign(seed, offsets, gains, frame, noise, rows), only=only)


def moved(by, joint=2):
    """The offsets with one changed."""
    return tuple(value + by * (k == joint) for k, value in enumerate(OFFSETS))


def lagging_days(strain=2e-5):
    """Three campaigns of links that follow the air with 1500 s: it jumps, it falls, and nobody read the clock."""
    robot, minutes = tr.load_robot("builtin:rv_m2", "tool0"), 60.0 * np.arange(60)
    jump, fall = np.where(minutes > 900.0, 34.0, 20.0), np.where(minutes > 1500.0, 18.0, 30.0)
    days = [(minutes, jump), (minutes, fall), (None, np.linspace(20.0, 32.0, 60))]
    made = []
    for seed, (time, temperature) in enumerate(days, 1):
        plan = tr.simulate(robot, rows=60, conditions={"time": time, "temperature": temperature}, seed=seed)
        settings = ThermalElongation().variants(observe(plan))
        at_work = next(s for s in settings if s.lag == (0.0 if time is None else 1500.0) and s.common and not s.spread)
        made.append(tr.simulate(robot, [(at_work, [strain])], commands=plan, noise=1e-5, seed=seed))
    return made
