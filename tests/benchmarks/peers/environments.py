"""Make an environment of its own for each program that we are compared with, and run a calibration in it.

usage: python tests/benchmarks/peers/environments.py FOLDER

They are made by ``venv`` and ``pip``: robotkinecal and its robotics toolbox need a NumPy before 2, and nothing of a
peer is to change what we run with. What cannot be installed is told in the table.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import venv
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
SECONDS = 60
"""That a peer may take for one figure, repeats included."""
TRIES = 5
"""Calibrations by a peer for one figure, at most; fewer where they take long."""


@dataclass(frozen=True)
class Peer:
    """A program that calibrates: as it is told, what pip installs, what its Python runs, and the methods it has."""

    name: str
    packages: tuple[str, ...]
    script: str
    methods: tuple[str, ...]


PEERS = (
    Peer("figaroh", ("figaroh",), "figaroh_calibrates.py", ("excitation", "structural", "map_cv")),
    Peer("robotkinecal", ("robotkinecal", "numpy<2"), "robotkinecal_calibrates.py", ("solve",)),
)


def python(peer, folder):
    """Return the path of a peer's Python."""
    return Path(folder) / peer.name / ("Scripts" if sys.platform == "win32" else "bin") / "python"


def make(folder):
    """Make what is not there yet; return by peer what went wrong."""
    wrong = {}
    for peer in PEERS:
        done = python(peer, folder).parents[1] / "installed"
        if done.exists():
            continue
        venv.create(done.parent, with_pip=True, clear=True)
        call = [python(peer, folder), "-m", "pip", "install", "--quiet", *peer.packages]
        answer = subprocess.run(call, capture_output=True, text=True, check=False)
        if answer.returncode:
            wrong[peer.name] = _last_line(answer.stderr)
        else:
            done.write_text(" ".join(peer.packages))
    return wrong


def calibrated(peer, method, folder, source, seconds=SECONDS):
    """Return what a peer says of one calibration, or one line why it says nothing."""
    if folder is None or not (python(peer, folder).parents[1] / "installed").exists():
        return "not installed"
    call = [python(peer, folder), HERE / peer.script, source, method, str(TRIES), str(seconds)]
    own = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    own |= dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    try:
        answer = subprocess.run(call, capture_output=True, text=True, check=False, timeout=4 * seconds, env=own)
    except subprocess.TimeoutExpired:
        return f"no answer within {4 * seconds} s"
    if answer.returncode:
        return f"failed: {_last_line(answer.stderr)}"
    return json.loads(answer.stdout.splitlines()[-1])


def _last_line(text):
    lines = [line for line in text.splitlines() if line.strip()]
    return lines[-1].strip()[:160] if lines else "it says nothing"


if __name__ == "__main__":
    Path(sys.argv[1]).mkdir(parents=True, exist_ok=True)
    failed = make(sys.argv[1])
    for name, why in failed.items():
        print(f"{name}: {why}")
    sys.exit(1 if failed else 0)
