"""Writers of campaigns: campaign.toml, table and robot; tables of predictions."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from thermal_robot.campaign import names
from thermal_robot.campaign.campaign import Campaign
from thermal_robot.campaign.document import FILE_NAME
from thermal_robot.campaign.recognise import Heading, headings
from thermal_robot.campaign.settings import FIELDS, scaled
from thermal_robot.campaign.table import PARQUET, TABLES, WORKBOOKS, without_library
from thermal_robot.campaign.targets import of_a_point
from thermal_robot.campaign.units import ANGLE_UNITS, LENGTH_UNITS, Units
from thermal_robot.errors import CampaignError, require
from thermal_robot.files import whole, write_one, write_text
from thermal_robot.robot import Robot

if TYPE_CHECKING:
    import pandas as pd

TABLE_NAME, PLAN_NAME, ROBOT_NAME = "measurements.csv", "plan.csv", "robot.urdf"


def write_campaign(campaign: Campaign, directory: str | Path, *, comments: Sequence[str] = ()) -> Path:
    """Write a campaign so that reading it gives the same arrays.

    Filled gaps are written with the values that filled them.

    Parameters
    ----------
    campaign
        With measured positions.
    directory
        Folder, created if missing; campaign.toml, measurements.csv and robot.urdf in it are replaced.
    comments
        Sentences that campaign.toml begins with.

    Returns
    -------
    Path
        Path of the campaign.toml.

    Raises
    ------
    CampaignError
        Samples without measured positions, which :func:`write_table` writes; a directory that cannot be
        written.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> file = tr.write_campaign(tr.demo_campaign(), "hall_3", comments=["Before the gear was changed."])
    >>> sorted(path.name for path in file.parent.iterdir())
    ['campaign.toml', 'measurements.csv', 'robot.urdf']
    """
    require("write_campaign()", campaign, (Campaign,), "a campaign")
    require("write_campaign()", directory, (str, os.PathLike), "the path of a folder")
    folder = Path(directory)
    if not campaign.measured:
        raise CampaignError(str(folder), "samples without measured positions are no campaign")
    file = _declare(campaign, folder, comments)
    write_table(campaign, folder / TABLE_NAME)
    return file


def write_planned(
    commands: Campaign, directory: str | Path, *, comments: Sequence[str] = (), derived: Sequence[str] = ()
) -> Path:
    """Write the folder of a campaign still to be measured; return the path of its campaign.toml.

    Beside campaign.toml and the robot stand plan.csv, all that is planned, and measurements.csv, the same with empty
    cells where something is to be recorded: the target's place and the temperatures.

    ``commands`` has no measured positions; with orientations it asks for these, too, and at sockets or planes for the
    joints. ``derived`` columns follow from the order of the rows, and are left out. A directory that holds a
    campaign.toml is refused: somebody may have filled in its table.
    """
    folder = Path(directory)
    if (folder / FILE_NAME).exists():
        expected = "another folder, as its measurements would be overwritten"
        raise CampaignError(str(folder), "there is a campaign already", expected=expected)
    file = _declare(commands, folder, comments)
    write_commands(commands, folder / PLAN_NAME, derived=derived)
    write_commands(commands, folder / TABLE_NAME, derived=derived, recorded=True)
    return file


def write_commands(
    commands: Campaign, path: str | Path, *, derived: Sequence[str] = (), recorded: bool = False
) -> None:
    """Write a CSV table of commands, with empty cells for the measurements.

    ``derived`` are columns that are left out; with ``recorded`` cells of temperatures, to be recorded, are empty, too,
    and those of the joints where the robot is led to sockets or planes.
    """
    frame = replace(commands, orientation=None).to_frame().drop(columns=list(derived), errors="ignore")
    measured = names.KINDS[commands.measures][0]
    if recorded and not measured:  # led to a socket or a plane, it is the joints that are read
        measured = commands.robot.joint_names
    noted = [str(name) for name in frame if names.split_name(str(name))[0] == "temperature"] if recorded else []
    frame = frame.assign(**dict.fromkeys((*noted, *measured), ""))
    _write(Path(path), frame.to_csv, lineterminator="\n", float_format="%.9g")


def _declare(campaign: Campaign, folder: Path, comments: Sequence[str]) -> Path:
    """Write campaign.toml and robot.urdf to a folder; return the path of campaign.toml."""
    import tomli_w

    file = folder / FILE_NAME
    remarks = "".join(f"# {' '.join(comment.split())}\n" for comment in comments)

    def write(folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        write_text(folder / ROBOT_NAME, campaign.robot.urdf)
        write_text(file, remarks + tomli_w.dumps(_document(campaign)))

    try:
        write_one(str(folder), write)
    except ValueError as error:  # NUL in a name
        raise CampaignError(str(folder), f"cannot be written: {error}") from error
    return file


def write_table(campaign: Campaign, path: str | Path) -> None:
    """Write the table of a campaign, or of samples, as CSV in the campaign's units, with all digits."""
    _write(Path(path), campaign.to_frame().to_csv, lineterminator="\n")


