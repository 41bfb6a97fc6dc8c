"""The program that is examined, in a process of its own: it is given a folder with a campaign, and no answers.

``python -m thermal_robot.blind.examinee DIRECTORY`` reads one request a line, as JSON, and writes one reply a line::

    {"folder": "...", "without": ["backlash"], "only": []}
    {"said": {diagnosis} | null, "predicted": [[x, y, z], ...] | null, "refitted": {"drift+backlash": [[x, y, z], ...]},
     "seconds": 0.4, "error": null | "..."}

A request for several campaigns has ``"asks"``, too (:data:`thermal_robot.blind.cases.ASKS`); what is said is then a
comparison, a robot over time or a fleet, and nothing is predicted.

Before the first it writes ``{"ready": true}``. ``DIRECTORY`` is that of the trial.
"""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.blind.cases import LISTED
from thermal_robot.blind.refitted import refitted
from thermal_robot.campaign import read_campaign
from thermal_robot.correction import CorrectedModel
from thermal_robot.datasets import demo_directory
from thermal_robot.diagnosis import Diagnosis, diagnose
from thermal_robot.effects import library
from thermal_robot.fleet.compare import compare
from thermal_robot.fleet.listed import Listed, campaigns
from thermal_robot.fleet.many import TABLE, diagnosed
from thermal_robot.fleet.rows import write_rows
from thermal_robot.fleet.summary import summarise
from thermal_robot.fleet.wear import wear

CAMPAIGN, FRESH, MODEL = "campaign.toml", "fresh.csv", "model.json"


class Fence:
    """An audit hook that refuses every file of the trial except those of the folder in question.

    It keeps honest code honest: a compiled library that opens files past Python is not seen. The seal does not depend
    on it.

    Parameters
    ----------
    directory
        Of the trial.
    """

    def __init__(self, directory: Path) -> None:
        self._directory = os.path.realpath(directory)
        self._folder: str | None = None

    def allow(self, folder: Path) -> None:
        """Let this folder be read, and no longer the one before."""
        self._folder = os.path.realpath(folder)

    def __call__(self, event: str, arguments: tuple[Any, ...]) -> None:
        """Refuse, if that is what is asked for."""
        if event not in ("open", "os.listdir", "os.scandir") or not isinstance(arguments[0], (str, bytes, os.PathLike)):
            return
        # links are followed: one inside the folder could lead out of it
        path = os.path.realpath(os.fsdecode(arguments[0]))
        if _within(path, self._directory) and not (self._folder and _within(path, self._folder)):
            raise PermissionError(f"{path} is no business of the one who is examined")


def answer(request: dict[str, Any]) -> dict[str, Any]:
    """Diagnose a campaign and predict its fresh samples; whatever goes wrong becomes the reply's error."""
    folder, asks = Path(request["folder"]), request.get("asks", "diagnosis")
    reply: dict[str, Any] = {"said": None, "predicted": None, "refitted": {}, "seconds": None, "error": None}
    at = asks
    try:
        # what the library does not have need not be taken out of it
        without = [name for name in request["without"] if name in library()]
        start = time.perf_counter()
        if asks in ANSWERS:
            reply["said"] = ANSWERS[asks](folder, request["only"])
            reply["seconds"] = time.perf_counter() - start
            return reply
        found = diagnose(folder / CAMPAIGN, only=request["only"] or None, without=without)
        reply["seconds"] = time.perf_counter() - start
        reply["said"] = found.to_dict()
        at = "prediction"
        if (folder / FRESH).is_file():
            reply["predicted"] = _predict(found, folder)
            at = "refit of its parts"
            samples = found.model.samples(folder / FRESH)
            parts = refitted(found, read_campaign(folder / CAMPAIGN), samples)
            reply["refitted"] = {names: _plain(position) for names, position in parts.items()}
    except Exception as error:
        reply["error"] = f"the {at} failed: {type(error).__name__}: {error}"
    return reply


