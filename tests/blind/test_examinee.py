"""The one who is examined: what it answers of one campaign and of several, what it may read."""

import json
import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from blind_fakes import case, rms, simulated
from blind_records import change, compared, fleet, series
from simulate import simulate as campaign_of

from thermal_robot import diagnose, load_robot, simulate, write_campaign
from thermal_robot.blind import supervise
from thermal_robot.blind.cases import LISTED
from thermal_robot.blind.examinee import Fence, answer, refitted
from thermal_robot.blind.judged import marks
from thermal_robot.blind.score import shares
from thermal_robot.correction import CorrectedModel
from thermal_robot.inference.registration import register
from thermal_robot.observations import observe


@pytest.fixture(scope="module")
def directory(tmp_path_factory):
    """A trial's directory with two campaigns, and answers that are none of the examinee's business."""
    found = tmp_path_factory.mktemp("trial")
    for seed, name in enumerate(("c1", "c2")):
        (found / "campaigns" / name).mkdir(parents=True)
        simulated(case(name, "thermal_elongation", seed=seed), found / "campaigns" / name)
    for name in ("answers.sealed", "opened.json", "trial.json"):
        (found / name).write_text("{}")
    return found


def request(folder, **more):
    return {"folder": str(folder), "without": [], "only": ["thermal_elongation"], **more}


def test_the_answer_holds_the_diagnosis_and_where_its_model_has_the_fresh_samples(directory):
    folder = directory / "campaigns" / "c1"
    reply = answer(request(folder))
    assert reply["error"] is None
    assert reply["said"]["verdict"]["effects"] == ["thermal_elongation"]
    assert reply["seconds"] > 0.0
    model = CorrectedModel.load(folder / "model.json")
    position, _ = model.prediction(model.samples(folder / "fresh.csv"))[:2]
    np.testing.assert_allclose(reply["predicted"], position, atol=1e-9)  # to a nanometre
    # frames alone, and with the one effect that is in the model
    assert set(reply["refitted"]) == {"", "thermal_elongation"}
    np.testing.assert_allclose(reply["refitted"]["thermal_elongation"], position, atol=1e-5)
    assert json.loads(json.dumps(reply, allow_nan=False)) == reply


def test_whatever_goes_wrong_becomes_the_error_of_the_reply(directory, tmp_path):
    reply = answer(request(tmp_path, asks="wear"))
    assert reply["error"].startswith("the wear failed: CampaignError: ")
    reply = answer(request(directory / "campaigns" / "absent"))
    assert reply["error"].startswith("the diagnosis failed: CampaignError: ")
    assert reply["said"] is reply["predicted"] is reply["seconds"] is None
    for file in (directory / "campaigns" / "c1").iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    (tmp_path / "fresh.csv").write_text("no,such,columns\n1,2,3\n")
    reply = answer(request(tmp_path))
    assert reply["error"].startswith("the prediction failed: ")
    assert reply["said"] is not None
    assert reply["predicted"] is None
    (tmp_path / "fresh.csv").unlink()
    assert (answer(request(tmp_path))["predicted"], answer(request(tmp_path))["error"]) == (None, None)


def test_the_fence_lets_through_the_folder_in_question_and_all_that_is_no_trials(directory, tmp_path):
    fence = Fence(directory)
    inside = directory / "campaigns" / "c1" / "campaign.toml"
    with pytest.raises(PermissionError, match="no business"):
        fence("open", (str(inside), "r", 0))
    fence.allow(directory / "campaigns" / "c1")
    fence("open", (str(inside), "r", 0))
    fence("open", (os.fsencode(inside), "r", 0))
    fence("open", (3, "r", 0))  # a file that is open already
    fence("open", (str(tmp_path / "elsewhere"), "r", 0))
    fence("os.listdir", (str(directory / "campaigns" / "c1"),))
    fence("os.mkdir", (str(directory),))  # not what it watches
    for event, path in (
        ("open", directory / "answers.sealed"),
        ("open", str(directory) + "/campaigns/c1/../../opened.json"),
        ("open", directory / "campaigns" / "c11" / "campaign.toml"),
        ("os.scandir", str(directory)),
        ("os.listdir", str(directory / "campaigns" / "c2")),
    ):
        with pytest.raises(PermissionError, match="no business"):
            fence(event, (path, "r", 0))


EXAMINED = """
import json, os, sys
from pathlib import Path
from thermal_robot.blind import examinee
from thermal_robot.diagnosis import diagnose

def noisy(*arguments, **options):
    print("a library greets")
    os.write(1, b"and so does its C code\\n")
    return diagnose(*arguments, **options)

examinee.diagnose = noisy
trial = Path(sys.argv[1])
examinee.main([str(trial)])
found = {"loaded": [m for m in sys.modules if m.startswith(("mujoco", "thermal_robot.blind.reality"))], "opened": []}
inside = trial / "campaigns" / "c2"
for name in ("answers.sealed", "opened.json", "trial.json", "campaigns/c1/campaign.toml", "campaigns/c2/campaign.toml",
             "campaigns/c2/way_out", "campaigns/c2/../c1/campaign.toml", "campaigns/c22/robot.urdf"):
    for path in (str(trial / name), os.fsencode(trial / name), os.path.relpath(trial / name)):
        try:
            open(path).close()
            found["opened"].append(name)
        except PermissionError:
            pass
for folder in (trial, trial / "campaigns" / "c1"):
    try:
        os.listdir(folder)
        found["opened"].append(str(folder))
    except PermissionError:
        pass
print(json.dumps(found), file=sys.stderr)
"""


