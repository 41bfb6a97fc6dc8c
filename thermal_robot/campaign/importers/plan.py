"""What a mapping says: a campaign.toml whose table has columns of other names, in another layout."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from thermal_robot.campaign.document import Document
from thermal_robot.campaign.importers.columns import columns_kind
from thermal_robot.campaign.importers.orientation import orientation_kind
from thermal_robot.campaign.settings import (
    ANGLE_UNIT,
    GEARS,
    GRAVITY,
    HOW_MOVED,
    LENGTH_UNIT,
    PRIORS,
    SIGMA,
    TEMPERATURE,
    VECTOR,
    WORD,
    Settings,
    as_vector,
)
from thermal_robot.campaign.tabular import SPACE, Layout
from thermal_robot.campaign.units import Units
from thermal_robot.campaign.ur_kinematics import with_kinematics
from thermal_robot.errors import CampaignError
from thermal_robot.robot import Robot, load_robot
from thermal_robot.schema import (
    NOT_NEGATIVE,
    POSITIVE,
    Kind,
    MisfitError,
    boolean,
    number,
    record,
    shown,
    text,
    whole,
    word,
)
from thermal_robot.urdf_text import BUILTIN, EXAMPLE_ROBOT_DATA

JOINING = ("key", "targets")
"""What ``[table]`` says of names, and not of how a file is laid out."""
_SEPARATORS = {"comma": ",", "semicolon": ";", "tab": "\t", "space": SPACE}
_KNOWN = word(("known", "unknown"), WORD)
_NAME = text("a name")
_LAID_OUT: Mapping[str, Kind] = {
    "separator": word(_SEPARATORS),
    "skip": whole(0),
    "header": boolean,
    "comment": text("the first letters of a comment"),
}
_KINDS: dict[str, Mapping[str, Kind]] = {
    "robot": {
        "urdf": text("the path of the robot's URDF file"),
        "tool_frame": text("the URDF link that carries the target"),
        "root_frame": text("the URDF link where the chain starts"),
        "kinematics": text("the path of a kinematics.yaml of Universal Robots"),
        "gravity": GRAVITY,
        "moves": HOW_MOVED,
        "reference_temperature": TEMPERATURE,
    },
    "measurements": {"angle_unit": ANGLE_UNIT, "length_unit": LENGTH_UNIT},
    "frames": {"base": _KNOWN, "tool": _KNOWN, "target": VECTOR},
    "noise": {"position": SIGMA, "orientation": SIGMA},
    "payload": {"com": VECTOR},
    "priors": {},
    "gears": {},
    "table": {**_LAID_OUT, **dict.fromkeys(JOINING, _NAME)},
    "commands": _LAID_OUT,
    "columns": {},
    "orientation": {},
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
_OWN: dict[str, Kind] = {"priors": PRIORS, "gears": GEARS, "orientation": orientation_kind, "columns": columns_kind}
SECTIONS: dict[str, tuple[str, ...]] = {
    section: () if section in _OWN else tuple(kinds) for section, kinds in _KINDS.items()
}
"""Keys by section: those of campaign.toml but the name of the table, and how the table is read."""


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
        for key in _KINDS["measurements"]:
            if self.get("measurements", key) is None:
                expected = f"[measurements] {key} in the file of --mapping"
                raise CampaignError(self.file or "import", f"no {key} is stated", expected=expected)
        units = Units(self.get("measurements", "angle_unit"), self.get("measurements", "length_unit"))
        scale = units.length_scale
        noise = self.get("noise", "position")
        plain = {key: self.get("robot", key) for key in ("moves", "reference_temperature")}
        return Settings(
            urdf="",
            tool_frame=robot.tool_frame,
            root_frame=robot.root_frame,
            gravity=as_vector(robot.gravity),
            units=units,
            base_known=self.get("frames", "base") == "known",
            tool_known=self.get("frames", "tool") == "known",
            target=as_vector(value * scale for value in self.get("frames", "target", (0.0, 0.0, 0.0))),
            noise_position=noise * scale if noise else None,
            noise_orientation=self.get("noise", "orientation") or None,
            payload_com=as_vector(value * scale for value in self.get("payload", "com", (0.0, 0.0, 0.0))),
            priors=self.sections.get("priors", {}),
            gears=self.sections.get("gears", {}),
            **{key: value for key, value in plain.items() if value is not None},
        )


def planned(sections: Mapping[str, Mapping[str, Any]]) -> Plan:
    """Return the plan that a format brings along, written as a mapping is."""
    return Plan("", {section: _kind(section)(content, section) for section, content in sections.items()})


def read_mapping(path: Path) -> Plan:
    """Read a mapping; the robot's path is relative to the file.

    Raises
    ------
    CampaignError
        No such file, a syntax error, a section or key that is unknown, a value of the wrong kind: with its line.
    """
    document = Document(path, SECTIONS)
    sections = {section: _fitted(document, section, content) for section, content in document.data.items()}
    for key, named in sections.get("robot", {}).items():
        if key in ("urdf", "kinematics") and not named.startswith((BUILTIN, EXAMPLE_ROBOT_DATA)):
            sections["robot"][key] = str(path.parent / named)
    return Plan(str(path), sections)


def _fitted(document: Document, section: str, content: Any) -> dict[str, Any]:
    try:
        values: dict[str, Any] = _kind(section)(content, section)
    except MisfitError as error:
        keys = error.path.removeprefix(f"{section}.").split(".")[0].split("[")[0]
        raise CampaignError(
            document.file,
            error.problem or "wrong kind of value",
            row=document.row(section, keys) or document.row(section),
            column=error.path,
            found=shown(error.value),
            expected=error.expected,
        ) from None
    return values


def _kind(section: str) -> Kind:
    """Kind of a section: known keys, of which none is needed, or keys of the user's own."""
    return _OWN.get(section) or record(_KINDS[section], may_lack=_KINDS[section])
