"""Calibration of mixed effects: how its time grows with rows, joints and effects."""

from __future__ import annotations

import numpy as np
from benchmarks.parts import Curve, Part, Plot
from benchmarks.timing import by_turns, exponent

import thermal_robot as tr

ARM = ("example-robot-data:ur10", "tool0")
NAMES = ("joint_offset", "geometric", "backlash", "joint_compliance", "thermal_elongation", "joint_gain")
"""Effects in the order in which they join."""
SIZES = {
    "joint_offset": 5e-4,
    "geometric": 2e-4,
    "backlash": 2e-4,
    "joint_compliance": 1e-6,
    "thermal_elongation": 1e-5,
    "joint_gain": 1e-4,
}
NOISE = 3e-5
ROWS, JOINTS, COUNTS = (50, 100, 200, 400, 800, 1600, 3200, 6400), (2, 3, 4, 6, 8, 12, 16), (1, 2, 3, 4, 5, 6)
MIDDLE = 200
"""Rows where joints or effects are counted."""
FEWEST = 60
TEXT = (
    "`tr.calibrate` with unknown base and tool, positions with 0.03 mm of noise per axis, payload and temperature "
    "recorded. By rows and by effects a UR10; by joints chains of equal links whose axes turn by a right angle "
    "from each to the next, joint zeros and geometry alone. By rows four effects: joint zeros, geometry, lost "
    "motion, joint elasticity."
)


def chain(joints):
    """Return an arm of so many joints, of 1.2 m whatever their number."""
    length, parts = 1.2 / joints, ['<robot name="chain"><link name="base"/>']
    for k in range(joints):
        axis = ("0 0 1", "0 1 0")[k % 2]
        parent = f"link_{k - 1}" if k else "base"
        parts.append(
            f'<link name="link_{k}"/><joint name="joint_{k}" type="revolute"><parent link="{parent}"/>'
            f'<child link="link_{k}"/><origin xyz="{0.05 * (k % 2)} 0 {length}"/><axis xyz="{axis}"/>'
            '<limit lower="-2.4" upper="2.4" effort="1" velocity="1"/></joint>'
        )
    tip = f'<link name="tip"/><joint name="end" type="fixed"><parent link="link_{joints - 1}"/><child link="tip"/>'
    return tr.load_robot("".join([*parts, tip, '<origin xyz="0.1 0.03 0.1"/></joint></robot>']), "tip")


def campaign(robot, names, rows, seed=1):
    """Simulate effects of these names at work in all their places."""
    drawn = np.random.default_rng(seed)
    tool = np.eye(4)
    tool[:3, 3] = [0.05, 0.02, 0.1]
    conditions = {"payload": drawn.choice([0.0, 5.0, 10.0], rows)}
    own = {name: SIZES[name] for name in names if name not in ("geometric",)}
    bare = tr.simulate(robot, own, rows=rows, noise=NOISE, base=np.eye(4), tool=tool, seed=seed, conditions=conditions)
    return bare


def _times(effort, cases):
    """Return for each of the cases (size, campaign, effects) its seconds and the parameters that are fitted."""
    found = []
    for size, measured, names in cases:
        fit = tr.calibrate(measured, names).fit
        count = sum(len(values) for _, values in fit.effects)
        seconds = float(np.median(by_turns(effort, lambda m=measured, n=names: tr.calibrate(m, n))))
        found.append((size, seconds, count))
    return found


def _table(name, found):
    power = exponent([size for size, _, _ in found][-3:], [seconds for _, seconds, _ in found][-3:])
    told = "" if power is None else f", time ~ N^{power:.2f} at the end"
    rows = [(f"{name}{told}", "parameters", "ms")]
    return tuple(rows + [(f"{size:,}", str(count), f"{1e3 * seconds:.1f}") for size, seconds, count in found])


def measured(effort, peers):
    """Time calibrations."""
    ur10, four = tr.load_robot(*ARM), NAMES[:4]
    most = [n for n in ROWS if n <= max(effort.largest, ROWS[0])]
    rows = min(MIDDLE, max(effort.largest, FEWEST))
    arms = JOINTS if effort.largest > MIDDLE else JOINTS[:2]
    counts = COUNTS if effort.largest > MIDDLE else COUNTS[:2]
    by_rows = _times(effort, ((n, campaign(ur10, four, n), four) for n in most))
    kinematic = NAMES[:2]
    by_joints = _times(effort, ((n, campaign(chain(n), ("joint_offset",), rows), kinematic) for n in arms))
    # one set of data: what is not at work is fitted all the same
    whole = campaign(ur10, NAMES, rows)
    by_effects = _times(effort, ((n, whole, NAMES[:n]) for n in counts))
    tables = (_table("rows", by_rows), _table(f"joints, {rows} rows", by_joints), _table("effects", by_effects))
    curve = Curve("four effects", *zip(*((n, seconds) for n, seconds, _ in by_rows), strict=True))
    return Part("Mixed effects", TEXT, tables, (Plot("calibrate_rows", "UR10, calibrate", "rows", (curve,)),))
