"""What is done is on disk at once, is told by content, and belongs to one run at a time."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from fleet.robots import write_robot

from thermal_robot.errors import CampaignError
from thermal_robot.fleet.many import _fingerprint, _opened

ROWS = [{"outcome": "diagnosed", "rms_before": 0.1 + 0.2, "summary": "µm – \ud800"}, {"effect": "drift"}]


def test_what_was_put_is_there_in_the_next_run_in_the_order_of_its_list(tmp_path):
    with _opened(tmp_path / "done") as done:
        done.put("a", ROWS)
        done.put("b", [{"effect": "backlash"}])
    with _opened(tmp_path / "done") as done:
        assert "a" in done
        assert "c" not in done
        for number, key in enumerate("bab"):
            done.name(number, key)
        assert list(done.in_order()) == [(0, [{"effect": "backlash"}]), (1, ROWS), (2, [{"effect": "backlash"}])]


def test_what_may_be_otherwise_next_time_is_forgotten(tmp_path):
    with _opened(tmp_path / "done") as done:
        done.put("a", ROWS, again=True)
        done.name(0, "a")
        assert list(done.in_order()) == [(0, ROWS)]
    with _opened(tmp_path / "done") as done:
        assert "a" not in done
        assert list(done.in_order()) == []


def test_two_runs_in_one_folder_are_one_too_many(tmp_path):
    with _opened(tmp_path / "done"), pytest.raises(CampaignError, match="no other run"), _opened(tmp_path / "done"):
        pass


def test_a_file_of_another_kind_is_left_alone(tmp_path):
    (tmp_path / "done").write_text("a diary, which is longer than the header of a database would be" * 20)
    with pytest.raises(CampaignError, match="is not what a fleet has written"), _opened(tmp_path / "done"):
        pass
    assert (tmp_path / "done").read_text().startswith("a diary")


KILLED = """
import os, signal, sys, time
from pathlib import Path
from thermal_robot.fleet import many as done
from thermal_robot.fleet import settings
settings.WRITTEN_EVERY = 0.0
with done._opened(Path(sys.argv[1])) as known:
    for k in range(5):
        known.put(str(k), [{"effect": str(k)}])
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_process_that_is_killed_leaves_what_it_had_put(tmp_path):
    root = Path(__file__).parents[2]
    run = [sys.executable, "-c", KILLED, str(tmp_path / "done")]
    ended = subprocess.run(run, env={**os.environ, "PYTHONPATH": str(root)}, check=False)
    assert ended.returncode == -signal.SIGKILL
    with _opened(tmp_path / "done") as done:
        assert all(str(k) in done for k in range(5))


def test_a_fingerprint_follows_content_and_options_and_nothing_else(rv_m2, tmp_path):
    folder = write_robot(rv_m2, tmp_path / "a")
    known = _fingerprint(str(folder), [["drift"], []])
    assert _fingerprint(str(folder / "campaign.toml"), [["drift"], []]) == known
    assert _fingerprint(str(folder), [[], ["drift"]]) != known
    moved = tmp_path / "elsewhere"
    moved.mkdir()
    folder.rename(moved / "a")
    os.utime(moved / "a" / "measurements.csv", (1e9, 1e9))
    assert _fingerprint(str(moved / "a"), [["drift"], []]) == known
    for file in ("campaign.toml", "measurements.csv", "robot.urdf"):
        before = (moved / "a" / file).read_bytes()
        (moved / "a" / file).write_bytes(before + b"\n")
        assert _fingerprint(str(moved / "a"), [["drift"], []]) != known, file
        (moved / "a" / file).write_bytes(before)
    assert _fingerprint(str(moved / "a"), [["drift"], []]) == known


def test_another_version_of_the_program_may_say_something_else(rv_m2, tmp_path, monkeypatch):
    folder = str(write_robot(rv_m2, tmp_path / "a"))
    known = _fingerprint(folder, [])
    monkeypatch.setattr("importlib.metadata.version", lambda _: "99.0")
    assert _fingerprint(folder, []) != known
