"""YAML files that an importer is given."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from thermal_robot.errors import CampaignError
from thermal_robot.files import is_file, is_folder

_LARGEST_YAML = 64 << 20
"""Bytes: ten thousand samples of a calibration as text; it takes a minute to read them."""
WITH_YAML = 'pip install "thermal-robot[yaml]"'


def is_yaml(file: Path) -> bool:
    """Return whether a file is YAML by its name."""
    return file.suffix.lower() in (".yaml", ".yml")


def read_yaml(file: Path) -> list[Any]:
    """Return the documents of a YAML file, of plain values alone; the empty ones are left out.

    Raises
    ------
    CampaignError
        No such file, one that is no YAML, or PyYAML that is not installed.
    """
    try:
        import yaml
    except ImportError as error:
        raise CampaignError(str(file), "YAML files need PyYAML, which is not installed", expected=WITH_YAML) from error
    if not is_file(file):
        problem = "is a directory" if is_folder(file) else "there is no such file"
        raise CampaignError(str(file), problem, expected="a YAML file")
    if file.stat().st_size > _LARGEST_YAML:
        raise CampaignError(str(file), "is larger than can be read", expected=f"at most {_LARGEST_YAML >> 20} MiB")
    try:
        loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
        documents = list(yaml.load_all(file.read_text(encoding="utf-8-sig"), Loader=loader))
    except OSError as error:
        raise CampaignError(str(file), f"cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise CampaignError(str(file), "is not UTF-8 text", expected="a YAML file") from error
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        mark = getattr(error, "problem_mark", None)
        row = None if mark is None else mark.line + 1
        reason = getattr(error, "problem", None) or str(error)
        raise CampaignError(str(file), f"not valid YAML: {reason}", row=row) from error
    return [document for document in documents if document is not None]
