"""What is asked of several campaigns, answered by the program: a comparison, a robot over time, a fleet."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from thermal_robot.blind.cases import LISTED
from thermal_robot.fleet.compare import compare
from thermal_robot.fleet.listed import Listed, campaigns
from thermal_robot.fleet.many import TABLE, diagnosed
from thermal_robot.fleet.rows import write_rows
from thermal_robot.fleet.summary import summarise
from thermal_robot.fleet.wear import wear

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
