"""Where the simulated robot stands, where its target sits, and what of that the campaign knows."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.campaign import Campaign
from thermal_robot.errors import CampaignError
from thermal_robot.observations import Frames
from thermal_robot.schema import boolean, fitted, optional, shown
from thermal_robot.simulation.commanded import CALL

Array = NDArray[np.float64]
_RIGID = 1e-6
"""Of a rotation: by how much its entries, written with few digits, may be off."""


def placed(plan: Campaign, base: Any, tool: Any, base_known: Any, tool_known: Any) -> tuple[Campaign, Frames]:
    """Return the rows with what they declare of their frames, and the true ones.

    Parameters
    ----------
    plan
        Commands and conditions; a campaign that was taken over has frames of its own.
    base, tool, base_known, tool_known
        As for :func:`thermal_robot.simulate`.

    Raises
    ------
    CampaignError
        Something that is no pose; a frame that is said to be known and is not where it is declared.
    """
    declared = Frames.declared(plan)
    told = {"base_known": base_known, "tool_known": tool_known}
    known = {key: fitted(optional(boolean), value, CALL, key) for key, value in told.items()}
    ground = declared.base if base is None else _pose("base", base)
    point = None if tool is None else _point(tool)
    if point is not None:
        plan = replace(plan, target=point)
        target, sits = Frames.declared(plan).tool, True
    elif tool is not None:
        target, sits = _pose("tool", tool), False
        plan = replace(plan, target=target[:3, 3])
    else:
        target, sits = declared.tool, plan.tool_known
    stands = plan.base_known if base is None else False
    stands, sits = (
        own if key is None else key for own, key in ((stands, known["base_known"]), (sits, known["tool_known"]))
    )
    for key, claimed, true, where in (
        ("base_known", stands, ground, declared.base),
        ("tool_known", sits, target, Frames.declared(plan).tool),
    ):
        if claimed and not np.allclose(true, where, atol=_RIGID, rtol=0.0):
            expected = "a frame where it is declared: its error is an effect of its own"
            raise CampaignError(CALL, "the frame that is given is elsewhere", column=key, expected=expected)
    return replace(plan, base_known=stands, tool_known=sits), Frames(ground, target)


def _point(tool: Any) -> Array | None:
    """Return three numbers; ``None`` for everything else."""
    try:
        point = np.array(tool, dtype=np.float64)
    except (TypeError, ValueError):
        return None
    return point if point.shape == (3,) else None


def _pose(key: str, given: Any) -> Array:
    """Return a (4, 4) pose, seen to be rigid."""
    also = ", or three numbers" if key == "tool" else ""
    try:
        pose = np.array(given, dtype=np.float64)
    except (TypeError, ValueError):
        pose = np.empty(0)
    if pose.shape == (4, 4) and np.isfinite(pose).all():
        turn = pose[:3, :3]
        right = np.allclose(turn @ turn.T, np.eye(3), atol=_RIGID) and np.linalg.det(turn) > 0.0
        if right and np.array_equal(pose[3], [0.0, 0.0, 0.0, 1.0]):
            return pose
    expected = f"a (4, 4) pose: a rotation, a shift in m, and the row 0 0 0 1{also}"
    raise CampaignError(CALL, "no pose", column=key, found=shown(given), expected=expected)
