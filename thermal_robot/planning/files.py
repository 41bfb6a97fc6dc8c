"""A plan as files: a table, or the folder of a campaign that is still to be measured."""

from __future__ import annotations

from pathlib import Path

from thermal_robot.campaign.write import write_commands, write_planned
from thermal_robot.planning.plan import Plan

TABLE = ".csv"
COMMENTS = (
    "Planned, not yet measured: go direct from row to row in this order, and fill in measurements.csv: time in s, "
    "temperature in °C as recorded, and the target's place.",
    "plan.csv holds the temperatures that were planned; a column that will not be recorded is taken out.",
)


def write_plan(plan: Plan, path: str | Path) -> Path:
    """Write a plan: a table where the name ends in ``.csv``, else a folder that is made if need be.

    Parameters
    ----------
    plan
        What to write, in the units of its commands. Approaches are left out: they follow from the order of the rows.
    path
        The table, or the folder: campaign.toml, plan.csv, measurements.csv with empty cells for what is measured, and
        the robot.

    Returns
    -------
    Path
        The table or the campaign.toml.

    Raises
    ------
    CampaignError
        What cannot be written; a folder that holds a campaign already.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> from thermal_robot.planning import plan, write_plan
    >>> found = plan(tr.load_robot("builtin:rv_m2", "tool0"), rows=12, effects=["joint_gain"])
    >>> sorted(path.name for path in write_plan(found, "hall_3").parent.iterdir())
    ['campaign.toml', 'measurements.csv', 'plan.csv', 'robot.urdf']
    """
    derived = [name for name in plan.commands.covariates if name.startswith("approach.")]
    if Path(path).suffix.lower() != TABLE:
        return write_planned(plan.commands, path, comments=COMMENTS, derived=derived)
    write_commands(plan.commands, path, derived=derived)
    return Path(path)
