"""A mapping: what it states counts for more than what a format says, and its paths are relative to it."""

import pytest
from campaign.files import URDF

from thermal_robot.campaign.document import KINDS as OF_CAMPAIGN
from thermal_robot.campaign.importers.plan import KINDS, Plan, planned, read_mapping
from thermal_robot.errors import CampaignError

UNITS = {"measurements": {"angle_unit": "rad", "length_unit": "mm"}}


def test_a_mapping_has_every_section_of_a_campaign_and_every_key():
    for section, kinds in OF_CAMPAIGN.items():
        assert KINDS[section] is kinds or set(KINDS[section]) == set(kinds) - {"file"}


def test_the_one_that_is_over_counts_key_by_key():
    below = planned({**UNITS, "columns": {"x": "a", "y": "b"}, "table": {"skip": 3}})
    above = planned({"measurements": {"length_unit": "m"}, "columns": {"x": "c"}, "noise": {"position": 0.1}})
    both = above.over(below)
    assert both.get("measurements", "angle_unit") == "rad"
    assert both.get("measurements", "length_unit") == "m"
    assert [both.get("columns", axis).sources for axis in "xy"] == [("c",), ("b",)]
    assert both.layout().skip == 3
    assert both.get("noise", "position") == 0.1


def test_an_orientation_is_stated_as_a_whole():
    matrix = planned({"orientation": {"kind": "matrix", "columns": list(range(1, 10))}})
    vector = planned({"orientation": {"kind": "rotation_vector", "unit": "deg", "columns": ["a", "b", "c"]}})
    assert vector.over(matrix).get("orientation", "stated").kind == "rotation_vector"
    assert Plan().over(matrix).get("orientation", "stated").kind == "matrix"


def test_the_robot_lies_beside_the_mapping(tmp_path):
    (tmp_path / "cell").mkdir()
    (tmp_path / "cell" / "robot.urdf").write_text(URDF)
    file = tmp_path / "cell" / "m.toml"
    file.write_text('[robot]\nurdf = "robot.urdf"\ntool_frame = "tool"\n[payload]\ncom = [0.0, 0.0, 50.0]\n')
    plan = read_mapping(file).over(planned(UNITS))
    robot = plan.robot()
    assert robot.joint_names == ("turn", "lift", "slide", "roll")
    settings = plan.settings(robot)
    assert settings.payload_com == pytest.approx((0, 0, 0.05))
    assert (settings.noise_position, settings.base_known, settings.moves) == (None, False, "direct")
    file.write_text('[robot]\nurdf = "builtin:rv_m2"\ntool_frame = "tool0"\n')
    assert read_mapping(file).robot().n == 5


def test_what_is_not_stated_is_asked_for():
    with pytest.raises(CampaignError, match="import: no robot is named, expected --robot URDF"):
        Plan().robot()
    robot = planned({"robot": {"urdf": "builtin:rv_m2", "tool_frame": "tool0"}}).robot()
    with pytest.raises(CampaignError, match="no angle_unit is stated"):
        Plan().settings(robot)


def test_a_separator_is_a_word():
    layout = planned({"table": {"separator": "tab", "comment": "#", "header": False, "key": "n"}}).layout()
    assert (layout.separator, layout.skip, layout.header, layout.comment) == ("\t", 0, False, "#")
