"""Settings of a campaign for all its rows (units, frames, noise, payload), and the one table of what each may be."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from datetime import date
from typing import Any, NamedTuple, TypeAlias

from thermal_robot.campaign.names import KINDS as MEASURED
from thermal_robot.campaign.units import ANGLE_UNITS, LENGTH_UNITS, SI, Units
from thermal_robot.errors import CampaignError
from thermal_robot.robot import STRONGEST_GRAVITY
from thermal_robot.schema import (
    Kind,
    MisfitError,
    boolean,
    fitted,
    listed,
    mapping,
    number,
    optional,
    plain,
    record,
    shown,
    text,
    word,
)

Vector: TypeAlias = tuple[float, float, float]

MOVES = ("direct", "unknown")
"""Whether the robot goes straight from pose to pose in the order of the rows, which tells whence each joint came."""
STANDARD_TEMPERATURE = 20.0  # °C; ISO 1, at which lengths are specified unless somebody says otherwise
MOST_PIPED = 500_000_000  # bytes from standard input: a million rows of forty columns; an endless pipe must end here
STILL = 1e-4
"""rad or m within which a joint stands still: the encoder of one that is held jitters by a microradian, seldom by
fifty, and nothing that follows a joint's position shows over less."""
SAME_CONFIGURATION = 9  # decimals, rad or m, to which commands are compared: finer than controllers, coarser than units
ABSOLUTE_ZERO = -273.15  # °C
SMALLEST = 1e-30  # In any unit: what is nearer to 0 is 0; a picometre in metres is 1e-12

_WORD = "unknown word"
ANGLE_UNIT, LENGTH_UNIT = word(ANGLE_UNITS, "unknown unit"), word(LENGTH_UNITS, "unknown unit")
TEMPERATURE = number(least=ABSOLUTE_ZERO, expected="a number of °C", problem="no temperature is lower than −273.15 °C")
VECTOR = listed(number(), 3, "three numbers")
_G = STRONGEST_GRAVITY
GRAVITY = listed(number(least=-_G, most=_G, expected=f"a number of m/s² from {-_G:g} to {_G:g}"), 3, "three numbers")
_STATED = "a finite number above 0, or 0 for not given"
_SIGMA = number(least=0.0, expected=_STATED, problem="a standard deviation cannot be negative")
_SIZE: dict[str, Any] = {"least": SMALLEST, "expected": "a number above 0"}
_TEXT = text("text in quotes, a number or a date")


def sigma(value: Any, path: str) -> float | None:
    """Validate a standard deviation; 0 and ``None`` give ``None``, a negative or vanishing one a MisfitError."""
    found: float = 0.0 if value is None else _SIGMA(value, path)
    if 0.0 < found < SMALLEST:
        raise MisfitError(path, value, _STATED, "smaller than any noise")
    return found or None


def _named(meaning: str) -> Kind:
    return text(f"{meaning}, as text in quotes")


def _vector(value: Any, path: str) -> Any:
    try:
        return VECTOR(value, path)
    except MisfitError:
        raise MisfitError(path, value, "three numbers in brackets, such as [0.0, 0.0, 80.0]") from None


def _known(value: Any, path: str) -> bool:
    return bool(word(("unknown", "known"), _WORD)(value, path) == "known")


def _said(value: Any, path: str) -> str:
    """Validate text, a number or a date, and convert it to text."""
    plain = isinstance(value, (int, float, date)) and not isinstance(value, bool)
    return str(_TEXT(str(value) if plain else value, path))


ABOUT = mapping(_said)


class Field(NamedTuple):
    """Schema of a setting: its section and key in campaign.toml, its validator, and whether it is a length."""

    section: str
    key: str  # empty where the section is the setting, whose keys are the user's own
    kind: Kind
    length: bool = False  # whether it is in the file's length unit


