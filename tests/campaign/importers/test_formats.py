"""The registry of formats: what each must have, and the page that tells of it."""

import inspect
from pathlib import Path

import pytest

from thermal_robot.campaign.importers.run import FORMATS


@pytest.mark.parametrize("name", FORMATS)
def test_a_format_says_what_it_reads_and_cites_its_source(name):
    format = FORMATS[name]
    assert format.does
    assert format.files
    assert 1 <= format.least <= format.most <= 2
    told = inspect.getmodule(getattr(format.read, "func", format.read)).__doc__
    assert name == "table" or "Source" in told or "ros_csv" in told


def test_the_page_has_every_format():
    page = (Path(__file__).parents[3] / "docs" / "importers.md").read_text(encoding="utf-8")
    assert [name for name in FORMATS if f"| `{name}` |" not in page] == []
