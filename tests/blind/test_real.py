"""Real campaigns with a condition put in or withheld; they lie in the folder that THERMAL_ROBOT_DATA names."""

import json
import os
import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from thermal_robot import diagnose
from thermal_robot.blind import real as faults
from thermal_robot.blind.real import REMAINDERS, RealCase, judged, real_cases
from thermal_robot.campaign import read_campaign, read_samples
from thermal_robot.observations import observe

DATA = os.environ.get("THERMAL_ROBOT_DATA")
pytestmark = pytest.mark.skipif(not DATA, reason="THERMAL_ROBOT_DATA names no folder of measured campaigns")
FOLDER = Path(DATA or ".")
UM = 1e-6


def case(fault, campaign="ur5_jacobi", seed=1, draw=1):
    return RealCase("r002", seed, draw, FOLDER, campaign, fault, "r001")


def made(folder, fault, campaign="ur5_jacobi", draw=1):
    answers = case(fault, campaign, draw=draw).make(folder)
    return read_campaign(folder), answers


@pytest.fixture(scope="module")
def control(tmp_path_factory):
    """The same rows, untouched."""
    return {name: made(tmp_path_factory.mktemp(name), "nothing", name) for name in ("ur5_jacobi", "ipa_ur10_b")}


def test_the_seed_settles_which_cases():
    cases = real_cases(FOLDER, 1)
    assert cases == real_cases(FOLDER, 1) == pickle.loads(pickle.dumps(cases))
    assert [c.fault for c in cases] != [c.fault for c in real_cases(FOLDER, 2)]
    assert len(cases) == len({c.id for c in cases}) == 17
    assert {c.fault for c in cases} == {
        "nothing",
        "offset",
        "scale",
        "backlash",
        "slip",
        "temperature",
        "hidden",
        "later",
    }
    assert {c.campaign for c in cases} == set(REMAINDERS)
    assert {c.kind for c in cases} == {"real"}


def test_each_case_comes_after_its_control():
    for count in (1, 2, 5, None):
        cases = real_cases(FOLDER, 3, count)
        assert count is None or len(cases) <= count
        before = {}
        for c in cases:
            if c.control is None:
                assert c.fault == "nothing"
            else:
                assert before[c.control].fault == "nothing"
                assert before[c.control].campaign == c.campaign
            before[c.id] = c


def test_campaigns_that_are_missing_are_left_out(tmp_path):
    assert real_cases(tmp_path, 1) == ()
    (tmp_path / "wam_jacobi").symlink_to(FOLDER / "wam_jacobi")
    assert {c.campaign for c in real_cases(tmp_path, 1)} == {"wam_jacobi"}


def test_the_same_case_is_made_alike_and_stands_alone(tmp_path):
    texts = []
    for name in ("one", "two"):
        answers = case("backlash").make(tmp_path / name)
        files = sorted((tmp_path / name).iterdir())
        assert [f.name for f in files] == ["campaign.toml", "fresh.csv", "measurements.csv", "robot.urdf"]
        texts.append([f.read_text() for f in files] + [json.dumps(answers)])
    assert texts[0] == texts[1]
    assert not any("ur5_jacobi" in text for text in texts[0][:-1])


def test_control_is_a_part_of_the_measured_rows(control):
    for name, (campaign, answers) in control.items():
        whole = read_campaign(FOLDER / name)
        row_of = {tuple(p): k for k, p in enumerate(np.round(np.asarray(whole.position) / UM).tolist())}
        rows = [row_of[tuple(p)] for p in np.round(np.asarray(campaign.position) / UM).tolist()]
        np.testing.assert_allclose(campaign.q, whole.q[rows], atol=1e-14)
        assert 400 <= campaign.samples == answers["samples"]
        # nothing that was kept for the prediction was given
        fresh = {tuple(p) for p in np.round(np.array(answers["fresh_position"]) / UM).tolist()}
        assert len(fresh) > 100
        assert not fresh & {tuple(p) for p in np.round(np.asarray(campaign.position) / UM).tolist()}
        # nominal robot, frames alone: what the READMEs call registration only
        miss = np.array(answers["fresh_before"]) - np.array(answers["fresh_position"])
        assert 0.5e-3 < np.sqrt((miss**2).sum(axis=1).mean()) < 1.3e-3


def test_an_offset_is_in_the_commands_of_one_joint(tmp_path, control):
    campaign, answers = made(tmp_path, "offset")
    part = answers["truth"]["parts"]["joint_offset"]
    joint = campaign.robot.joint_names.index(part["places"][0]["name"])
    shift = campaign.q - control["ur5_jacobi"][0].q
    np.testing.assert_allclose(shift[:, joint], -part["size"], atol=1e-12)
    assert np.abs(np.delete(shift, joint, axis=1)).max() < 1e-14
    fresh = read_samples(tmp_path / "fresh.csv", campaign)
    assert fresh.position is None
    assert fresh.samples == len(answers["fresh_position"])
    # after the best frames it leaves what it should
    seen = observe(control["ur5_jacobi"][0], faults.registered(control["ur5_jacobi"][0]))
    left = faults.leaves(seen, seen.joint_sensitivity[:, :3, joint] * part["size"])
    assert left == pytest.approx(part["ratio"] * REMAINDERS["ur5_jacobi"], rel=0.1)


