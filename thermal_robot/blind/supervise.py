"""Supervisor of examinee processes: requests, timeouts, termination."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import threading
from collections.abc import Generator, Mapping
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import suppress
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any

START_TIMEOUT = 180.0
"""Seconds for imports and the warm-up, on a busy machine."""
NO_ANSWER: dict[str, Any] = {"said": None, "predicted": None, "refitted": {}, "seconds": None, "error": None}
"""Reply in place of an examinee that gave none."""
_KEPT = ("PATH", "HOME", "LD_LIBRARY_PATH")  # a Pinocchio that came with ROS or conda is found by the last


class Lost(Exception):
    """Error: an examinee process ended, timed out or replied no JSON; the message says which."""


class Examinee:
    """Subprocess that diagnoses campaigns of the trial in a directory, one request at a time."""

    def __init__(self, directory: Path) -> None:
        self._complaints = tempfile.TemporaryFile()
        # in a session of its own, so that Ctrl-C reaches the supervisor only, who then ends it
        self._process = subprocess.Popen(
            command(directory),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._complaints,
            text=True,
            encoding="utf-8",
            env=environment(),
            start_new_session=True,
        )

    def start(self) -> None:
        """Wait until the process is ready; RuntimeError if it does not start."""
        try:
            self._line(START_TIMEOUT)
        except Lost as why:
            raise RuntimeError(f"the examinee does not start: {why}") from None

    def ask(self, request: Mapping[str, Any], timeout: float) -> dict[str, Any]:
        """Send a request and return the reply; :class:`Lost` if the process ends, times out (s) or replies no JSON."""
        assert self._process.stdin
        try:
            self._process.stdin.write(json.dumps(request) + "\n")
            self._process.stdin.flush()
        except OSError:
            raise Lost(self._ended()) from None
        line = self._line(timeout)
        try:
            return dict(json.loads(line))
        except ValueError:
            raise Lost(f"its reply cannot be read: {line[:60]!r}") from None

    def end(self) -> None:
        """Terminate the process; idempotent."""
        self._process.kill()
        self._process.wait()

    def close(self) -> None:
        """Terminate the process and release its resources."""
        self.end()
        for stream in (self._process.stdin, self._process.stdout, self._complaints):
            with suppress(BrokenPipeError):  # what it never read
                if stream:
                    stream.close()

    def _line(self, timeout: float) -> str:
        late = threading.Event()

        def expire() -> None:
            late.set()
            self._process.kill()

        timer = threading.Timer(timeout, expire)
        timer.daemon = True
        timer.start()
        assert self._process.stdout
        try:
            line = self._process.stdout.readline()
        finally:
            timer.cancel()
        if late.is_set():
            raise Lost(f"no answer within {timeout:g} s")
        if not line.endswith("\n"):
            raise Lost(self._ended())
        return line

    def _ended(self) -> str:
        self.end()
        self._complaints.seek(0)
        last = self._complaints.read().decode("utf-8", "replace").strip().splitlines()[-1:]
        return f"the process ended with status {self._process.returncode}" + "".join(f": {line}" for line in last)


def command(directory: Path) -> list[str]:
    """Command line that starts an examinee for the trial in a directory."""
    return [sys.executable, "-m", "thermal_robot.blind.examinee", str(directory.resolve())]


def environment() -> dict[str, str]:
    """Environment variables of an examinee: search paths of programs, libraries and this package, one OpenMP thread."""
    root = Path(__file__).resolve().parents[2]
    # a checkout is found by PYTHONPATH; an installed package must not be, since it would stand before Python's own
    own = [] if root.name in ("site-packages", "dist-packages") else [str(root)]
    path = os.pathsep.join([*own, *filter(None, [os.environ.get("PYTHONPATH")])])
    kept = {name: os.environ[name] for name in _KEPT if name in os.environ}
    return {**kept, "PYTHONPATH": path, "PYTHONSAFEPATH": "1", "OMP_NUM_THREADS": "1"}


def examine(
    requests: Mapping[str, Mapping[str, Any]], directory: Path, *, workers: int, timeout: float
) -> Generator[tuple[str, dict[str, Any]], None, None]:
    """Send requests, by name of the case, to examinee processes in parallel, and yield each name with its reply.

    Replies come as they are ready. A process that ends or exceeds the timeout (s) is replaced, and an error stands in
    for its reply. Leaving the loop early ends all processes.
    """
    idle: SimpleQueue[Examinee] = SimpleQueue()
    started: list[Examinee] = []
    stopped = threading.Event()

    def answered(name: str) -> tuple[str, dict[str, Any]]:
        try:
            examinee = idle.get_nowait()
        except Empty:
            examinee = Examinee(directory)
            started.append(examinee)
            if stopped.is_set():  # it was started while the others were ended
                examinee.end()
            examinee.start()
        try:
            reply = examinee.ask(requests[name], timeout)
        except Lost as why:
            examinee.close()
            return name, {**NO_ANSWER, "error": f"the diagnosis failed: {why}"}
        idle.put(examinee)
        return name, reply

    pool = ThreadPoolExecutor(max(1, min(workers, len(requests))))
    try:
        for task in as_completed([pool.submit(answered, name) for name in requests]):
            yield task.result()
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
        stopped.set()
        for examinee in tuple(started):
            examinee.end()
        pool.shutdown()
        for examinee in started:
            examinee.close()
