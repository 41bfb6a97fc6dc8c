"""The documentation builds as a site, and a warning is an error."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """Build the site as `mkdocs build -f .mkdocs.yml --strict` does; its folder."""
    pytest.importorskip("mkdocs", reason="mkdocs is not installed: the extra docs")
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "-f", str(ROOT / ".mkdocs.yml"), "--strict", "-d", str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-3000:]
    return folder


def test_every_page_is_in_it(site):
    for page in (ROOT / "docs").glob("*.md"):
        named = page.stem if page.stem != "index" else ""
        assert (site / "docs" / named / "index.html").is_file(), page.name


def test_the_reference_tells_arguments_and_errors(site):
    shown = (site / "docs" / "reference" / "index.html").read_text(encoding="utf-8")
    assert "CampaignError" in shown
    assert "held_out" in shown or "joint_names" in shown


def test_nothing_is_fetched_from_elsewhere(site):
    start = (site / "index.html").read_text(encoding="utf-8")
    assert "fonts.googleapis.com" not in start
