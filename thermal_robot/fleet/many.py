"""Parallel diagnosis of many campaigns by Dask workers, local or of a cluster.

Finished rows of each campaign are stored by its fingerprint in an SQLite database, which survives a killed process.
Only the process that runs the fleet opens it; a second one is refused.

On one machine a ``LocalCluster`` is started: a process a core, started anew by its nanny when it ends or outgrows its
share of the memory. It listens on 127.0.0.1 alone, behind TLS with a certificate of its own that lasts as long as it
does, so that no other user of the machine can hand it work, and serves no page. A cluster's scheduler is named by its
address; its TLS is that of Dask's own configuration.

At most one task a thread is submitted at a time, so that a killed process had one campaign. Dask would retry that on
other workers and suspect their tasks, too: here it is retried once at the end, alone. If that process is killed as
well, the campaign has failed.
"""

from __future__ import annotations

import faulthandler
import gc
import hashlib
import json
import math
import os
import sqlite3
import time
import warnings
import zlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from itertools import chain, count
from pathlib import Path
from typing import TYPE_CHECKING, Any

from thermal_robot.campaign.document import read_declaration
from thermal_robot.diagnosis import diagnose
from thermal_robot.effects.catalogue import choose
from thermal_robot.errors import CampaignError, ThermalRobotError
from thermal_robot.files import checksum, is_file, write_one
from thermal_robot.fleet import settings
from thermal_robot.fleet.listed import Listed, campaigns
from thermal_robot.fleet.rows import CAMPAIGN, Plain, failed, needed, rows_of, write_rows
from thermal_robot.fleet.summary import Summary, summarise
from thermal_robot.renderer import registered_renderer

if TYPE_CHECKING:
    import pandas as pd


TABLE, DONE = "fleet.parquet", "done.sqlite"
_LOCAL = "127.0.0.1"
_KILLED = "the process that diagnosed it was ended twice, the second time with nothing else to do: by the system, for \
memory, by a crash, or because it took longer than the time limit"
Task = tuple[str, tuple[Any, ...]]
"""Key, and the arguments of the work."""


@dataclass(frozen=True, eq=False, repr=False)
class Fleet:
    """Result of a fleet's diagnosis: path of the table of all campaigns, and their summary.

    Attributes
    ----------
    table
        Path of the table: Parquet, a row for each campaign and effect.
    summary
        Summary of effects by robot and of common parameters; prints as text.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> file = tr.write_campaign(tr.demo_campaign(), "robots/hall_3")
    >>> fleet = tr.diagnose_many("robots", "out", only=["backlash", "thermal_elongation"], workers=1)
    >>> fleet
    <Fleet: 1 campaign, 1 robot, 0 failed>
    >>> list(fleet.to_frame()["status"])
    ['found', 'found']
    """

    table: Path
    summary: Summary

    def to_frame(self, columns: Sequence[str] | None = None) -> pd.DataFrame:
        """Return the data frame of the table, or of some columns; SI."""
        import pandas as pd

        return pd.read_parquet(self.table, columns=None if columns is None else list(columns))

    def __str__(self) -> str:
        return str(registered_renderer().fleet_text(self.summary.to_dict()))

    def __repr__(self) -> str:
        s = self.summary
        many = [f"{n} {word}{'' if n == 1 else 's'}" for n, word in ((s.campaigns, "campaign"), (s.robots, "robot"))]
        return f"<Fleet: {', '.join(many)}, {len(s.failures)} failed>"


