"""What an import writes, and what it never overwrites; the registry of formats, and the page that tells of it."""

import inspect
from pathlib import Path

import pytest
from campaign.importers.written import COMMANDS, put

from thermal_robot.campaign.importers.plan import planned
from thermal_robot.campaign.importers.run import FORMATS, import_files
from thermal_robot.errors import CampaignError


def sources(tmp_path):
    """A folder with a table to import, and how."""
    header, *rows = COMMANDS.split()
    lines = [f"{header},x,y,z", *(f"{row},{k},1,2" for k, row in enumerate(rows))]
    folder = put(tmp_path, measurements__csv="\n".join(lines))
    plan = planned({
        "robot": {"urdf": str(folder / "robot.urdf"), "tool_frame": "tool"},
        "measurements": {"angle_unit": "rad", "length_unit": "mm"},
    })  # fmt: skip
    return folder, plan


def test_a_campaign_that_is_read_from_is_not_overwritten(tmp_path):
    folder, plan = sources(tmp_path)
    with pytest.raises(CampaignError, match="is read from, and would be overwritten"):
        import_files("table", [folder / "measurements.csv"], folder, plan)
    done = import_files("table", [folder / "measurements.csv"], folder / "new", plan)
    assert sorted(file.name for file in (folder / "new").iterdir()) == [
        "campaign.toml",
        "measurements.csv",
        "robot.urdf",
    ]
    assert done.file == folder / "new" / "campaign.toml"
    assert done.campaign.name == "new"
    assert done.notes == ("3 rows read, 3 taken",)


def test_a_campaign_that_was_not_imported_is_not_replaced(tmp_path):
    folder, plan = sources(tmp_path)
    again = folder / "again"
    file = import_files("table", [folder / "measurements.csv"], again, plan).file
    first = file.read_text(encoding="utf-8")
    import_files("table", [folder / "measurements.csv"], again, plan)
    assert file.read_text(encoding="utf-8") == first
    own = first.partition("\n")[2]
    file.write_text(own, encoding="utf-8")
    with pytest.raises(CampaignError, match="there is a campaign already"):
        import_files("table", [folder / "measurements.csv"], again, plan)
    assert file.read_text(encoding="utf-8") == own


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