@pytest.mark.slow
def test_an_examinee_reads_its_own_folder_only_and_knows_no_reality(directory, tmp_path):
    (directory / "campaigns" / "c2" / "way_out").symlink_to(directory / "opened.json")
    (directory / "campaigns" / "c22").mkdir()
    (directory / "campaigns" / "c22" / "robot.urdf").write_text("")
    requests = [
        {"folder": str(directory / "campaigns" / name), "without": [], "only": ["thermal_elongation"]}
        for name in ("c1", "absent", "c2")
    ]
    done = subprocess.run(
        [sys.executable, "-c", EXAMINED, str(directory)],
        input="".join(json.dumps(request) + "\n" for request in requests),
        capture_output=True,
        text=True,
        env={**supervise.environment(), "COLUMNS": "80"},
        cwd=tmp_path,
        check=True,
        timeout=120,
    )
    ready, first, absent, second = map(json.loads, done.stdout.splitlines())
    assert ready == {"ready": True}
    assert first["said"]["verdict"]["effects"] == second["said"]["verdict"]["effects"] == ["thermal_elongation"]
    assert first["error"] is second["error"] is None
    assert absent["said"] is None
    assert absent["error"].startswith("the diagnosis failed: CampaignError: ")
    found = json.loads(done.stderr.splitlines()[-1])
    assert found == {"loaded": [], "opened": ["campaigns/c2/campaign.toml"] * 3}


# ---- several campaigns

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


@pytest.mark.slow
def test_a_series_tells_the_day(tmp_path):
    days = [f"2026-0{month}-01" for month in range(1, 6)]
    made(tmp_path, [BEFORE] * 3 + [AFTER] * 2, date=days)
    said = asked(tmp_path, "wear")
    assert [c["date"] for c in said["campaigns"]] == days
    answers = marks({**series("series", [], change("joint_offset", "joint_3", "jumps", 2, amount=1e-3)), "said": said})
    assert answers["exact"] == answers["day"] == answers["amount"] == (True,)


@pytest.mark.slow
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


# ---- every subset of a model fitted alone

NOISE = 25e-6


@pytest.fixture(scope="module")
def model():
    robot = load_robot("builtin:rv_m2", "tool0")
    asked = ("drift", "joint_gain")
    campaign, _, (samples, position) = campaign_of(robot, asked, seed=4, samples=80, fresh=200)
    found = diagnose(campaign, only=asked)
    assert set(found.verdict) == set(asked)
    return found, campaign, samples, position, refitted(found, campaign, samples)


def test_without_effects_the_frames_are_those_of_least_squares(model):
    """No rigid alignment leaves less of the rows that were given, the robust one of the program neither."""
    found, campaign, _, _, _ = model
    alone = refitted(found, campaign, campaign)[""]
    robust = observe(campaign, register(campaign)).predicted_position
    assert rms(alone, campaign.position) < (1.0 + 1e-4) * rms(robust, campaign.position)
    assert rms(alone, campaign.position) > 0.8 * rms(robust, campaign.position)


def test_every_subset_is_there_more_effects_err_less_and_all_predict_what_the_model_does(model):
    found, campaign, samples, position, predicted = model
    names = "+".join(effect.name for effect, _ in found.model.effects)
    assert rms(predicted[names], found.model.prediction(samples)[0]) < 0.3 * NOISE
    assert refitted(replace(found, model=replace(found.model, effects=())), campaign, samples) == {}
    assert sorted(map(len, (name.split("+") for name in predicted if name))) == [1, 1, 2]
    left = {name: rms(rows, position) for name, rows in predicted.items()}
    both = max(left, key=len)
    assert all(left[""] > left[name] > left[both] for name in left if name not in ("", both))
    parts = shares(predicted, position, NOISE)
    whole = (left[""] ** 2 - left[both] ** 2) / (left[""] ** 2 + 3 * NOISE**2)
    assert sum(parts.values()) == pytest.approx(whole)


@pytest.mark.slow
def test_known_frames_are_not_fitted(model):
    """Without effects and without unknown frames nothing is fitted: the nominal robot predicts."""
    _, campaign, samples, _, _ = model
    frames = register(campaign)
    inside = (campaign.position - frames.base[:3, 3]) @ frames.base[:3, :3]
    declared = {"base_known": True, "tool_known": True, "target": frames.tool[:3, 3]}
    known = replace(campaign, position=inside, **declared)
    asked = replace(samples, **declared)
    found = diagnose(known, only=("drift", "joint_gain"))
    assert found.model.effects
    predicted = refitted(found, known, asked)[""]
    np.testing.assert_allclose(predicted, observe(asked).predicted_position, atol=1e-12)
