"""Parsers of campaign.toml, with line numbers and a schema, and of other programs' YAML."""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

from thermal_robot.campaign.names import did_you_mean, listed
from thermal_robot.campaign.settings import KINDS, Settings
from thermal_robot.errors import CampaignError
from thermal_robot.files import is_file, is_folder
from thermal_robot.schema import Kind, MisfitError, record, shown
from thermal_robot.urdf_text import BUILTIN, EXAMPLE_ROBOT_DATA

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

Kinds: TypeAlias = Mapping[str, "Mapping[str, Kind] | Kind"]
"""What each key of each section may be; of a section whose keys are the user's own, what the whole may be."""
FILE_NAME = "campaign.toml"
_LARGEST_FILE = 1 << 16  # Bytes: it holds a few lines, and a line for every joint and every effect
_LARGEST_YAML = 64 << 20  # Bytes: ten thousand samples of a calibration as text; it takes a minute to read them
_MOST_NAMED = 5  # campaigns of a folder in one sentence


def _content(file: Path, most: int, name: str, kind: str) -> str:
    """Content of a UTF-8 file; refused are other encodings, and one larger than ``most`` bytes."""
    try:
        if file.stat().st_size > most:
            raise CampaignError(str(file), f"is larger than any {name}", expected=f"at most {most >> 10} KiB")
        return file.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise CampaignError(str(file), f"cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise CampaignError(str(file), "is not UTF-8 text", expected=f"a {kind} file saved as UTF-8") from error


class Document:
    """A parsed and validated TOML file together with its text, so that an error can name the line.

    ``sections`` holds the validated values by section and key, without those not stated; ``data`` the values as parsed.
    ``kinds`` is the schema; ``name`` is the usual name of such a file, for messages.
    """

    def __init__(self, file: Path, kinds: Kinds = KINDS, name: str = FILE_NAME) -> None:
        self.file, self.kinds = str(file), kinds
        self.text = _content(file, _LARGEST_FILE, name, "TOML")
        try:
            self.data: dict[str, Any] = tomllib.loads(self.text)
        except tomllib.TOMLDecodeError as error:
            line = re.search(r"at line (\d+)", str(error))
            raise CampaignError(self.file, f"not valid TOML: {error}", row=int(line[1]) if line else None) from error
        except RecursionError as error:
            raise CampaignError(self.file, "values stand within each other too deep") from error
        except ValueError as error:  # an integer of thousands of digits
            raise CampaignError(self.file, "a number has too many digits to be read", found=str(error)) from error
        for section, content in self.data.items():
            self._refuse_unknown(section, content)
        self.sections = {section: self._fitted(section, content) for section, content in self.data.items()}

    def row(self, section: str, key: str = "") -> int | None:
        """Line number of a section or key, ``None`` where it cannot be located."""
        current, table = "", f"{section}.{key}" if key else section
        stated = re.compile(rf"\s*[\"']?{re.escape(key or section)}[\"']?\s*=")
        for number, line in enumerate(self.text.splitlines(), start=1):
            if header := re.match(r"\s*\[\s*([^\[\]]+?)\s*\]", line):
                current = header[1].strip("\"'")
                if current == table:
                    return number
            elif current == (section if key else "") and stated.match(line):
                return number
        return None

    def _error(self, problem: str, section: str, key: str = "", column: str = "", **told: str) -> CampaignError:
        """Build the CampaignError for a section or one of its keys, with the line number."""
        column = column or (f"{section}.{key}" if key else section)
        return CampaignError(self.file, problem, row=self.row(section, key), column=column, **told)

    def _refuse_unknown(self, section: str, content: Any) -> None:
        if section not in self.kinds:
            problem = f"unknown section or key{did_you_mean(section, self.kinds)}"
            raise self._error(problem, section, expected=f"one of the sections {', '.join(self.kinds)}")
        if not isinstance(content, dict):
            told = {"found": shown(content), "expected": f"a section [{section}]"}
            raise self._error("wrong kind of value", section, **told)
        kind = self.kinds[section]
        known = kind if isinstance(kind, Mapping) else content
        for key in content:
            if key not in known:
                expected = f"{'one of ' if len(known) > 1 else ''}{', '.join(known)}"
                raise self._error(f"unknown key{did_you_mean(key, known)}", section, key, expected=expected)

    def _fitted(self, section: str, content: Any) -> dict[str, Any]:
        """Return the validated values of a section; errors name the line."""
        try:
            return fitted_sections(self.kinds, {section: content})[section]
        except MisfitError as error:
            key = re.split(r"[.\[]", error.path.removeprefix(f"{section}."))[0]
            key = key if self.row(section, key) else ""
            problem, told = error.problem or "wrong kind of value", {"found": shown(error.value)}
            raise self._error(problem, section, key, error.path, **told, expected=error.expected) from None

    def required(self, section: str, key: str) -> Any:
        """Return the value of a required key; a missing one raises a CampaignError."""
        if key in self.sections.get(section, {}):
            return self.sections[section][key]
        known = self.kinds[section]
        try:
            expected = str(known[key](None, key)) if isinstance(known, Mapping) else ""
        except MisfitError as error:
            expected = error.expected
        raise self._error("is missing", section, column=f"{section}.{key}", expected=f"{expected} under [{section}]")


def fitted_sections(kinds: Kinds, sections: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Validate values by section and key against the schema ``kinds``; a wrong one raises a :class:`MisfitError`."""
    own = {section: kinds[section] for section in sections}
    whole = {key: record(kind, may_lack=kind) if isinstance(kind, Mapping) else kind for key, kind in own.items()}
    return {section: whole[section](content, section) for section, content in sections.items()}


@dataclass(frozen=True)
class Declaration:
    """Validated content of a campaign.toml: paths of table and robot, and settings in SI."""

    file: Path  # path of the file as the user gave it
    table: Path  # path of the table
    robot: str | Path  # what load_robot wants: a reference to a known robot, or a path
    settings: Settings  # all the rest, SI
    gear_rows: Mapping[str, int | None]  # line of each key of ``[gears]``, for a message once the joints are known
    kinematics: Path | None = None  # path of the calibration that a robot of Universal Robots brings along

    @property
    def files(self) -> list[Path]:
        """Input files of the campaign: campaign.toml, table, and the robot's own where it names any."""
        return [self.file, self.table, *(own for own in (self.robot, self.kinematics) if isinstance(own, Path))]


def read_declaration(path: Path, folder: Path | None = None) -> Declaration:
    """Read campaign.toml, or that of a directory; its paths are relative to ``folder``, by default its own."""
    file = declared_file(path)
    document = Document(file)
    for place in ("measurements.angle_unit", "measurements.length_unit", "robot.urdf", "robot.tool_frame"):
        document.required(*place.split("."))
    folder = file.parent if folder is None else folder
    table = folder / document.required("measurements", "file")
    settings, kinematics = Settings.stated(document.sections), document.sections["robot"].get("kinematics")
    rows = {joint: document.row("gears", joint) for joint in settings.gears}
    robot = robot_reference(settings.urdf, folder)
    return Declaration(file, table, robot, settings, rows, folder / kinematics if kinematics else None)


def robot_reference(urdf: str, folder: Path) -> str | Path:
    """Resolve a robot's reference for ``load_robot``: a built-in name stays, a path is relative to the folder."""
    return urdf if urdf.startswith((EXAMPLE_ROBOT_DATA, BUILTIN)) else folder / urdf


def declared_file(path: Path, name: str = FILE_NAME, section: str = "measurements") -> Path:
    """Return the path of a declaration file, from its own path or its folder's; one that is missing is refused.

    The CampaignError lists declarations beside it: TOML files with this ``section``, and subfolders with such a file.
    """
    file = path / name if is_folder(path) else path
    if is_file(file):
        return file
    problem, folder = (
        (f"this folder has no {name}", path) if is_folder(path) else ("there is no such file", path.parent)
    )
    try:
        inside, mark = sorted(folder.iterdir()), f"[{section}]".encode()
        found = [f.name for f in inside if f.suffix == ".toml" and f.is_file() and mark in f.read_bytes()]
        found += [f.name for f in inside if f.is_dir() and (f / name).is_file()]
    except (OSError, ValueError):  # nothing can be proposed where nothing can be read
        found = []
    beside = f"; campaigns there: {listed(found, _MOST_NAMED)}" if found else ""
    raise CampaignError(str(path), problem + beside, expected=f"{name}, or the folder that holds it")


def is_yaml(file: Path) -> bool:
    """Whether a file's name ends in .yaml or .yml."""
    return file.suffix.lower() in (".yaml", ".yml")


def _yaml(file: str) -> Any:
    """Import ``yaml``, or say how to install it."""
    try:
        import yaml
    except ImportError as error:
        expected = 'pip install "thermal-robot[yaml]"'
        raise CampaignError(file, "YAML files need PyYAML, which is not installed", expected=expected) from error
    return yaml


def yaml_text(plain: Any) -> str:
    """Convert plain values to YAML text, keys in their order, numbers with all digits."""
    return str(_yaml("YAML").safe_dump(plain, sort_keys=False, allow_unicode=True))


def read_yaml(file: Path) -> list[Any]:
    """Parse all non-empty documents of a YAML file by a safe loader (plain values only); else a CampaignError."""
    yaml = _yaml(str(file))
    if not is_file(file):
        problem = "is a directory" if is_folder(file) else "there is no such file"
        raise CampaignError(str(file), problem, expected="a YAML file")
    text = _content(file, _LARGEST_YAML, "file of samples", "YAML")
    try:
        documents = list(yaml.load_all(text, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader)))
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        mark = getattr(error, "problem_mark", None)
        row = None if mark is None else mark.line + 1
        reason = getattr(error, "problem", None) or str(error)
        raise CampaignError(str(file), f"not valid YAML: {reason}", row=row) from error
    return [document for document in documents if document is not None]