def _predict(found: Diagnosis, folder: Path) -> list[list[float]]:
    """Predict with the model as a user would have it: saved and loaded."""
    found.model.save(folder / MODEL)
    model = CorrectedModel.load(folder / MODEL)
    position, _ = model.predict(model.samples(folder / FRESH))
    if not np.all(np.isfinite(position)):
        raise ValueError("a predicted position is not a number")
    return _plain(position)


def _plain(position: NDArray[np.float64]) -> list[list[float]]:
    """Return positions in m as plain numbers, to a nanometre."""
    return [[float(value) for value in row] for row in position.round(9)]


def main(arguments: Sequence[str] | None = None) -> int:
    """Answer requests until there are no more."""
    (directory,) = sys.argv[1:] if arguments is None else arguments
    # whatever a library prints goes to stderr, C code included: the replies have a channel of their own
    with os.fdopen(os.dup(1), "w", encoding="utf-8") as replies:
        os.dup2(2, 1)
        sys.stdout = sys.stderr
        fence = Fence(Path(directory))
        sys.addaudithook(fence)
        # the first diagnosis of a process also pays for imports; none of the trial's is to be the first
        diagnose(demo_directory())
        _say(replies, {"ready": True})
        for line in sys.stdin:
            request = json.loads(line)
            fence.allow(Path(request["folder"]))
            _say(replies, answer(request))
    return 0


def _say(replies: Any, reply: dict[str, Any]) -> None:
    print(json.dumps(reply), file=replies, flush=True)


def _within(path: str, folder: str) -> bool:
    return path == folder or path.startswith(folder.rstrip(os.sep) + os.sep)


Plain = dict[str, Any]
_DATE = "date"


def comparison(folder: Path, only: Sequence[str]) -> Plain:
    """Compare the campaigns that are listed in a folder.

    Parameters
    ----------
    folder
        With the list and the campaigns.
    only
        Names of effects; all where empty.

    Returns
    -------
    dict
        Of the format ``thermal-robot/comparison/1``.
    """
    listed = campaigns(folder / LISTED)
    names = [name for name, _ in listed.campaigns]
    return compare(*(listed.folder(name) for name in names), names=names, only=only or None).to_dict()


def followed(folder: Path, only: Sequence[str]) -> Plain:
    """Follow the robot of dated campaigns; ``folder`` and ``only`` as for :func:`comparison`.

    Returns
    -------
    dict
        Of the format ``thermal-robot/wear/1``.
    """
    listed = campaigns(folder / LISTED)
    date = listed.names.index(_DATE)
    return wear(
        [(labels[date], listed.folder(name)) for name, labels in listed.campaigns], effects=only or None
    ).to_dict()


def fleet(folder: Path, only: Sequence[str]) -> Plain:
    """Diagnose the robots of a fleet and summarise; ``folder`` and ``only`` as for :func:`comparison`.

    It is what :func:`~thermal_robot.diagnose_many` does, but within this process: those of Dask would stand outside
    the fence, and outlive an examinee that is ended.

    Returns
    -------
    dict
        Of the format ``thermal-robot/fleet/1``.
    """
    listed = campaigns(folder / LISTED)
    write_rows(folder / TABLE, listed.names, _rows(listed, only))
    return summarise(folder / TABLE, listed.names).to_dict()


def _rows(listed: Listed, only: Sequence[str]) -> Iterator[Plain]:
    for name, labels in listed.campaigns:
        rows, _ = diagnosed(listed.folder(name), only, ())
        named = {"campaign": name, **dict(zip(listed.names, labels, strict=True))}
        yield from ({**named, **row} for row in json.loads(rows))


ANSWERS = {"comparison": comparison, "wear": followed, "fleet": fleet}
"""By what is asked (:data:`thermal_robot.blind.cases.ASKS`)."""


if __name__ == "__main__":
    sys.exit(main())
