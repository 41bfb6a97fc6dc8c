"""Maps of the workspace: inverse kinematics in all postures, probability, C_p and required clearance."""

from __future__ import annotations

import tempfile
from pathlib import Path

from benchmarks.parts import Curve, Part, Plot
from benchmarks.timing import seconds

import thermal_robot as tr
from thermal_robot.maps import Joints, Positions, Question, workspace_map

ARM = ("example-robot-data:ur10", "tool0")
SIDES = (5, 10, 20, 50, 100)
"""Places along each side of a square of 1.6 m."""
CONFIGURATIONS = (1_000, 10_000, 100_000)
TEXT = (
    "A UR10, tool down, a square of 1.6 m at half a metre's height: all postures at each place, and of each the "
    "scatter, the thermal displacement and its polygon, the probability, C_p and the required clearance, cold and "
    "warm, written to Parquet. *joints*: the same of drawn joint positions, without inverse kinematics. One run "
    "each."
)


def _mapped(robot, over):
    """Return the seconds of a map and its rows."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "map.parquet"
        spent = seconds(lambda: workspace_map(robot, over, path, Question()))
        from thermal_robot.maps import Map

        return spent, len(Map(path).frame(["place"]))


def measured(effort, peers):
    """Time maps of places and of joint positions."""
    robot = tr.load_robot(*ARM)
    sides = [n for n in SIDES if 10 * n * n <= effort.largest] or SIDES[:1]
    configurations = [n for n in CONFIGURATIONS if n <= effort.largest] or [effort.largest]
    _mapped(robot, Joints(10))
    rows, points = [("map", "N", "postures", "s", "ms each")], {"places": [], "joints": []}
    cases = [("places", n * n, Positions((-0.8, 0.8, n), (-0.8, 0.8, n), (0.5, 0.5, 1))) for n in sides]
    cases += [("joints", n, Joints(n)) for n in configurations]
    for name, count, over in cases:
        spent, postures = _mapped(robot, over)
        points[name].append((count, spent))
        rows.append((name, f"{count:,}", f"{postures:,}", f"{spent:.2f}", f"{1e3 * spent / count:.3f}"))
    curves = tuple(Curve(name, *zip(*known, strict=True)) for name, known in points.items())
    return Part("Maps", TEXT, (tuple(rows),), (Plot("maps", "UR10, maps", "places or configurations", curves),))
