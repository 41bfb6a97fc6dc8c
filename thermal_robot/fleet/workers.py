"""Who does the work: processes of Dask, on this machine or behind the scheduler of a cluster. No engine of our own.

On one machine a ``LocalCluster`` is started: a process a core, started anew by its nanny when it ends or outgrows its
share of the memory. It listens on 127.0.0.1 alone, behind TLS with a certificate of its own that lasts as long as it
does, so that no other user of the machine can hand it work, and serves no page. A cluster's scheduler is named by its
address; its TLS is that of Dask's own configuration.

As much is handed out at a time as there are threads, so that a process that is killed had one campaign. Dask would
hand that to others again and again, and count whatever else lay on them as suspicious, too: here it waits until the end
and is done then by itself, once. If that process is killed as well, it was this campaign.
"""

from __future__ import annotations

import faulthandler
import math
import os
import time
import warnings
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any

from thermal_robot.errors import ThermalRobotError
from thermal_robot.fleet import settings


def needed(module: str) -> Any:
    """Return a module of the extra ``fleet``.

    Raises
    ------
    ThermalRobotError
        If it is not installed; says how to.
    """
    try:
        return import_module(module)
    except ImportError as error:
        package = module.partition(".")[0]
        raise ThermalRobotError(
            f"a fleet needs {package}, which cannot be loaded ({error}); pip install 'thermal-robot[fleet]'"
        ) from error


LOCAL = "127.0.0.1"
KILLED = "the process that diagnosed it was ended twice, the second time with nothing else to do: by the system, for \
memory, by a crash, or because it took longer than the time limit"

Task = tuple[str, tuple[Any, ...]]
"""Key, and the arguments of the work."""


@contextmanager
def client(workers: int, scheduler: str | None = None) -> Iterator[Any]:
    """Give a client of Dask whose workers do the work.

    Parameters
    ----------
    workers
        How many processes to start on this machine.
    scheduler
        Address of a scheduler that runs; then none is started here.

    Yields
    ------
    distributed.Client

    Raises
    ------
    ThermalRobotError
        If Dask is not installed, or the scheduler does not answer.
    """
    dask, distributed = needed("dask"), needed("distributed")
    if scheduler is None:
        with dask.config.set(_UNSERVED), _local(distributed, workers) as cluster, distributed.Client(cluster) as found:
            yield found
        return
    try:
        found = distributed.Client(scheduler, timeout=settings.ANSWERS_WITHIN)
    except (OSError, ValueError, TypeError) as error:
        raise ThermalRobotError(
            f"the scheduler {scheduler} does not answer: {error}; is it running, and do its TLS files stand in Dask's "
            "configuration (distributed.comm.tls)?"
        ) from error
    with found:
        yield found


_UNSERVED = {
    "distributed.scheduler.http.routes": [],
    "distributed.worker.http.routes": [],
    "distributed.worker.profile.enabled": False,
    "distributed.scheduler.allowed-failures": 0,
    "distributed.admin.large-graph-warning-threshold": "1GB",
}
"""Nothing is served beside the work itself, nor kept of how it goes on, which grows by a megabyte a campaign; and a
campaign whose process was killed comes back at once."""


@contextmanager
def _local(distributed: Any, workers: int) -> Iterator[Any]:
    needed("cryptography")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of a port that is taken, of a page that cannot be served
        cluster = distributed.LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=True,
            host=LOCAL,
            dashboard_address=f"{LOCAL}:0",
            worker_dashboard_address=f"{LOCAL}:0",
            security=distributed.Security.temporary(),
            silence_logs=50,
        )
    with cluster:
        yield cluster


def answers(
    client: Any, work: Callable[..., Any], tasks: Iterator[Task]
) -> Generator[tuple[str, Any, str], None, None]:
    """Have tasks worked on, a few at a time.

    Parameters
    ----------
    client
        Of Dask.
    work
        A function of a module; each process imports it.
    tasks
        Taken one by one as the work goes on; keys are unique.

    Yields
    ------
    tuple
        Key, answer, and an empty text; or why there is no answer. Each key once, in whatever order.

    Raises
    ------
    ThermalRobotError
        If the scheduler is lost.
    """
    distributed = needed("distributed")
    ended: list[Task] = []
    try:
        for task, reply, error in _flow(client, work, tasks, distributed, _threads(client)):
            if isinstance(error, distributed.KilledWorker):
                ended.append(task)
            else:
                yield task[0], reply, _said(error)
        for task, reply, error in _flow(client, work, iter(ended), distributed, lambda: 1):
            killed = isinstance(error, distributed.KilledWorker)
            yield task[0], reply, KILLED if killed else _said(error)
    except (distributed.comm.core.CommClosedError, distributed.CancelledError, OSError) as error:
        raise ThermalRobotError(f"the scheduler was lost: {error}; the same command continues") from error


@contextmanager
def limited(seconds: float) -> Iterator[None]:
    """End this whole process where what is done within takes longer, even where it hangs outside Python."""
    with open(os.devnull, "w", encoding="utf-8") as nowhere:
        faulthandler.dump_traceback_later(seconds, exit=True, file=nowhere)
        try:
            yield
        finally:
            faulthandler.cancel_dump_traceback_later()


def _threads(client: Any) -> Callable[[], int]:
    """Return what tells how many threads there are, asked again now and then: workers come and go."""
    known = [-math.inf, 1.0]

    def threads() -> int:
        if time.monotonic() - known[0] > settings.ASKED_EVERY:
            known[:] = time.monotonic(), max(sum(client.nthreads().values()), 1)
        return int(known[1])

    return threads


def _said(error: BaseException | None) -> str:
    return "" if error is None else f"{type(error).__name__}: {error}"


def _flow(
    client: Any, work: Callable[..., Any], tasks: Iterator[Task], distributed: Any, most: Callable[[], int]
) -> Iterator[tuple[Task, Any, BaseException | None]]:
    """Yield each task with its answer or its error; so many are under way at a time."""
    under_way: dict[Any, Task] = {}
    finished = distributed.as_completed(with_results=True, raise_errors=False)

    def begin() -> None:
        while len(under_way) < most() and (task := next(tasks, None)) is not None:
            future = client.submit(work, *task[1], key=f"thermal-robot-{task[0]}", pure=False)
            under_way[future.key] = task
            finished.add(future)

    begin()
    while under_way:
        future, reply = next(finished)
        task = under_way.pop(future.key)
        if future.status == "cancelled":
            raise distributed.CancelledError(task[0])
        error = reply[1] if future.status == "error" else None
        future.release()
        begin()
        yield task, None if error is not None else reply, error