FIELDS = {
    "urdf": Field("robot", "urdf", _named("the path of the robot's URDF file")),
    "tool_frame": Field("robot", "tool_frame", _named("the URDF link that carries the target")),
    "root_frame": Field("robot", "root_frame", _named("the URDF link where the chain starts")),
    "gravity": Field("robot", "gravity", _vector),
    "moves": Field("robot", "moves", word(MOVES, _WORD)),
    "reference_temperature": Field("robot", "reference_temperature", TEMPERATURE),
    "kind": Field("measurements", "kind", word(tuple(MEASURED), _WORD)),
    "base_known": Field("frames", "base", _known),
    "tool_known": Field("frames", "tool", _known),
    "target": Field("frames", "target", _vector, length=True),
    "noise_position": Field("noise", "position", sigma, length=True),
    "noise_orientation": Field("noise", "orientation", sigma),
    "payload_com": Field("payload", "com", _vector, length=True),
    "priors": Field("priors", "", mapping(number(**_SIZE, problem="the expected size of an effect must be positive"))),
    "gears": Field("gears", "", mapping(number(**_SIZE, problem="a transmission ratio must be positive"))),
    "about": Field("about", "", ABOUT),
}
"""Settings by their names: read from campaign.toml, written to it, stored in a model, and given to calls, by these."""
_CAMERA = dict.fromkeys(("fx", "fy", "cx", "cy"), number(above=0.0, expected="a number of pixels above 0"))
_CAMERA |= {"mount": word(("hand", "room"), _WORD), "refine": boolean}
_SHARED: dict[str, Kind] = {"camera": mapping(record(_CAMERA, may_lack=("refine",)))}
"""Sections that state what is known of things that rows share: :attr:`Settings.facts`."""
_OF_A_FILE: dict[str, dict[str, Kind]] = {
    "robot": {"kinematics": _named("the path of a kinematics.yaml of Universal Robots")},
    "measurements": {
        "file": _named("the path of the table"),
        "angle_unit": ANGLE_UNIT,
        "length_unit": LENGTH_UNIT,
    },
}
KINDS: dict[str, Mapping[str, Kind] | Kind] = {
    **{
        section: {**_OF_A_FILE.get(section, {}), **{own.key: own.kind for own in FIELDS.values() if own[0] == section}}
        for section in ("robot", "measurements", "frames", "noise", "payload")
    },
    **{section: FIELDS[section].kind for section in ("priors", "gears", "about")},
    **_SHARED,
}
"""What each key of each section of campaign.toml may be; of a section whose keys are the user's own, the whole."""


def given(call: str, name: str, value: Any, kind: Kind) -> Any:
    """Argument of a call, validated against its schema; a :class:`CampaignError` names the call and the argument."""
    try:
        return kind(value, name)
    except MisfitError as error:
        problem, found = error.problem or "wrong kind of value", shown(error.value)
        raise CampaignError(call, problem, column=error.path, found=found, expected=error.expected) from None


