"""A table of another program becomes a campaign, by a plan: every importer's last step."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from thermal_robot.campaign import names
from thermal_robot.campaign.campaign import Campaign
from thermal_robot.campaign.importers.plan import JOINTS, Column, Plan, found, planned
from thermal_robot.campaign.names import listed
from thermal_robot.campaign.recognise import headings, size, wanted
from thermal_robot.campaign.table import Cells, Table
from thermal_robot.campaign.units import ANGLE_UNITS, LENGTH_UNITS
from thermal_robot.campaign.validate import build_campaign
from thermal_robot.errors import CampaignError
from thermal_robot.robot import Robot


@dataclass(frozen=True)
class Source:
    """What a format makes of the files that it is given.

    Attributes
    ----------
    table
        Rows of commands and measurements, in the columns of that program.
    plan
        What the format says of these columns; the user's mapping counts for more.
    notes
        What was left out before, and why; what was found out. A sentence each.
    comments
        Sentences that belong into campaign.toml.
    """

    table: Table
    plan: Plan
    notes: tuple[str, ...] = ()
    comments: tuple[str, ...] = ()


@dataclass(frozen=True)
class Format:
    """A format that can be imported.

    Attributes
    ----------
    does, files
        What it reads, and which files, for the help.
    read
        Makes a table of them, and says as a mapping would what its columns are.
    least, most
        How many files it has.
    """

    does: str
    files: str
    read: Callable[[Sequence[Path], Plan], Source]
    least: int = 1
    most: int = 2

    def source(self, files: Sequence[Path], plan: Plan) -> Source:
        """Read the files.

        Raises
        ------
        CampaignError
            Another number of files than the format has, or what its reader raises.
        """
        files_of(files, self.files, self.least, self.most)
        return self.read(files, plan)


def files_of(files: Sequence[Path], expected: str, least: int, most: int) -> None:
    """Refuse another number of files than a format has.

    Raises
    ------
    CampaignError
        Naming what is expected.
    """
    if not least <= len(files) <= most:
        raise CampaignError(
            "FILES", "another number of files than this format has", found=str(len(files)), expected=expected
        )


def campaign_of(source: Source, plan: Plan, robot: Robot, name: str) -> tuple[Campaign, tuple[str, ...]]:
    """Return the campaign of a table, and in sentences how many rows it has and what was left out.

    Parameters
    ----------
    source
        The table, with what its format says of it.
    plan
        All that is said of it, the user's mapping first.
    robot
        Whose joints the columns command.
    name
        Of the campaign.

    Raises
    ------
    CampaignError
        Whatever cannot be used, with row and column of the table.
    """
    table = source.table
    columns = _columns(table, plan, robot)
    plan = plan.over(planned({"measurements": _units(table, columns, robot)}))
    settings = plan.settings(robot)
    columns = {name: _in_units(column, table, wanted(name, robot, settings.units)) for name, column in columns.items()}
    measured = np.zeros(len(table.rows), dtype=bool)
    places = [name for name in columns if name in names.POSITION or names.target_of(name)]
    for axis in places:
        measured |= ~np.isnan(columns[axis].numbers(table))
    whole = set(names.POSITION) <= set(columns) or any(map(names.target_of, places))
    if not measured.any() and whole:
        raise CampaignError(table.file, "no row has a measured position", expected="x, y and z of a point")
    notes = [f"{len(table.rows)} rows read, {int(measured.sum())} taken"]
    if not measured.all() and whole:
        notes.append(f"{table.told(~measured)} left out, without a measured position")
        table = table.take(measured)
    cells = _cells(table, columns, robot)
    orientation = plan.get("orientation", "stated")
    if orientation is not None:
        cells.update(zip(names.ORIENTATION, orientation.quaternions(table).T, strict=True))
    spare = _spare(table, columns.values(), () if orientation is None else orientation.columns)
    if spare:
        notes.append(f"columns left out: {listed(spare)}")
    ready = Table(table.file, cells, table.rows, table.header, warnings=table.warnings)
    campaign = build_campaign(ready, settings, robot, name=name)
    # what follows from the order of the rows is not recorded: it will follow again
    kept = {name: values for name, values in campaign.covariates.items() if name not in campaign.derived}
    return replace(campaign, covariates=kept, derived=()), (*source.notes, *notes)


def _columns(table: Table, plan: Plan, robot: Robot) -> dict[str, Column]:
    """Return where each column comes from: as stated, else from the column of that name where there is one."""
    stated = dict(plan.sections.get("columns", {}))
    joints = stated.pop(JOINTS, ())
    if joints and len(joints) != robot.n:
        raise CampaignError(
            plan.file or table.file,
            "another number of joints than the chain has",
            column=f"columns.{JOINTS}",
            found=str(len(joints)),
            expected=f"{robot.n}: {listed(robot.joint_names)}",
        )
    orientation = plan.get("orientation", "stated")
    place = () if orientation is None else orientation.position
    taken = () if orientation is None else names.ORIENTATION
    own = {name: name for name in table.columns if _defined(name, robot)}
    own |= {name: heading.column for name, heading in headings(table.columns, robot).items()}
    found_out = {name: Column((column,)) for name, column in own.items() if name not in taken}
    in_order = dict(zip(robot.joint_names, joints, strict=bool(joints)))
    return {**found_out, **dict(zip(names.POSITION, place, strict=bool(place))), **in_order, **stated}


def _units(table: Table, columns: dict[str, Column], robot: Robot) -> dict[str, str]:
    """Return the units of angles and lengths that headers name, of the first column that has one."""
    said = {name: columns[name].header_unit(table) for name in (*names.POSITION, *robot.joint_names) if name in columns}
    kinds = {"angle_unit": ANGLE_UNITS, "length_unit": LENGTH_UNITS}
    return {key: unit for key, kind in kinds.items() for unit in reversed(said.values()) if unit in kind}


def _in_units(column: Column, table: Table, unit: str) -> Column:
    """Return a column whose header's unit is converted to that of the campaign's."""
    scale = size(column.header_unit(table), unit) if unit else 1.0
    return column if scale in (1.0, None) else replace(column, scale=column.scale * scale)


def _defined(name: str, robot: Robot) -> bool:
    """Return whether the format of a campaign defines a column of this name for the robot."""
    known = (*names.RESERVED, *robot.joint_names, *names.conditions(robot.joint_names, robot.urdf_links))
    return name in known or names.target_of(name) is not None


def _cells(table: Table, columns: dict[str, Column], robot: Robot) -> dict[str, Cells]:
    """Return the campaign's columns; none of a command or a measurement may have a gap."""
    whole = (*robot.joint_names, *names.POSITION)
    cells: dict[str, Cells] = {}
    for name in dict.fromkeys([*(n for n in whole if n in columns), *columns]):
        if name in names.LABELS:
            cells[name] = columns[name].text(table)
        else:
            cells[name] = columns[name].complete(table, name) if name in whole else columns[name].numbers(table)
    return cells


def _spare(table: Table, columns: Iterable[Column], oriented: Iterable[Column]) -> list[str]:
    used = {found(table, source) for column in (*columns, *oriented) for source in column.sources}
    return [name for name in table.columns if name not in used]
