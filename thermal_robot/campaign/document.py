"""A TOML file with its lines: every key known, every value of its kind, nothing ignored in silence."""

from __future__ import annotations

import math
import re
import sys
from pathlib import Path
from typing import Any

from thermal_robot.campaign.names import did_you_mean
from thermal_robot.campaign.settings import as_vector
from thermal_robot.errors import CampaignError

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

SECTIONS: dict[str, tuple[str, ...]] = {
    "robot": ("urdf", "tool_frame", "root_frame", "gravity", "moves", "reference_temperature"),
    "measurements": ("file", "angle_unit", "length_unit"),
    "frames": ("base", "tool", "target"),
    "noise": ("position", "orientation"),
    "payload": ("com",),
    "priors": (),
    "gears": (),
}
"""Keys by section; priors and gears have keys of the user's own (effects and joints)."""

_ABSENT: Any = object()


class Document:
    """The parsed file together with its text, so that an error can name the line."""

    def __init__(self, file: Path) -> None:
        self.file = str(file)
        try:
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
            if section not in SECTIONS:
                raise CampaignError(
                    self.file,
                    f"unknown section or key{did_you_mean(section, SECTIONS)}",
                    row=self.row(section),
                    column=section,
                    expected=f"one of the sections {', '.join(SECTIONS)}",
                )
            if not isinstance(content, dict):
                raise CampaignError(
                    self.file,
                    "wrong kind of value",
                    row=self.row(section),
                    column=section,
                    found=repr(content),
                    expected=f"a section [{section}]",
                )
            known = SECTIONS[section]
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
            found=repr(found),
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
            "file": "the path of the table",
        }[key]
        value = self._get(section, key, default, meaning)
        if value is not None and (not isinstance(value, str) or not value.strip()):
            raise self._wrong(section, key, value, f"{meaning}, as text in quotes")
        return value

    def word(self, section: str, key: str, allowed: Any, default: Any = _ABSENT) -> str:
        """Return one of the allowed words."""
        expected = " or ".join(f'"{word}"' for word in allowed)
        value = self._get(section, key, default, expected)
        if not isinstance(value, str) or value not in allowed:
            problem = "unknown unit" if key.endswith("unit") else "unknown word"
            raise self._wrong(section, key, value, expected, problem)
        return value

    def number(self, section: str, key: str, default: Any) -> float:
        """Return a finite number."""
        value = self._get(section, key, default, "a number")
        if not _is_number(value):
            raise self._wrong(section, key, value, "a number")
        return float(value)

    def size(self, section: str, key: str) -> float:
        """Return a number that is not negative, 0 when absent."""
        value = self.number(section, key, 0.0)
        if value < 0:
            raise self._wrong(
                section,
                key,
                value,
                "a number above 0, or 0 for not given",
                "a standard deviation cannot be negative",
            )
        return value

    def vector(self, section: str, key: str, default: Any) -> Any:
        """Return three finite numbers, or the default."""
        value = self._get(section, key, default, "three numbers")
        if value is None or value is default:
            return value
        if not isinstance(value, list) or len(value) != 3 or not all(_is_number(part) for part in value):
            raise self._wrong(section, key, value, "three numbers in brackets, such as [0.0, 0.0, 80.0]")
        return as_vector(value)

    def positive(self, section: str) -> dict[str, float]:
        """Return a section whose keys are the user's own, each with a number above 0."""
        values = self.data.get(section, {})
        for key, value in values.items():
            if not _is_number(value):
                raise self._wrong(section, key, value, "a number above 0")
            if value <= 0:
                what = "the expected size of an effect" if section == "priors" else "a transmission ratio"
                raise self._wrong(section, key, value, "a number above 0", f"{what} must be positive")
        return {key: float(value) for key, value in values.items()}


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
