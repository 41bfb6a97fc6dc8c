"""What a campaign says once about all its rows: units, frames, noise, payload; no table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from typing import Any, TypeAlias

from thermal_robot.campaign.units import ANGLE_UNITS, LENGTH_UNITS, SI, Units
from thermal_robot.robot import STRONGEST_GRAVITY
from thermal_robot.schema import Kind, boolean, fitted, listed, mapping, number, optional, record, text, word

Vector: TypeAlias = tuple[float, float, float]

MOVES = ("direct", "unknown")
"""Whether the robot goes straight from pose to pose in the order of the rows, which tells whence each joint came."""

STANDARD_TEMPERATURE = 20.0
"""°C; ISO 1, the temperature at which lengths are specified unless somebody says otherwise."""

MOST_PIPED = 500_000_000
"""Bytes that are taken from standard input: a million rows of forty columns; a pipe that never ends must end here."""
STILL = 1e-4
"""rad or m within which a joint stands still: the encoder of one that is held jitters by a microradian, seldom by
fifty, and nothing that follows a joint's position shows over less."""
ABSOLUTE_ZERO = -273.15
"""°C."""

UNIT, WORD = "unknown unit", "unknown word"
ANGLE_UNIT, LENGTH_UNIT = word(ANGLE_UNITS, UNIT), word(LENGTH_UNITS, UNIT)
HOW_MOVED = word(MOVES, WORD)
TEMPERATURE = number(least=ABSOLUTE_ZERO, expected="a number of °C", problem="no temperature is lower than −273.15 °C")
VECTOR = listed(number(), 3, "three numbers")
GRAVITY = listed(
    number(
        least=-STRONGEST_GRAVITY,
        most=STRONGEST_GRAVITY,
        expected=f"a number of m/s² from {-STRONGEST_GRAVITY:g} to {STRONGEST_GRAVITY:g}",
    ),
    3,
    "three numbers",
)
SIGMA = number(
    least=0.0,
    expected="a number above 0, or 0 for not given",
    problem="a standard deviation cannot be negative",
)
PRIORS = mapping(
    number(above=0.0, expected="a number above 0", problem="the expected size of an effect must be positive")
)
GEARS = mapping(number(above=0.0, expected="a number above 0", problem="a transmission ratio must be positive"))
"""What the values of a campaign may be, whoever states them: campaign.toml, a call, a model file."""


@dataclass(frozen=True)
class Settings:
    """The part of a campaign that is not in the table, in SI units; a model file stores it as a plain dict.

    Attributes
    ----------
    urdf
        The robot's reference as written in the campaign: a path relative to it, ``example-robot-data:…`` or
        ``builtin:…``; empty for a campaign that was made without files.
    tool_frame, root_frame
        Ends of the chain; ``root_frame`` ``None`` for the URDF's root.
    gravity
        m/s², in the root frame; ``None`` for the robot's default.
    moves
        One of :data:`MOVES`.
    reference_temperature
        °C at which the URDF's lengths hold.
    units
        Units of the table's columns; everything else here is SI.
    base_known, tool_known
        Whether the measurements are in the root frame, and whether the target is where ``target`` says.
    target
        The measured point in the tool frame, m.
    noise_position, noise_orientation
        One sigma per axis of the instrument, m and rad; ``None`` when not given.
    payload_com
        Centre of mass of the payload in the tool frame, m.
    priors
        Expected size (one sigma) of an effect's parameters, by the effect's name, in their unit.
    gears
        Transmission ratio by joint name.
    turned
        Quantities whose columns are read with the other sign.
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

    def to_dict(self) -> dict[str, Any]:
        """Return a dict of strings, numbers, booleans, lists and dicts only, ready for JSON; lengths in m."""
        own = {each.name: getattr(self, each.name) for each in fields(self)}
        own |= {"units": asdict(self.units), "priors": dict(self.priors), "gears": dict(self.gears)}
        plain = {key: list(value) if isinstance(value, tuple) else value for key, value in own.items()}
        return plain if self.turned else {key: value for key, value in plain.items() if key != "turned"}

    def of_rows(self) -> dict[str, Any]:
        """Return the fields of a :class:`~thermal_robot.Campaign` that say how its rows are meant, by name."""
        once = ("moves", "reference_temperature", "gears", "units")
        return {key: getattr(self, key) for key in ("base_known", "tool_known", "target", "payload_com", *once)}

    @classmethod
    def stated(cls, sections: Mapping[str, Mapping[str, Any]], **ends: Any) -> Settings:
        """Return the settings of values by section and key, as campaign.toml has them, lengths in its unit.

        Parameters
        ----------
        sections
            Both units at least.
        ends
            The robot's reference, the ends of the chain and gravity.
        """
        robot, frames, noise = (sections.get(section, {}) for section in ("robot", "frames", "noise"))
        units = Units(sections["measurements"]["angle_unit"], sections["measurements"]["length_unit"])
        place, turn = noise.get("position"), noise.get("orientation")
        return cls(
            **ends,
            **{key: robot[key] for key in ("moves", "reference_temperature") if key in robot},
            units=units,
            base_known=frames.get("base") == "known",
            tool_known=frames.get("tool") == "known",
            target=as_vector(units.length_scale * value for value in frames.get("target", (0.0, 0.0, 0.0))),
            noise_position=place * units.length_scale if place else None,
            noise_orientation=turn or None,
            payload_com=as_vector(
                units.length_scale * value for value in sections.get("payload", {}).get("com", (0.0, 0.0, 0.0))
            ),
            priors=sections.get("priors", {}),
            gears=sections.get("gears", {}),
        )

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], file: str = "<settings>") -> Settings:
        """Build settings from what :meth:`to_dict` returned.

        Parameters
        ----------
        data
            The dict, possibly after a journey through JSON.
        file
            Name of the file it came from, for the error message.

        Raises
        ------
        CampaignError
            A key that is missing or unknown, or a value of the wrong kind.
        """
        settings: Settings = fitted(settings_kind, data, file)
        return settings


_KEYS: dict[str, Kind] = {
    "urdf": text(empty=True),
    "tool_frame": text("the name of a link"),
    "root_frame": optional(text("the name of a link")),
    "gravity": optional(GRAVITY),
    "moves": HOW_MOVED,
    "reference_temperature": TEMPERATURE,
    "units": record({"angle": ANGLE_UNIT, "length": LENGTH_UNIT}),
    "base_known": boolean,
    "tool_known": boolean,
    "target": VECTOR,
    "noise_position": optional(SIGMA),
    "noise_orientation": optional(SIGMA),
    "payload_com": VECTOR,
    "priors": PRIORS,
    "gears": GEARS,
    "turned": listed(text("the name of a quantity")),
}


def settings_kind(value: Any, path: str) -> Settings:
    """Kind of the settings in a file (:mod:`thermal_robot.schema`)."""
    # those who wrote no word of moves were fitted to what was recorded alone, in its own sign
    values = record(_KEYS)({"moves": "unknown", "turned": (), **value} if isinstance(value, Mapping) else value, path)
    sigmas = {key: values[key] or None for key in ("noise_position", "noise_orientation")}
    return Settings(**{**values, **sigmas, "units": Units(**values["units"])})


def as_vector(values: Any) -> Vector:
    """Return three floats; ``ValueError`` for any other number of them."""
    x, y, z = (float(value) for value in values)
    return x, y, z
