"""From files, or from a pandas data frame, to a campaign."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from thermal_robot.campaign.campaign import Campaign
from thermal_robot.campaign.checked import check_joints
from thermal_robot.campaign.document import FILE_NAME, check_gears, read_declaration
from thermal_robot.campaign.settings import (
    ANGLE_UNIT,
    GEARS,
    HOW_MOVED,
    LENGTH_UNIT,
    MOVES,
    PRIORS,
    SIGMA,
    STANDARD_TEMPERATURE,
    TEMPERATURE,
    VECTOR,
    WORD,
    Settings,
    as_vector,
)
from thermal_robot.campaign.table import Table, read_table, table_from_frame
from thermal_robot.campaign.units import SI
from thermal_robot.campaign.ur_kinematics import with_kinematics
from thermal_robot.campaign.validate import build_campaign
from thermal_robot.errors import CampaignError, RobotError, require
from thermal_robot.robot import Robot, load_robot
from thermal_robot.schema import Kind, MisfitError, boolean, optional, shown, text, word

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


FILE = "<table>"
"""What messages call the data frame."""
_NOISE = "a finite number above 0, or None"


def campaign_from_table(
    robot: Robot,
    table: pd.DataFrame,
    *,
    angle_unit: str | None = None,
    length_unit: str | None = None,
    base: str = "unknown",
    tool: str = "unknown",
    target: Sequence[float] = (0.0, 0.0, 0.0),
    noise_position: float | None = None,
    noise_orientation: float | None = None,
    payload_com: Sequence[float] = (0.0, 0.0, 0.0),
    reference_temperature: float = STANDARD_TEMPERATURE,
    moves: str = MOVES[0],
    priors: Mapping[str, float] | None = None,
    gears: Mapping[str, float] | None = None,
    name: str = "table",
    measured: bool = True,
) -> Campaign:
    """Make a campaign from a pandas data frame, with the columns and the validation of a campaign's file.

    Parameters
    ----------
    robot
        From :func:`thermal_robot.load_robot`.
    table
        One row per measurement. Messages speak of its rows by their integer index.
    angle_unit, length_unit
        Units of the columns; ``length_unit`` also of ``target``, ``noise_position`` and ``payload_com``. By default
        those that the table carries in its ``attrs``, as one of :meth:`Campaign.to_frame` does, else rad and m.
    base, tool
        ``"unknown"`` or ``"known"``, as under ``[frames]`` in campaign.toml.
    target
        The measured point in the tool frame.
    noise_position, noise_orientation
        One sigma per axis, length_unit and rad; ``None`` or 0 for not given.
    payload_com
        Centre of mass of the payload in the tool frame.
    reference_temperature
        °C at which the URDF's lengths hold.
    moves
        ``"direct"`` where the robot goes straight from pose to pose in the order of the rows, which tells directions of
        approach where no column does; else ``"unknown"``.
    priors, gears
        Expected size by effect; transmission ratio by joint.
    name
        Name of the campaign.
    measured
        False for samples to predict: x y z need not be there.

    Raises
    ------
    CampaignError
        As for a file, which is called ``<table>``.

    Examples
    --------
    >>> import pandas as pd
    >>> import thermal_robot as tr
    >>> robot = tr.load_robot("builtin:rv_m2", "tool0")
    >>> q = [[0.1 * k, 0.2, -0.3 * k, 0.1, 0.0] for k in range(1, 6)]
    >>> table = pd.DataFrame(q, columns=robot.joint_names)
    >>> table[["x", "y", "z"]] = 1e3 * robot.forward(q)[:, :3, 3]
    >>> tr.campaign_from_table(robot, table, length_unit="mm", base="known", tool="known")
    <Campaign 'table': 5 samples of position, 5 joints, 0 covariates>
    """
    import pandas as pd

    require("campaign_from_table(), robot", robot, (Robot,), "a robot, as load_robot gives it")
    require("campaign_from_table(), table", table, (pd.DataFrame,), "a pandas DataFrame")
    frame = word(("known", "unknown"), WORD)
    angle_unit = table.attrs.get("angle_unit", SI.angle) if angle_unit is None else angle_unit
    length_unit = table.attrs.get("length_unit", SI.length) if length_unit is None else length_unit
    stated = {
        "robot": {
            "moves": _given("moves", moves, HOW_MOVED),
            "reference_temperature": _given("reference_temperature", reference_temperature, TEMPERATURE),
        },
        "measurements": {
            "angle_unit": _given("angle_unit", angle_unit, ANGLE_UNIT),
            "length_unit": _given("length_unit", length_unit, LENGTH_UNIT),
        },
        "frames": {
            "base": _given("base", base, frame),
            "tool": _given("tool", tool, frame),
            "target": _given("target", target, VECTOR, "three numbers"),
        },
        "noise": {
            "position": _given("noise_position", noise_position, optional(SIGMA), _NOISE),
            "orientation": _given("noise_orientation", noise_orientation, optional(SIGMA), _NOISE),
        },
        "payload": {"com": _given("payload_com", payload_com, VECTOR, "three numbers")},
        "priors": _given("priors", {} if priors is None else priors, PRIORS),
        "gears": _given("gears", {} if gears is None else gears, GEARS),
    }
    ends = {"tool_frame": robot.tool_frame, "root_frame": robot.root_frame, "gravity": as_vector(robot.gravity)}
    settings = Settings.stated(stated, urdf="", **ends)
    check_joints(FILE, "gears", settings.gears, robot.joint_names)
    name, measured = _given("name", name, text(empty=True)), _given("measured", measured, boolean)
    return build_campaign(table_from_frame(table, FILE), settings, robot, name=name, measured=measured)


def _given(argument: str, value: Any, kind: Kind, expected: str = "") -> Any:
    """Return an argument of a kind; what is no such value is told by the argument's name."""
    try:
        return kind(value, argument)
    except MisfitError as error:
        problem = error.problem or "wrong kind of value"
        found = shown(value if expected else error.value)
        column = argument if expected else error.path
        raise CampaignError(FILE, problem, column=column, found=found, expected=expected or error.expected) from None
