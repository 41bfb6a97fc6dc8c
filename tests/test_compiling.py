"""Who runs compiled loops: every row once, in as many threads as are set; a module that cannot be loaded is told."""

import os
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

from thermal_robot import compiling


def test_the_threads_are_those_that_are_set_or_one_a_processor(monkeypatch):
    monkeypatch.setattr(compiling, "THREADS", 0)
    assert 1 <= compiling.threads() <= os.cpu_count()
    monkeypatch.setattr(compiling, "THREADS", 3)
    assert compiling.threads() == 3


@pytest.mark.parametrize("rows", [0, 1, 99, 100, 101, 1234])
@pytest.mark.parametrize("threads", [1, 4])
def test_every_row_is_written_once(monkeypatch, rows, threads):
    monkeypatch.setattr(compiling, "THREADS", threads)
    monkeypatch.setattr(compiling, "PIECE", 100)
    lock = threading.Lock()

    def kernel(step, start, stop, out):
        with lock:
            out[start:stop] += step

    out = np.zeros(rows)
    compiling.in_pieces(kernel, (2.0,), rows, (out,))
    np.testing.assert_array_equal(out, 2.0)


def test_what_goes_wrong_in_a_thread_is_raised(monkeypatch):
    monkeypatch.setattr(compiling, "THREADS", 2)
    monkeypatch.setattr(compiling, "PIECE", 10)

    def kernel(start, stop):
        if start >= 50:
            raise ArithmeticError(start)

    with pytest.raises(ArithmeticError):
        compiling.in_pieces(kernel, (), 100, ())


def test_nothing_is_written_any_more_once_an_error_is_raised(monkeypatch):
    monkeypatch.setattr(compiling, "THREADS", 3)
    monkeypatch.setattr(compiling, "PIECE", 10)
    busy = threading.Event()

    def kernel(start, stop, out):
        if start == 0:
            busy.wait(10.0)
            raise ArithmeticError
        busy.set()
        time.sleep(0.05)
        out[start:stop] = 1.0

    out = np.zeros(90)
    with pytest.raises(ArithmeticError):
        compiling.in_pieces(kernel, (), 90, (out,))
    left = out.copy()
    time.sleep(0.2)
    np.testing.assert_array_equal(out, left)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="processes are not forked here")
def test_a_forked_process_has_threads_of_its_own():
    code = """
import os, numpy as np
from thermal_robot import compiling
compiling.THREADS, compiling.PIECE = 2, 10
def kernel(start, stop, out): out[start:stop] = 1.0
def done():
    out = np.zeros(100)
    compiling.in_pieces(kernel, (), 100, (out,))
    return int(out.sum())
first, child = done(), os.fork()
if not child: os._exit(done())
print(first, os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""
    found = subprocess.run([sys.executable, "-W", "ignore", "-c", code], capture_output=True, text=True, timeout=120)
    assert found.stdout == "100 100\n", found.stderr


def test_a_full_disk_is_no_reason_to_stop(monkeypatch):
    left = [OSError(28, "No space left on device")] * 7

    def kernel(start, stop, out):
        if left:
            raise left.pop()
        out[start:stop] = 1.0

    out = np.zeros(5)
    compiling.in_pieces(kernel, (), 5, (out,))
    np.testing.assert_array_equal(out, 1.0)


def test_without_numba_nothing_is_loaded(monkeypatch):
    monkeypatch.setattr(compiling, "find_spec", lambda _: None)
    assert not compiling.loads.__wrapped__("thermal_robot.no_such_module")


def test_what_cannot_be_loaded_is_told(monkeypatch):
    monkeypatch.setattr(compiling, "find_spec", lambda _: sys)
    with pytest.warns(RuntimeWarning, match="numba is installed but cannot be loaded .*several times slower"):
        assert not compiling.loads.__wrapped__("thermal_robot.no_such_module")
