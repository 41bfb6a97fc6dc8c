"""The command ``thermal-robot plan``."""

from __future__ import annotations

import argparse

from thermal_robot.campaign.units import ANGLE_UNITS, LENGTH_UNITS
from thermal_robot.commands.shared import deliver
from thermal_robot.files import write_text

DOES = "plan the first campaign: poses that tell effects apart, and what accuracy to expect"
EXAMPLE = " robot.urdf --tool tool0 --rows 60 -o campaign"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Define the options of ``thermal-robot plan``."""
    parser.add_argument("robot", metavar="URDF", help="its file, or a robot that comes along, as in campaign.toml")
    parser.add_argument("-o", "--output", metavar="DIR", help="folder of the campaign to measure; a table if F.csv")
    parser.add_argument("--tool", metavar="LINK", default="", help="the link that carries the target")
    parser.add_argument("--root", metavar="LINK", help="where the chain starts; the root of the URDF where left out")
    parser.add_argument("--rows", metavar="N", type=int, default=60, help="of the campaign, repeats included (60)")
    parser.add_argument("--repeats", metavar="K", type=int, default=1, help="how often each pose is measured (1)")
    parser.add_argument("--effects", metavar="EFFECT", nargs="+", help="those to tell; all where left out")
    parser.add_argument("--noise", metavar="MM", type=float, default=0.02, help="one sigma per axis, mm (0.02)")
    parser.add_argument("--orientation", action="store_true", help="orientations will be measured, too")
    parser.add_argument("--target", metavar="MM", nargs=3, type=float, default=[0.0, 0.0, 0.0], help="in the tool, mm")
    parser.add_argument("--loads", metavar="KG", nargs="+", type=float, default=[], help="payloads beside none")
    parser.add_argument("--warming", metavar="K", type=float, default=6.0, help="by how much the robot warms (6)")
    parser.add_argument("--known", choices=("base", "tool"), nargs="+", default=[], help="frames that will be known")
    parser.add_argument("--angle-unit", choices=ANGLE_UNITS, default="rad", help="of the joints in the table (rad)")
    parser.add_argument("--length-unit", choices=LENGTH_UNITS, default="mm", help="of lengths in the table (mm)")
    parser.add_argument("--seed", metavar="N", type=int, default=0, help="of the candidates (0)")
    parser.add_argument("--json", metavar="F", help="write the plan as JSON ('-' prints it instead of the text)")
    parser.set_defaults(run=run, writes=("json",))


def run(options: argparse.Namespace) -> None:
    """Plan, write what was asked for, and say what to expect."""
    import json

    from thermal_robot.campaign import Units
    from thermal_robot.planning import plan, text, write_plan
    from thermal_robot.robot import load_robot

    found = plan(
        load_robot(options.robot, options.tool, root_frame=options.root),
        options.rows,
        options.effects,
        repeats=options.repeats,
        noise=1e-3 * options.noise,
        orientation=options.orientation,
        target=[1e-3 * part for part in options.target],
        loads=options.loads,
        rise=options.warming,
        base_known="base" in options.known,
        tool_known="tool" in options.known,
        units=Units(options.angle_unit, options.length_unit),
        seed=options.seed,
    )
    if options.output:
        write_plan(found, options.output)
    plain = json.dumps(found.to_dict(), indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    shown = text(found)
    deliver(options, [(options.json, lambda path: write_text(path, plain))], shown, shown.partition("\n")[0])
