"""Several targets of one pose, a line each in a list of points, become one row of x.1 y.1 z.1, x.2 and so on."""

from __future__ import annotations

from collections import Counter

import numpy as np

from thermal_robot.campaign import names
from thermal_robot.campaign.names import listed
from thermal_robot.campaign.table import Table
from thermal_robot.errors import CampaignError


def grouped(table: Table, key: str, targets: str) -> tuple[Table, str]:
    """Return a table with a row for each visit of a pose, and in a sentence which targets there are.

    Targets are numbered as they first appear. One that is measured again at a pose begins another visit. A target that
    a visit lacks has empty cells there.

    Parameters
    ----------
    table
        A line a point, with the columns x, y and z.
    key, targets
        Columns of the names of poses, and of those of targets on the tool.

    Raises
    ------
    CampaignError
        A column that is not there; a single target.
    """
    for column in (key, targets):
        if column not in table.columns:
            raise CampaignError(
                table.file, "there is no such column", column=column, expected=f"one of {listed(list(table.columns))}"
            )
    poses, called = table.text(key), table.text(targets)
    order = {name: k for k, name in enumerate(dict.fromkeys(called))}
    if len(order) < 2:
        raise CampaignError(
            table.file,
            "holds a single target of each pose",
            column=targets,
            found=listed(list(order)),
            expected="names of several targets, or no [table] targets",
        )
    seen: Counter[tuple[str, str]] = Counter()
    visits: dict[tuple[str, int], int] = {}
    first: list[int] = []
    place = np.empty((len(poses), 2), dtype=np.int64)
    for line, (pose, target) in enumerate(zip(poses, called, strict=True)):
        visit = (pose, seen[pose, target])
        seen[pose, target] += 1
        if visit not in visits:
            visits[visit] = len(first)
            first.append(line)
        place[line] = visits[visit], order[target]
    values = np.full((len(first), len(order), 3), np.nan)
    values[place[:, 0], place[:, 1]] = np.stack([table.numbers(axis, gaps=True) for axis in names.POSITION], axis=1)
    cells = {key: [poses[line] for line in first]}
    told = {f"{axis}.{k + 1}": values[:, k, i] for k in range(len(order)) for i, axis in enumerate(names.POSITION)}
    both = Table(table.file, {**cells, **told}, table.rows[first], table.header, warnings=table.warnings)
    return both, f"{len(order)} targets of each pose, numbered so: {listed(list(order))}"
