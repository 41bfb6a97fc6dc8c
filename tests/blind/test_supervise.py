"""Examinees are asked, replaced where they do not answer, and ended."""

import os
import sys
import time
from pathlib import Path

import pytest
from blind_fakes import alive, put_examinee

from thermal_robot.blind import supervise
from thermal_robot.blind.supervise import examine


@pytest.fixture
def trial(monkeypatch, tmp_path):
    """Replace the examinee; return the trial's directory."""
    return put_examinee(monkeypatch, tmp_path)


def asked(trial, *todo):
    """Write a campaign for each thing to do; return the requests."""
    requests = {}
    for k, do in enumerate(todo):
        folder = trial / "campaigns" / f"c{k}"
        folder.mkdir(parents=True)
        (folder / "campaign.toml").write_text(do)
        requests[f"c{k}"] = {"folder": str(folder), "without": [], "only": []}
    return requests


def told(trial):
    """Return which folders were asked about, and by which process."""
    return [line.split() for line in (trial / "asked.txt").read_text().splitlines()]


def test_every_request_is_answered_once_by_no_more_examinees_than_workers(trial):
    requests = asked(trial, "", "", "", "")
    replies = list(examine(requests, trial, workers=2, timeout=30.0))
    assert sorted(name for name, _ in replies) == ["c0", "c1", "c2", "c3"]
    for name, reply in replies:
        assert reply["said"] == {"was": requests[name]}
        assert reply["error"] is None
    assert sorted(name for name, _ in told(trial)) == sorted(requests)
    processes = {pid for _, pid in told(trial)}
    assert 1 <= len(processes) <= 2
    assert not [pid for pid in processes if alive(int(pid))]


@pytest.mark.parametrize(
    ("do", "why"),
    [
        ("crash", "the process ended with status 7: out of luck"),
        ("hang", "no answer within 1 s"),
        ("babble", "its reply cannot be read: 'not JSON"),
    ],
)
def test_who_gives_no_answer_is_replaced_and_the_next_is_asked(trial, do, why):
    replies = dict(examine(asked(trial, do, ""), trial, workers=1, timeout=1.0))
    assert replies["c0"]["error"].startswith(f"the diagnosis failed: {why}")
    assert {name: value for name, value in replies["c0"].items() if name != "error"} == {
        "said": None, "predicted": None, "refitted": {}, "seconds": None,
    }  # fmt: skip
    assert replies["c1"]["error"] is None
    first, second = (pid for _, pid in told(trial))
    assert first != second


def test_who_stops_asking_ends_all_examinees(trial):
    replies = examine(asked(trial, "", "hang", "hang", ""), trial, workers=3, timeout=100.0)
    start = time.perf_counter()
    next(replies)
    replies.close()
    assert time.perf_counter() - start < 20.0
    assert not [pid for _, pid in told(trial) if alive(int(pid))]


def test_who_stops_asking_has_nobody_else_started(trial, monkeypatch):
    started = []
    command = supervise.command
    monkeypatch.setattr(supervise, "command", lambda directory: started.append(directory) or command(directory))
    replies = examine(asked(trial, "", "hang", "hang", "hang"), trial, workers=1, timeout=100.0)
    next(replies)
    replies.close()
    assert len(started) == 1
    assert {name for name, _ in told(trial)} <= {"c0", "c1"}


def test_an_examinee_that_does_not_start_is_the_fault_of_no_campaign(trial, monkeypatch):
    monkeypatch.setattr(supervise, "command", lambda _: [sys.executable, "-c", "raise SystemExit('no such library')"])
    with pytest.raises(RuntimeError, match="does not start: the process ended with status 1: no such library"):
        list(examine(asked(trial, ""), trial, workers=1, timeout=1.0))


def test_ending_an_examinee_twice_does_no_harm(trial):
    examinee = supervise.Examinee(trial.parent)
    examinee.start()
    examinee.end()
    examinee.end()
    with pytest.raises(supervise.Lost, match="the process ended with status"):
        examinee.ask({}, 1.0)
    examinee.close()
    examinee.close()


def test_an_examinee_is_given_no_more_of_the_environment_than_it_needs(monkeypatch):
    monkeypatch.setenv("ANSWERS", "backlash")
    assert set(supervise.environment()) <= {
        "PATH", "HOME", "LD_LIBRARY_PATH", "PYTHONPATH", "PYTHONSAFEPATH", "OMP_NUM_THREADS"
    }  # fmt: skip


def test_a_checkout_is_found_and_an_installed_package_does_not_stand_before_pythons_own(monkeypatch, tmp_path):
    monkeypatch.setenv("PYTHONPATH", "elsewhere")
    root = Path(supervise.__file__).parents[2]
    own = [] if root.name in ("site-packages", "dist-packages") else [str(root)]
    assert supervise.environment()["PYTHONPATH"].split(os.pathsep) == [*own, "elsewhere"]
    installed = tmp_path / "site-packages" / "thermal_robot" / "blind" / "supervise.py"
    monkeypatch.setattr(supervise, "__file__", str(installed))
    assert supervise.environment()["PYTHONPATH"] == "elsewhere"
    assert supervise.command(tmp_path)[1:] == ["-m", "thermal_robot.blind.examinee", str(tmp_path.resolve())]
