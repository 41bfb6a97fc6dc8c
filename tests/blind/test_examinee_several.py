"""Several campaigns examined: what a comparison, a series and a fleet say of robots whose change is known."""

import json

import pytest
from blind_records import change, compared, fleet, series

from thermal_robot import load_robot, simulate, write_campaign
from thermal_robot.blind.cases import LISTED
from thermal_robot.blind.examinee import Fence, answer
from thermal_robot.blind.judged import marks

ONLY = ["joint_offset", "joint_gain"]
BEFORE = {"joint_offset": {"joint_2": 1e-3}}
AFTER = {"joint_offset": {"joint_2": 1e-3, "joint_3": 1e-3}}


def made(folder, effects, **labels):
    """Write a campaign for each robot or day, and the list."""
    robot = load_robot("builtin:rv_m2", "tool0")
    lines = [",".join(["campaign", *labels])]
    for k, own in enumerate(effects):
        name = f"{k + 1:02d}"
        campaign = simulate(robot, own, rows=40, noise=2e-5, seed=k, base_known=True, tool_known=True)
        write_campaign(campaign, folder / name)
        lines.append(",".join([name, *(values[k] for values in labels.values())]))
    (folder / LISTED).write_text("\n".join(lines) + "\n")


def asked(folder, asks):
    """The reply, which a process could send."""
    reply = answer({"folder": str(folder), "without": [], "only": ONLY, "asks": asks})
    assert reply["error"] is None
    assert (reply["predicted"], reply["refitted"]) == (None, {})
    assert reply["seconds"] > 0.0
    return json.loads(json.dumps(reply, allow_nan=False))["said"]


def test_a_comparison_tells_what_changed(tmp_path):
    made(tmp_path, [BEFORE, AFTER])
    said = asked(tmp_path, "comparison")
    assert [c["name"] for c in said["campaigns"]] == ["01", "02"]
    record = compared("changed", [], change("joint_offset", "joint_3", "changes", 0))
    assert marks({**record, "said": said})["exact"] == (True,)


def test_a_series_tells_the_day(tmp_path):
    days = [f"2026-0{month}-01" for month in range(1, 6)]
    made(tmp_path, [BEFORE] * 3 + [AFTER] * 2, date=days)
    said = asked(tmp_path, "wear")
    assert [c["date"] for c in said["campaigns"]] == days
    answers = marks({**series("series", [], change("joint_offset", "joint_3", "jumps", 2, amount=1e-3)), "said": said})
    assert answers["exact"] == answers["day"] == answers["amount"] == (True,)


def test_a_fleet_tells_what_is_shared_and_who_stands_out(tmp_path):
    pytest.importorskip("pyarrow", reason='fleets need "thermal-robot[fleet]"')
    sizes = (1.0e-3, 1.1e-3, 0.9e-3, 1.05e-3, 0.95e-3, 1.0e-3)
    robots, effects = [f"r{k}" for k in range(6)], [{"joint_offset": {"joint_2": size}} for size in sizes]
    effects[4]["joint_gain"] = {"joint_3": 2e-3}
    made(tmp_path, effects, robot=robots, hall=["a", "b"] * 3)
    said = asked(tmp_path, "fleet")
    assert (said["campaigns"], said["robots"], said["outcomes"]) == (6, 6, {"diagnosed": 6})
    names = ("effect", "parameter", "place")
    true = dict(zip(names, ("joint_offset", "zero offset, joint_2", {"name": "joint_2"}), strict=True))
    own = dict(zip(names, ("joint_gain", "gain error, joint_3", {"name": "joint_3"}), strict=True))
    answers = marks({**fleet([{**true, "group": None}], [{**own, "robot": "r4"}], []), "said": said})
    assert {question: all(given) for question, given in answers.items()} == {
        "exact": True, "shared_found": True, "false_alarm": False, "own_kept": True, "own_named": True,
    }  # fmt: skip


def test_whatever_goes_wrong_becomes_the_error_of_the_reply(tmp_path):
    reply = answer({"folder": str(tmp_path), "without": [], "only": [], "asks": "wear"})
    assert reply["error"].startswith("the wear failed: CampaignError: ")
    assert reply["said"] is reply["seconds"] is None


def test_all_that_is_read_and_written_stays_within_the_fence(tmp_path):
    """What the audit hook would refuse of another case, it does not refuse of this one's parts."""
    fence = Fence(tmp_path)
    fence.allow(tmp_path / "campaigns" / "s1")
    fence("open", (str(tmp_path / "campaigns" / "s1" / "02" / "campaign.toml"), "r", 0))
    with pytest.raises(PermissionError):
        fence("open", (str(tmp_path / "campaigns" / "s2" / "02" / "campaign.toml"), "r", 0))
