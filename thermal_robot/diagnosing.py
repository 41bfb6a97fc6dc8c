"""Diagnosis and comparison of campaigns of poses and of motion logs, dispatched on the kind of what is given."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, overload

from thermal_robot.campaign import Campaign, read_campaign
from thermal_robot.diagnosis import Diagnosis
from thermal_robot.diagnosis import diagnose as diagnose_campaign
from thermal_robot.diagnosis.diagnose import effect_names
from thermal_robot.effects import Effect
from thermal_robot.errors import CampaignError, EffectError, require
from thermal_robot.fleet.compare import compare as compare_campaigns
from thermal_robot.fleet.comparison import Comparison
from thermal_robot.motion.compare import compare_motions
from thermal_robot.motion.diagnose import diagnose_motion
from thermal_robot.motion.log import MotionLog
from thermal_robot.motion.read import declares_motion, read_motion
from thermal_robot.motion.result import MotionDiagnosis, with_summary

Progress = Callable[[str], None]


def read(path: str | Path, *, folder: str | Path | None = None) -> Campaign | MotionLog:
    """Read a campaign of poses, or a motion log where the file holds a section ``[motion]``.

    Parameters
    ----------
    path
        campaign.toml or motion.toml, or the directory that holds one; of one that holds both, the campaign.
    folder
        Against which the paths in it are resolved; its own where absent.
    """
    return read_motion(path, folder=folder) if declares_motion(Path(path)) else read_campaign(path, folder=folder)


@overload
def diagnose(
    campaign: MotionLog, *, only: Iterable[str] | None = ..., without: Iterable[str] = ..., progress: Progress = ...
) -> MotionDiagnosis: ...
@overload
def diagnose(
    campaign: Campaign,
    *,
    only: Iterable[str] | None = ...,
    without: Iterable[str] = ...,
    effects: Sequence[Effect] = ...,
    progress: Progress = ...,
) -> Diagnosis: ...
@overload
def diagnose(
    campaign: str | Path,
    *,
    only: Iterable[str] | None = ...,
    without: Iterable[str] = ...,
    effects: Sequence[Effect] = ...,
    progress: Progress = ...,
) -> Diagnosis | Any: ...
def diagnose(
    campaign: Campaign | MotionLog | str | Path,
    *,
    only: Iterable[str] | None = None,
    without: Iterable[str] = (),
    effects: Sequence[Effect] = (),
    progress: Progress = lambda _: None,
) -> Diagnosis | MotionDiagnosis:
    """Say where the gap between a robot and its model lies, which effects cause it, and how far it shrinks.

    Parameters
    ----------
    campaign
        Poses: a campaign, or the path of a campaign.toml. Motion: a log, or the path of a motion.toml.
    only, without
        Names of effects to consider (all where it is left out), or to leave out; one name may stand by itself.
    effects
        Effects of your own, considered beside those of the library; of poses alone.
    progress
        Called with a few words at each stage.

    Returns
    -------
    Diagnosis or MotionDiagnosis
        Prints as text, writes as JSON, shows itself in Jupyter.

    Raises
    ------
    CampaignError, RobotError
        If the campaign or log cannot be used, or ``only`` is empty.
    EffectError
        If an effect's name is not known.
    EstimationError
        If there are too few measurements for the unknown frames.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> found = tr.diagnose(tr.demo_campaign())
    >>> found
    Diagnosis('demo': thermal_elongation, backlash)
    >>> print(found.summary)
    The gap of 62.6 µm comes from thermal elongation of the links and lost motion in the joints (91 % sure); ...
    """
    if isinstance(campaign, (str, os.PathLike)) and declares_motion(Path(campaign)):
        progress("reading the log")
        campaign = read_motion(campaign)
    if not isinstance(campaign, MotionLog):
        return diagnose_campaign(campaign, only=only, without=without, effects=effects, progress=progress)
    if effects:
        raise EffectError("effects of your own are of poses; a log of motion knows its servos' alone")
    require("diagnose(), progress", progress, (Callable,), "a function that takes the words of a stage")
    only, without = effect_names(only, without)
    return with_summary(diagnose_motion(campaign, only=only, without=without, progress=progress))


def compare(
    *campaigns: Any,
    names: Sequence[str] = (),
    only: Iterable[str] | None = None,
    without: Iterable[str] = (),
    effects: Sequence[Effect] = (),
    progress: Progress = lambda _: None,
) -> Comparison | Any:
    """Compare campaigns or motion logs of one robot: which effects they share, and which changed between them.

    Parameters
    ----------
    *campaigns
        Poses, two or more: as for :func:`thermal_robot.fleet.compare.compare`. Motion, two: logs, their diagnoses, or
        paths of a motion.toml, the earlier one first.
    names
        What they are called; by default their own names.
    only, without, effects
        As for :func:`~thermal_robot.diagnose`, of what is not diagnosed yet.
    progress
        Called with a few words at each stage.

    Returns
    -------
    Comparison or MotionComparison
        Prints as text, writes as JSON.

    Raises
    ------
    CampaignError
        Fewer than two, or poses beside motion; of different robots; one that is not usable.
    EffectError, EstimationError
        As :func:`~thermal_robot.diagnose`.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> robot = tr.load_robot("builtin:rv_m2", "tool0")
    >>> monday = tr.simulate(robot, rows=40, noise=2e-5, seed=1)
    >>> friday = tr.simulate(robot, {"joint_offset": {"joint_3": 1e-3}}, rows=40, noise=2e-5, seed=2)
    >>> found = tr.compare(monday, friday, names=["monday", "friday"])
    >>> [(change.effect, change.place, change.since) for change in found.changes]
    [('joint_offset', 'joint_3', 'friday')]
    """
    motion = [is_motion(one) for one in campaigns]
    if not any(motion):
        return compare_campaigns(
            *campaigns, names=names, only=only, without=without, effects=effects, progress=progress
        )
    if not all(motion) or len(motion) != 2 or len(names) not in (0, 2):
        found = f"{sum(motion)} of motion, {len(motion) - sum(motion)} of poses, {len(names)} names"
        raise CampaignError("compare()", "motion is compared in pairs", found=found, expected="two logs of motion")
    first, second = (
        one if isinstance(one, MotionDiagnosis) else diagnose(one, only=only, without=without, progress=progress)
        for one in campaigns
    )
    return compare_motions(first, second, names)


def is_motion(given: Any) -> bool:
    """Whether an argument concerns motion: it is a motion log, its diagnosis, or the path of a motion.toml."""
    path = isinstance(given, (str, os.PathLike)) and declares_motion(Path(given))
    return path or isinstance(given, (MotionLog, MotionDiagnosis))
