"""The program as a process: interrupted, printing to a full disk, or to a reader that leaves."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from thermal_robot.datasets import demo_directory


def started(*arguments, **streams):
    return subprocess.Popen([sys.executable, "-m", "thermal_robot", *map(str, arguments)], text=True, **streams)


@pytest.mark.skipif(sys.platform == "win32", reason="signals and pipes of POSIX")
def test_an_interrupt_is_one_line_and_leaves_no_file(tmp_path):
    os.mkfifo(tmp_path / "nobody-reads")  # who writes to it waits, if the interrupt comes late
    asked = ("diagnose", demo_directory(), "--json", tmp_path / "nobody-reads", "--model", tmp_path / "m.json")
    # who is started in the background ignores interrupts, and so would all that it starts
    heeds = {"preexec_fn": lambda: signal.signal(signal.SIGINT, signal.SIG_DFL)}
    with started(*asked, stdout=subprocess.PIPE, stderr=subprocess.PIPE, **heeds) as process:
        time.sleep(6.0)  # until it has loaded
        process.send_signal(signal.SIGINT)
        try:
            out, err = process.communicate(timeout=60)
        finally:
            process.kill()
    assert process.returncode == 130
    assert err == "thermal-robot: interrupted; nothing was left half written\n"
    assert out == ""
    assert [file.name for file in tmp_path.iterdir()] == ["nobody-reads"]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="has no full device")
def test_a_full_disk_behind_the_terminal_is_one_line():
    with open("/dev/full", "w") as full, started("effects", stdout=full, stderr=subprocess.PIPE) as process:
        err = process.communicate(timeout=60)[1]
    assert process.returncode == 1
    assert err == "thermal-robot: cannot print: No space left on device\n"


@pytest.mark.skipif(sys.platform == "win32", reason="pipes of POSIX")
def test_a_reader_that_leaves_is_no_error():
    with started("effects", stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        process.stdout.close()
        assert process.stderr.read() == ""
    assert process.returncode == 0


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="has no full device")
def test_a_full_disk_behind_a_file_that_is_printed_is_one_line():
    with (
        open("/dev/full", "w") as full,
        started("paper", "--json", "-", stdout=full, stderr=subprocess.PIPE) as process,
    ):
        err = process.communicate(timeout=60)[1]
    assert process.returncode == 1
    assert err == "thermal-robot: cannot print: No space left on device\n"


@pytest.mark.skipif(sys.platform == "win32", reason="pipes of POSIX")
def test_a_reader_that_leaves_a_file_that_is_printed_is_no_error():
    with started("paper", "--json", "-", stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        process.stdout.close()
        assert process.stderr.read() == ""
    assert process.returncode == 0
