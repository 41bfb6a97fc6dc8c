"""What `thermal-robot diagnose` writes of a log of motion: the user's MJCF and URDF with the causes in them."""

from __future__ import annotations

import argparse
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from thermal_robot.campaign.document import Document, declared_file
from thermal_robot.commands.shared import Output
from thermal_robot.console import note
from thermal_robot.errors import CampaignError
from thermal_robot.files import write_text
from thermal_robot.motion.read import FILE_NAME, KINDS

if TYPE_CHECKING:
    from thermal_robot.motion.result import MotionDiagnosis
    from thermal_robot.motion.write import Written


def motion_files(options: argparse.Namespace, found: MotionDiagnosis) -> list[Output]:
    """Return the outputs of ``--mjcf`` and ``--urdf`` with the causes found; print what each holds and cannot hold.

    The MJCF is that of ``--from-mjcf``, else the one that the log names, else a translation of its URDF. Of a log of
    other motions, ``--unseen``, the shrinkage of the gap in MuJoCo's own rollout is printed.
    """
    from thermal_robot.motion.write import motion_mjcf, motion_urdf

    if not options.mjcf:
        for name in ("from_mjcf", "unseen"):
            if getattr(options, name):
                raise CampaignError(
                    f"--{name.replace('_', '-')}", "is of use with --mjcf only", expected="--mjcf F.xml"
                )
    outputs: list[Output] = []
    if options.urdf:
        written = motion_urdf(found)
        _tell(options, options.urdf, written)
        outputs.append((options.urdf, partial(write_text, text=written.text)))
    if options.mjcf:
        written = motion_mjcf(found, _own_mjcf(options, found))
        _tell(options, options.mjcf, written)
        outputs.append((options.mjcf, partial(write_text, text=written.text)))
        if options.unseen:
            _tell_rollout(options, found, written.text)
    return outputs


def _own_mjcf(options: argparse.Namespace, found: MotionDiagnosis) -> Path | str:
    """Return the path of the MJCF of ``--from-mjcf`` or of the log's declaration, else MJCF text made of the URDF."""
    from thermal_robot.correction import mjcf_of_urdf

    if options.from_mjcf:
        return Path(options.from_mjcf)
    file = declared_file(Path(options.campaign), FILE_NAME, "motion")
    said = Document(file, KINDS, FILE_NAME).sections.get("robot", {})
    return file.parent / said["mjcf"] if "mjcf" in said else mjcf_of_urdf(found.log.robot.urdf)


def _tell(options: argparse.Namespace, name: str, written: Written) -> None:
    for told in written.held:
        note(f"{name} holds: {told}", options.loudness)
    for told in written.kept:
        note(f"{name} cannot hold: {told}", options.loudness)


def _tell_rollout(options: argparse.Namespace, found: MotionDiagnosis, mjcf: str) -> None:
    from thermal_robot.motion.read import read_motion
    from thermal_robot.motion.rollout import rollout

    did = rollout(found, mjcf, read_motion(options.unseen))
    told = f"the model told {100 * did.shrinkage_told:.0f} %"
    agree = "" if did.agrees else "; they do not agree: the simulator differs from the servo model"
    note(
        f"MuJoCo's rollout of unseen motions shrinks their gap by {100 * did.shrinkage:.0f} %, {told}{agree}",
        options.loudness,
    )
