"""Which campaigns a fleet has: below a folder, in a CSV, in TOML; and complaints that say where to look."""

import pytest

from thermal_robot.errors import CampaignError
from thermal_robot.fleet.listed import campaigns


@pytest.fixture
def root(tmp_path):
    for name in ("hall_2/b/monday", "hall_1/a/monday", "hall_1/a/friday", "hall_1/c"):
        (tmp_path / "all" / name).mkdir(parents=True)
        (tmp_path / "all" / name / "campaign.toml").write_text("")
    (tmp_path / "all" / "notes").mkdir()
    return tmp_path / "all"


def test_a_folder_holds_every_campaign_below_it_labelled_by_its_folders(root):
    found = campaigns(root, ["hall", "robot"])
    assert found.names == ("hall", "robot", "level_3")
    assert found.campaigns == (
        ("hall_1/a/friday", ("hall_1", "a", "friday")),
        ("hall_1/a/monday", ("hall_1", "a", "monday")),
        ("hall_1/c", ("hall_1", "c", "")),
        ("hall_2/b/monday", ("hall_2", "b", "monday")),
    )
    assert found.folder("hall_1/c") == str(root / "hall_1" / "c")
    assert campaigns(root).names == ("level_1", "level_2", "level_3")
    assert campaigns(root / "hall_1" / "c").campaigns == ((".", ()),)  # a folder that is a campaign


def test_a_campaign_whose_file_is_a_broken_link_is_not_passed_over(root):
    (root / "hall_1" / "d").mkdir()
    (root / "hall_1" / "d" / "campaign.toml").symlink_to(root / "gone")
    assert [name for name, _ in campaigns(root / "hall_1").campaigns] == ["a/friday", "a/monday", "c", "d"]


CSV = "campaign,hall,robot\nhall_1/a/monday,one,a\nhall_2/b/monday,two,\n"
TOML = '[[campaigns]]\ncampaign = "hall_1/a/monday"\nhall = "one"\nrobot = "a"\n'
TOML += '[[campaigns]]\ncampaign = "hall_2/b/monday"\nhall = "two"\n'


@pytest.mark.parametrize(("name", "text"), [("list.csv", CSV), ("list.toml", TOML)])
def test_a_list_keeps_its_order_and_its_columns_are_labels(root, name, text):
    (root / name).write_text(text)
    found = campaigns(root / name)
    assert found.names == ("hall", "robot")
    assert found.campaigns == (("hall_1/a/monday", ("one", "a")), ("hall_2/b/monday", ("two", "")))
    assert found.folder("hall_1/a/monday") == str(root / "hall_1" / "a" / "monday")
    with pytest.raises(CampaignError, match="its columns"):
        campaigns(root / name, ["hall"])
    (root / name).write_text('[[campaigns]]\ncampaign = "a"\n' if name.endswith("toml") else "campaign\na\n")
    assert campaigns(root / name).campaigns == (("a", ()),)


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("list.csv", "campain,hall\na,one\n", r"no column 'campaign'.*did you mean 'campain'"),
        ("list.csv", "campaign,effect\na,one\n", r"column 'effect'.*another name"),
        ("list.csv", "campaign,hall\na,one\nb,two\n./a,three\n", r"row 4, column 'campaign'.*stands in row 2"),
        ("list.csv", "campaign,hall\na,one\n,two\n", r"row 3, column 'campaign': no campaign is named"),
        ("list.toml", "[[campaigns]]\ncampaign = 3\n", r"campaigns\[0\].campaign"),
        ("list.toml", "[[campaigns]]\ncampaign = 'a'\n' ' = 'b'\n", "a label has no name"),
        ("list.toml", "[[campaigns]\n", r"row 1: not valid TOML"),
        ("list.toml", "[[campaign]]\n", r"found campaign, expected \[\[campaigns\]\]"),
        ("list.toml", "campaigns = []\n", "lists no campaign"),
        ("list.toml", "campaigns = [3]\n", "no list of campaigns"),
        ("list.toml", "", "found nothing"),
        ("list.txt", "campaign\na\n", r"no list of campaigns.*\.csv or \.toml"),
        ("campaign.toml", "", "no list of campaigns"),
    ],
)
def test_a_list_that_is_none_says_where(tmp_path, name, text, said):
    (tmp_path / name).write_text(text)
    with pytest.raises(CampaignError, match=said):
        campaigns(tmp_path / name)


@pytest.mark.parametrize(
    ("below", "labels", "said"),
    [
        ("nowhere", [], "no such folder or list"),
        ("notes", [], r"no campaign\.toml lies below"),
        ("", ["a", "b", "c", "d"], "fewer levels"),
        ("", ["hall", "hall"], "stands twice"),
    ],
)
def test_what_is_not_there_or_empty_says_so(root, below, labels, said):
    with pytest.raises(CampaignError, match=said):
        campaigns(root / below, labels)
