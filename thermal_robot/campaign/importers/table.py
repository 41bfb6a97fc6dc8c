"""Any table, by a mapping: FILES are the table, or the measured and the commanded one, and ``--mapping`` says the rest.

The mapping is described in docs/importers.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from thermal_robot.campaign.importers.columns import found
from thermal_robot.campaign.importers.join import commands, joined
from thermal_robot.campaign.importers.mapped import Format, Source
from thermal_robot.campaign.importers.plan import Plan
from thermal_robot.campaign.tabular import read_table
from thermal_robot.errors import CampaignError


def _read(files: Sequence[Path], plan: Plan) -> Source:
    """Read one table, or two that are joined by the names in ``[table] key``, else row by row."""
    if plan.get("table", "targets") is not None:
        expected = 'the format `points`; or the columns of each target, "x.1" = …, in [columns]'
        raise CampaignError(plan.file, "is for lists of points", column="table.targets", expected=expected)
    table = read_table(files[0], plan.layout())
    if len(files) == 1:
        return Source(table, Plan())
    key = plan.get("table", "key")
    both, notes = joined(table, commands(files[1], plan), "" if key is None else found(table, key))
    return Source(both, Plan(), notes)


FORMAT = Format(
    "any table, by a mapping; or two, of what was measured and of what was commanded",
    "TABLE, or MEASURED COMMANDED",
    _read,
)
