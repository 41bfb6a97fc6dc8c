"""The JSON Schema of a diagnosis, which ships with the package."""

from __future__ import annotations

import json
from importlib.resources import files
from typing import Any


def schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of the format ``thermal-robot/diagnosis/2``."""
    text = files(__package__).joinpath("diagnosis.schema.json").read_text(encoding="utf-8")
    return dict(json.loads(text))