@dataclass(frozen=True)
class Settings:
    """Settings of a campaign that are not in the table, SI; a model file stores them as a plain dict.

    Attributes
    ----------
    urdf
        The robot's reference as written in the campaign: a path relative to it, ``example-robot-data:…`` or
        ``builtin:…``; empty for a campaign that was made without files.
    tool_frame, root_frame
        Ends of the chain; ``root_frame`` ``None`` for the URDF's root.
    gravity
        m/s², in the root frame; ``None`` for the robot's default.
    moves, reference_temperature, base_known, tool_known, target, payload_com, priors, gears, turned, facts, about
        As in a :class:`~thermal_robot.Campaign`; ``moves`` is empty where a file does not state it, and then follows
        from what the rows measure.
    kind
        What all rows measure, where the table has no column ``kind``; empty for position or pose.
    units
        Units of the table's columns; everything else here is SI.
    noise_position, noise_orientation
        One sigma per axis of the instrument, m and rad; ``None`` when not given.
    """

    urdf: str
    tool_frame: str
    root_frame: str | None = None
    gravity: Vector | None = None
    moves: str = "direct"
    reference_temperature: float = STANDARD_TEMPERATURE
    units: Units = SI
    base_known: bool = False
    tool_known: bool = False
    target: Vector = (0.0, 0.0, 0.0)
    noise_position: float | None = None
    noise_orientation: float | None = None
    payload_com: Vector = (0.0, 0.0, 0.0)
    priors: Mapping[str, float] = field(default_factory=dict)
    gears: Mapping[str, float] = field(default_factory=dict)
    turned: tuple[str, ...] = ()
    kind: str = ""
    facts: Mapping[str, Any] = field(default_factory=dict)
    about: Mapping[str, str] = field(default_factory=dict)

    def to_dict(self) -> dict[str, Any]:
        """Return a dict of strings, numbers, booleans, lists and dicts only, ready for JSON; lengths in m."""
        spare = {"turned", "kind", "facts", "about"}  # left out where nothing is said
        own = {name: value for name, value in vars(self).items() if value or name not in spare}
        own |= {"units": asdict(self.units), "priors": dict(self.priors), "gears": dict(self.gears)}
        return {key: list(value) if isinstance(value, tuple) else value for key, value in own.items()}

    def of_rows(self) -> dict[str, Any]:
        """Return the settings that a :class:`~thermal_robot.Campaign` takes over unchanged, as keyword arguments."""
        frames = ("base_known", "tool_known", "target", "payload_com")
        known = ("moves", "reference_temperature", "gears", "units", "facts", "about")
        return {key: getattr(self, key) for key in (*frames, *known)}

    @classmethod
    def stated(cls, sections: Mapping[str, Mapping[str, Any]], **ends: Any) -> Settings:
        """Build settings in SI from values by section and key of campaign.toml, whose lengths are in its length unit.

        ``sections`` have both units at least; ``ends`` are arguments that replace them, such as ``tool_frame``.
        """
        measurements = sections["measurements"]
        units = Units(measurements["angle_unit"], measurements["length_unit"])
        for name, (section, key, _, length) in FIELDS.items():
            held = sections.get(section, {})
            value = held.get(key) if key else held
            if name not in ends and value is not None:
                ends[name] = scaled(value, units.length_scale) if length else value
        facts = {key: sections[key] for key in _SHARED if sections.get(key)}
        return cls(**{"moves": "", **ends}, units=units, facts=facts)

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], file: str = "<settings>") -> Settings:
        """Build settings from the output of :meth:`to_dict`, possibly after a round trip through JSON.

        Raises
        ------
        CampaignError
            A key that is missing or unknown, or a value of the wrong kind; it names ``file``.
        """
        settings: Settings = fitted(settings_kind, data, file)
        return settings


_KEYS: dict[str, Kind] = {
    **{name: own.kind for name, own in FIELDS.items()},
    **dict.fromkeys(("urdf", "kind"), text(empty=True)),
    **dict.fromkeys(("base_known", "tool_known"), boolean),
    "tool_frame": text("the name of a link"),
    "root_frame": optional(text("the name of a link")),
    "gravity": optional(GRAVITY),
    "units": record({"angle": ANGLE_UNIT, "length": LENGTH_UNIT}),
    "turned": listed(text("the name of a quantity")),
    "facts": mapping(plain),
}
"""What each setting may be in a model file, in SI."""


def settings_kind(value: Any, path: str) -> Settings:
    """Validate a mapping from a model file and build the Settings; a wrong value raises a MisfitError."""
    # those who wrote no word of moves were fitted to what was recorded alone, in its own sign
    unsaid = {"moves": "unknown", "turned": (), "kind": "", "facts": {}, "about": {}}
    values = record(_KEYS)({**unsaid, **value} if isinstance(value, Mapping) else value, path)
    return Settings(**{**values, "units": Units(**values["units"])})


def scaled(value: Any, scale: float) -> Any:
    """Multiply a length, or a tuple of three, by a factor."""
    return as_vector(scale * each for each in value) if isinstance(value, tuple) else scale * value


def as_vector(values: Any) -> Vector:
    """Convert three numbers to a tuple of floats; any other number of them raises a ``ValueError``."""
    x, y, z = (float(value) for value in values)
    return x, y, z
