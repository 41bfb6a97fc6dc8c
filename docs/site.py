"""Lay the pages out for the site as they lie in the repository, so that their links lead to the same places."""

import shutil
import tempfile
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
FOLDERS = ("docs", "notebooks", "robots")
_STAGE = tempfile.TemporaryDirectory(prefix="thermal-robot-docs-")


def on_config(config: Any) -> Any:
    """Copy README and its companions, docs, notebooks and robots, and let the site be made of the copy."""
    stage = Path(_STAGE.name)
    for page in (*ROOT.glob("*.md"), ROOT / "LICENSE"):
        shutil.copy(page, stage)
    for folder in FOLDERS:
        shutil.copytree(
            ROOT / folder, stage / folder, dirs_exist_ok=True, ignore=shutil.ignore_patterns("*.py", "__pycache__")
        )
    config["docs_dir"] = str(stage)
    config["watch"] = [*config["watch"], *(str(ROOT / folder) for folder in FOLDERS)]
    return config
