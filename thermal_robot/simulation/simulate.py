"""One verb: a robot and its effects go in, the campaign that would be measured of it comes out."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from thermal_robot.campaign import Campaign
from thermal_robot.errors import CampaignError
from thermal_robot.observations import observe
from thermal_robot.robot import ENDS, Robot, load_robot
from thermal_robot.schema import fitted, whole
from thermal_robot.simulation.commanded import CALL, AtWork, at_work, commanded
from thermal_robot.simulation.measured import instrument, measured, placed

if TYPE_CHECKING:
    from thermal_robot.urdf_text import WritesUrdf

_POSES, _JOINTS, _INSTRUMENT = range(3)
"""Chance of the poses, of joints that scatter and of the instrument: each is its own, so that none changes another."""


def simulate(
    robot: Robot | str | Path | WritesUrdf,
    effects: AtWork | None = None,
    *,
    tool_frame: str = "",
    rows: int | None = None,
    repeats: int = 1,
    commands: Campaign | ArrayLike | None = None,
    conditions: Mapping[str, Any] | None = None,
    measures: str | None = None,
    noise: float = 0.0,
    noise_orientation: float = 0.0,
    base: ArrayLike | None = None,
    tool: ArrayLike | None = None,
    base_known: bool | None = None,
    tool_known: bool | None = None,
    seed: int = 0,
) -> Campaign:
    """Simulate what would be measured of a robot with effects of known size at work.

    The exact model of the program, not its linear one: joints, links, base and tool are displaced by what the effects
    say, and the kinematics run through all of it, as in :meth:`CorrectedModel.predict
    <thermal_robot.CorrectedModel.predict>`. It shares the effects' formulas with the diagnosis: it tests what a
    campaign can tell, not whether robots are so.

    Parameters
    ----------
    robot
        A robot, or what :func:`~thermal_robot.load_robot` takes, with its ``tool_frame``.
    effects
        Values of the parameters by effect, SI: ``{"backlash": {"joint_3": 3e-4}}``. An effect stands by its name, in
        the setting in which it is first looked for, or as it is, with settings or code of your own; pairs of effect and
        values, such as :attr:`CorrectedModel.effects <thermal_robot.CorrectedModel>`, do as well. Values stand by name
        of the parameter (``"lost motion, joint_3"``), or by its place or its label where that is one parameter alone;
        those not named are 0. One number is given to all parameters, if these have one unit; an array gives all in
        their order. Effects that scatter are drawn.
    tool_frame
        Link whose pose is measured; only where ``robot`` is no robot yet.
    rows
        How many are measured, 60 by default, at poses drawn evenly within the joints' limits, and within 2.4 rad where
        a joint can turn once round.
    repeats
        How often each pose is measured: once a round, labelled ``pose``.
    commands
        (P, n) joint positions instead of drawn ones, rad or m, or (n,) of one pose; or a campaign, such as that of a
        plan or one that was measured, whose commands, conditions and declarations are taken over.
    conditions
        Columns beside the commands, SI: one value for all rows or (N,); ``None`` leaves a column out. Without a
        campaign a row a minute is measured while the robot warms by 6 K from 20 °C and cools again (``time``,
        ``temperature``). Directions of approach follow from the order of the rows where none are given.
    measures
        ``"position"``, or ``"pose"`` for orientations, too; by default what the campaign in ``commands`` has, or
        positions.
    noise, noise_orientation
        One sigma per axis of the instrument, m and rad, normal; the campaign states it.
    base
        (4, 4) pose of the root frame in the measurement frame, m; the identity by default. The campaign does not know
        one that is given.
    tool
        (3,) the measured point in the tool frame, m, which the campaign knows; or (4, 4) the target's pose in it, of
        which it knows a start value. The origin by default.
    base_known, tool_known
        Whether the campaign declares these frames as known, if not as said above.
    seed
        Of everything that is drawn: the same seed gives the same campaign, and the same poses whatever is at work.

    Returns
    -------
    Campaign
        As :func:`~thermal_robot.read_campaign` returns one.

    Raises
    ------
    EffectError
        A name that no effect, or no parameter of it, has; a value that is no number, or negative where none can be; an
        effect that needs a condition that is not there.
    CampaignError
        Rows, conditions or frames that no campaign has.
    RobotError
        A robot that cannot be loaded.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> robot = tr.load_robot("builtin:rv_m2", "tool0")
    >>> worn = tr.simulate(robot, {"backlash": {"joint_3": 3e-4}}, rows=40, noise=20e-6, seed=1)
    >>> worn
    <Campaign 'simulated': 40 samples of position, 5 joints, 7 covariates>
    >>> sound = tr.simulate(robot, rows=40, noise=20e-6, seed=1)
    >>> bool(abs(worn.position - sound.position).max() > 5e-5)
    True
    """
    robot = _loaded(robot, tool_frame)
    seed = fitted(whole(0), seed, CALL, "seed")
    poses, joints, readings = (np.random.default_rng([seed, part]) for part in (_POSES, _JOINTS, _INSTRUMENT))
    given = commands.measures if measures is None and isinstance(commands, Campaign) else measures
    used = instrument(given, noise, noise_orientation)
    plan = used.awaiting(commanded(robot, rows, repeats, commands, conditions, poses))
    plan, frames = placed(plan, base, tool, base_known, tool_known)
    effects_at_work = at_work(effects, observe(plan, frames))
    return measured(plan, frames, effects_at_work, used, joints, readings)


def _loaded(robot: Any, tool_frame: str) -> Robot:
    if isinstance(robot, Campaign):
        expected = "its robot, and the campaign in commands: simulate(campaign.robot, ..., commands=campaign)"
        raise CampaignError(CALL, "a campaign is no robot", column="robot", expected=expected)
    if not isinstance(robot, Robot):
        return load_robot(robot, tool_frame)
    if tool_frame in ("", robot.tool_frame):
        return robot
    expected = f"{robot.tool_frame!r}, where its chain ends; load_robot makes another"
    raise CampaignError(CALL, "this robot has a tool frame", column=ENDS[0], found=repr(tool_frame), expected=expected)
