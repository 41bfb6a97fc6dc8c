"""Examinees and their supervisor: processes that are given a folder each, and ended where they do not answer."""

from __future__ import annotations

import json
import os
import queue
import subprocess
import sys
import tempfile
import threading
from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

START_TIMEOUT = 180.0
"""Seconds for imports and the warm-up, on a busy machine."""
_KEPT = ("PATH", "HOME", "LD_LIBRARY_PATH")  # a Pinocchio that came with ROS or conda is found by the last


class Lost(Exception):
    """An examinee that gave no answer; says why."""


class Examinee:
    """One examinee's process, of the trial in a directory."""

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
        """Wait until it is ready; RuntimeError if it does not start: then the fault is not a campaign's."""
        try:
            self._line(START_TIMEOUT)
        except Lost as why:
            raise RuntimeError(f"the examinee does not start: {why}") from None

    def ask(self, request: Mapping[str, Any], timeout: float) -> dict[str, Any]:
        """Return its reply; Lost if it ends, or takes longer than the timeout (s), and is then ended."""
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
        """End it, whatever it does; more than once does no harm."""
        self._process.kill()
        self._process.wait()

    def close(self) -> None:
        """End it and give everything back."""
        self.end()
        for stream in (self._process.stdin, self._process.stdout, self._complaints):
            try:
                if stream:
                    stream.close()
            except BrokenPipeError:  # what it never read
                pass

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
    """Return the command line of an examinee."""
    return [sys.executable, "-m", "thermal_robot.blind.examinee", str(directory.resolve())]


def environment() -> dict[str, str]:
    """Return an examinee's environment: enough to find the program and its libraries, on one core."""
    root = Path(__file__).resolve().parents[2]
    # a checkout is found by PYTHONPATH; an installed package must not be, since it would stand before Python's own
    own = [] if root.name in ("site-packages", "dist-packages") else [str(root)]
    path = os.pathsep.join([*own, *filter(None, [os.environ.get("PYTHONPATH")])])
    kept = {name: os.environ[name] for name in _KEPT if name in os.environ}
    return {**kept, "PYTHONPATH": path, "PYTHONSAFEPATH": "1", "OMP_NUM_THREADS": "1"}


def examine(
    requests: Mapping[str, Mapping[str, Any]], directory: Path, *, workers: int, timeout: float
) -> Generator[tuple[str, dict[str, Any]], None, None]:
    """Have requests, by name of the case, answered by several examinees at once, each within the timeout, s.

    Yields name and reply, as they come. An examinee that ends or is late is replaced, and the reply says so. Leaving
    the loop early ends all of them.
    """
    shared = _Shared(requests, directory, timeout)
    for name in requests:
        shared.todo.put(name)
    threads = [threading.Thread(target=shared.serve, daemon=True) for _ in range(min(workers, len(requests)))]
    for thread in threads:
        thread.start()
    try:
        for _ in requests:
            item = shared.done.get()
            if isinstance(item, Exception):
                raise item
            yield item
    finally:
        shared.stop.set()
        _end_all(threads, shared.running)


@dataclass(frozen=True)
class _Shared:
    """What the supervisor's threads share; each of them has one examinee at a time."""

    requests: Mapping[str, Mapping[str, Any]]
    directory: Path
    timeout: float
    todo: queue.SimpleQueue[str] = field(default_factory=queue.SimpleQueue)
    done: queue.SimpleQueue[tuple[str, dict[str, Any]] | Exception] = field(default_factory=queue.SimpleQueue)
    stop: threading.Event = field(default_factory=threading.Event)
    running: list[Examinee] = field(default_factory=list)

    def serve(self) -> None:
        """Have requests answered until there are no more, or it is told to stop."""
        examinee: Examinee | None = None
        try:
            while not self.stop.is_set():
                name = self.todo.get_nowait()
                if examinee is None:
                    examinee = Examinee(self.directory)
                    self.running.append(examinee)
                    examinee.start()
                try:
                    self.done.put((name, examinee.ask(self.requests[name], self.timeout)))
                except Lost as why:
                    examinee.close()
                    self.running.remove(examinee)
                    examinee = None
                    self.done.put((name, no_answer(f"the diagnosis failed: {why}")))
        except queue.Empty:
            pass
        except Exception as error:
            self.done.put(error)
        finally:
            if examinee is not None:
                examinee.close()


def no_answer(error: str) -> dict[str, Any]:
    """Return the reply that stands for one that never came."""
    return {"said": None, "predicted": None, "refitted": {}, "seconds": None, "error": error}


def _end_all(threads: Sequence[threading.Thread], running: Sequence[Examinee]) -> None:
    while any(thread.is_alive() for thread in threads):
        for examinee in tuple(running):  # one may just have been started
            examinee.end()
        for thread in threads:
            thread.join(0.1)
