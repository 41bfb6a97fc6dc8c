"""Formats of the files that commands write, by the endings of their names; one check of all of them."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

from thermal_robot.campaign.table import TABLES
from thermal_robot.errors import CampaignError


@dataclass(frozen=True)
class Form:
    """Format of an output file: its name in messages, and the endings that it may have.

    Attributes
    ----------
    what
        What such a file is called.
    endings
        Its endings, each with the module that writing it needs; empty where nothing more is needed.
    folder
        Whether a name without any of these endings is that of a folder.
    """

    what: str
    endings: Mapping[str, str]
    folder: bool = False


def _plain(what: str, *endings: str, folder: bool = False) -> Form:
    return Form(what, dict.fromkeys(endings, ""), folder)


FORMS = {
    "json": _plain("JSON file", ".json"),
    "model": _plain("file of a model", ".json"),
    "page": Form("page", {".html": "", ".htm": "", ".pdf": "weasyprint"}),
    "table": Form("table", TABLES),
    "csv": _plain("CSV table", ".csv"),
    "picture": _plain("picture", ".png", ".svg", ".pdf", ".jpg", ".jpeg", ".webp", ".tif", ".tiff", ".eps"),
    "urdf": _plain("URDF", ".urdf", ".xml"),
    "mjcf": _plain("MJCF", ".xml", ".mjcf"),
    "yaml": _plain("YAML file", ".yaml", ".yml"),
    "folder": _plain("folder", folder=True),
    "plan": _plain("folder or CSV table", ".csv", folder=True),
}
"""What an option writes; :mod:`~thermal_robot.commands.table` says which option writes what."""

EXTRAS = {"pyarrow": "parquet", "openpyxl": "excel", "odf": "excel", "weasyprint": "pdf"}
"""The extra of this package that brings a module."""

_TAKEN = {ending for form in FORMS.values() for ending in form.endings}


def require_endings(options: argparse.Namespace) -> None:
    """Refuse a file whose ending is not of the format that its option writes; a name without ending is accepted.

    Parameters
    ----------
    options
        Of a command; ``forms`` names the form of each option that writes.

    Raises
    ------
    CampaignError
        Naming the file, its ending and those of the format; or the module that writing it needs.
    """
    for name, kind in options.forms.items():
        file, form = getattr(options, name), FORMS[kind]
        ending = Path(file or "").suffix.lower()
        if not ending or (form.folder and ending not in _TAKEN):
            continue
        if ending not in form.endings:
            known = ", ".join(form.endings) or "a name without the ending of a file"
            raise CampaignError(file, f"is no {form.what} by its ending", found=ending, expected=known)
        if module := form.endings[ending]:
            _require(module, file, ending)


def _require(module: str, file: str, ending: str) -> None:
    """Import a module that writing a file needs; CampaignError if it, or a system library of its, is not installed."""
    try:
        import_module(module)
    except ImportError as error:
        problem = f"cannot be written: {ending} needs {module}, which is not installed"
        extra = f'pip install "thermal-robot[{EXTRAS[module]}]", or another ending'
        raise CampaignError(file, problem, expected=extra) from error
    except OSError as error:
        problem, found = f"cannot be written: {module} lacks a library of the system", str(error).splitlines()[0]
        raise CampaignError(file, problem, found=found, expected="that library, or another ending") from error
