"""The command ``thermal-robot map``."""

from __future__ import annotations

import argparse
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

from thermal_robot.commands.shared import deliver
from thermal_robot.console import counted
from thermal_robot.errors import CampaignError

if TYPE_CHECKING:
    import pandas as pd

    from thermal_robot.maps import Map
    from thermal_robot.robot import Robot

DOES = "map the workspace: scatter, thermal displacement, probability of joining, C_p, clearance"
EXAMPLE = " robot.urdf --tool tool0 -o map.parquet --x -0.8 0.8 41 --y -0.8 0.8 41 --z 0.2 0.2 1 --figure map.png"
_WHERE = re.compile(r"\s*([\w.]+)\s*(>=|<=)\s*([-+.\deE]+)\s*")
_SHOWN = ("x", "y", "z", "required", "required_warm", "capability_warm", "probability_warm", "margin")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Define the options of ``thermal-robot map``."""
    add = parser.add_argument
    add("robot", metavar="URDF", help="its file, or a robot that comes along, as in campaign.toml")
    add("-o", "--output", metavar="F", required=True, help="F.parquet or F.zarr; gone on with if it is there")
    add("--tool", metavar="LINK", default="", help="the link that holds the part")
    add("--root", metavar="LINK", help="where the chain starts; the root of the URDF where left out")
    for axis in "xyz":
        add(f"--{axis}", nargs=3, metavar=("FROM", "TO", "N"), help=f"places along {axis} of the root frame, m")
    add("--joints", metavar="N", type=int, help="instead of places: N joint positions that fill the limits")
    add("--sigma", metavar="S", nargs="+", default=["5e-5"], help="1 sigma, rad or m: one, or JOINT=S … (5e-5)")
    add("--expansion", metavar="A", nargs="+", default=["1.2e-5"], help="1/K: one, or SEGMENT=A … (1.2e-5)")
    add("--rise", metavar="K", nargs="+", default=["3"], help="of temperature: one, or SEGMENT=K … (3)")
    add("--law", choices=("shift", "uniform"), default="shift", help="the rise has happened; or is within ± (shift)")
    add("--clearance", metavar="MM", type=float, default=0.2, help="diameter for the probability, mm (0.2)")
    add("--capability", metavar="CP", type=float, default=1.33, help="for the required clearance (1.33)")
    add("--approach", metavar="X", help="where the tool points, root frame (0 0 -1)", **_triple(0.0, 0.0, -1.0))
    add("--axis", metavar="X", help="the tool's direction, tool frame (0 0 1)", **_triple(0.0, 0.0, 1.0))
    add("--point", metavar="MM", help="the tip in the tool frame, mm (0 0 0)", **_triple(0.0, 0.0, 0.0))
    add("--by", metavar="COLUMN", default="required_warm", help="what tells the best places (required_warm)")
    add("--where", metavar="RULE", nargs="+", default=[], help="what they must have, such as 'capability_warm>=1.33'")
    add("--count", metavar="N", type=int, default=5, help="of them (5)")
    add("--figure", metavar="F.png", help="draw the column of --by: contours of a plane, else points in space")
    add("--json", metavar="F", help="write the best places as JSON ('-' prints it instead of the text)")
    add("--replace", action="store_true", help="begin anew where another map stands there")
    parser.set_defaults(run=run, writes=("figure", "json"))


def _triple(*default: float) -> Any:
    return {"nargs": 3, "type": float, "default": list(default)}


def run(options: argparse.Namespace) -> None:
    """Map, draw what was asked for, and tell the best places."""
    from thermal_robot.files import write_text
    from thermal_robot.maps import plot_map, workspace_map
    from thermal_robot.maps.figures import larger_is_better
    from thermal_robot.robot import load_robot

    if options.figure:
        _require_picture(options.figure)
    robot = load_robot(options.robot, options.tool, root_frame=options.root)
    within = dict(_rule(rule) for rule in options.where)
    with counted(options.loudness) as show:
        found = workspace_map(
            robot, _over(options), options.output, _question(options), replace=options.replace, progress=show
        )
    best = found.best(options.by, largest=larger_is_better(options.by), within=within, count=options.count)
    plain = best.to_json(orient="records", indent=2) + "\n"
    outputs: list[Any] = [(options.json, lambda path: write_text(path, plain))]
    if options.figure:
        figure = plot_map(found, options.by)
        outputs.append((options.figure, lambda path: figure.savefig(path, dpi=150)))
    shown = _text(found, robot, best, options)
    deliver(options, outputs, shown, shown.partition("\n")[0])


def _require_picture(figure: str) -> None:
    """Refuse an ending that is no picture's, before anything is computed."""
    from matplotlib.backend_bases import FigureCanvasBase

    known = FigureCanvasBase.get_supported_filetypes()
    ending = Path(figure).suffix.lower().removeprefix(".")
    if ending and ending not in known:
        raise CampaignError(figure, "is no picture by its ending", found=f".{ending}", expected=", ".join(known))


