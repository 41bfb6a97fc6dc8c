"""What is done already: the rows of each campaign by its fingerprint, on disk as soon as they are known.

A database of SQLite, so that a process that is killed leaves what it has written, and nothing half. Only the process
that runs the fleet opens it; a second one is refused.
"""

from __future__ import annotations

import hashlib
import json
import os
import sqlite3
import time
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from thermal_robot.campaign.document import read_declaration
from thermal_robot.errors import CampaignError
from thermal_robot.files import checksum
from thermal_robot.fleet import settings

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
