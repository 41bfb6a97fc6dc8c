"""Reading campaign.toml: what it declares about robot, units, frames, noise and payload, converted to SI."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from thermal_robot.campaign.document import Document
from thermal_robot.campaign.names import did_you_mean, listed
from thermal_robot.campaign.settings import Settings
from thermal_robot.errors import CampaignError
from thermal_robot.files import is_file, is_folder

FILE_NAME = "campaign.toml"
_MOST_NAMED = 5  # campaigns of a folder in one sentence


@dataclass(frozen=True)
class Declaration:
    """What campaign.toml says.

    Attributes
    ----------
    file
        Path of the file as the user gave it.
    table
        Path of the table.
    settings
        All the rest, SI.
    gear_rows
        Line of each key of ``[gears]``, for a message once the robot's joints are known.
    folder
        Against which its paths are resolved.
    kinematics
        Path of the calibration that a robot of Universal Robots brings along; ``None`` without one.
    """

    file: Path
    table: Path
    settings: Settings
    gear_rows: Mapping[str, int | None]
    folder: Path
    kinematics: Path | None = None

    @property
    def robot(self) -> str | Path:
        """What :func:`thermal_robot.robot.load_robot` wants: a reference to a known robot, or a path."""
        urdf = self.settings.urdf
        return urdf if urdf.startswith(("example-robot-data:", "builtin:")) else self.folder / urdf


def read_declaration(path: Path, folder: Path | None = None) -> Declaration:
    """Read campaign.toml.

    Parameters
    ----------
    path
        The file, or the directory that holds it.
    folder
        Against which its paths are resolved; its own where absent.

    Raises
    ------
    CampaignError
        No such file, a syntax error, a section or key that is unknown or missing, a value of the wrong kind.
    """
    file = path / FILE_NAME if is_folder(path) else path
    if not is_file(file):
        raise _absent(path)
    document = Document(file)
    for key in ("angle_unit", "length_unit"):
        document.required("measurements", key)
    robot = document.sections.get("robot", {})
    ends = {key: robot.get(key) for key in ("root_frame", "gravity")}
    named = {key: document.required("robot", key) for key in ("urdf", "tool_frame")}
    settings = Settings.stated(document.sections, **named, **ends)
    folder = file.parent if folder is None else folder
    table = folder / document.required("measurements", "file")
    rows = {joint: document.row("gears", joint) for joint in settings.gears}
    kinematics = robot.get("kinematics")
    return Declaration(file, table, settings, rows, folder, folder / kinematics if kinematics else None)


def check_gears(declaration: Declaration, joints: tuple[str, ...]) -> None:
    """Refuse a transmission ratio for a joint that the chain does not have.

    Raises
    ------
    CampaignError
        Naming the joint, its line, and the nearest joint of the chain.
    """
    for joint in declaration.settings.gears:
        if joint not in joints:
            raise CampaignError(
                str(declaration.file),
                f"the chain has no such joint{did_you_mean(joint, joints)}",
                row=declaration.gear_rows.get(joint),
                column=f"gears.{joint}",
                expected=f"one of {listed(joints)}",
            )


def _absent(path: Path) -> CampaignError:
    """Say that there is no campaign, and which there are beside it."""
    problem = f"this folder has no {FILE_NAME}" if is_folder(path) else "there is no such file"
    found = _campaigns(path if is_folder(path) else path.parent)
    beside = f"; campaigns there: {listed(found, _MOST_NAMED)}" if found else ""
    return CampaignError(str(path), problem + beside, expected=f"{FILE_NAME}, or the folder that holds it")


def _campaigns(folder: Path) -> list[str]:
    """Return the names of campaigns in a folder: files that have their section, folders that have their file."""
    try:
        inside = sorted(folder.iterdir())
        files = [f for f in inside if f.suffix == ".toml" and f.is_file() and b"[measurements]" in f.read_bytes()]
        folders = [f for f in inside if f.is_dir() and (f / FILE_NAME).is_file()]
    except (OSError, ValueError):  # nothing can be proposed where nothing can be read
        return []
    return [f.name for f in (*files, *folders)]
