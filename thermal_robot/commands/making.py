"""Commands that start without a campaign: plan, import, paper."""

from __future__ import annotations

import argparse
from pathlib import Path

from thermal_robot.campaign import Units
from thermal_robot.commands.shared import as_json, deliver, tell
from thermal_robot.files import write_one
from thermal_robot.robot import ENDS, load_robot


def plan(options: argparse.Namespace) -> None:
    """Run ``plan``: plan a campaign by optimal design, write it if asked, and print the expected precision."""
    from thermal_robot.effects import KINEMATIC
    from thermal_robot.planning import plan, text, write_plan
    from thermal_robot.planning.plan import CRASH_ROWS, ROWS

    found = plan(
        load_robot(options.robot, options.tool, root_frame=options.root),
        options.rows or (CRASH_ROWS if options.after_crash else ROWS),
        options.effects or (KINEMATIC if options.after_crash else None),
        repeats=options.repeats,
        noise=1e-3 * options.noise,
        orientation=options.orientation,
        target=[1e-3 * part for part in options.target],
        loads=options.loads,
        rise=0.0 if options.after_crash else options.warming,
        base_known="base" in options.known,
        tool_known="tool" in options.known,
        units=Units(options.angle_unit, options.length_unit),
        seed=options.seed,
        measures=options.measures,
    )
    if options.output:
        write_plan(found, options.output)
    shown = text(found)
    deliver(options, [as_json(options.json, found.to_dict())], shown, shown.partition("\n")[0])


def import_files(options: argparse.Namespace) -> None:
    """Run ``import``: convert files of another program into a campaign or motion log, and print what was read."""
    from thermal_robot.campaign.importers.plan import Plan, planned, read_mapping
    from thermal_robot.campaign.importers.run import import_files
    from thermal_robot.motion.importers import MOTION_FORMATS

    if options.format in MOTION_FORMATS:
        return _import_motion(options)
    ends = dict(zip(("urdf", *ENDS), (options.robot, options.tool, options.root), strict=True))
    said = {
        "robot": {**ends, "kinematics": options.kinematics},
        "measurements": {"angle_unit": options.angle_unit, "length_unit": options.length_unit},
    }
    stated = {section: {k: v for k, v in content.items() if v is not None} for section, content in said.items()}
    plan = planned(stated).over(read_mapping(Path(options.mapping)) if options.mapping else Plan())
    done = import_files(options.format, [Path(file) for file in options.files], Path(options.output), plan)
    return tell(options, f"{options.format}: {'; '.join(done.notes)}; written to {done.file}")


def _import_motion(options: argparse.Namespace) -> None:
    from thermal_robot.motion.importers import import_motion

    kind = "mjcf" if (options.robot or "").endswith(".xml") else "urdf"
    ends = zip((kind, *ENDS), (options.robot, options.tool, options.root), strict=True)
    log, file, notes = import_motion(
        options.format,
        [Path(each) for each in options.files],
        Path(options.output),
        robot={key: value for key, value in ends if value is not None},
        angle_unit=options.angle_unit or "",
        mapping=Path(options.mapping) if options.mapping else None,
    )
    tell(options, f"{options.format}: {'; '.join((repr(log)[1:-1], *notes))}; written to {file}")


def paper(options: argparse.Namespace) -> None:
    """Run ``paper``: print or write the table of the paper's figures beside the computed ones."""
    from thermal_robot.paper import PaperInputs, ledger

    found = ledger(PaperInputs() if options.l5 is None else PaperInputs(l5=options.l5))
    if options.json:
        write_one(options.json, as_json(options.json, found.to_dict())[1])
    if not options.printed:
        print(found.markdown() if options.markdown else found.text())
