"""What a mapping says: a campaign.toml whose table has columns of other names, in another layout."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from thermal_robot.campaign.document import KINDS as OF_CAMPAIGN
from thermal_robot.campaign.document import Document
from thermal_robot.campaign.importers.columns import columns_kind
from thermal_robot.campaign.importers.orientation import orientation_kind
from thermal_robot.campaign.settings import ANGLE_UNIT, LENGTH_UNIT, Settings, as_vector
from thermal_robot.campaign.tabular import SPACE, Layout
from thermal_robot.campaign.ur_kinematics import with_kinematics
from thermal_robot.errors import CampaignError
from thermal_robot.robot import Robot, load_robot
from thermal_robot.schema import NOT_NEGATIVE, POSITIVE, Kind, boolean, number, record, text, whole, word
from thermal_robot.urdf_text import BUILTIN, EXAMPLE_ROBOT_DATA

JOINING = ("key", "targets")
"""What ``[table]`` says of names, and not of how a file is laid out."""
_SEPARATORS = {"comma": ",", "semicolon": ";", "tab": "\t", "space": SPACE}
_NAME = text("a name")
_LAID_OUT: Mapping[str, Kind] = {
    "separator": word(_SEPARATORS),
    "skip": whole(0),
    "header": boolean,
    "comment": text("the first letters of a comment"),
}
KINDS: dict[str, Mapping[str, Kind] | Kind] = {
    **OF_CAMPAIGN,
    "measurements": {"angle_unit": ANGLE_UNIT, "length_unit": LENGTH_UNIT},
    "table": {**_LAID_OUT, **dict.fromkeys(JOINING, _NAME)},
    "commands": _LAID_OUT,
    "columns": columns_kind,
    "orientation": orientation_kind,
    "recording": {
        "joints": _NAME,
        "pose": _NAME,
        "sensor": _NAME,
        "feature": whole(1),
        "offset": number(),
        "tolerance": POSITIVE,
        "standstill": POSITIVE,
        "velocity": POSITIVE,
        "settling": NOT_NEGATIVE,
    },
}
"""What each key of each section may be: those of campaign.toml but the name of the table, and how tables are read."""


@dataclass(frozen=True)
class Plan:
    """How tables of another program become a campaign.

    Attributes
    ----------
    file
        The mapping that the user wrote; empty where there is none.
    sections
        Values by section and key, each of its kind; what is not stated is absent.
    """

    file: str = ""
    sections: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    def get(self, section: str, key: str, default: Any = None) -> Any:
        """Return what is stated, or the default."""
        return self.sections.get(section, {}).get(key, default)

    def over(self, other: Plan) -> Plan:
        """Return this plan with what it does not state taken from another; an orientation is stated as a whole."""
        merged = {
            section: dict(self.sections.get(section) or other.sections.get(section, {}))
            if section == "orientation"
            else {**other.sections.get(section, {}), **self.sections.get(section, {})}
            for section in {**other.sections, **self.sections}
        }
        return Plan(self.file or other.file, merged)

    def layout(self, section: str = "table") -> Layout:
        """Return how a table is laid out; the section is ``table``, or ``commands`` of the second one."""
        stated = {key: value for key, value in self.sections.get(section, {}).items() if key not in JOINING}
        if "separator" in stated:
            stated["separator"] = _SEPARATORS[stated["separator"]]
        return Layout(**stated)

    def robot(self) -> Robot:
        """Load the robot.

        Raises
        ------
        CampaignError
            None is named.
        RobotError
            It cannot be loaded, or has no such link.
        """
        urdf = self.get("robot", "urdf")
        if urdf is None:
            expected = "--robot URDF, or [robot] urdf in the file of --mapping"
            raise CampaignError(self.file or "import", "no robot is named", expected=expected)
        ends = {key: self.get("robot", key) for key in ("root_frame", "gravity")}
        robot = load_robot(urdf, self.get("robot", "tool_frame", ""), **ends)
        measured = self.get("robot", "kinematics")
        return with_kinematics(robot, measured) if measured else robot

    def settings(self, robot: Robot) -> Settings:
        """Return what a campaign says once about all its rows, SI.

        Raises
        ------
        CampaignError
            Units of angles or lengths that are not stated.
        """
        for key in ("angle_unit", "length_unit"):
            if self.get("measurements", key) is None:
                expected = f"[measurements] {key} in the file of --mapping"
                raise CampaignError(self.file or "import", f"no {key} is stated", expected=expected)
        ends = {"tool_frame": robot.tool_frame, "root_frame": robot.root_frame, "gravity": as_vector(robot.gravity)}
        return Settings.stated(self.sections, urdf="", **ends)


def planned(sections: Mapping[str, Mapping[str, Any]]) -> Plan:
    """Return the plan that a format brings along, written as a mapping is."""
    kinds = {s: record(k, may_lack=k) if isinstance(k, Mapping) else k for s, k in KINDS.items()}
    return Plan("", {section: kinds[section](content, section) for section, content in sections.items()})


def read_mapping(path: Path) -> Plan:
    """Read a mapping; the robot's path is relative to the file.

    Raises
    ------
    CampaignError
        No such file, a syntax error, a section or key that is unknown, a value of the wrong kind: with its line.
    """
    sections = Document(path, KINDS).sections
    for key, named in sections.get("robot", {}).items():
        if key in ("urdf", "kinematics") and not named.startswith((BUILTIN, EXAMPLE_ROBOT_DATA)):
            sections["robot"][key] = str(path.parent / named)
    return Plan(str(path), sections)
