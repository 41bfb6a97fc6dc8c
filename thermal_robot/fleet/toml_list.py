"""A list of campaigns as TOML: ``[[campaigns]]`` with a path and labels each."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

from thermal_robot.errors import CampaignError
from thermal_robot.schema import fitted, text

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

SECTION = "campaigns"


def read_toml(path: Path) -> tuple[dict[str, list[str]], list[int]]:
    """Read a list.

    Returns
    -------
    tuple
        Columns of text by name, empty where a campaign does not have the label; and the number of each campaign.

    Raises
    ------
    CampaignError
        What cannot be read, holds anything but ``[[campaigns]]``, or a value that is no text.
    """
    try:
        data: dict[str, Any] = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise CampaignError(str(path), f"cannot be read: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        line = re.search(r"at line (\d+)", str(error))
        raise CampaignError(str(path), f"not valid TOML: {error}", row=int(line[1]) if line else None) from error
    items = data.get(SECTION)
    if set(data) != {SECTION} or not isinstance(items, list) or not all(isinstance(item, dict) for item in items):
        found = ", ".join(data) or "nothing"
        raise CampaignError(
            str(path), "is no list of campaigns", found=found, expected=f"[[{SECTION}]] and nothing else"
        )
    if not items:
        raise CampaignError(str(path), "lists no campaign", expected=f"a [[{SECTION}]] for each")
    names = dict.fromkeys(name for item in items for name in item)
    word = text(empty=True)
    columns = {
        name: [fitted(word, item.get(name, ""), str(path), f"{SECTION}[{k}].{name}") for k, item in enumerate(items)]
        for name in names
    }
    return columns, list(range(1, len(items) + 1))
