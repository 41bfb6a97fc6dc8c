"""A list of campaigns as TOML."""

import pytest

from thermal_robot.errors import CampaignError
from thermal_robot.fleet.listed import _read_toml


def test_a_label_that_a_campaign_does_not_have_is_empty(tmp_path):
    file = tmp_path / "list.toml"
    file.write_text('[[campaigns]]\ncampaign = "a"\n[[campaigns]]\ncampaign = "b"\nhall = "2"\n')
    assert _read_toml(file) == ({"campaign": ["a", "b"], "hall": ["", "2"]}, [1, 2])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[[campaigns]\n", r"row 1: not valid TOML"),
        ("[[campaign]]\n", r"found campaign, expected \[\[campaigns\]\]"),
        ("campaigns = []\n", "lists no campaign"),
        ("campaigns = [3]\n", "no list of campaigns"),
        ("", "found nothing"),
    ],
)
def test_what_is_no_list_says_what_is_expected(tmp_path, text, said):
    file = tmp_path / "list.toml"
    file.write_text(text)
    with pytest.raises(CampaignError, match=said):
        _read_toml(file)