def diagnose_many(
    source: str | Path,
    out: str | Path,
    *,
    labels: Sequence[str] = (),
    only: Iterable[str] | None = None,
    without: Iterable[str] = (),
    workers: int | None = None,
    scheduler: str | None = None,
    time_limit: float = settings.TIME_LIMIT,
    progress: Callable[[str, int, int], None] = lambda *_: None,
) -> Fleet:
    """Diagnose many campaigns with :func:`diagnose` in parallel, and summarise them.

    An interrupted run is resumed: finished campaigns with the same files, program version and options are not repeated.
    The table is the same, byte for byte, for any number of workers. A failed campaign is a row with its reason; it is
    retried by the next run unless its own files are the reason.

    A script that calls this does so under ``if __name__ == "__main__":``, for its processes import it.

    Parameters
    ----------
    source
        Folder with a ``campaign.toml`` at any depth for each campaign; or a list, CSV with a column ``campaign`` or
        TOML with ``[[campaigns]]``, whose other columns are labels.
    out
        Folder of the table and of finished results; created if missing.
    labels
        Names of the levels of folders, from the top, ``["hall", "robot", "day"]``; campaigns with the same label
        ``robot`` are of one robot.
    only, without
        Names of effects, as in :func:`diagnose`.
    workers
        Number of processes on this machine, each on one core; by default as many as cores.
    scheduler
        Address of a Dask scheduler, whose workers see the same files under the same paths, instead of processes here.
    time_limit
        Seconds that one campaign may take; after two attempts it is a row with that reason, and the others continue.
    progress
        Called with a stage, how many campaigns are done, and how many there are.

    Returns
    -------
    Fleet
        Prints as text.

    Raises
    ------
    CampaignError
        Nothing to diagnose, a list that cannot be read, a folder that cannot be written or is in use.
    EffectError
        If an effect's name is not known.
    ThermalRobotError
        If the extra ``fleet`` is not installed, or the scheduler does not answer.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> file = tr.write_campaign(tr.demo_campaign(), "robots/hall_3")
    >>> fleet = tr.diagnose_many("robots", "out", only=["backlash", "thermal_elongation"], workers=1)
    >>> [finding.robot for finding in fleet.summary.found]
    ['hall_3', 'hall_3']
    """
    chosen = [[names] if isinstance(names, str) else list(names) for names in (only or (), without)]
    if only is not None and not chosen[0]:
        raise CampaignError("diagnose_many(), only", "names no effect", expected="at least one, or left out for all")
    choose(chosen[0], chosen[1])
    if workers is not None and (isinstance(workers, bool) or not isinstance(workers, int) or workers < 1):
        raise CampaignError("diagnose_many(), workers", "no such number", found=repr(workers), expected="at least 1")
    if isinstance(time_limit, bool) or not isinstance(time_limit, (int, float)) or not 0.0 < time_limit < math.inf:
        where = "diagnose_many(), time_limit"
        raise CampaignError(where, "no such time", found=repr(time_limit), expected="seconds above 0")
    for module in ("pyarrow", "distributed"):
        needed(module)
    found, folder = campaigns(source, labels), Path(out)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as error:
        raise CampaignError(str(out), "cannot be made", found=str(error), expected="a folder to write to") from None
    table, options = folder / TABLE, [sorted(names) for names in chosen]
    with opened(folder / DONE) as done:
        _diagnosed(found, options, done, workers or os.cpu_count() or 1, scheduler, time_limit, progress)
        write_one(str(table), lambda path: write_rows(path, found.names, _whole(found, done)))
    return Fleet(table, summarise(table, found.names, progress))


