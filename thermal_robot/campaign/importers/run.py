"""Import of foreign files as the folder of a campaign, and the list of formats."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from thermal_robot.campaign.campaign import Campaign
from thermal_robot.campaign.document import FILE_NAME
from thermal_robot.campaign.importers.kinds import CORNERS, MOVEIT, MUKCA
from thermal_robot.campaign.importers.plan import Format, Plan, campaign_of, files_of
from thermal_robot.campaign.importers.programs import KUKA, RAPID
from thermal_robot.campaign.importers.robot_calibration import FIGAROH, ROBOT_CALIBRATION
from thermal_robot.campaign.importers.rosbag import ROSBAG
from thermal_robot.campaign.importers.table import IPA_UR10, JACOBI, POINTS, TABLE
from thermal_robot.campaign.write import ROBOT_NAME, TABLE_NAME, write_campaign
from thermal_robot.errors import CampaignError

FORMATS: dict[str, Format] = {
    "table": TABLE,
    "points": POINTS,
    "kuka": KUKA,
    "rapid": RAPID,
    "figaroh": FIGAROH,
    "robot_calibration": ROBOT_CALIBRATION,
    "rosbag": ROSBAG,
    "jacobi": JACOBI,
    "ipa_ur10": IPA_UR10,
    "mukca": MUKCA,
    "moveit": MOVEIT,
    "corners": CORNERS,
}
"""Formats by name, in the order of the help."""
IMPORTED = "Imported by `thermal-robot import"  # What the first line of a campaign.toml says that was imported


class Imported(NamedTuple):
    """Result of an import."""

    campaign: Campaign  # as it was written
    file: Path  # its campaign.toml
    notes: tuple[str, ...]  # how many rows were read, what was left out and why, what was found out; a sentence each


def require_imported(files: Sequence[Path], directory: Path, names: Sequence[str]) -> None:
    """Refuse to import into a folder where input files, or a declaration that was not imported, would be overwritten.

    ``names`` are the names of the files that will be written, the declaration's first.
    """
    read = {Path(file).resolve() for file in files}
    for name in names:
        if (directory / name).resolve() in read:
            problem = "is read from, and would be overwritten"
            raise CampaignError(str(directory / name), problem, expected="another folder to write")
    there = directory / names[0]
    if there.is_file() and not there.read_text(encoding="utf-8", errors="replace").startswith(f"# {IMPORTED}"):
        expected = "another folder: what is there was not imported, and would be overwritten"
        raise CampaignError(str(there), "there is a campaign already", expected=expected)


def import_files(format: str, files: Sequence[Path], directory: Path, plan: Plan) -> Imported:
    """Import files of a format and write them as a campaign.

    The directory is created if missing. A campaign in it is replaced only if it was imported, too; any other may hold
    the only copy of measurements. ``plan`` is the user's mapping, which takes precedence over that of the format.
    """
    require_imported(files, directory, (FILE_NAME, TABLE_NAME, ROBOT_NAME))
    chosen = FORMATS[format]
    files_of(files, chosen.files, chosen.least, chosen.most)
    source = chosen.read(files, plan)
    full = plan.over(source.plan)
    campaign, notes = campaign_of(source, full, full.robot(), Path(directory).resolve().name)
    origin = f"{IMPORTED} {format}` from {', '.join(Path(file).name for file in files)}."
    return Imported(campaign, write_campaign(campaign, directory, comments=(origin, *source.comments)), notes)