def _write(path: Path, write: Callable[..., Any], **how: str) -> None:
    """Write a file by a data frame's own method ``write``, atomically: as a whole or not at all."""

    def put(target: Path) -> None:
        with whole(target) as place:
            write(place, index=False, **how)

    write_one(str(path), put)


def with_prediction(
    samples: pd.DataFrame,
    robot: Robot,
    position: ArrayLike,
    orientation: ArrayLike | None,
    std: ArrayLike,
    outside: Sequence[Sequence[str]],
    units: Units,
) -> pd.DataFrame:
    """Replace the measured columns of N samples by predicted ones; other columns stay.

    ``position`` (N, 3), m, is that of the target, ``std`` (N, 3), m, its standard deviation per axis, both written in
    the length unit; ``orientation`` (N, 4) are unit quaternions wxyz; ``outside`` lists per row the columns whose
    values are outside the measured range.
    """
    place = dict(zip(names.POSITION, np.asarray(position).T / units.length_scale, strict=True))
    turn = {} if orientation is None else dict(zip(names.ORIENTATION, np.asarray(orientation).T, strict=True))
    return _beside(samples, headings(samples.columns, robot), {**place, **turn, **_known(std, outside, units)})


def with_commands(
    samples: pd.DataFrame,
    robot: Robot,
    q: ArrayLike,
    std: ArrayLike,
    outside: Sequence[Sequence[str]],
    direction: ArrayLike,
    units: Units,
) -> pd.DataFrame:
    """Replace the joint positions of N samples by corrected commands ``q`` (N, n), rad or m, in the table's units.

    ``std`` (N, 3), m, and ``outside`` are as for :func:`with_prediction`; ``direction`` (N,), rad, is the angle by
    which the target's direction is missed.
    """
    found = headings(samples.columns, robot)
    own, there = {}, {str(name).strip(): str(name) for name in samples.columns}
    for joint, kind, commanded in zip(robot.joint_names, robot.joint_types, np.asarray(q).T, strict=True):
        column, unit = found.get(joint, Heading(joint, None))
        scale = (LENGTH_UNITS | ANGLE_UNITS)[unit] if unit else units.joint_scale(kind)
        if column in there:
            own[there[column]] = commanded / scale
    missed = {names.MISSED: np.asarray(direction) / units.angle_scale}
    return _beside(samples.assign(**own), found, {**_known(std, outside, units), **missed})


def _known(std: ArrayLike, outside: Sequence[Sequence[str]], units: Units) -> dict[str, Any]:
    """Columns of a prediction's uncertainty: ``std.x`` … in the length unit, and ``outside`` as text."""
    columns: dict[str, Any] = dict(zip(names.STD, np.asarray(std).T / units.length_scale, strict=True))
    return {**columns, names.OUTSIDE: [" ".join(left) for left in outside]}


def _beside(samples: pd.DataFrame, found: Mapping[str, Heading], columns: dict[str, Any]) -> pd.DataFrame:
    """Return the samples with further columns; measured columns, and those of the same names, are dropped."""
    called = {heading.column: name for name, heading in found.items()}
    meant = [called.get(str(name).strip(), str(name).strip()) for name in samples.columns]
    goes = [name in names.MEASURED or names.target_of(name) is not None or name in columns for name in meant]
    return samples.loc[:, ~np.array(goes, dtype=bool)].assign(**columns)


def write_predictions(path: str | Path, predictions: pd.DataFrame) -> None:
    """Write the result of :func:`with_prediction` as CSV with all digits or, by its ending, as Parquet or a workbook.

    Raises
    ------
    CampaignError
        An unknown ending, a file that cannot be written, or a library that is missing.
    """
    ending = Path(path).suffix.lower()
    if ending and ending not in TABLES:
        raise CampaignError(str(path), "is no table by its ending", found=ending, expected=", ".join(TABLES))
    try:
        if ending in PARQUET:
            _write(Path(path), predictions.to_parquet)
        elif ending in WORKBOOKS:
            _write(Path(path), predictions.to_excel)
        else:
            _write(Path(path), predictions.to_csv, lineterminator="\n")
    except ImportError as error:
        raise without_library(str(path), ending) from error


def _document(campaign: Campaign) -> dict[str, Any]:
    """Content of campaign.toml as a dict, lengths in the campaign's unit."""
    settings, several = campaign.settings, campaign.targets
    scale, sigma = settings.units.length_scale, settings.noise_position
    known = {
        "urdf": ROBOT_NAME,
        "base_known": "known" if settings.base_known else "unknown",
        "tool_known": "known" if settings.tool_known else "unknown",
        "noise_position": None if sigma is None or campaign.noise_of_rows is not None else of_a_point(sigma, several),
        "noise_orientation": None if several else settings.noise_orientation,
    }
    units = {"angle_unit": settings.units.angle, "length_unit": settings.units.length}
    document: dict[str, Any] = {"robot": {}, "measurements": {"file": TABLE_NAME, **units}}
    for name, (section, key, _, length) in FIELDS.items():
        value = known[name] if name in known else getattr(settings, name)
        if value is None or value == "":
            continue
        value = scaled(value, 1.0 / scale) if length else value
        document.setdefault(section, {}).update({key: value} if key else value)
    document |= settings.facts
    return {section: content for section, content in document.items() if content}
