"""Joint readings of MUKCa: a ball on the tool, held in each of two sockets of a stand.

Source of the layout: Franzese, Spahn, Kober and Della Santina, *MUKCa: Accurate and Affordable Cobot Calibration
Without External Measurement Devices* (arXiv 2503.12584), github.com/platonics-delft/kinematics_calibration, ``data``,
``calibrate_fk/utils.py``: a folder for each place of the stand, with ``hole_0.csv`` and ``hole_1.csv``, a row for each
posture, joint positions in rad without a header; sockets are 0.05 m apart. Files ``hole_0_pose.csv`` beside them hold
what the controller made of it, and are left out. An arm was led by hand from posture to posture. One table of all
rows, with columns ``stand`` and ``socket``, is read, too.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from thermal_robot.campaign.importers.plan import Format, Plan, Source, planned
from thermal_robot.campaign.table import Cells, Layout, Table, read_table
from thermal_robot.errors import CampaignError

_HOLE = re.compile(r"hole_(\d+)\.csv")
_APART = 50.0  # mm, OFFSET_DISTANCE of the source
_MOST = 1000  # files: no campaign has so many stands


def _holes(files: Sequence[Path]) -> list[Path]:
    """Return the files of sockets among some files, or in folders at any depth, sorted."""
    inside = [found for file in files for found in (sorted(file.rglob("hole_*.csv")) if file.is_dir() else [file])]
    holes = [file for file in inside if _HOLE.fullmatch(file.name)]
    if not holes:
        expected = "hole_0.csv, hole_1.csv in a folder for each place of the stand"
        raise CampaignError(str(files[0]), "holds no readings of sockets", expected=expected)
    return holes


def _mukca(files: Sequence[Path], plan: Plan) -> Source:
    said: dict[str, dict[str, Any]] = {
        "robot": {"moves": "unknown"},
        "measurements": {"angle_unit": "rad", "length_unit": "mm", "kind": "socket"},
    }
    if len(files) == 1 and files[0].is_file() and not _HOLE.fullmatch(files[0].name):
        return Source(read_table(files[0], plan.layout()), planned(said))
    holes = _holes(files)
    tables = [read_table(file, Layout(header=False)) for file in holes]
    wide = {len(table.columns) for table in tables}
    if len(wide) > 1:
        raise CampaignError(str(holes[0]), "other files have another number of joints", found=str(sorted(wide)))
    stands = [file.parent.name for file in holes]
    sockets = [_HOLE.fullmatch(file.name)[1] for file in holes]  # type: ignore[index]
    rows = [len(table.rows) for table in tables]
    joints = [f"joint {k + 1}" for k in range(wide.pop())]
    columns: dict[str, Cells] = {
        name: np.concatenate([table.numbers(list(table.columns)[k]) for table in tables])
        for k, name in enumerate(joints)
    }
    columns |= {"stand": np.repeat(stands, rows).tolist(), "socket": np.repeat(sockets, rows).tolist()}
    columns["order"] = np.arange(float(sum(rows)))
    table = Table(str(holes[0].parent.parent), columns, np.arange(2, sum(rows) + 2))
    note = f"{len(holes)} sockets on {len(set(stands))} stands; {_APART:g} mm between two of a stand are not used"
    return Source(table, planned({**said, "columns": {"joints": joints}}), (note,))


MUKCA = Format(
    "a ball in printed sockets, read by the joints alone (MUKCa)", "FOLDERS or hole_0.csv …", _mukca, most=_MOST
)
