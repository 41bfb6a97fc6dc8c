"""Command ``thermal-robot map``."""

from __future__ import annotations

import argparse
import re

import numpy as np
import pandas as pd

from thermal_robot.commands.shared import Output, deliver
from thermal_robot.console import counted
from thermal_robot.errors import CampaignError
from thermal_robot.files import write_text
from thermal_robot.maps import Joints, Map, Positions, Question, plot_map, workspace_map
from thermal_robot.maps.figures import larger_is_better
from thermal_robot.robot import Robot, load_robot
from thermal_robot.tables import aligned

_WHERE = re.compile(r"\s*([\w.]+)\s*(>=|<=)\s*([-+.\deE]+)\s*")
_SHOWN = (
    ("x (mm)", "x", 1e3, 1),
    ("y (mm)", "y", 1e3, 1),
    ("z (mm)", "z", 1e3, 1),
    ("required (µm)", "required", 1e6, 1),
    ("warm (µm)", "required_warm", 1e6, 1),
    ("C_p, warm", "capability_warm", 1.0, 2),
    ("P, warm", "probability_warm", 1.0, 4),
    ("margin", "margin", 1.0, 2),
)
"""Head, column, factor to its unit, and decimals."""


def run(options: argparse.Namespace) -> None:
    """Run ``map``: compute or continue the map of a workspace, draw it, and print the best places by one column."""
    robot = load_robot(options.robot, options.tool, root_frame=options.root)
    within = dict(_rule(rule) for rule in options.where)
    with counted(options.loudness) as show:
        asked, question = _over(options), _question(options)
        found = workspace_map(robot, asked, options.output, question, replace=options.replace, progress=show)
    best = found.best(options.by, largest=larger_is_better(options.by), within=within, count=options.count)
    plain = best.to_json(orient="records", indent=2) + "\n"
    outputs: list[Output] = [(options.json, lambda path: write_text(path, plain))]
    if options.figure:
        figure = plot_map(found, options.by)
        outputs.append((options.figure, lambda path: figure.savefig(path, dpi=150)))
    shown = _text(found, robot, best, options.by)
    deliver(options, outputs, shown, shown.partition("\n")[0])


def _over(options: argparse.Namespace) -> Positions | Joints:
    spans = {axis: getattr(options, axis) for axis in "xyz"}
    if options.joints is not None and not any(spans.values()):
        return Joints(options.joints)
    if options.joints is not None or not all(spans.values()):
        raise CampaignError("map", "does not say where", expected="--x, --y and --z, or --joints")
    return Positions(**{axis: _span(axis, span) for axis, span in spans.items()})


def _span(axis: str, given: list[str]) -> tuple[float, float, int]:
    try:
        low, high, count = float(given[0]), float(given[1]), int(given[2])
    except ValueError:
        low, high, count = 0.0, 0.0, 0
    if count < 1:
        expected = "FROM TO N, N at least 1"
        raise CampaignError("map", "no span", column=f"--{axis}", found=" ".join(given), expected=expected)
    return low, high, count


def _question(options: argparse.Namespace) -> Question:
    sigma, expansion, rise = (_numbers(name, getattr(options, name)) for name in ("sigma", "expansion", "rise"))
    clearance, point = 1e-3 * options.clearance, tuple(1e-3 * part for part in options.point)
    approach, axis = tuple(options.approach), tuple(options.axis)
    return Question(sigma, expansion, rise, clearance, options.capability, options.law, approach, axis, point)


def _numbers(name: str, given: list[str]) -> float | dict[str, float]:
    """Parse one number, or ``NAME=NUMBER`` pairs into numbers by name; :class:`CampaignError` for anything else."""
    pairs = [word.rpartition("=") for word in given]
    try:
        if len(pairs) == 1 and not pairs[0][1]:
            return float(given[0])
        if all(equals for _, equals, _ in pairs):
            return {key: float(value) for key, _, value in pairs}
    except ValueError:
        pass
    raise CampaignError("map", "no number", column=f"--{name}", found=" ".join(given), expected="one, or NAME=NUMBER …")


def _rule(text: str) -> tuple[str, tuple[float | None, float | None]]:
    known = _WHERE.fullmatch(text)
    try:
        if known:
            value = float(known[3])
            return known[1], (value, None) if known[2] == ">=" else (None, value)
    except ValueError:
        pass
    raise CampaignError("map", "no rule", column="--where", found=text, expected="COLUMN>=NUMBER or COLUMN<=NUMBER")


def _text(found: Map, robot: Robot, best: pd.DataFrame, by: str) -> str:
    """Format a summary of the map and a table of its best places, in mm, µm and degrees (m of sliding joints)."""
    # the postures of a place stand in one chunk
    counts = np.array([(len(c["place"]), len(np.unique(c["place"]))) for c in found.chunks(["place"])])
    rows, reached = counts.sum(axis=0)
    said = f"{rows} configurations; the map is {found.path}."
    if found.notes["over"] == "positions":
        asked = int(np.prod([found.notes[axis][2] for axis in "xyz"]))
        said = f"{reached} of {asked} places are reached, in {rows} postures; the map is {found.path}."
    if best.empty:
        return f"{said}\nNo place has what is asked for."
    lines = [[*(head for head, *_ in _SHOWN), "joints (°, m)"]]
    joints = list(zip(robot.joint_names, robot.joint_types, strict=True))
    for row in best.to_dict("records"):
        turned = " ".join(f"{np.degrees(row[n]) if kind != 'prismatic' else row[n]:.1f}" for n, kind in joints)
        lines.append([*(f"{factor * row[name]:.{digits}f}" for _, name, factor, digits in _SHOWN), turned])
    return "\n".join([said, "", f"best by {by}", *aligned(lines, left=())])
