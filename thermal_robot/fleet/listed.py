"""Campaigns of a fleet with their labels, from a folder tree or a list in CSV or TOML."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from thermal_robot.campaign import read_table
from thermal_robot.campaign.document import FILE_NAME
from thermal_robot.campaign.names import did_you_mean, listed
from thermal_robot.errors import CampaignError, require
from thermal_robot.files import is_file, is_folder
from thermal_robot.fleet.rows import CAMPAIGN, OWN
from thermal_robot.schema import fitted, text

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib


_SECTION = "campaigns"
_LISTS = (".csv", ".toml")


@dataclass(frozen=True)
class Listed:
    """Campaigns of a fleet: (path relative to ``root``, label values in the order of the label ``names``) of each."""

    root: Path
    names: tuple[str, ...]
    campaigns: tuple[tuple[str, tuple[str, ...]], ...]

    def folder(self, name: str) -> str:
        """Absolute path of a campaign."""
        return os.path.abspath(self.root / name)


def campaigns(source: str | Path, names: Sequence[str] = ()) -> Listed:
    """Find the campaigns of a fleet in a folder, sorted by path, or in a list file, in its order.

    In a folder every ``campaign.toml`` below it is one, and the folders on the way to it are its labels; ``names`` are
    the labels' names from the top level, ``level_1`` and so on where left out. A list is CSV, or TOML with
    ``[[campaigns]]``: its column ``campaign`` has paths relative to the list's folder, its other columns are labels.
    Raises :class:`CampaignError` for a missing folder or file, one without campaigns, a campaign listed twice, and a
    label with a reserved, empty or repeated name.
    """
    require("diagnose_many()", source, (str, os.PathLike), "the path of a folder, or of a list of campaigns")
    path = Path(source)
    if is_folder(path):
        return _below(path, names)
    if not is_file(path):
        raise CampaignError(str(path), "there is no such folder or list", expected="a folder of campaigns, or a list")
    if names:
        problem = "a list names its labels itself: they are its columns"
        raise CampaignError(str(path), problem, found=listed(names, len(names)), expected="--labels with a folder only")
    if path.suffix.lower() not in _LISTS or path.name == FILE_NAME:
        raise CampaignError(str(path), "is no list of campaigns", expected=f"{' or '.join(_LISTS)}, or a folder")
    return _of_list(path)


def _below(root: Path, names: Sequence[str]) -> Listed:
    """Find every folder below ``root`` with a campaign.toml, labelled by the folders on the way; ``.`` is the root."""
    # a file that cannot be opened, such as a broken link, is a campaign: its row says why
    having = (folder for folder, _, files in os.walk(root) if FILE_NAME in files)
    found = sorted(Path(os.path.relpath(folder, root)).as_posix() for folder in having)
    if not found:
        raise CampaignError(str(root), f"no {FILE_NAME} lies below this folder", expected="a folder of campaigns")
    parts = [Path(name).parts for name in found]
    depth = max(len(levels) for levels in parts)
    if len(names) > depth:
        problem = "has fewer levels of folders than labels"
        raise CampaignError(str(root), problem, found=str(depth), expected=str(len(names)))
    labels = _checked(str(root), [*names, *(f"level_{k + 1}" for k in range(len(names), depth))])
    padded = ((*levels, *[""] * (depth - len(levels))) for levels in parts)
    return Listed(root, labels, tuple(zip(found, padded, strict=True)))


def _of_list(path: Path) -> Listed:
    """Read a list of campaigns in CSV or TOML: paths in the column ``campaign``, labels in the other columns."""
    if path.suffix.lower() == ".toml":
        columns, rows = _read_toml(path)
    else:
        table = read_table(path)
        columns, rows = {name: table.text(name) for name in table.columns}, [int(row) for row in table.rows]
    if CAMPAIGN not in columns:
        problem = f"has no column {CAMPAIGN!r}{did_you_mean(CAMPAIGN, columns)}"
        raise CampaignError(str(path), problem, expected="the paths of the campaigns in it, labels in the others")
    names = columns.pop(CAMPAIGN)
    labels = _checked(str(path), columns)
    seen: dict[str, int] = {}
    for name, row in zip(names, rows, strict=True):
        if not name.strip():
            raise CampaignError(str(path), "no campaign is named", row=row, column=CAMPAIGN, expected="a path")
        first = seen.setdefault(os.path.normpath(name), row)
        if first != row:
            problem = f"this campaign stands in row {first}, too"
            raise CampaignError(str(path), problem, row=row, column=CAMPAIGN, found=name, expected="each once")
    of_each = zip(*columns.values(), strict=True) if labels else (() for _ in rows)
    return Listed(path.parent, labels, tuple(zip(names, of_each, strict=True)))


def _checked(file: str, labels: Iterable[str]) -> tuple[str, ...]:
    """Return the label names; one that is empty, a column of the fleet's table, or a duplicate is refused."""
    names = tuple(labels)
    for name in names:
        if name in OWN or not name.strip():
            problem = "the table of a fleet has a column of this name" if name.strip() else "a label has no name"
            raise CampaignError(file, problem, column=name, expected="another name for the label")
        if names.count(name) > 1:
            raise CampaignError(file, "a label stands twice", column=name, expected="each once")
    return names


def _read_toml(path: Path) -> tuple[dict[str, list[str]], list[int]]:
    """Read a TOML list: columns of text by name, empty where a campaign lacks a label, and numbers from 1."""
    try:
        data: dict[str, Any] = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise CampaignError(str(path), f"cannot be read: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        line = re.search(r"at line (\d+)", str(error))
        raise CampaignError(str(path), f"not valid TOML: {error}", row=int(line[1]) if line else None) from error
    items = data.get(_SECTION)
    if set(data) != {_SECTION} or not isinstance(items, list) or not all(isinstance(item, dict) for item in items):
        found, expected = ", ".join(data) or "nothing", f"[[{_SECTION}]] and nothing else"
        raise CampaignError(str(path), "is no list of campaigns", found=found, expected=expected)
    if not items:
        raise CampaignError(str(path), "lists no campaign", expected=f"a [[{_SECTION}]] for each")
    word = text(empty=True)
    columns = {
        name: [fitted(word, item.get(name, ""), str(path), f"{_SECTION}[{k}].{name}") for k, item in enumerate(items)]
        for name in dict.fromkeys(name for item in items for name in item)
    }
    return columns, list(range(1, len(items) + 1))
