"""The command ``thermal-robot import``."""

from __future__ import annotations

import argparse
from pathlib import Path

from thermal_robot.campaign.importers.run import FORMATS
from thermal_robot.campaign.units import ANGLE_UNITS, LENGTH_UNITS
from thermal_robot.commands.shared import tell
from thermal_robot.robot import ENDS

DOES = "make a campaign of other programs' files"
EXAMPLE = " table log.csv --mapping mapping.toml -o campaign"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Define the options of ``thermal-robot import``."""
    width = max(map(len, FORMATS))
    parser.epilog = "formats:\n" + "\n".join(
        f"  {name:{width}}  {each.does}\n  {'':{width}}  {each.files}" for name, each in FORMATS.items()
    )
    parser.add_argument("format", metavar="FORMAT", choices=FORMATS, help="what the files are, see below")
    parser.add_argument("files", metavar="FILES", nargs="+", help="to read, as many as the format has")
    parser.add_argument("-o", "--output", metavar="DIR", required=True, help="folder of the campaign, made if need be")
    parser.add_argument("--robot", metavar="URDF", help="its file, or a robot that comes along, as in campaign.toml")
    parser.add_argument("--tool", metavar="LINK", help="the link that carries the target")
    parser.add_argument("--root", metavar="LINK", help="where the chain starts; the root of the URDF where left out")
    parser.add_argument("--kinematics", metavar="F.yaml", help="calibration of a robot of Universal Robots (ROS)")
    parser.add_argument("--angle-unit", choices=ANGLE_UNITS, help="of the joints, where the format does not say")
    parser.add_argument("--length-unit", choices=LENGTH_UNITS, help="of the positions, where the format does not say")
    parser.add_argument("--mapping", metavar="F.toml", help="what the columns are, and the campaign's declarations")
    parser.set_defaults(run=run, reads=(), writes=())


def run(options: argparse.Namespace) -> None:
    """Import the files and say what became of them."""
    from thermal_robot.campaign.importers.plan import Plan, planned, read_mapping
    from thermal_robot.campaign.importers.run import import_files

    said = {
        "robot": {
            **dict(zip(("urdf", *ENDS), (options.robot, options.tool, options.root), strict=True)),
            "kinematics": options.kinematics,
        },
        "measurements": {"angle_unit": options.angle_unit, "length_unit": options.length_unit},
    }
    stated = {section: {k: v for k, v in content.items() if v is not None} for section, content in said.items()}
    plan = planned(stated).over(read_mapping(Path(options.mapping)) if options.mapping else Plan())
    done = import_files(options.format, [Path(file) for file in options.files], Path(options.output), plan)
    tell(options, f"{options.format}: {'; '.join(done.notes)}; written to {done.file}")
