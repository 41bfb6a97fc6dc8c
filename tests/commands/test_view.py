"""`thermal-robot view`: served to this machine alone until it is interrupted, and errors of one line."""

import builtins
import signal
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
import webbrowser
from pathlib import Path
from types import SimpleNamespace

import pytest
from commanded import refused

from thermal_robot.datasets import demo_directory

VIEWER = "the viewer needs viser, which is in the extra viewer"


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def started(*arguments):
    # who is started in the background ignores interrupts, and so would all that it starts
    heeds = {"preexec_fn": lambda: signal.signal(signal.SIGINT, signal.SIG_DFL)}
    command = [sys.executable, "-m", "thermal_robot", "view", *map(str, arguments)]
    return subprocess.Popen(command, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE, **heeds)


def answer(url, seconds=60.0):
    """Status of the page, once there is one."""
    end = time.monotonic() + seconds
    while True:
        try:
            with urllib.request.urlopen(url, timeout=10) as page:
                return page.status
        except urllib.error.URLError:
            if time.monotonic() > end:
                raise
            time.sleep(0.2)


def listening(port):
    """Addresses on which something listens at a port, as the kernel writes them."""
    tables = [Path("/proc/net/tcp"), Path("/proc/net/tcp6")]
    lines = [line.split() for table in tables if table.exists() for line in table.read_text().splitlines()[1:]]
    return {
        here.split(":")[0] for _, here, _, state, *_ in lines if state == "0A" and int(here.split(":")[1], 16) == port
    }


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_it_is_served_to_this_machine_alone_until_it_is_interrupted():
    pytest.importorskip("viser", reason=VIEWER)
    port = free_port()
    with started(demo_directory(), "--no-diagnosis", "--port", port) as process:
        try:
            status = answer(f"http://127.0.0.1:{port}")
            addresses = listening(port)
            said = process.stdout.readline()  # at once, though nobody reads it on a terminal
            process.send_signal(signal.SIGINT)
            rest, err = process.communicate(timeout=30)
        finally:
            process.kill()
    assert status == 200
    if Path("/proc/net/tcp").exists():
        assert addresses == {"0100007F"}  # 127.0.0.1
    assert said == f"http://127.0.0.1:{port} shows demo; Ctrl-C ends it\n"
    assert (process.returncode, rest) == (130, "")
    assert err == "thermal-robot: interrupted; nothing was left half written\n"


@pytest.mark.slow
def test_another_port_is_taken_where_this_one_is_and_the_diagnosis_is_shown(run, monkeypatch):
    pytest.importorskip("viser", reason=VIEWER)
    seen = []

    def interrupted():
        assert answer(seen[0]) == 200
        raise KeyboardInterrupt

    event = SimpleNamespace(wait=interrupted)
    monkeypatch.setattr("thermal_robot.commands.campaigns.threading", SimpleNamespace(Event=lambda: event))
    monkeypatch.setattr(webbrowser, "open", seen.append)
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        status, out, _ = run("view", demo_directory(), "--port", port, "-q", "--open")
    assert (status, out) == (130, f"{seen[0]}\n")
    assert seen[0].startswith("http://127.0.0.1:")
    assert int(seen[0].rsplit(":", 1)[1]) != port


@pytest.mark.parametrize("port", ["-1", "65536", "80a", "", "٣"])
def test_a_port_that_is_none_is_refused(run, port, capsys):
    with pytest.raises(SystemExit) as stop:
        run("view", demo_directory(), f"--port={port}")
    err = capsys.readouterr().err
    assert (stop.value.code, err.count("\n")) == (2, 1)
    assert "65535" in err


def test_without_viser_it_says_how_to_install_it(run, monkeypatch):
    whole = builtins.__import__

    def without(name, *rest, **more):
        if name.partition(".")[0] == "viser":
            raise ImportError(name)
        return whole(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", without)
    refused(run("view", demo_directory()), "viser", 'pip install "thermal-robot[viewer]"')


def test_a_campaign_that_cannot_be_used_is_one_line(run, tmp_path):
    pytest.importorskip("viser", reason=VIEWER)
    refused(run("view", tmp_path / "no.toml"), "no.toml")
    refused(run("view", tmp_path / "no.toml", "--no-diagnosis"), "no.toml")
