"""The program says of known campaigns what the files beside this test hold."""

import os

import pytest
from golden.record import ELSEWHERE, REAL, campaign, diagnosed, differences, golden, names, unchanged

from thermal_robot.report.words import MOST_WORDS

QUICK = ("demo", "open_cases/case_000", "open_cases/case_007", "open_cases/case_016")
measured = pytest.mark.skipif(
    not os.environ.get("THERMAL_ROBOT_DATA"), reason="THERMAL_ROBOT_DATA names no folder of measured campaigns"
)


def listed(name):
    marks = [] if name in QUICK else [pytest.mark.slow]
    return pytest.param(name, marks=marks if name == "demo" else [*marks, measured])


@pytest.mark.parametrize("name", [listed(name) for name in names() if name not in REAL])
def test_the_same_is_said_as_before_and_the_headline_is_short(name):
    unchanged(name)
    assert len(diagnosed(name).summary.split()) <= MOST_WORDS


def test_every_campaign_has_its_file_and_every_file_its_campaign():
    held = {golden(name).name for name in names()}
    assert held == {file.name for file in golden("demo").parent.glob("*.json")}
    assert set(QUICK) < set(names())


def test_the_demo_is_no_measured_campaign(monkeypatch):
    monkeypatch.delenv("THERMAL_ROBOT_DATA", raising=False)
    assert (campaign("demo") / "campaign.toml").exists()
    with pytest.raises(KeyError):
        campaign("ur5_jacobi")


@pytest.mark.parametrize(
    ("old", "new", "said_of_it"),
    [
        ({"a": 1.0}, {"a": 1.0 + 1e-8}, []),
        ({"a": 1.0}, {"a": 1.0 + 1e-5}, ["/a: 1.0 became 1.00001"]),
        ({"a": {"b": [1, 2]}}, {"a": {"b": [1, 3]}}, ["/a/b[1]: 2 became 3"]),
        ({"a": [1]}, {"a": [1, 2]}, ["/a: [1] became [1, 2]"]),
        ({"a": "found"}, {"a": "not_found"}, ["/a: 'found' became 'not_found'"]),
        ({"a": 1e-13}, {}, []),
        ({}, {"a": 1e-3}, ["/a: 0.0 became 0.001"]),
        ({"a": float("nan")}, {"a": 1.0}, ["/a: nan became 1.0"]),
        ({"probability": 1.80763633126e-06}, {"probability": 1.80762545937e-06}, []),
        ({"probability": 1e-6}, {"probability": 3e-6}, ["/probability: 1e-06 became 3e-06"]),
    ],
)
def test_a_difference_is_one_line(old, new, said_of_it):
    assert differences(old, new, ELSEWHERE) == said_of_it
