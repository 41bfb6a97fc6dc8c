"""Makers of campaigns for the tests of the blind trial: the true one needs MuJoCo, and takes its time."""

from __future__ import annotations

import os
import sys
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from simulate import simulate

from thermal_robot.blind import supervise
from thermal_robot.blind.cases import Case, RobotChoice
from thermal_robot.campaign.write import write_campaign, write_table
from thermal_robot.errors import CampaignError
from thermal_robot.robot import load_robot

RV_M2 = RobotChoice("rv_m2", "builtin:rv_m2", "tool0")


def case(name, *effects, seed=0, **more):
    return Case(name, seed, "single", RV_M2, effects, **more)


def simulated(case, folder):
    """Write a campaign of the program's own model."""
    robot = load_robot(case.robot.urdf, case.robot.tool_frame)
    campaign, truth, fresh = simulate(robot, case.effects, seed=case.seed, samples=80, fresh=12)
    write_campaign(campaign, folder)
    answers = {"truth": {"effects": truth["effects"]}, "noise": 25e-6, "samples": 80, "measures": "position"}
    if case.own == "none fresh":
        return {**answers, "fresh_position": None, "fresh_before": None}
    write_table(fresh[0], folder / "fresh.csv")
    return {**answers, "fresh_position": fresh[1].tolist(), "fresh_before": (fresh[1] + [0.0, 3e-3, 4e-3]).tolist()}


def light(case, folder):
    """Write what :data:`FAKE_EXAMINEE` understands: what it is to do."""
    if case.own == "nothing can be made":
        raise CampaignError("robot.urdf", "has no joints")
    (folder / "campaign.toml").write_text(case.own)
    return {
        "truth": {"effects": list(case.effects)},
        "noise": 1e-5,
        "samples": 2,
        "measures": "position",
        "fresh_position": [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]],
        "fresh_before": [[6.0, 0.0, 8.0], [1.0, 0.0, 0.0]],
    }


FAKE_EXAMINEE = """
import json, os, sys, time
print(json.dumps({"ready": True}), flush=True)
for line in sys.stdin:
    request = json.loads(line)
    do = open(os.path.join(request["folder"], "campaign.toml")).read()
    with open(os.path.join(sys.argv[1], "asked.txt"), "a") as file:
        print(os.path.basename(request["folder"]), os.getpid(), file=file)
    if do == "crash":
        print("out of luck", file=sys.stderr)
        os._exit(7)
    if do == "hang":
        time.sleep(100)
    if do == "babble":
        print("not JSON", flush=True)
        continue
    predicted = [[3.0, 0.0, 0.0], [1.0, 4.0, 0.0]]
    reply = {"said": {"was": request}, "predicted": predicted, "refitted": {}, "seconds": 0.1, "error": None}
    print(json.dumps(reply), flush=True)
"""


@dataclass(frozen=True)
class Real:
    """A case that makes and judges itself."""

    id: str
    control: str | None = None
    kind: str = "real"

    def make(self, folder):
        return {"robot": "arm", **light(case(self.id), folder), "asked": "untouched", "fresh_position": None}

    def judge(self, record, control):
        return {**record, "right": record["said"] is not None, "answer": control and control["id"]}


def rms(a, b):
    """Root mean square of the distance, in words of its own."""
    return np.sqrt(np.mean(np.linalg.norm(np.subtract(a, b), axis=1) ** 2))


def put_examinee(monkeypatch, folder):
    """Let :data:`FAKE_EXAMINEE` be asked instead of the program; return the directory for a trial."""
    script = folder / "fake.py"
    script.write_text(FAKE_EXAMINEE)
    monkeypatch.setattr(supervise, "command", lambda directory: [sys.executable, str(script), str(directory)])
    return folder / "trial"


def alive(pid):
    """Tell whether a process still runs."""
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return Path(f"/proc/{pid}/stat").read_text().split()[2] != "Z" if Path("/proc").is_dir() else True


class AtOnce(Executor):
    """Make campaigns in this process, which saves what a new one takes to import the program."""

    def __init__(self, *_):
        pass

    def submit(self, make, /, *arguments):
        made = Future()
        try:
            made.set_result(make(*arguments))
        except Exception as error:
            made.set_exception(error)
        return made
