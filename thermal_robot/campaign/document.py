"""A TOML file with its lines: every key known, every value of its kind, nothing ignored in silence."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from thermal_robot.campaign.figures import SMALLEST
from thermal_robot.campaign.names import did_you_mean
from thermal_robot.campaign.settings import GEARS, NUMBER, PRIORS, SIGMA, UNIT, VECTOR, WORD
from thermal_robot.errors import CampaignError
from thermal_robot.schema import Kind, MisfitError, alternatives, shown, word

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

SECTIONS: dict[str, tuple[str, ...]] = {
    "robot": ("urdf", "tool_frame", "root_frame", "kinematics", "gravity", "moves", "reference_temperature"),
    "measurements": ("file", "angle_unit", "length_unit"),
    "frames": ("base", "tool", "target"),
    "noise": ("position", "orientation"),
    "payload": ("com",),
    "priors": (),
    "gears": (),
}
"""Keys by section; priors and gears have keys of the user's own (effects and joints)."""

_NAMED = {"priors": PRIORS, "gears": GEARS}
_ABSENT: Any = object()
_LARGEST_FILE = 1 << 16
"""Bytes: it holds a few lines, and a line for every joint and every effect."""


class Document:
    """The parsed file together with its text, so that an error can name the line.

    Parameters
    ----------
    file
        Its path.
    sections
        Keys by section that it may have; a section without any has keys of the user's own.
    """

    def __init__(self, file: Path, sections: Mapping[str, tuple[str, ...]] = SECTIONS) -> None:
        self.file, self.sections = str(file), sections
        try:
            if file.stat().st_size > _LARGEST_FILE:
                raise CampaignError(self.file, "is larger than any campaign.toml", expected="at most 64 KiB")
            self.text = file.read_text(encoding="utf-8-sig")
            self.data: dict[str, Any] = tomllib.loads(self.text)
        except OSError as error:
            raise CampaignError(self.file, f"cannot be read: {error.strerror}") from error
        except UnicodeDecodeError as error:
            raise CampaignError(self.file, "is not UTF-8 text", expected="a TOML file saved as UTF-8") from error
        except tomllib.TOMLDecodeError as error:
            line = re.search(r"at line (\d+)", str(error))
            row = int(line[1]) if line else None
            raise CampaignError(self.file, f"not valid TOML: {error}", row=row) from error
        except RecursionError as error:
            raise CampaignError(
                self.file, "values stand within each other too deep", expected="lists of numbers"
            ) from error
        except ValueError as error:  # an integer of thousands of digits
            raise CampaignError(self.file, "a number has too many digits to be read", found=str(error)) from error
        self._refuse_unknown()

    def row(self, section: str, key: str = "") -> int | None:
        """Return the line of a section or key, ``None`` where it is written in some unusual way."""
        current = ""
        for number, line in enumerate(self.text.splitlines(), start=1):
            if header := re.match(r"\s*\[\s*([^\[\]]+?)\s*\]", line):
                current = header[1].strip("\"'")
                if current == section and not key:
                    return number
            elif current == section and key and re.match(rf"\s*[\"']?{re.escape(key)}[\"']?\s*=", line):
                return number
            elif not current and not key and re.match(rf"\s*{re.escape(section)}\s*=", line):
                return number
        return None

    def _refuse_unknown(self) -> None:
        for section, content in self.data.items():
            if section not in self.sections:
                raise CampaignError(
                    self.file,
                    f"unknown section or key{did_you_mean(section, self.sections)}",
                    row=self.row(section),
                    column=section,
                    expected=f"one of the sections {', '.join(self.sections)}",
                )
            if not isinstance(content, dict):
                raise CampaignError(
                    self.file,
                    "wrong kind of value",
                    row=self.row(section),
                    column=section,
                    found=shown(content),
                    expected=f"a section [{section}]",
                )
            known = self.sections[section]
            for key in content if known else ():
                if key not in known:
                    raise CampaignError(
                        self.file,
                        f"unknown key{did_you_mean(key, known)}",
                        row=self.row(section, key),
                        column=f"{section}.{key}",
                        expected=f"one of {', '.join(known)}" if len(known) > 1 else known[0],
                    )

    def _wrong(
        self, section: str, key: str, found: Any, expected: str, problem: str = "wrong kind of value"
    ) -> CampaignError:
        return CampaignError(
            self.file,
            problem,
            row=self.row(section, key),
            column=f"{section}.{key}",
            found=shown(found),
            expected=expected,
        )

    def _get(self, section: str, key: str, default: Any, expected: str) -> Any:
        value = self.data.get(section, {}).get(key, default)
        if value is _ABSENT:
            raise CampaignError(
                self.file,
                "is missing",
                row=self.row(section) if section in self.data else None,
                column=f"{section}.{key}",
                expected=f"{expected} under [{section}]",
            )
        return value

    def string(self, section: str, key: str, default: Any = _ABSENT) -> Any:
        """Return a text that is not empty, or the default."""
        meaning = {
            "urdf": "the path of the robot's URDF file",
            "tool_frame": "the URDF link that carries the target",
            "root_frame": "the URDF link where the chain starts",
            "kinematics": "the path of a kinematics.yaml of Universal Robots",
            "file": "the path of the table",
        }[key]
        value = self._get(section, key, default, meaning)
        if value is not None and (not isinstance(value, str) or not value.strip()):
            raise self._wrong(section, key, value, f"{meaning}, as text in quotes")
        return value

    def word(self, section: str, key: str, allowed: Iterable[str], default: Any = _ABSENT) -> str:
        """Return one of the allowed words."""
        kind = word(allowed, UNIT if key.endswith("unit") else WORD)
        return str(self._fit(section, key, self._get(section, key, default, alternatives(allowed)), kind))

    def number(self, section: str, key: str, default: Any, kind: Kind = NUMBER) -> float:
        """Return a number of a kind, any finite one where none is given."""
        return float(self._fit(section, key, self._get(section, key, default, "a number"), kind))

    def size(self, section: str, key: str) -> float:
        """Return a number that is not negative, 0 when absent."""
        value = self.number(section, key, 0.0, SIGMA)
        if 0.0 < value < SMALLEST:
            raise self._wrong(section, key, value, "a number above 0, or 0 for not given", "smaller than any noise")
        return value

    def vector(self, section: str, key: str, default: Any) -> Any:
        """Return three finite numbers, or the default."""
        value = self._get(section, key, default, "three numbers")
        if value is None or value is default:
            return value
        return self._fit(section, key, value, VECTOR, "three numbers in brackets, such as [0.0, 0.0, 80.0]")

    def positive(self, section: str) -> dict[str, float]:
        """Return a section whose keys are the user's own, each with a number above 0."""
        kind, values = _NAMED[section], self.data.get(section, {})
        return {key: self._fit(section, key, {key: value}, kind)[key] for key, value in values.items()}

    def _fit(self, section: str, key: str, value: Any, kind: Kind, expected: str = "") -> Any:
        """Return a value of a kind; what is no such value is told with its line."""
        try:
            return kind(value, "")
        except MisfitError as error:
            found = value if expected else error.value
            problem = error.problem or "wrong kind of value"
            raise self._wrong(section, key, found, expected or error.expected, problem) from None