def _over(options: argparse.Namespace) -> Any:
    from thermal_robot.maps import Joints, Positions

    spans = [getattr(options, axis) for axis in "xyz"]
    if options.joints is not None and not any(spans):
        return Joints(options.joints)
    if options.joints is not None or not all(spans):
        raise CampaignError("map", "does not say where", expected="--x, --y and --z, or --joints")
    return Positions(*(_span(axis, span) for axis, span in zip("xyz", spans, strict=True)))


def _span(axis: str, given: list[str]) -> tuple[float, float, int]:
    try:
        low, high, count = float(given[0]), float(given[1]), int(given[2])
    except ValueError:
        low, high, count = 0.0, 0.0, 0
    if count < 1:
        expected = "FROM TO N, N at least 1"
        raise CampaignError("map", "no span", column=f"--{axis}", found=" ".join(given), expected=expected)
    return low, high, count


def _question(options: argparse.Namespace) -> Any:
    from thermal_robot.maps import Question

    return Question(
        _numbers("sigma", options.sigma),
        _numbers("expansion", options.expansion),
        _numbers("rise", options.rise),
        1e-3 * options.clearance,
        options.capability,
        options.law,
        tuple(options.approach),
        tuple(options.axis),
        tuple(1e-3 * part for part in options.point),
    )


def _numbers(name: str, given: list[str]) -> float | dict[str, float]:
    """Return one number, or numbers by name."""
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


def _text(found: Map, robot: Robot, best: pd.DataFrame, options: argparse.Namespace) -> str:
    """Say where the robot is best, in mm and degrees."""
    import numpy as np

    # the postures of a place stand in one chunk
    counts = np.array([(len(c["place"]), len(np.unique(c["place"]))) for c in found.chunks(["place"])])
    rows, reached = counts.sum(axis=0)
    if found.notes["over"] == "positions":
        asked = int(np.prod([found.notes[axis][2] for axis in "xyz"]))
        said = f"{reached} of {asked} places are reached, in {rows} postures; the map is {found.path}."
    else:
        said = f"{rows} configurations; the map is {found.path}."
    if best.empty:
        return f"{said}\nNo place has what is asked for."
    heads = ["x (mm)", "y (mm)", "z (mm)", "required (µm)", "warm (µm)", "C_p, warm", "P, warm", "margin"]
    lines, joints = [[*heads, "joints (°, m)"]], list(zip(robot.joint_names, robot.joint_types, strict=True))
    for _, row in best.iterrows():
        turned = " ".join(f"{np.degrees(row[n]) if kind != 'prismatic' else row[n]:.1f}" for n, kind in joints)
        told = zip(_SHOWN, (1e3, 1e3, 1e3, 1e6, 1e6, 1.0, 1.0, 1.0), (1, 1, 1, 1, 1, 2, 4, 2), strict=True)
        lines.append([*(f"{factor * row[name]:.{digits}f}" for name, factor, digits in told), turned])
    widths = [max(len(line[k]) for line in lines) for k in range(len(lines[0]))]
    table = ["  ".join(cell.rjust(w) for cell, w in zip(line, widths, strict=True)) for line in lines]
    return "\n".join([said, "", f"best by {options.by}", *table])
