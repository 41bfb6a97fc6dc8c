"""Campaigns without an instrument: one effect at 3 to 10 times the noise, or none, by kind of measurement and arm.

usage: python tests/benchmarks/measure_kinds.py SEED [KIND ...]

Robot, effect, its values, rows and postures are drawn from the seed; five arms, 60 to 120 rows. A case is right where
exactly what is at work is named, or where it stands in the group with which the one name is confounded; without an
effect, where nothing is named. Simulated by the program itself: ``thermal-robot blind`` has a physics of its own.
"""

from __future__ import annotations

import sys

import numpy as np

import thermal_robot as tr
from thermal_robot.effects import gate, named
from thermal_robot.inference.registration import register
from thermal_robot.observables import figures_of_a_row
from thermal_robot.observations import observe

KINDS = ("socket", "plane", "distance", "pixel")
ARMS = (
    ("builtin:rv_m2", "tool0"),
    ("example-robot-data:panda", "panda_hand_tcp"),
    ("example-robot-data:ur10", "tool0"),
    ("example-robot-data:kinova", "j2s6s200_end_effector"),
    ("example-robot-data:xarm7", "link_eef"),
)
EFFECTS = (
    "joint_offset",
    "joint_gain",
    "backlash",
    "joint_compliance",
    "geometric",
    "transmission_error",
    "link_compliance",
)
NOISE, TOOL = 5e-5, (0.05, 0.02, 0.1)
LED = ("socket", "plane")  # from which side a hand brings each joint is not known: no lost motion


def gap(campaign):
    """Return the rms gap of a robot as declared, registered, m."""
    return float(np.sqrt((observe(campaign, register(campaign)).gap[:, :3] ** 2).sum(axis=1).mean()))


def drawn(robot, name, ratio, given, rng):
    """Return an effect with values that make a gap of so many times the noise."""
    sound = tr.simulate(robot, **given)
    seen = observe(sound, register(sound))
    effect = gate.variants(named(name), seen)[0]
    values = np.array([p.size * rng.normal() for p in effect.parameters(seen)])
    values = np.where([p.positive for p in effect.parameters(seen)], np.abs(values), values)
    wanted = ratio * NOISE * np.sqrt(figures_of_a_row(sound)[0])
    for _ in range(2):  # nearly proportional
        values *= wanted / gap(tr.simulate(robot, [(effect, values)], **given))
    return [(effect, values)]


def right(diagnosis, name):
    """Whether the verdict is what is at work, or the one name of a group that holds it."""
    said = set(diagnosis.verdict)
    group = {n for effect in diagnosis.effects if effect.name in said for n in effect.confounded_with}
    return said == ({name} if name else set()) or (name in group and len(said) == 1)


def made(robot, kind, name, ratio, rows, rng):
    """Return the campaign of a robot with one effect, ``ratio`` times the noise per axis, or with none."""
    given = dict(rows=rows, measures=kind, tool=TOOL, tool_known=False, seed=int(rng.integers(10**6)))
    effects = drawn(robot, name, ratio, given, rng) if name else {}
    return tr.simulate(robot, effects, noise=NOISE, **given)


def run(made):
    """Print each case that ``made`` makes, and how many of each kind are right."""
    seed, *kinds = sys.argv[1:]
    rng = np.random.default_rng(int(seed))
    for kind in kinds or KINDS:
        told = {True: [], False: []}
        for source, tool in ARMS:
            robot = tr.load_robot(source, tool)
            for name in (None, None, *(e for e in EFFECTS if kind not in LED or e != "backlash")):
                rows, ratio = int(rng.integers(60, 121)), rng.uniform(3.0, 10.0)
                try:
                    campaign = made(robot, kind, name, ratio, rows, rng)
                    diagnosis = tr.diagnose(campaign)
                except tr.ThermalRobotError as error:  # out of reach
                    print(kind, source, name, "not made:", error)
                    continue
                told[name is None].append(right(diagnosis, name))
                said = ", ".join(diagnosis.verdict) or "nothing"
                print(kind, source, name, f"{ratio:.1f} times, {campaign.samples} of {rows} rows:", said, flush=True)
        print(
            f"{kind}: one effect {sum(told[False])} of {len(told[False])}, none {sum(told[True])} of {len(told[True])}"
        )


if __name__ == "__main__":
    run(made)
