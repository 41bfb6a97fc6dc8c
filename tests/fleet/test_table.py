"""The table read again: campaigns, robots, labels, findings, and one parameter of all."""

import numpy as np
import pytest
from fleet.robots import told_rows, write_told

from thermal_robot.fleet.rows import findings, overview, told


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    play, gain = ("backlash", (True, "joint_2", {"play": (1.0, 0.1), "other": (3.0, 0.2)})), ("gain", (False, "", {}))
    campaigns = [
        told_rows("a/1", {"hall": "1", "robot": "a"}, dict([play, gain])),
        told_rows("a/2", {"hall": "1", "robot": "a"}, {"backlash": (False, "", {"play": (2.0, 0.3)})}),
        told_rows("b/1", {"hall": "2", "robot": ""}, {}, outcome="failed", reason="no such file"),
        told_rows("c/1", {"hall": "2", "robot": "c"}, {"backlash": (False, "", {"other": (4.0, 0.4)})}),
    ]
    return write_told(tmp_path_factory.mktemp("table") / "t.parquet", campaigns, ("hall", "robot"))


def test_who_is_in_it(table):
    found = overview(table, ("hall", "robot"))
    assert list(found.numbers) == ["a/1", "a/2", "b/1", "c/1"]
    assert list(found.robots.values) == ["a", "b/1", "c"]
    assert found.robot_of().tolist() == [0, 0, 1, 2]
    assert list(found.labels) == ["hall", "model"]
    assert found.label_of("hall").tolist() == [0, 1, 1]
    assert found.outcomes == {"diagnosed": 3, "failed": 1}
    assert found.excused == [("b/1", "failed", "no such file")]


def test_rows_without_an_effect_are_no_findings(table):
    assert [(row["campaign"], row["effect"]) for row in findings(table)] == [
        ("a/1", "backlash"), ("a/1", "gain"), ("a/2", "backlash"), ("c/1", "backlash"),
    ]  # fmt: skip


def test_a_parameter_of_all_campaigns(table):
    numbers = overview(table, ("hall", "robot")).numbers
    play, other = told(table, "backlash", numbers)
    assert (play.parameter, play.unit, play.campaigns.tolist()) == ("play", "rad", [0, 1])
    assert (play.values.tolist(), play.deviations.tolist()) == ([1.0, 2.0], [0.1, 0.3])
    assert (other.parameter, other.campaigns.tolist(), other.values.tolist()) == ("other", [0, 3], [3.0, 4.0])
    assert list(told(table, "gain", numbers)) == []
    assert isinstance(play.values, np.ndarray)
