"""Readers of campaigns and of further rows, from files or a pandas data frame: validated, in SI, gaps filled."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign import names
from thermal_robot.campaign.campaign import Campaign, read_alike
from thermal_robot.campaign.checked import LARGEST_COMMAND, check_covariate, check_joints, check_quaternions
from thermal_robot.campaign.document import FILE_NAME, read_declaration
from thermal_robot.campaign.names import CLOCK, split_name
from thermal_robot.campaign.plausible import doubts
from thermal_robot.campaign.recognise import Columns, named, recognise
from thermal_robot.campaign.settings import (
    FIELDS,
    KINDS,
    MOVES,
    SAME_CONFIGURATION,
    SMALLEST,
    STANDARD_TEMPERATURE,
    Settings,
    as_vector,
    given,
)
from thermal_robot.campaign.table import Table, listed_rows, read_table, table_from_frame
from thermal_robot.campaign.targets import FEWEST, Posed, posed, propagated_sigma, telling
from thermal_robot.campaign.turning import arrivals
from thermal_robot.campaign.units import SI, Units, scale_of
from thermal_robot.campaign.ur_kinematics import with_kinematics
from thermal_robot.errors import CampaignError, RobotError, require
from thermal_robot.robot import Robot, load_robot
from thermal_robot.schema import boolean, text

if TYPE_CHECKING:
    import pandas as pd

MINIMUM_POSES = 3  # Distinct configurations without which a rigid frame can turn about the line through two points


def build_campaign(table: Table, settings: Settings, robot: Robot, *, name: str, measured: bool = True) -> Campaign:
    """Validate a table and build the campaign in SI; a CampaignError names row and column.

    With ``measured`` false the rows are to be predicted, and measured columns are ignored.
    """
    units, told, left_out = settings.units, None, list[str]()
    table = named(table, robot, units)
    columns = recognise(table, robot, measured=measured, kind=settings.kind)
    if columns.targets:
        table, told, left_out = of_targets(table, columns, settings)
        settings = replace(settings, tool_known=False)
    q = _commands(table, robot, units)
    covariates, missing, gaps = _covariates(table, columns, robot, units, q)
    settings, columns = framed(settings, columns)
    groups = names.POSES.items()
    poses: dict[str, Any] = {key: _pose(table, group, units) for key, group in groups if group in columns.groups}
    poses["readings"], labels = readings(table, columns, settings)
    poses |= {"position": told.position, "orientation": told.orientation} if told else {}
    campaign = Campaign(
        name,
        robot,
        q,
        **poses,
        covariates=covariates,
        extra=columns.extra,
        labels=labels,
        **settings.of_rows(),
        priors=settings.priors,
        urdf=settings.urdf,
        **_noise(table, columns, settings, told),
        rows=table.rows,
        missing=missing,
    )
    left_out += _too_few(table.file, campaign) if measured else []
    warnings = (*table.warnings, *columns.warnings, *left_out, *gaps, *doubts(campaign))
    return replace(arrived(campaign), warnings=warnings)


def arrived(campaign: Campaign) -> Campaign:
    """Add directions of approach derived from the order of rows, if none are recorded and moves are ``"direct"``."""
    recorded = any(split_name(name)[0] == "approach" for name in campaign.covariates)
    if recorded or campaign.moves != "direct":
        return campaign
    joints, sessions = campaign.robot.joint_names, campaign.labels.get("session")
    found = arrivals(campaign.q, joints, campaign.covariates, sessions)
    return replace(campaign, covariates={**campaign.covariates, **found}, derived=tuple(found))


def framed(settings: Settings, columns: Columns) -> tuple[Settings, Columns]:
    """Complete settings and columns by what follows from the kinds of measurement.

    Moves not stated are ``"unknown"`` where the robot is led to a socket or plane, else ``"direct"``; base and tool are
    known for poses from the controller, the base also where no row is a position or pose.
    """
    led = {*columns.kinds, settings.kind} & {*names.TOUCHED}  # by hand, from whatever side
    settings = replace(settings, moves=settings.moves or MOVES[bool(led)])
    if columns.kinds == ("controller",):  # poses like any other, in the controller's frames
        groups = (names.POSITION, names.ORIENTATION, *columns.groups)
        return replace(settings, base_known=True, tool_known=True), replace(columns, groups=groups)
    # nothing but an instrument says where the base stands: without one it stands where the URDF has it
    alone = bool(columns.kinds) and not {"position", "pose"} & {*columns.kinds}
    return replace(settings, base_known=settings.base_known or alone), columns


def readings(
    table: Table, columns: Columns, settings: Settings
) -> tuple[dict[str, Array], dict[str, NDArray[np.str_]]]:
    """Read the figures (N,) of rows of other kinds than position and pose, by column in SI, and all label columns.

    Figures are 0 in rows of another kind; labels include each row's kind. A missing value is refused.
    """
    labels = {label: np.array(table.text(label), dtype=np.str_) for label in columns.labels}
    if not columns.kinds:
        return {}, labels
    if columns.kinds == ("controller",):
        return {}, labels | {names.KIND: np.full(len(table.rows), "controller")}
    stated = table.text(names.KIND) if names.KIND in table.columns else [columns.kinds[0]] * len(table.rows)
    kind, figures, missing = np.array(stated, dtype=np.str_), dict[str, Array](), "a value is missing"
    for own in columns.kinds:
        numeric, texts = names.KINDS[own]
        here, spare = kind == own, [name for name in names.OPTIONAL.get(own, ()) if name in table.columns]
        for column in (*numeric, *spare):
            values = table.numbers(column, gaps=True) * names.reading_scale(column, settings.units.length_scale)
            if column in numeric:
                table.refuse(here & np.isnan(values), missing, column, "a number")
            figures[column] = np.where(here & ~np.isnan(values), values, figures.get(column, 0.0))
        for column in texts:
            labels[column] = np.array(table.text(column), dtype=np.str_)
            table.refuse(np.asarray(here & (labels[column] == "")), missing, column, "a label")
    if (apart := np.isin(kind, names.APART)).any():
        sat = {*zip(labels["stand"][kind == "socket"], labels["socket"][kind == "socket"], strict=True)}
        expected = "a socket in which the ball sits, in a row of the same stand"
        for column in names.ENDS:
            astray = [end not in sat for end in zip(labels["stand"], labels[column], strict=True)]
            table.refuse(apart & np.array(astray), "no such socket", column, expected)
    return figures, labels | {names.KIND: kind}


def _commands(table: Table, robot: Robot, units: Units) -> Array:
    """Read the commanded joint positions (N, n), rad or m; one beyond 1e6 is refused."""
    columns = []
    for joint, kind in zip(robot.joint_names, robot.joint_types, strict=True):
        figures = table.numbers(joint)
        columns.append(figures * units.joint_scale(kind))
        far, expected = np.abs(columns[-1]) > LARGEST_COMMAND, f"at most {LARGEST_COMMAND:g} rad or m"
        table.refuse(far, "no joint goes so far", joint, expected)
    return np.column_stack(columns)


def _covariates(
    table: Table, columns: Columns, robot: Robot, units: Units, commands: Array
) -> tuple[dict[str, Array], dict[str, NDArray[np.bool_]], list[str]]:
    """Read the covariates (N,) in SI with gaps imputed, masks (N,) of the gaps, and sentences on the imputation."""
    covariates: dict[str, Array] = {}
    missing: dict[str, NDArray[np.bool_]] = {}
    warnings: list[str] = []
    clocks = (table.numbers(name, gaps=True) for name in CLOCK if name in columns.covariates)
    clock = next((values for values in clocks if not np.isnan(values).any()), None)
    for column in (*columns.covariates, *columns.extra):
        values = table.numbers(column, gaps=True)
        check_covariate(table.file, column, values, table.rows)
        gaps = np.isnan(values)
        if gaps.any():
            values, how = fill(column, values, None if column in CLOCK else clock)
            missing[column] = gaps
            warnings.append(f"column {column!r} is empty in {int(gaps.sum())} of {len(gaps)} rows: {how}")
        if column == "order" and _restarts(values, commands):
            values = np.arange(float(len(values)))
            warnings.append("column 'order' starts anew within the table: rows count as measured in the table's order")
        covariates[column] = values * scale_of(column, robot, units)
    return covariates, missing, warnings


def _restarts(order: Array, commands: Array) -> bool:
    """Whether ``order`` is no clock: it falls, only ever to its first number, at which commands then differ."""
    falls = np.flatnonzero(np.diff(order) < 0.0) + 1
    if not len(falls) or (order[falls] != order[0]).any():
        return False
    same = order == order[0]
    return bool((commands[same] != commands[0]).any())


def _pose(table: Table, group: Sequence[str], units: Units) -> Array:
    """Read a group of columns as positions (N, 3), m, or as normalised quaternions (N, 4) wxyz."""
    figures = np.column_stack([table.numbers(column) for column in group])
    if len(group) == len(names.POSITION):
        return figures * units.length_scale
    check_quaternions(table.file, group[0], figures, table.rows)
    return np.asarray(figures / np.linalg.norm(figures, axis=1, keepdims=True))


def _noise(table: Table, columns: Columns, settings: Settings, told: Posed | None) -> dict[str, Any]:
    """Noise and targets of a campaign as keyword arguments; noise of several targets is propagated to their pose."""
    stated, turn, each, targets = settings.noise_position, settings.noise_orientation, None, None
    place = stated
    if told:
        targets = told.targets
        place, turn = (None, None) if stated is None else propagated_sigma(stated, targets)
    if columns.has_noise:
        each = table.numbers(names.NOISE, gaps=True) * settings.units.length_scale
        each = each if stated is None else np.where(np.isnan(each), stated, each)
        expected, place = "one sigma above 0", None
        table.refuse(each < SMALLEST, "no standard deviation", names.NOISE, expected)
        more = f"{expected}, or [noise] position for the rows without one"
        table.refuse(np.isnan(each), "a value is missing", names.NOISE, more)
    return {"noise_position": place, "noise_of_rows": each, "targets": targets, "noise_orientation": turn}


def _too_few(file: str, campaign: Campaign) -> list[str]:
    """Warn if different configurations are too few to determine the unknown frames; refuse them if none is repeated."""
    if campaign.position is None:  # what rows of other kinds share is counted with them
        return []
    equations = 6 if campaign.measures == "pose" else 3
    # of the tool: the target's orientation is fitted where it is measured
    unknowns = {"base": 0 if campaign.base_known else 6, "tool": 0 if campaign.tool_known else equations}
    needed = max(-(-sum(unknowns.values()) // equations), MINIMUM_POSES if unknowns["base"] else 0)
    distinct = len(np.unique(np.round(campaign.q, SAME_CONFIGURATION), axis=0))
    if distinct >= needed:
        return []
    unknown = [word for word, count in unknowns.items() if count]
    problem = f"too few measurements to find the unknown {' and '.join(unknown)} frame{'s' if len(unknown) > 1 else ''}"
    found = f"{campaign.samples} rows with {distinct} different joint configurations"
    expected = f"at least {needed} different configurations"
    if distinct == campaign.samples:
        raise CampaignError(file, problem, found=found, expected=expected)
    return [f"{problem}: found {found}, expected {expected}; they tell repeatability alone"]


ASTRAY = 10.0
"""Times the usual deviation from which on targets of a row are said not to keep their places: noise comes to five."""
LOOSE = 2.0  # Times the stated noise from which on targets are said to move against each other


def of_targets(table: Table, columns: Columns, settings: Settings) -> tuple[Table, Posed, list[str]]:
    """Compute the pose of each row from several targets (Procrustes), with sentences on what is left out or doubtful.

    Returns the table of rows that determine a pose, too. A CampaignError refuses a simulator's prediction, incomplete
    coordinates, collinear targets in all rows, and a target never seen with three others.
    """
    several = columns.targets
    file, first = table.file, f"x.{several[0]}"
    if names.SIMULATED_POSITION in columns.groups:
        problem, expected = "sim.x, sim.y, sim.z predict one target", "one target, as x y z; or no columns sim.*"
        raise CampaignError(file, problem, column=first, found=f"{len(several)} targets", expected=expected)
    points = np.stack([_points(table, number) for number in several], axis=1) * settings.units.length_scale
    kept = telling(points)
    if not kept.any():
        expected = f"{FEWEST} targets or more that are not on a line; or one target, as x y z"
        found = "fewer targets in each, or targets on a line"
        raise CampaignError(file, "no row tells a pose", column=first, found=found, expected=expected)
    seen = posed(several, points[kept])
    if seen is None:
        rarest = several[int(np.argmin(np.isfinite(points[kept, :, 0]).sum(axis=0)))]
        problem = "a target is never seen together with three others: its place cannot be found"
        raise CampaignError(file, problem, column=f"x.{rarest}", expected="rows that show it beside them")
    warnings = []
    if settings.tool_known:
        warnings.append('where several targets sit on the tool is fitted: tool = "known" counts as "unknown"')
    if not kept.all():
        few = f"fewer than {FEWEST} targets, or targets on a line"
        warnings.append(f"{listed_rows(table.rows[~kept])} left out: {few} tell no pose")
    taken = table.take(kept)
    return taken, seen, [*warnings, *_doubts(taken, seen, settings)]


def _points(table: Table, number: int) -> Array:
    """Positions (N, 3) of one target, in the file's unit; NaN where it was not seen."""
    axes = names.axes_of(number)
    found = np.column_stack([table.numbers(column, gaps=True) for column in axes])
    gaps = np.isnan(found)
    expected = f"a number, or {axes[0]}, {axes[1]} and {axes[2]} empty where the target was not seen"
    for column, lacking in zip(axes, gaps.T, strict=True):
        table.refuse(np.asarray(lacking & ~gaps.all(axis=1)), "a value is missing", column, expected)
    return found