def diagnosed(folder: str, only: Sequence[str], without: Sequence[str]) -> tuple[list[Plain], bool]:
    """Diagnose one campaign: its table rows, and whether a rerun may differ because the program itself failed."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # what is worth a word stands in the rows
            return rows_of(diagnose(folder, only=only or None, without=without)), False
    except ThermalRobotError as error:
        return failed(_without_path(str(error), folder)), False
    except Exception as error:
        return failed(f"the program failed: {type(error).__name__}: {_without_path(str(error), folder)}"), True


def _diagnosed(
    found: Listed,
    options: Sequence[list[str]],
    done: Done,
    workers: int,
    scheduler: str | None,
    time_limit: float,
    progress: Callable[[str, int, int], None],
) -> None:
    """Diagnose in parallel the campaigns that are not stored yet, in the order of the list, and store their rows."""
    under_way: set[str] = set()
    finished, total = count(1), len(found.campaigns)

    def tasks() -> Iterator[Task]:
        for number, (name, _) in enumerate(found.campaigns):
            folder = found.folder(name)
            try:
                key = fingerprint(folder, options)
            except (ThermalRobotError, OSError) as error:
                key = f"unread {number}"
                done.put(key, failed(_without_path(str(error), folder)), again=True)
            done.name(number, key)
            if key in under_way or key in done:
                progress("campaigns", next(finished), total)
            else:
                under_way.add(key)
                yield key, (time_limit, folder, *options)

    waiting = tasks()
    first = next(waiting, None)
    if first is None:
        return
    with connected(min(workers, total), scheduler) as client:
        for key, reply, reason in answers(client, _in_time, chain([first], waiting)):
            done.put(key, *(reply or (failed(reason), True)))
            under_way.discard(key)
            progress("campaigns", next(finished), total)


def _in_time(time_limit: float, *campaign: Any) -> tuple[list[Plain], bool]:
    """Diagnose a campaign within a time limit; end the process otherwise.

    Reference cycles of each diagnosis are collected at once; objects that survive the first one, mostly modules, are
    frozen.
    """
    with limited(time_limit):
        found = diagnosed(*campaign)
    gc.collect()
    if not gc.get_freeze_count():
        gc.freeze()
    return found


@contextmanager
def limited(seconds: float) -> Iterator[None]:
    """End this process after a time limit, even where it hangs outside Python."""
    with open(os.devnull, "w", encoding="utf-8") as nowhere:
        faulthandler.dump_traceback_later(seconds, exit=True, file=nowhere)
        try:
            yield
        finally:
            faulthandler.cancel_dump_traceback_later()


def _whole(found: Listed, done: Done) -> Iterator[Plain]:
    """Yield all rows of the fleet's table, in the order of the list, with campaign names and labels."""
    for number, rows in done.in_order():
        name, labels = found.campaigns[number]
        named = {CAMPAIGN: name, **dict(zip(found.names, labels, strict=True))}
        yield from ({**named, **row} for row in rows)


def _without_path(message: str, folder: str) -> str:
    """Remove a campaign's absolute folder path from a message."""
    place = folder if not is_file(Path(folder)) else os.path.dirname(folder)
    return " ".join(message.replace(place + os.sep, "").split())


def fingerprint(folder: str, options: Sequence[object]) -> str:
    """SHA-256 hash of a campaign's name, its files (campaign.toml, table, URDF), the program's version and options."""
    from importlib.metadata import version

    declaration = read_declaration(Path(folder))
    name = Path(os.path.abspath(declaration.file)).parts[-2:]  # it stands in messages
    told = json.dumps([name, version("thermal-robot"), list(options), [checksum(file) for file in declaration.files]])
    return hashlib.sha256(told.encode()).hexdigest()


class Done:
    """SQLite store of finished rows by fingerprint, and of each campaign's fingerprint; opened by :func:`opened`."""

    def __init__(self, database: sqlite3.Connection) -> None:
        self._database, self._written = database, time.monotonic()

    def __contains__(self, key: str) -> bool:
        return self._database.execute("SELECT 1 FROM done WHERE key = ?", (key,)).fetchone() is not None

    def name(self, number: int, key: str) -> None:
        """Set the fingerprint of a campaign, by its number in the list."""
        self._database.execute("INSERT INTO listed VALUES (?, ?)", (number, key))

    def put(self, key: str, rows: list[Plain], again: bool = False) -> None:
        """Store the rows of a campaign, on disk within a second; ``again`` marks them for a rerun."""
        packed = zlib.compress(json.dumps(rows).encode())
        self._database.execute("INSERT OR REPLACE INTO done VALUES (?, ?, ?)", (key, packed, again))
        if time.monotonic() - self._written > settings.WRITTEN_EVERY:
            self._database.commit()
            self._written = time.monotonic()

    def in_order(self) -> Iterator[tuple[int, list[Plain]]]:
        """Yield number and rows of every campaign, in the order of the list."""
        found = self._database.execute("SELECT number, rows FROM listed JOIN done USING (key) ORDER BY number")
        yield from ((number, json.loads(zlib.decompress(packed))) for number, packed in found)


_BEGIN = """
    PRAGMA locking_mode = EXCLUSIVE;
    BEGIN EXCLUSIVE;
    CREATE TABLE IF NOT EXISTS done (key TEXT PRIMARY KEY, rows BLOB, again INTEGER);
    CREATE TABLE IF NOT EXISTS listed (number INTEGER PRIMARY KEY, key TEXT);
    DELETE FROM listed;
    DELETE FROM done WHERE again;
    COMMIT;
"""


