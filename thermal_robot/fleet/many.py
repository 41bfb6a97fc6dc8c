"""Many campaigns go in; a table, and what they have in common, come out.

What is done already, the rows of each campaign by its fingerprint, is a database of SQLite: a process that is killed
leaves what it has written, and nothing half. Only the process that runs the fleet opens it; a second one is refused.
"""

from __future__ import annotations

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
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

from thermal_robot.campaign.declaration import read_declaration
from thermal_robot.diagnosis import diagnose
from thermal_robot.effects.catalogue import choose
from thermal_robot.errors import CampaignError, ThermalRobotError
from thermal_robot.files import checksum, is_file, write_one
from thermal_robot.fleet import settings
from thermal_robot.fleet import workers as processes
from thermal_robot.fleet.listed import Listed, campaigns
from thermal_robot.fleet.rows import failed, rows_of, write_rows
from thermal_robot.fleet.summary import Summary, summarise
from thermal_robot.fleet.workers import needed
from thermal_robot.teller import registered

if TYPE_CHECKING:
    import pandas as pd


TABLE, DONE = "fleet.parquet", "done.sqlite"


@dataclass(frozen=True, eq=False, repr=False)
class Fleet:
    """The diagnoses of many campaigns, and what they have in common.

    Attributes
    ----------
    table
        Path of the table: Parquet, a row for each campaign and effect.
    summary
        What is wrong with which robot, and what several share; it prints as text.

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
        """Return the table, or some of its columns; SI throughout."""
        import pandas as pd

        return pd.read_parquet(self.table, columns=None if columns is None else list(columns))

    def __str__(self) -> str:
        return str(registered().fleet_text(self.summary.to_dict()))

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
    """Diagnose many campaigns, each as :func:`diagnose` does, and say what their robots have in common.

    A run that was stopped continues: what is done, by the content of its files, the version of the program and the
    options, is not done again. The table is the same, byte for byte, for any number of workers. A campaign that fails
    is a row with its reason; one that failed for another reason than its own files is tried again by the next run.

    A script that calls this does so under ``if __name__ == "__main__":``, for its processes import it.

    Parameters
    ----------
    source
        A folder, with a ``campaign.toml`` somewhere below for each; or a list, CSV with a column ``campaign`` or TOML
        with ``[[campaigns]]``, whose other columns are labels.
    out
        Folder of the table and of what is done; made if need be.
    labels
        Names of the levels of folders, from the top, ``["hall", "robot", "day"]``; campaigns of an equal ``robot`` are
        of the same robot.
    only, without
        Names of effects, as in :func:`diagnose`.
    workers
        Processes on this machine, each on one core; one a core where left out.
    scheduler
        Address of a Dask scheduler, whose workers see the same files under the same paths, instead of processes here.
    time_limit
        Seconds that one campaign may take, tried twice; then it is a row that says so, and the rest goes on.
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
    options = _options(only, without)
    if workers is not None and (isinstance(workers, bool) or not isinstance(workers, int) or workers < 1):
        raise CampaignError("diagnose_many(), workers", "no such number", found=repr(workers), expected="at least 1")
    if isinstance(time_limit, bool) or not isinstance(time_limit, (int, float)) or not 0.0 < time_limit < math.inf:
        where = "diagnose_many(), time_limit"
        raise CampaignError(where, "no such time", found=repr(time_limit), expected="seconds above 0")
    for module in ("pyarrow", "distributed"):
        needed(module)
    found, folder = campaigns(source, labels), _made(out)
    table = folder / TABLE
    with opened(folder / DONE) as done:
        _diagnosed(found, options, done, workers or os.cpu_count() or 1, scheduler, time_limit, progress)
        write_one(str(table), lambda path: write_rows(path, found.names, _whole(found, done)))
    return Fleet(table, summarise(table, found.names, progress))


