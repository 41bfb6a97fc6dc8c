"""What the simulated robot is told to do, and when: rows drawn, given, or those of a campaign; and their conditions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.campaign import Campaign
from thermal_robot.campaign import names as columns
from thermal_robot.campaign.checked import checked_mapping
from thermal_robot.campaign.names import did_you_mean, listed, split_name, tilted
from thermal_robot.campaign.recognise import TYPING_ERROR
from thermal_robot.campaign.validate import arrived
from thermal_robot.errors import CampaignError
from thermal_robot.robot import Robot, joint_range
from thermal_robot.schema import fitted, matrix, shown, whole
from thermal_robot.simulation import schedule, settings

Array = NDArray[np.float64]
CALL = "simulate()"
"""What messages call the file that there is none of."""


def commanded(
    robot: Robot, rows: Any, repeats: Any, commands: Any, conditions: Any, rng: np.random.Generator
) -> Campaign:
    """Return the rows that are simulated, with their conditions and nothing measured.

    Parameters
    ----------
    robot, rows, repeats, commands, conditions
        As for :func:`thermal_robot.simulate`.
    rng
        Source of the poses, where they are drawn.

    Raises
    ------
    CampaignError
        Rows, positions or conditions that no campaign has.
    """
    if isinstance(commands, Campaign):
        plan = _of_campaign(robot, rows, repeats, commands)
    else:
        poses, times = _poses(robot, rows, repeats, commands, rng)
        q, which = schedule.in_turn(poses, schedule.visits(len(poses) * times, times))
        labels = {"pose": np.array([str(k + 1) for k in which])} if times > 1 else {}
        given = schedule.conditions(len(q), settings.RISE)
        plan = Campaign("simulated", robot, q, covariates=given, labels=labels, base_known=True, tool_known=True)
    return arrived(_under(plan, conditions))


def _of_campaign(robot: Robot, rows: Any, repeats: Any, commands: Campaign) -> Campaign:
    """Return the rows of a campaign, without what was measured."""
    if rows is not None or repeats != 1:
        expected = "neither rows nor repeats beside a campaign, which has its own"
        raise CampaignError(CALL, "too much is said of the rows", expected=expected)
    if commands.robot.joint_names != robot.joint_names:
        found, expected = listed(commands.robot.joint_names), f"the robot's {listed(robot.joint_names)}"
        raise CampaignError(
            CALL, "the campaign commands other joints", column="commands", found=found, expected=expected
        )
    return replace(
        commands, robot=robot, position=None, orientation=None, targets=None, noise_of_rows=None, warnings=()
    )


def _poses(robot: Robot, rows: Any, repeats: Any, commands: Any, rng: np.random.Generator) -> tuple[Array, int]:
    """Return (P, n) different poses, and how often each is measured."""
    times = fitted(whole(1), repeats, CALL, "repeats")
    if commands is not None:
        if rows is not None:
            raise CampaignError(CALL, "too much is said of the rows", expected="either rows or commands")
        return _given(robot, commands), times
    count = fitted(whole(1), settings.ROWS if rows is None else rows, CALL, "rows")
    if count % times:
        expected = f"a number of rows of which {times} visit each pose"
        raise CampaignError(CALL, "does not divide into poses", column="rows", found=str(count), expected=expected)
    low, high = joint_range(robot)
    for joint, width in zip(robot.joint_names, high - low, strict=True):
        if not np.isfinite(width):
            expected = "a <limit> in the URDF for a joint that slides, or commands of your own"
            raise CampaignError(CALL, "no poses can be drawn", column=joint, found="no limits", expected=expected)
    return rng.uniform(low, high, (count // times, robot.n)), times


def _given(robot: Robot, commands: Any) -> Array:
    """Return (P, n) positions that a user gave; (n,) counts as one row."""
    rows = f"rows of {robot.n} joint positions, or a campaign, which read_samples makes of a table"
    if not isinstance(commands, (list, tuple, np.ndarray)):
        raise CampaignError(CALL, "no positions", column="commands", found=type(commands).__name__, expected=rows)
    if len(commands) == robot.n and not any(isinstance(each, (list, tuple, np.ndarray)) for each in commands):
        commands = [commands]
    plain = [each.tolist() if isinstance(each, np.ndarray) else each for each in commands]
    poses: Array = fitted(matrix((None, robot.n)), plain, CALL, "commands")
    if not len(poses):
        raise CampaignError(CALL, "there is no row", column="commands", expected=rows)
    return poses


def _under(plan: Campaign, conditions: Any) -> Campaign:
    """Return the rows under conditions that are given, beside those that they had."""
    given: Mapping[str, Any] = checked_mapping(CALL, "conditions", {} if conditions is None else conditions)
    covariates, labels, extra = dict(plan.covariates), dict(plan.labels), list(plan.extra)
    for name, values in given.items():
        own = _known(name, plan.robot)
        held: dict[str, Any] = labels if name in columns.LABELS else covariates
        held.pop(name, None)
        if values is not None:
            held[name] = _of_rows(name, values, plan.samples)
            extra += [name] if not own and name not in extra else []
    kept = {name: gaps for name, gaps in plan.missing.items() if name not in given}
    # what followed from an order follows anew from another
    followed = tuple(name for name in plan.derived if name not in given)
    if {*columns.CLOCK, "session"} & set(given):
        covariates = {name: values for name, values in covariates.items() if name not in followed}
    left = tuple(name for name in followed if name in covariates)
    named = tuple(name for name in extra if name in covariates)
    return replace(plan, covariates=covariates, labels=labels, extra=named, missing=kept, derived=left, travelled={})


def _of_rows(name: str, values: Any, rows: int) -> NDArray[Any]:
    """Return (N,) values of a condition; one stands for all rows."""
    try:
        found = np.asarray(values, dtype=np.str_ if name in columns.LABELS else np.float64)
        return np.broadcast_to(found, rows).copy()
    except (TypeError, ValueError):
        expected = f"one value for all rows, or one for each of {rows}"
        raise CampaignError(CALL, "no condition", column=name, found=shown(values), expected=expected) from None


def _known(name: str, robot: Robot) -> bool:
    """Tell whether the format defines a column; refuse one that is no condition, and typing errors."""
    if name in robot.joint_names or name in (*columns.MEASURED, *columns.SIMULATED):
        what = "is commanded, no condition" if name in robot.joint_names else "is no condition"
        raise CampaignError(CALL, what, column=name, expected="positions in commands; poses are what is simulated")
    places = {
        **dict.fromkeys(columns.PER_JOINT, robot.joint_names),
        **dict.fromkeys(columns.PER_LINK, robot.urdf_links),
    }
    known = columns.conditions(robot.joint_names, robot.urdf_links)
    quantity, place = split_name(name)
    if name in known or name in columns.LABELS:
        return True
    if place and quantity in places:
        what = "the chain has no such joint" if quantity in columns.PER_JOINT else "the robot has no such link"
        near = did_you_mean(place, places[quantity])
        raise CampaignError(
            CALL, f"{what}{near}", column=name, expected=f"{quantity}. and one of {listed(places[quantity])}"
        )
    # a tilt of what is no link is a column of the user's own
    offered = [*(column for column in known if not tilted(column)), *columns.LABELS]
    meant = did_you_mean(name, offered, cutoff=TYPING_ERROR)
    if meant:
        raise CampaignError(CALL, f"there is no such condition{meant}", column=name)
    return False