@contextmanager
def opened(file: Path) -> Iterator[Done]:
    """Open or create the SQLite store exclusively; it is committed to disk at the end in any case.

    Raises :class:`CampaignError` if another run has it open, or the file is no such store.
    """
    with closing(sqlite3.connect(file, timeout=settings.WAIT_FOR_OTHERS)) as database:
        try:
            database.executescript(_BEGIN)
        except sqlite3.OperationalError as error:
            expected = "no other run with it"
            raise CampaignError(str(file), "cannot be used", found=str(error), expected=expected) from error
        except sqlite3.DatabaseError as error:
            problem = "is not what a fleet has written"
            raise CampaignError(str(file), problem, expected="another folder for --out") from error
        try:
            yield Done(database)
        finally:
            database.commit()


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
def connected(workers: int, scheduler: str | None = None) -> Iterator[Any]:
    """Yield a Dask client: of local worker processes, or of a scheduler's address."""
    dask, distributed = needed("dask"), needed("distributed")
    if scheduler is None:
        with dask.config.set(_UNSERVED), _local(distributed, workers) as cluster, distributed.Client(cluster) as found:
            yield found
        return
    why = ""
    try:
        found = distributed.Client(scheduler, timeout=settings.ANSWERS_WITHIN)
    except (OSError, ValueError, TypeError) as error:
        why = str(error) or type(error).__name__
    if why:
        gc.collect()  # the client that failed closes: collected while another one is made, it would wait for ever
        raise ThermalRobotError(
            f"the scheduler {scheduler} does not answer: {why}; is it running, and do its TLS files stand in Dask's "
            "configuration (distributed.comm.tls)?"
        )
    with found:
        yield found


def _local(distributed: Any, workers: int) -> Any:
    needed("cryptography")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of a port that is taken, of a page that cannot be served
        return distributed.LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=True,
            host=_LOCAL,
            dashboard_address=f"{_LOCAL}:0",
            worker_dashboard_address=f"{_LOCAL}:0",
            security=distributed.Security.temporary(),
            silence_logs=50,
        )


def answers(client: Any, work: Callable[..., Any], tasks: Iterator[Task]) -> Iterator[tuple[str, Any, str]]:
    """Run tasks on a Dask client, one per worker thread at a time; yield (key, result or ``None``, error or empty).

    Tasks whose process was killed are retried once, alone, at the end. Raises :class:`ThermalRobotError` if the
    scheduler is lost.
    """
    distributed = needed("distributed")
    ended: list[Task] = []
    told: list[tuple[str, Any, str]] = []
    under_way: dict[Any, Task] = {}
    finished = distributed.as_completed(with_results=True, raise_errors=False)
    asked, threads, alone = -math.inf, 1, False
    try:
        while True:
            if not alone and time.monotonic() - asked > settings.ASKED_EVERY:  # workers come and go
                asked, threads = time.monotonic(), max(sum(client.nthreads().values()), 1)
            while len(under_way) < threads and (task := next(tasks, None)) is not None:
                future = client.submit(work, *task[1], key=f"thermal-robot-{task[0]}", pure=False)
                under_way[future.key] = task
                finished.add(future)
            yield from told  # once others are under way
            told = []
            if under_way:
                future, reply = next(finished)
                task = under_way.pop(future.key)
                error = reply[1] if future.status == "error" else None
                if future.status == "cancelled":
                    raise distributed.CancelledError(task[0])
                killed = isinstance(error, distributed.KilledWorker)
                if killed and not alone:
                    ended.append(task)
                else:
                    why = _KILLED if killed else "" if error is None else f"{type(error).__name__}: {error}"
                    told = [(task[0], None if why else reply, why)]
                future.release()
            elif ended and not alone:
                tasks, threads, alone = iter(ended), 1, True
            else:
                return
    except (distributed.comm.core.CommClosedError, distributed.CancelledError, OSError) as error:
        raise ThermalRobotError(f"the scheduler was lost: {error}; the same command continues") from error
