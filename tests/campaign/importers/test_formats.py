"""The registry of formats: what each must have, and the page that tells of it."""

import inspect
from pathlib import Path

import pytest

from thermal_robot.campaign.importers.formats import FORMATS


@pytest.mark.parametrize("name", FORMATS)
def test_a_format_says_what_it_reads_and_cites_its_source(name):
    module = FORMATS[name]
    assert module.DOES
    assert module.FILES
    assert list(inspect.signature(module.read).parameters) == ["files", "plan"]
    assert name == "table" or "Source" in module.__doc__ or "ros_csv" in module.__doc__


def test_the_page_has_every_format():
    page = (Path(__file__).parents[3] / "docs" / "importers.md").read_text(encoding="utf-8")
    assert [name for name in FORMATS if f"| `{name}` |" not in page] == []
