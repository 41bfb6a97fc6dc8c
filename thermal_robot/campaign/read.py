"""From files to a campaign."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from thermal_robot.campaign.campaign import Campaign
from thermal_robot.campaign.declaration import FILE_NAME, check_gears, read_declaration
from thermal_robot.campaign.settings import Settings
from thermal_robot.campaign.table import Table
from thermal_robot.campaign.tabular import read_table, table_from_frame
from thermal_robot.campaign.ur_kinematics import with_kinematics
from thermal_robot.campaign.validate import build_campaign
from thermal_robot.errors import CampaignError, RobotError, require
from thermal_robot.robot import Robot, load_robot

if TYPE_CHECKING:
    import pandas as pd


def read_campaign(path: str | Path, *, folder: str | Path | None = None) -> Campaign:
    """Read and validate a campaign.

    Parameters
    ----------
    path
        campaign.toml, or the directory that holds it.
    folder
        Against which the paths in it are resolved; its own where absent.

    Returns
    -------
    Campaign
        In SI units; what is doubtful but was accepted stands in its ``warnings``.

    Raises
    ------
    CampaignError
        A file that cannot be used: names file, row and column, what was found and what was expected.
    RobotError
        A robot that cannot be loaded, or has no such frame.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> file = tr.write_campaign(tr.demo_campaign(), "hall_3")
    >>> tr.read_campaign(file)
    <Campaign 'hall_3': 120 samples of position, 5 joints, 8 covariates>
    """
    require("read_campaign()", path, (str, os.PathLike), f"the path of a {FILE_NAME}, or of its folder")
    if path == "":  # which Path takes for the folder that one stands in
        raise CampaignError("read_campaign()", "the path is empty", expected=f"that of a {FILE_NAME}, or of its folder")
    declaration = read_declaration(Path(path), None if folder is None else Path(folder))
    settings = declaration.settings
    try:
        robot = load_robot(
            declaration.robot, settings.tool_frame, root_frame=settings.root_frame, gravity=settings.gravity
        )
    except RobotError as error:
        raise RobotError(
            f"{declaration.file}, [robot]: {error}", name=error.name, candidates=error.candidates
        ) from error
    if declaration.kinematics:
        robot = with_kinematics(robot, declaration.kinematics)
    check_gears(declaration, robot.joint_names)
    file = Path(os.path.abspath(declaration.file))  # the parent of "." and ".." has a name, too
    name = file.parent.name if file.name == FILE_NAME else file.stem
    return build_campaign(read_table(declaration.table), settings, robot, name=name)


def read_samples(
    path: str | Path | pd.DataFrame | Table, settings: Settings | Campaign, robot: Robot | None = None
) -> Campaign:
    """Read a table of commands and conditions to predict.

    Parameters
    ----------
    path
        CSV or Parquet, or the table itself, already read or a data frame, with the columns and units of the campaign.
        Measured columns are ignored.
    settings
        Of the campaign that the model was fitted to, or that campaign itself.
    robot
        The robot; may be left out when a campaign is given.

    Returns
    -------
    Campaign
        With ``position`` and ``orientation`` ``None``, one sample per row in the file's order.

    Raises
    ------
    CampaignError
        A table that cannot be used.
    TypeError
        Settings without a robot.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> campaign = tr.demo_campaign()
    >>> tr.read_samples(campaign.to_frame().head(3), campaign)
    <Campaign 'table': 3 samples to predict, 5 joints, 8 covariates>
    """
    if isinstance(settings, Campaign):
        robot = robot or settings.robot
        settings = settings.settings
    if robot is None:
        raise TypeError("read_samples() needs the robot when it is given settings instead of a campaign")
    if isinstance(path, (str, os.PathLike)):
        path = read_table(Path(path))
    if isinstance(path, Table):
        return build_campaign(path, settings, robot, name=Path(path.file).stem, measured=False)
    import pandas as pd

    require("read_samples()", path, (pd.DataFrame,), "a table: its path, or a pandas DataFrame")
    return build_campaign(table_from_frame(path), settings, robot, name="table", measured=False)