def _doubts(table: Table, told: Posed, settings: Settings) -> list[str]:
    sigma, unit, scale = told.targets.sigma, settings.units.length, settings.units.length_scale
    noise, found = settings.noise_position, []
    astray = told.deviation > ASTRAY * max(sigma, noise or 0.0)
    if astray.any():
        far = f"{listed_rows(table.rows[astray])}, by up to {float(told.deviation.max()) / scale:.3g} {unit}"
        asked = "is one of them exchanged for another, or has one moved?"
        found.append(f"the targets do not keep their places on the tool in {far}: {asked}")
    if noise and sigma > LOOSE * noise:
        more = f"more than the stated noise of {noise / scale:.3g} {unit}"
        found.append(f"the targets move against each other by {sigma / scale:.3g} {unit} per axis, which is {more}")
    return found


def fill(column: str, values: Array, clock: Array | None = None) -> tuple[Array, str]:
    """Impute the gaps (NaN) of a covariate (N,); returns the filled values and a phrase that says how.

    A missing direction, velocity or acceleration is 0, which means "unknown" or "at rest". A payload or speed keeps its
    previous value. Everything else is interpolated linearly, and held at both ends. ``clock`` (N,) is the time of each
    row; without it rows are taken in their order.
    """
    gaps = np.isnan(values)
    quantity, _ = split_name(column)
    if quantity in ("approach", "velocity", "acceleration"):
        return np.where(gaps, 0.0, values), "taken as 0"
    at = np.arange(float(len(values))) if clock is None else clock
    sequence = np.argsort(at, kind="stable")
    known = sequence[~gaps[sequence]]
    if quantity in ("payload", "speed"):
        before = np.cumsum(~gaps[sequence]) - 1
        filled = np.empty(len(values))
        filled[sequence] = values[known[np.maximum(before, 0)]]
        return filled, f"the previous {'row' if clock is None else 'measurement'}'s value held"
    # repeats of one instant keep what each recorded
    between = np.interp(at, at[known], values[known])
    return np.where(gaps, between, values), f"interpolated {'between rows' if clock is None else 'in time'}"