def diagnosed(folder: str, only: Sequence[str], without: Sequence[str]) -> tuple[str, bool]:
    """Diagnose one campaign in a process of its own.

    Parameters
    ----------
    folder
        Absolute path.
    only, without
        Names of effects.

    Returns
    -------
    tuple
        Its rows as JSON, and whether another run may give others: the program failed, and not the campaign.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # what is worth a word stands in the rows
            rows, again = rows_of(diagnose(folder, only=only or None, without=without)), False
    except ThermalRobotError as error:
        rows, again = failed(_without_place(str(error), folder)), False
    except Exception as error:
        rows, again = failed(f"the program failed: {type(error).__name__}: {_without_place(str(error), folder)}"), True
    return json.dumps(rows), again


def _options(only: Iterable[str] | None, without: Iterable[str]) -> tuple[list[str], list[str]]:
    """Return the names of effects, sorted, all of them known."""
    chosen = [[names] if isinstance(names, str) else list(names) for names in (only or (), without)]
    if only is not None and not chosen[0]:
        raise CampaignError("diagnose_many(), only", "names no effect", expected="at least one, or left out for all")
    choose(tuple(chosen[0]), tuple(chosen[1]), ())
    return sorted(chosen[0]), sorted(chosen[1])


def _made(out: str | Path) -> Path:
    folder = Path(out)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as error:
        raise CampaignError(str(out), "cannot be made", found=str(error), expected="a folder to write to") from None
    return folder


def _diagnosed(
    found: Listed,
    options: tuple[list[str], list[str]],
    done: Done,
    workers: int,
    scheduler: str | None,
    time_limit: float,
    progress: Callable[[str, int, int], None],
) -> None:
    """Diagnose what is not done yet."""
    total, finished = len(found.campaigns), 0

    def told(more: int) -> None:
        nonlocal finished
        finished += more
        progress("campaigns", finished, total)

    under_way: set[str] = set()
    tasks = _tasks(found, options, done, told, under_way)
    first = next(tasks, None)
    if first is None:
        return
    with processes.client(min(workers, total), scheduler) as client:
        for key, reply, reason in processes.answers(client, _in_time, _limited(time_limit, chain([first], tasks))):
            rows, again = (json.loads(reply[0]), reply[1]) if reply is not None else (failed(reason), True)
            done.put(key, rows, again)
            under_way.discard(key)
            told(1)


def _limited(time_limit: float, tasks: Iterator[processes.Task]) -> Iterator[processes.Task]:
    """Yield tasks as :func:`_in_time` takes them."""
    for key, arguments in tasks:
        yield key, (time_limit, *arguments)


def _in_time(time_limit: float, *campaign: Any) -> tuple[str, bool]:
    """Diagnose a campaign, or end the process.

    What a diagnosis leaves refers to itself, and would stay for hundreds of campaigns; what was there after the first,
    modules above all, is not looked through again.
    """
    with processes.limited(time_limit):
        found = diagnosed(*campaign)
    gc.collect()
    if not gc.get_freeze_count():
        gc.freeze()
    return found


def _tasks(
    found: Listed,
    options: tuple[list[str], list[str]],
    done: Done,
    told: Callable[[int], None],
    under_way: set[str],
) -> Iterator[processes.Task]:
    """Yield what is to be done, in the order of the list; what is alike is done once."""
    for number, (name, _) in enumerate(found.campaigns):
        folder = found.folder(name)
        try:
            key = fingerprint(folder, options)
        except (ThermalRobotError, OSError) as error:
            key = f"unread {number}"
            done.put(key, failed(_without_place(str(error), folder)), again=True)
        done.name(number, key)
        if key in under_way or key in done:
            told(1)
        else:
            under_way.add(key)
            yield key, (folder, *options)


def _whole(found: Listed, done: Done) -> Iterator[dict[str, Any]]:
    """Yield every row of the table, with names and labels."""
    for number, rows in done.in_order():
        name, labels = found.campaigns[number]
        named = {"campaign": name, **dict(zip(found.names, labels, strict=True))}
        yield from ({**named, **row} for row in rows)


def _without_place(message: str, folder: str) -> str:
    """Return a message without the folder that its table names anyway, and that differs from machine to machine."""
    place = folder if not is_file(Path(folder)) else os.path.dirname(folder)
    return " ".join(message.replace(place + os.sep, "").split())


Rows = list[dict[str, Any]]


def fingerprint(folder: str, options: Sequence[object]) -> str:
    """Return what the rows of a campaign follow from: name, content of its files, version of the program, options.

    Raises
    ------
    CampaignError
        If the campaign cannot be read.
    OSError
        If one of its files cannot be.
    """
    from thermal_robot import __version__

    declaration = read_declaration(Path(folder))
    robot = declaration.robot
    files = [declaration.file, declaration.table, *([robot] if isinstance(robot, Path) else [])]
    name = Path(os.path.abspath(declaration.file)).parts[-2:]  # it stands in messages
    told = json.dumps([name, __version__, list(options), [checksum(file) for file in files]])
    return hashlib.sha256(told.encode()).hexdigest()


class Done:
    """The rows that are known, by fingerprint, and which campaign has which. Use :func:`opened`."""

    def __init__(self, database: sqlite3.Connection) -> None:
        self._database, self._written = database, time.monotonic()

    def __contains__(self, key: str) -> bool:
        return self._database.execute("SELECT 1 FROM done WHERE key = ?", (key,)).fetchone() is not None

    def name(self, number: int, key: str) -> None:
        """Say which fingerprint a campaign has, by its number in the list."""
        self._database.execute("INSERT INTO listed VALUES (?, ?)", (number, key))

    def put(self, key: str, rows: Rows, again: bool = False) -> None:
        """Keep the rows of a campaign, on disk within a second; ``again`` until the next run, which does it again."""
        packed = zlib.compress(json.dumps(rows).encode())
        self._database.execute("INSERT OR REPLACE INTO done VALUES (?, ?, ?)", (key, packed, again))
        if time.monotonic() - self._written > settings.WRITTEN_EVERY:
            self._database.commit()
            self._written = time.monotonic()

    def in_order(self) -> Iterator[tuple[int, Rows]]:
        """Yield number and rows of every campaign, in the order of the list, one at a time."""
        found = self._database.execute("SELECT number, rows FROM listed JOIN done USING (key) ORDER BY number")
        for number, packed in found:
            yield number, json.loads(zlib.decompress(packed))


@contextmanager
def opened(file: Path) -> Iterator[Done]:
    """Open what is done, or begin it; whatever happens, what was put there is on disk afterwards.

    Raises
    ------
    CampaignError
        If another run has it open, or it is no such file.
    """
    database = sqlite3.connect(file, timeout=settings.WAIT_FOR_OTHERS)
    try:
        database.execute("PRAGMA locking_mode = EXCLUSIVE")
        database.execute("BEGIN EXCLUSIVE")
        database.execute("CREATE TABLE IF NOT EXISTS done (key TEXT PRIMARY KEY, rows BLOB, again INTEGER)")
        database.execute("CREATE TABLE IF NOT EXISTS listed (number INTEGER PRIMARY KEY, key TEXT)")
        database.execute("DELETE FROM listed")
        database.execute("DELETE FROM done WHERE again")
        database.commit()
    except sqlite3.OperationalError as error:
        database.close()
        raise CampaignError(str(file), "cannot be used", found=str(error), expected="no other run with it") from error
    except sqlite3.DatabaseError as error:
        database.close()
        raise CampaignError(
            str(file), "is not what a fleet has written", expected="another folder for --out"
        ) from error
    try:
        yield Done(database)
    finally:
        database.commit()
        database.close()