def test_a_scale_is_in_the_positions(tmp_path, control):
    campaign, answers = made(tmp_path, "scale", "ipa_ur10_b")
    true = control["ipa_ur10_b"][0]
    factor = 1.0 + answers["truth"]["parts"]["instrument_scale"]["size"]
    np.testing.assert_allclose(campaign.position, factor * np.asarray(true.position), rtol=1e-12)
    np.testing.assert_allclose(campaign.orientation, true.orientation, atol=1e-15)
    fresh = np.array(control["ipa_ur10_b"][1]["fresh_position"])
    np.testing.assert_allclose(answers["fresh_position"], factor * fresh, rtol=1e-12)


def test_lost_motion_is_in_the_commands(tmp_path, control):
    campaign, answers = made(tmp_path, "backlash")
    part = answers["truth"]["parts"]["backlash"]
    name = part["places"][0]["name"]
    joint = campaign.robot.joint_names.index(name)
    side = campaign.covariates[f"approach.{name}"]
    assert set(side) >= {-1.0, 1.0}
    shift = campaign.q - control["ur5_jacobi"][0].q
    np.testing.assert_allclose(shift[:, joint], 0.5 * part["size"] * side, atol=1e-12)
    assert part["size"] > 0


def test_a_slip_starts_once_and_stays(tmp_path):
    campaign, answers = made(tmp_path, "slip")
    part, truth = answers["truth"]["parts"]["slip"], answers["truth"]
    joint = campaign.robot.joint_names.index(truth["places"][0]["name"])
    whole = read_campaign(FOLDER / "ur5_jacobi")
    shift = campaign.q - whole.q[campaign.covariates["order"].astype(int)]
    start = int(np.argmax(np.abs(shift[:, joint]) > 1e-9))
    assert 0.3 < start / campaign.samples < 0.7
    np.testing.assert_allclose(shift[start:, joint], -part["size"], atol=1e-12)
    assert np.abs(shift[:start]).max() < 1e-12
    # what the frames leave of it is to be seen beside what a full geometry leaves
    seen = observe(campaign, faults.registered(campaign))
    slipped = np.arange(campaign.samples) >= start
    left = faults.leaves(seen, seen.joint_sensitivity[:, :3, joint] * (part["size"] * slipped)[:, None])
    assert left == pytest.approx(part["ratio"] * REMAINDERS["ur5_jacobi"], rel=0.1)
    assert left > REMAINDERS["ur5_jacobi"]
    assert answers["fresh_position"] is None
    assert not (tmp_path / "fresh.csv").exists()


@pytest.mark.parametrize("campaign", ["ur5_jacobi", "ipa_ur10_a"])
def test_a_hidden_temperature_is_in_the_positions_only(tmp_path, campaign):
    told, _ = made(tmp_path / "told", "temperature", campaign)
    hidden, answers = made(tmp_path / "hidden", "hidden", campaign)
    assert np.ptp(told.covariates["temperature"]) >= 9.0
    assert not any("temperature" in name for name in hidden.covariates)
    assert answers["hidden"] == answers["truth"]["needs"] == ["temperature"]
    place = dict(zip(map(tuple, hidden.q.tolist()), np.asarray(hidden.position), strict=True))
    same = np.array([place[tuple(q)] for q in told.q.tolist()])
    np.testing.assert_allclose(told.position, same, atol=1e-12)


def test_a_failure_is_no_right_answer():
    record = {"said": None, "truth": SLIP, "error": "the diagnosis failed: no reason"}
    judged_record = case("slip").judge(record, None)
    assert judged_record["right"] is False
    assert judged_record["answer"] == "the diagnosis failed: no reason"


ELBOW = {"kind": "joint", "name": "elbow_joint"}

SLIP = {"places": [ELBOW], "quantities": ["time", "order"]}


def with_lost_motion(campaign):
    campaign = faults.with_approaches(campaign)
    side = campaign.covariates["approach.elbow_joint"]
    return faults.with_joint_error(campaign, 2, -0.5 * 1e-3 * side)


BESIDE = ["geometric", "transmission_error", "backlash", "drift"]
"""Effects that are looked for: all would take minutes, and the trial itself does look for all."""

LOST = {"parts": {"backlash": {"places": [ELBOW], "size": 1e-3}}}


@pytest.mark.slow
def test_lost_motion_among_a_hundred_rows_of_a_real_arm_is_named_and_measured(ur5):
    campaign = with_lost_motion(ur5.take(np.arange(100)))
    found = diagnose(campaign, only=["geometric", "backlash"]).to_dict()
    answer = judged("backlash", {"said": found, "truth": LOST}, None, 1e-4)
    assert answer[0], answer[1]


@pytest.mark.slow
def test_lost_motion_of_a_real_arm_is_named_and_measured(ur5):
    found = diagnose(with_lost_motion(ur5), only=BESIDE).to_dict()
    answer = judged("backlash", {"said": found, "truth": LOST}, None, 1e-4)
    assert answer[0], answer[1]
    # without anything put in there is none at that joint
    alone = diagnose(faults.with_approaches(ur5), only=BESIDE).to_dict()
    assert not judged("backlash", {"said": alone, "truth": LOST}, None, 1e-4)[0]


@pytest.mark.slow
def test_a_slip_of_a_real_arm_is_placed(ur5):
    step = 1e-3 * (np.arange(300) >= 140)
    campaign = replace(faults.with_joint_error(ur5, 2, step), name="slip")
    answer = judged("slip", {"said": diagnose(campaign, only=BESIDE).to_dict(), "truth": SLIP}, None, 1e-4)
    assert answer[0], answer[1]
    assert not judged("slip", {"said": diagnose(ur5, only=BESIDE).to_dict(), "truth": SLIP}, None, 1e-4)[0]