def stated_path(call: str, path: str | Path, name: str = FILE_NAME) -> Path:
    """Validate a path argument of a ``call`` and convert it to a Path; another type or an empty text is refused."""
    require(call, path, (str, os.PathLike), f"the path of a {name}, or of its folder")
    if path == "":  # which Path takes for the folder that one stands in
        raise CampaignError(call, "the path is empty", expected=f"that of a {name}, or of its folder")
    return Path(path)


def name_of(file: Path, usual: str = FILE_NAME) -> str:
    """Return the name of a campaign from its file: the folder's name if the file has its usual name, else its stem."""
    file = Path(os.path.abspath(file))  # the parent of "." and ".." has a name, too
    return file.parent.name if file.name == usual else file.stem


def stated_robot(file: Path, reference: str | Path, tool_frame: str, **ends: Any) -> Robot:
    """Load the robot that the section ``[robot]`` of a file states; a :class:`RobotError` names the file, too."""
    try:
        return load_robot(reference, tool_frame, **ends)
    except RobotError as error:
        raise RobotError(f"{file}, [robot]: {error}", name=error.name, candidates=error.candidates) from error


def read_campaign(path: str | Path, *, folder: str | Path | None = None) -> Campaign:
    """Read and validate a campaign.

    Parameters
    ----------
    path
        campaign.toml, or the directory that holds it.
    folder
        Folder that the paths in campaign.toml are relative to; its own where absent.

    Returns
    -------
    Campaign
        Campaign in SI units; doubtful but accepted data are in its ``warnings``.

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
    declaration = read_declaration(stated_path("read_campaign()", path), None if folder is None else Path(folder))
    settings = declaration.settings
    ends = {"root_frame": settings.root_frame, "gravity": settings.gravity}
    robot = stated_robot(declaration.file, declaration.robot, settings.tool_frame, **ends)
    if declaration.kinematics:
        robot = with_kinematics(robot, declaration.kinematics)
    check_joints(str(declaration.file), "gears", settings.gears, robot.joint_names, declaration.gear_rows)
    name = name_of(declaration.file)
    return build_campaign(read_table(declaration.table), settings, robot, name=name)


def read_samples(
    path: str | Path | pd.DataFrame | Table, settings: Settings | Campaign, robot: Robot | None = None
) -> Campaign:
    """Read a table of commands and conditions to be predicted.

    Parameters
    ----------
    path
        CSV or Parquet, or the table itself, already read or a data frame, with the columns and units of the campaign.
        Measured columns are ignored.
    settings
        Settings of the model's campaign, or that campaign itself.
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


