"""YAML of plain values alone."""

import sys

import pytest

from thermal_robot.campaign.document import is_yaml, read_yaml
from thermal_robot.errors import CampaignError


def test_yaml(tmp_path):
    file = tmp_path / "a.YML"
    file.write_text("a: [1, 2.5, x]\n---\n---\n- b\n")
    assert is_yaml(file)
    assert read_yaml(file) == [{"a": [1, 2.5, "x"]}, ["b"]]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"a: \xff\xfe", "is not UTF-8 text"),
        (b"a: !!python/object:os.system {}", "not valid YAML"),
        (b"a: [\n", "row 2: not valid YAML"),
    ],
)
def test_what_is_no_yaml(tmp_path, content, words):
    (tmp_path / "a.yaml").write_bytes(content)
    with pytest.raises(CampaignError, match=words):
        read_yaml(tmp_path / "a.yaml")


def test_what_is_not_there(tmp_path, monkeypatch):
    with pytest.raises(CampaignError, match="there is no such file"):
        read_yaml(tmp_path / "a.yaml")
    with pytest.raises(CampaignError, match="is a directory"):
        read_yaml(tmp_path)
    monkeypatch.setitem(sys.modules, "yaml", None)
    with pytest.raises(
        CampaignError, match=r'need PyYAML, which is not installed, expected pip install "thermal-robot'
    ):
        read_yaml(tmp_path / "a.yaml")
