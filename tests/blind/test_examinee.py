"""The one who is examined: what it answers, what it may read."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest
from blind_fakes import case, simulated

from thermal_robot.blind import supervise
from thermal_robot.blind.examinee import Fence, answer
from thermal_robot.correction import CorrectedModel


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
    position, _ = model.predict(model.samples(folder / "fresh.csv"))
    np.testing.assert_allclose(reply["predicted"], position, atol=1e-9)  # to a nanometre
    # frames alone, and with the one effect that is in the model
    assert set(reply["refitted"]) == {"", "thermal_elongation"}
    np.testing.assert_allclose(reply["refitted"]["thermal_elongation"], position, atol=1e-5)
    assert json.loads(json.dumps(reply, allow_nan=False)) == reply


def test_what_the_library_does_not_have_need_not_be_taken_from_it(directory):
    reply = answer(request(directory / "campaigns" / "c1", without=["unheard_of"]))
    assert reply["error"] is None
    assert reply["said"]["verdict"]["effects"] == ["thermal_elongation"]
    reply = answer(request(directory / "campaigns" / "c1", only=["drift", "joint_gain"], without=["drift"]))
    assert "drift" not in {effect["name"] for effect in reply["said"]["effects"]}


def test_whatever_goes_wrong_becomes_the_error_of_the_reply(directory, tmp_path):
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
