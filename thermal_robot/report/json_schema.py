"""The JSON Schemas of a diagnosis and of a comparison, which ship with the package."""

from __future__ import annotations

import json
from importlib.resources import files
from typing import Any


def schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of the format ``thermal-robot/diagnosis/2``."""
    return _read("diagnosis.schema.json")


def comparison_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of the format ``thermal-robot/comparison/1``."""
    return _read("comparison.schema.json")


def _read(name: str) -> dict[str, Any]:
    return dict(json.loads(files(__package__).joinpath(name).read_text(encoding="utf-8")))
