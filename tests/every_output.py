"""Diagnose the demo once, then write every kind of file: under a limit, or again and again while being killed.

Run as a program: ``every_output.py FOLDER full`` or ``every_output.py FOLDER killed KILLS``. It prints JSON.
"""

import json
import os
import random
import resource
import signal
import sys
import time
from pathlib import Path

import pandas as pd

from thermal_robot import demo_campaign, diagnose
from thermal_robot.campaign import write_predictions
from thermal_robot.files import write_text
from thermal_robot.report import html

SMALL = 2000  # bytes: less than any of the files
LONGEST = 0.15  # s until a process is killed
OLD = b"old"


def writers():
    campaign = demo_campaign()
    found = diagnose(campaign, only=["thermal_elongation", "backlash"])
    page, figure = html(found, generated="then"), found.explain("backlash")
    rows = pd.DataFrame({"joint_1": campaign.q[:, 0]})
    predicted = found.model.predicted(rows, found.model.prediction(campaign))

    def table(path):
        write_predictions(path, predicted)

    return {
        "d.json": found.to_json,
        "r.html": lambda path: write_text(path, page),
        "m.json": found.model.save,
        "p.csv": table,
        "p.parquet": table,
        "f.png": figure.savefig,
    }


def full(folder, write):
    """Write each file on a disk that is full; say what was raised."""
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (SMALL, before[1]))
    raised = {}
    for name, into in write.items():
        try:
            into(folder / name)
        except Exception as error:
            raised[name] = f"{type(error).__name__}: {error}"
    resource.setrlimit(resource.RLIMIT_FSIZE, before)  # for what is printed
    return raised


def killed(folder, write, kills):
    """Kill processes that write; give what was torn, and how many were killed while they wrote each file."""
    new = {}
    for name, into in write.items():
        into(folder / name)
        new[name] = (folder / name).read_bytes()
    torn, interrupted, draw = [], dict.fromkeys(write, 0), random.Random(7)
    for kill in range(kills):
        for file in folder.iterdir():
            file.unlink()
        if kill % 2:
            for name in write:
                (folder / name).write_bytes(OLD)
        process = os.fork()
        if not process:
            names = list(write)
            while True:
                name = draw.choice(names[kill % len(names) :] or names)
                write[name](folder / name)
        time.sleep(LONGEST * random.Random(kill).random())
        os.kill(process, signal.SIGKILL)
        os.waitpid(process, 0)
        for name in write:
            there = (folder / name).read_bytes() if (folder / name).exists() else None
            if there not in ({OLD, new[name]} if kill % 2 else {None, new[name]}):
                torn.append(f"{name}, kill {kill}")
        for left in folder.glob(".thermal-robot-*"):
            for name in write:
                interrupted[name] += left.suffix == Path(name).suffix
    return {"torn": torn, "interrupted": interrupted}


if __name__ == "__main__":
    where, how, *more = sys.argv[1:]
    told = killed(Path(where), writers(), int(more[0])) if how == "killed" else full(Path(where), writers())
    print(json.dumps(told))
