"""A map of the workspace: chunk after chunk into a file; a run that was stopped is gone on with."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from thermal_robot.errors import CampaignError, RobotError, require
from thermal_robot.maps.quantities import columns
from thermal_robot.maps.question import Joints, Over, Positions, Question, Spec
from thermal_robot.maps.stores import Map, store
from thermal_robot.robot import Robot


def workspace_map(
    robot: Robot,
    over: Over,
    path: str | Path,
    question: Question | None = None,
    *,
    replace: bool = False,
    progress: Callable[[str, int, int], None] = lambda _stage, _done, _all: None,
) -> Map:
    """Map what a robot is good for over its workspace: scatter, thermal displacement, probability, C_p, clearance.

    Results are written chunk by chunk. A run that is stopped leaves a map that can be read; the same call goes on with
    it, and gives the same file.

    Parameters
    ----------
    robot
        The robot.
    over
        Places of the tip, at which all postures are found, or joint positions.
    path
        ``F.zarr`` (extra ``maps``), or ``F.parquet``, a folder of parts (extra ``parquet``).
    question
        What is asked of each configuration.
    replace
        Begin anew where another map stands there.
    progress
        Called with a stage, how many chunks are done, and how many there are.

    Returns
    -------
    Map
        Read from there chunk by chunk.

    Raises
    ------
    RobotError
        Nothing to map, or a name that is not known.
    CampaignError
        Another map at that path, another ending.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> from thermal_robot.maps import Positions, Question, workspace_map
    >>> robot = tr.load_robot("builtin:rv_m2", "tool0")
    >>> line = Positions((0.0, 0.0, 1), (0.42, 0.48, 4), (0.2, 0.2, 1))
    >>> found = workspace_map(robot, line, "line.parquet", Question(axis=(0.0, 1.0, 0.0)))
    >>> found.frame(["place", "y", "required_warm"]).round(6).shape
    (4, 3)
    """
    require("workspace_map()", robot, (Robot,), "a robot, as load_robot returns it")
    require("workspace_map(), over", over, (Positions, Joints), "Positions or Joints")
    spec = Spec(robot, over, question or Question())
    if over.count < 1:
        raise RobotError("there is nothing to map: an axis has no values", name=robot.name)
    kept = store(path)
    known = kept.notes
    if not known or replace:
        kept.begin({**spec.to_dict(), "fingerprint": spec.fingerprint, "parts": spec.parts})
    elif known.get("fingerprint") != spec.fingerprint:
        raise CampaignError(
            str(path), "holds another map", found=_differs(known, spec), expected="the same settings, or replace"
        )
    done = kept.done
    for k, rows in enumerate(spec.chunks()):
        if k < done:
            continue
        progress("chunks", k, spec.parts)
        kept.add(columns(spec, rows))
    progress("chunks", spec.parts, spec.parts)
    return Map(path)


def _differs(known: dict[str, object], spec: Spec) -> str:
    """Say in which settings two maps differ."""
    own = spec.to_dict()
    other = [key for key in own if known.get(key) != own[key]]
    return "other " + ", ".join(other) if other else "settings of another version"
