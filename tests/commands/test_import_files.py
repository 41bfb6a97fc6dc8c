"""`thermal-robot import`: the formats in the help, options over the mapping, one line of what was done."""

import pytest
from campaign.importers.written import put
from commanded import refused

from thermal_robot import cli
from thermal_robot.campaign import read_campaign
from thermal_robot.campaign.importers.run import FORMATS

TABLE = "turn,lift,slide,roll,x,y,z\n0.1,0.2,0.03,0.4,1,2,3\n-0.1,0.3,0.06,3.5,4,5,6\n0.5,-0.4,0.09,-0.4,7,8,9\n"
MAPPING = '[robot]\nurdf = "robot.urdf"\ntool_frame = "hand"\n[measurements]\nangle_unit = "deg"\nlength_unit = "mm"\n'


def test_the_help_has_every_format(capsys):
    with pytest.raises(SystemExit):
        cli.main(["import", "--help"])
    text = capsys.readouterr().out
    for name, format in FORMATS.items():
        assert f"{name} " in text
        assert format.does in text
        assert format.files in text


def test_options_count_for_more_than_the_mapping(run, tmp_path):
    folder = put(tmp_path, t__csv=TABLE, m__toml=MAPPING)
    mapping = ("--mapping", folder / "m.toml")
    status, out, err = run("import", "table", folder / "t.csv", *mapping, "--length-unit", "m", "-o", folder / "c")
    assert (status, err) == (0, "")
    assert out == f"table: 3 rows read, 3 taken; written to {folder / 'c' / 'campaign.toml'}\n"
    campaign = read_campaign(folder / "c")
    assert campaign.position[0, 0] == 1.0
    assert campaign.units.angle == "deg"
    assert campaign.robot.tool_frame == "hand"
    assert run("import", "-q", "table", folder / "t.csv", *mapping, "--tool", "tool", "-o", folder / "d") == (0, "", "")
    assert read_campaign(folder / "d").robot.tool_frame == "tool"


def test_what_cannot_be_imported_is_one_line(run, tmp_path):
    folder = put(tmp_path, t__csv=TABLE, m__toml=MAPPING)
    mapping = ("--mapping", folder / "m.toml")
    refused(run("import", "table", folder / "absent.csv", *mapping, "-o", folder / "c"), "absent.csv: there is no such")
    refused(run("import", "table", folder / "t.csv", "-o", folder / "c"), "no robot is named")
    robot = ("--robot", folder / "robot.urdf")
    refused(run("import", "table", folder / "t.csv", *robot, "-o", folder / "c"), "no tool frame is given")
    with pytest.raises(SystemExit):
        run("import", "tabel", folder / "t.csv", *robot, "-o", folder / "c")
