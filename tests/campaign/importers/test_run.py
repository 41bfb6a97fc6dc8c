"""The registry of formats, and what an import writes and never overwrites."""

import inspect

import pytest
from campaign.importers.written import COMMANDS, put

from thermal_robot.campaign.importers import FORMATS
from thermal_robot.campaign.importers.plan import planned
from thermal_robot.campaign.importers.run import import_files
from thermal_robot.errors import CampaignError


@pytest.mark.parametrize("name", FORMATS)
def test_a_format_says_what_it_reads_and_cites_its_source(name):
    module = FORMATS[name]
    assert module.DOES
    assert module.FILES
    assert list(inspect.signature(module.read).parameters) == ["files", "plan"]
    assert name == "table" or "Source" in module.__doc__ or "ros_csv" in module.__doc__


def test_a_campaign_that_is_read_from_is_not_overwritten(tmp_path):
    header, *rows = COMMANDS.split()
    lines = [f"{header},x,y,z", *(f"{row},{k},1,2" for k, row in enumerate(rows))]
    folder = put(tmp_path, measurements__csv="\n".join(lines))
    plan = planned({
        "robot": {"urdf": str(folder / "robot.urdf"), "tool_frame": "tool"},
        "measurements": {"angle_unit": "rad", "length_unit": "mm"},
    })  # fmt: skip
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
