"""From a pandas data frame to a campaign, without files: for notebooks and programs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from thermal_robot.campaign.campaign import Campaign
from thermal_robot.campaign.names import did_you_mean, listed
from thermal_robot.campaign.settings import MOVES, STANDARD_TEMPERATURE, Settings, Vector, as_vector
from thermal_robot.campaign.tabular import table_from_frame
from thermal_robot.campaign.units import ANGLE_UNITS, LENGTH_UNITS, Units
from thermal_robot.campaign.validate import build_campaign
from thermal_robot.errors import CampaignError, require
from thermal_robot.robot import Robot

if TYPE_CHECKING:
    import pandas as pd

FILE = "<table>"
"""What messages call the data frame."""


def campaign_from_table(
    robot: Robot,
    table: pd.DataFrame,
    *,
    angle_unit: str = "rad",
    length_unit: str = "m",
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
        Units of the columns; ``length_unit`` also of ``target``, ``noise_position`` and ``payload_com``.
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
    """
    import pandas as pd

    require("campaign_from_table(), robot", robot, (Robot,), "a robot, as load_robot gives it")
    require("campaign_from_table(), table", table, (pd.DataFrame,), "a pandas DataFrame")
    _require_word("angle_unit", angle_unit, ANGLE_UNITS)
    _require_word("length_unit", length_unit, LENGTH_UNITS)
    _require_word("base", base, ("known", "unknown"))
    _require_word("tool", tool, ("known", "unknown"))
    _require_word("moves", moves, MOVES)
    units = Units(angle_unit, length_unit)
    position = _size("noise_position", noise_position)
    settings = Settings(
        urdf="",
        tool_frame=robot.tool_frame,
        root_frame=robot.root_frame,
        gravity=as_vector(robot.gravity),
        moves=moves,
        reference_temperature=float(reference_temperature),
        units=units,
        base_known=base == "known",
        tool_known=tool == "known",
        target=_vector("target", target, units.length_scale),
        noise_position=None if position is None else position * units.length_scale,
        noise_orientation=_size("noise_orientation", noise_orientation),
        payload_com=_vector("payload_com", payload_com, units.length_scale),
        priors=_positive("priors", priors),
        gears=_positive("gears", gears),
    )
    for joint in settings.gears:
        if joint not in robot.joint_names:
            raise CampaignError(
                FILE,
                f"the chain has no such joint{did_you_mean(joint, robot.joint_names)}",
                column=f"gears.{joint}",
                expected=f"one of {listed(robot.joint_names)}",
            )
    return build_campaign(table_from_frame(table, FILE), settings, robot, name=name, measured=measured)


def _require_word(argument: str, word: str, allowed: Sequence[str] | Mapping[str, float]) -> None:
    if word not in allowed:
        expected = " or ".join(f'"{other}"' for other in allowed)
        problem = "unknown unit" if argument.endswith("unit") else "unknown word"
        raise CampaignError(FILE, problem, column=argument, found=repr(word), expected=expected)


def _size(argument: str, sigma: float | None) -> float | None:
    """Return a standard deviation, ``None`` where it is not given."""
    if sigma is not None and not (np.isfinite(sigma) and sigma >= 0):
        problem = "a standard deviation cannot be negative" if sigma < 0 else "not a finite number"
        raise CampaignError(FILE, problem, column=argument, found=repr(sigma), expected="a number above 0, or None")
    return float(sigma) if sigma else None


def _vector(argument: str, values: Sequence[float], scale: float) -> Vector:
    array = np.asarray(values, dtype=np.float64)
    if array.shape != (3,) or not np.isfinite(array).all():
        raise CampaignError(FILE, "wrong kind of value", column=argument, found=repr(values), expected="three numbers")
    return as_vector(array * scale)


def _positive(argument: str, sizes: Mapping[str, float] | None) -> dict[str, float]:
    for key, size in (sizes or {}).items():
        if not (np.isfinite(size) and size > 0):
            raise CampaignError(
                FILE,
                "must be positive",
                column=f"{argument}.{key}",
                found=repr(size),
                expected="a number above 0",
            )
    return {key: float(size) for key, size in (sizes or {}).items()}