FILE = "<table>"  # What messages call the data frame


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
    moves: str | None = None,
    priors: Mapping[str, float] | None = None,
    gears: Mapping[str, float] | None = None,
    about: Mapping[str, str] | None = None,
    name: str = "table",
    measured: bool = True,
) -> Campaign:
    """Build a campaign from a pandas data frame, with the columns and the validation of a file.

    Parameters
    ----------
    robot
        From :func:`thermal_robot.load_robot`.
    table
        One row per measurement. Messages speak of its rows by their integer index.
    angle_unit, length_unit
        Units of the columns; ``length_unit`` also of ``target``, ``noise_position`` and ``payload_com``. By default
        those in the table's ``attrs``, which :meth:`Campaign.to_frame` sets, else rad and m.
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
        ``"direct"`` where the robot goes straight from pose to pose in the order of the rows, from which directions of
        approach are derived where no column has them; else ``"unknown"``. ``None`` is ``"unknown"`` for rows in which
        the robot was led to a socket or plane, else ``"direct"``.
    priors, gears
        Expected size by effect; transmission ratio by joint.
    about
        Entries for the first page of a report, by name: serial numbers, operator, date.
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
    angle_unit = table.attrs.get("angle_unit", SI.angle) if angle_unit is None else angle_unit
    length_unit = table.attrs.get("length_unit", SI.length) if length_unit is None else length_unit
    said: dict[tuple[str, str], Any] = {
        **({} if moves is None else {("robot", "moves"): moves}),
        ("robot", "reference_temperature"): reference_temperature,
        ("measurements", "angle_unit"): angle_unit,
        ("measurements", "length_unit"): length_unit,
        ("frames", "base"): base,
        ("frames", "tool"): tool,
        ("frames", "target"): target,
        ("noise", "position"): noise_position,
        ("noise", "orientation"): noise_orientation,
        ("payload", "com"): payload_com,
    }
    stated: dict[str, dict[str, Any]] = {}
    for (section, key), value in said.items():
        argument = f"{section}_{key}" if section in ("noise", "payload") else key
        stated.setdefault(section, {})[key] = given(FILE, argument, value, KINDS[section][key])  # type: ignore[index]
    for section, own in (("priors", priors), ("about", about), ("gears", gears)):
        stated[section] = given(FILE, section, {} if own is None else own, FIELDS[section].kind)
    ends = {"tool_frame": robot.tool_frame, "root_frame": robot.root_frame, "gravity": as_vector(robot.gravity)}
    settings = Settings.stated(stated, urdf="", **ends)
    check_joints(FILE, "gears", settings.gears, robot.joint_names)
    name, measured = given(FILE, "name", name, text(empty=True)), given(FILE, "measured", measured, boolean)
    return build_campaign(table_from_frame(table, FILE), settings, robot, name=name, measured=measured)


SAME_PLACE = 1e-9  # m: by which the tool frame differs between readings of one URDF at most


def more_rows(old: Campaign, rows: Campaign | pd.DataFrame, needs: tuple[str, ...]) -> Campaign:
    """Validate further rows, a campaign or a table in the old one's columns and units, as a campaign to append to it.

    Raises :class:`CampaignError` if robot, kind of measurement or declarations differ, or a needed column is missing.
    """
    if not isinstance(rows, Campaign):
        import pandas as pd

        expected = "a campaign of the same robot, or a pandas DataFrame of its columns"
        require("update(), rows", rows, (pd.DataFrame,), expected)
        rows = build_campaign(table_from_frame(rows, "<rows>"), old.settings, old.robot, name="rows")
    theirs = _stated(rows)
    for what, mine in _stated(old).items():
        if mine != theirs[what]:
            expected = f"{mine}, as of {old.name}"
            raise CampaignError(rows.name, f"another {what}", found=str(theirs[what]), expected=expected)
    if rows.robot is not old.robot:
        q = np.array([np.zeros(old.robot.n), *np.eye(old.robot.n), np.ones(old.robot.n)])
        if np.abs(rows.robot.forward(q) - old.robot.forward(q)).max() > SAME_PLACE:
            raise CampaignError(rows.name, "another nominal model", expected="the same URDF and tool frame")
    if old.targets is not None or rows.targets is not None:
        expected = "rows of one target; diagnose all rows together"
        raise CampaignError(rows.name, "several targets of each pose, whose places all rows tell", expected=expected)
    rows = replace(read_alike(rows, old.robot, old.turned), noise_of_kinds=old.noise_of_kinds)
    for column in needs:
        if column not in rows.covariates:
            raise CampaignError(rows.name, "lacks what the chosen effects read", column=column, expected="this column")
    return rows


def _stated(campaign: Campaign) -> dict[str, object]:
    """Return the declarations that old and new rows must share, by name."""
    own = campaign.simulated_position is not None
    return {
        "robot, by its joints": ", ".join(campaign.robot.joint_names),
        "kind of measurement": campaign.measures,
        "base frame": "known" if campaign.base_known else "unknown",
        "tool frame": "known" if campaign.tool_known else "unknown",
        "target": campaign.target.tolist(),
        "noise of positions": campaign.noise_position if campaign.noise_of_rows is None else "of each row",
        "noise of orientations": campaign.noise_orientation,
        "reference temperature": campaign.reference_temperature,
        "prediction": "of the user's simulator" if own else "of the URDF",
    }
