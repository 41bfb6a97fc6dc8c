"""Processes of a real cluster: every task answered once, whoever is ended; no port that others can reach."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path

import psutil
import pytest
from fleet.robots import samples_kept, square, square_in_time, threads
from helpers import some

from thermal_robot.errors import ThermalRobotError
from thermal_robot.fleet.many import answers, connected

pytestmark = pytest.mark.filterwarnings("default")


@pytest.fixture(scope="module", autouse=True)
def importable():
    """Let the processes import this folder, as pytest lets itself."""
    before = os.environ.get("PYTHONPATH")
    os.environ["PYTHONPATH"] = os.pathsep.join([str(Path(__file__).parents[1]), *filter(None, [before])])
    yield
    os.environ["PYTHONPATH"] = before or ""


@pytest.fixture(scope="module")
def cluster(importable):
    with connected(2) as found:
        yield found


def tasks(numbers, *more):
    return iter([(str(k), (k, *more)) for k in numbers])


def done(client, work, given):
    """Answer and reason of each number, which stands for its task once."""
    found = [(int(key), (reply, why)) for key, reply, why in answers(client, work, given)]
    assert len(dict(found)) == len(found)
    return dict(found)


def squares(numbers):
    return {k: (k * k, "") for k in numbers}


def workers():
    """The processes that work, without nannies and helpers: those in which Python runs a worker."""
    found = []
    for process in psutil.Process().children(recursive=True):
        with suppress(psutil.NoSuchProcess):  # one that was just ended
            found += [process] if "spawn_main" in " ".join(process.cmdline()) else []
    return found


def test_every_task_is_answered_once_and_taken_as_it_is_worked_on(cluster):
    taken, found, ahead = [], {}, []

    def counting():
        for task in tasks(range(30), 0.0):
            taken.append(task[0])
            yield task

    for key, *answer in answers(cluster, square, counting()):
        ahead.append(len(taken) - len(found))
        found[int(key)] = tuple(answer)
    assert (found, len(taken)) == (squares(range(30)), 30)
    assert max(ahead) <= 4


def test_work_that_fails_is_told_and_the_rest_goes_on(cluster):
    found = done(cluster, square, iter([("1", (1, 0.0)), ("2", ("two", 0.0)), ("3", (3, 0.0))]))
    reply, why = found.pop(2)
    assert reply is None
    assert "TypeError" in why
    assert found == squares((1, 3))


def test_processes_keep_nothing_of_where_they_were_and_have_one_thread_for_matrices(cluster):
    assert done(cluster, samples_kept, iter([("0", ())])) == {0: (0, "")}
    assert set().union(*cluster.run(threads).values()) == {1}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("work", "more", "ended"), some([(square_in_time, (30.0, 1.0), {3}), (square, (0.05, (3, 4)), {3, 4})], 2)
)
def test_work_that_ends_its_process_or_takes_too_long_is_the_only_one_without_an_answer(cluster, work, more, ended):
    found = done(cluster, work, tasks(range(12), *more))
    for number in ended:
        reply, why = found.pop(number)
        assert reply is None
        assert "was ended twice" in why
    assert found == squares({*range(12)} - ended)


def test_a_process_that_is_killed_in_the_middle_loses_nothing_and_does_nothing_twice(cluster):
    until = time.monotonic() + 60.0
    while len(workers()) < 2 and time.monotonic() < until:
        time.sleep(0.1)  # those that the test before has ended
    victim = workers()[0]
    ended = threading.Timer(1.0, lambda: os.kill(victim.pid, signal.SIGKILL))
    ended.start()
    assert done(cluster, square, tasks(range(40), 0.1)) == squares(range(40))
    ended.join()
    assert not victim.is_running() or victim.status() == psutil.STATUS_ZOMBIE


@pytest.mark.skipif(sys.platform == "darwin", reason="connections of other processes are not told there")
def test_nobody_else_can_reach_it(cluster):
    assert cluster.scheduler.address.startswith("tls://127.0.0.1:")
    listening = [
        connection.laddr.ip
        for process in (psutil.Process(), *psutil.Process().children(recursive=True))
        for connection in process.net_connections()
        if connection.status == psutil.CONN_LISTEN
    ]
    assert listening
    assert set(listening) == {"127.0.0.1"}


@pytest.fixture
def secured(tmp_path):
    """A scheduler and a worker as docs/fleet.md starts them, with TLS files; the address, and Dask's configuration."""
    from distributed import Security

    made = Security.temporary()
    files = {"ca": made.tls_ca_file, "cert": made.tls_client_cert, "key": made.tls_client_key}
    for name, text in files.items():
        (tmp_path / f"{name}.pem").write_text(text)
    paths = {name: str(tmp_path / f"{name}.pem") for name in files}
    tls = ["--tls-ca-file", paths["ca"], "--tls-cert", paths["cert"], "--tls-key", paths["key"]]
    here, contact = ["--host", "127.0.0.1", "--dashboard-address", "127.0.0.1:0"], tmp_path / "scheduler.json"
    dask = [sys.executable, "-m", "dask"]
    run = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "start_new_session": True}
    scheduler = [*dask, "scheduler", *here, "--protocol", "tls", "--port", "0", "--scheduler-file", str(contact), *tls]
    worker = [*dask, "worker", *here, "--nworkers", "1", "--nthreads", "1", "--scheduler-file", str(contact), *tls]
    running = [subprocess.Popen(command, **run) for command in (scheduler, worker)]
    until = time.monotonic() + 60.0
    while not contact.exists() and time.monotonic() < until:
        time.sleep(0.1)
    own = {"ca-file": paths["ca"], "client.cert": paths["cert"], "client.key": paths["key"]}
    yield json.loads(contact.read_text())["address"], {f"distributed.comm.tls.{k}": path for k, path in own.items()}
    for process in running:
        os.killpg(process.pid, signal.SIGTERM)
        process.wait(30)


@pytest.mark.slow
def test_a_scheduler_behind_tls_takes_who_has_its_files_and_nobody_else(secured, monkeypatch):
    import dask

    address, tls = secured
    assert address.startswith("tls://")
    with dask.config.set(tls), connected(1, address) as found:
        assert done(found, square, tasks(range(5), 0.0)) == squares(range(5))
    monkeypatch.setattr("thermal_robot.fleet.settings.ANSWERS_WITHIN", 3.0)
    for place in (address, "tcp://127.0.0.1:9"):
        said = rf"scheduler {place} does not answer.*distributed\.comm\.tls"
        with pytest.raises(ThermalRobotError, match=said), connected(1, place):
            pass
