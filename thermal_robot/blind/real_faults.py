"""Conditions put into a measured campaign: exactly, and without the library of effects.

Commands are changed, never the robot: where the robot stood when it was measured, it still stands, and the table says
something else. Only a scale and the growth of links change what was measured, orientations nothing.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.kinematics import Displacement, exp6, tool_poses
from thermal_robot.observations import Frames, Observations, observe

_STILL = 1e-4  # rad: a joint that is told to move less does not arrive from any side
_SHORTEST = 1e-9  # m: a shorter segment has no direction along which it grows


def with_joint_error(campaign: Campaign, joint: int, error: Array | float) -> Campaign:
    """Return the campaign with commands as if the joint were off: actual = command in the table + error.

    Parameters
    ----------
    campaign
        N rows.
    joint
        Number of the joint in the chain.
    error
        Scalar or (N,), rad: a constant is a zero offset, a step a slip, −½ b·approach lost motion.
    """
    q = campaign.q.copy()
    q[:, joint] -= error
    return replace(campaign, q=q)


def with_scale(campaign: Campaign, scale: float) -> Campaign:
    """Return the campaign with measured = (1 + scale)·true about the instrument's origin."""
    return replace(campaign, position=measured(campaign) * (1.0 + scale))


def with_approaches(campaign: Campaign) -> Campaign:
    """Return the campaign with the side from which each joint came, the rows being in the order of measurement.

    The sign of the change of the command since the row before; 0 in the first row and where the joint stayed. Where
    only some rows of a campaign are taken this is a side as good as any: what is put in follows it.
    """
    change = np.diff(campaign.q, axis=0, prepend=campaign.q[:1])
    side = np.sign(change) * (np.abs(change) > _STILL)
    columns = {f"approach.{joint}": side[:, j] for j, joint in enumerate(campaign.robot.joint_names)}
    return replace(campaign, covariates={**campaign.covariates, **columns})


def with_growth(campaign: Campaign, strains: Array, warmer: Array) -> Campaign:
    """Return the campaign with links that grew along their nominal segments; the table tells no temperature.

    Parameters
    ----------
    campaign
        N rows of a robot with S segments.
    strains
        (S,) 1/K.
    warmer
        (N,) kelvin above the temperature at which the URDF's lengths hold.
    """
    robot, frames = campaign.robot, registered(campaign)
    along = np.array([np.append(s.direction * s.length * (s.length > _SHORTEST), np.zeros(3)) for s in robot.segments])
    grown = Displacement(segment=warmer[:, None, None] * strains[:, None] * along)
    # the growth of a segment turns nothing: the tool frame's origin and the target move alike
    moved = tool_poses(robot, campaign.q, grown)[:, :3, 3] - tool_poses(robot, campaign.q)[:, :3, 3]
    turned = moved @ frames.base[:3, :3].T
    known = {name: v for name, v in campaign.covariates.items() if name.split(".")[0] != "temperature"}
    return replace(campaign, position=measured(campaign) + turned, covariates=known)


def with_temperature(campaign: Campaign, warmer: Array) -> Campaign:
    """Return the campaign with the column ``temperature``: its reference temperature + ``warmer``."""
    temperature = campaign.reference_temperature + warmer
    return replace(campaign, covariates={**campaign.covariates, "temperature": temperature})


def warm_up(rng: np.random.Generator, samples: int) -> Array:
    """Return (N,) kelvin above the start over a campaign: the robot warms up, cools in a break, and warms up again."""
    passed = np.linspace(0.0, 1.0, samples)
    start, end = rng.uniform(0.35, 0.45), rng.uniform(0.55, 0.65)
    slow = rng.uniform(0.1, 0.25)
    step = 1.0 / (samples - 1)
    warm = np.zeros(samples)
    for k in range(1, samples):
        goal = 0.0 if start < passed[k] < end else 1.0
        warm[k] = warm[k - 1] + (goal - warm[k - 1]) * (1.0 - np.exp(-step / slow))
    return np.asarray(rng.uniform(10.0, 20.0) * warm / warm.max())


def registered(campaign: Campaign) -> Frames:
    """Fit base and target point to the nominal robot by least squares, and nothing else."""
    frames = Frames.declared(campaign)
    predicted = observe(campaign, frames).position
    frames = Frames(_aligned(predicted, measured(campaign)), frames.tool)
    for _ in range(30):
        seen = observe(campaign, frames)
        columns = frame_columns(seen).reshape(-1, 9)
        length = np.linalg.norm(columns, axis=0)
        step = np.linalg.lstsq(columns / length, seen.gap[:, :3].ravel(), rcond=1e-9)[0] / length
        tool = frames.tool.copy()
        tool[:3, 3] += step[6:]
        frames = Frames(frames.base @ exp6(step[:6]), tool)
        if np.abs(step).max() < 1e-10:
            break
    return frames


def frame_columns(seen: Observations) -> Array:
    """Return (N, 3, 9): what a unit twist of the base and a unit shift of the target do to the target, root frame."""
    return np.concatenate([seen.base_sensitivity[:, :3], seen.tool_sensitivity[:, :3, :3]], axis=2)


def leaves(seen: Observations, shift: Array) -> float:
    """Return the rms distance, m, that (N, 3) shifts in the root frame leave after the best frames."""
    columns = frame_columns(seen).reshape(-1, 9)
    columns = columns / np.linalg.norm(columns, axis=0)
    rest = shift.ravel() - columns @ np.linalg.lstsq(columns, shift.ravel(), rcond=1e-9)[0]
    return float(np.sqrt((rest**2).sum() / len(shift)))


def measured(campaign: Campaign) -> Array:
    """Return the measured positions, which a campaign has that is no mere sample."""
    return np.asarray(campaign.position)


def _aligned(source: Array, target: Array) -> Array:
    """Return the rigid motion (4, 4) that brings points onto others (Umeyama 1991, without scale)."""
    u, _, vt = np.linalg.svd((target - target.mean(axis=0)).T @ (source - source.mean(axis=0)))
    motion = np.eye(4)
    motion[:3, :3] = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    motion[:3, 3] = target.mean(axis=0) - motion[:3, :3] @ source.mean(axis=0)
    return motion


Record = dict[str, Any]

WORSE = 1.1  # an absorbed cause may leave so many times what the control leaves
SIZE = 0.3  # relative error of a lost motion
CLAIM = (0.5, 1.25)  # rms reached over rms claimed


def judged(fault: str, record: Record, control: Record | None, remainder: float) -> tuple[bool, str]:
    """Return whether the answer is right, and the answer in short words.

    Parameters
    ----------
    fault
        What was asked.
    record, control
        As for :meth:`thermal_robot.blind.real.RealCase.judge`.
    remainder
        What a full geometry leaves of the campaign, rms distance, m.
    """
    said = record.get("said")
    if said is None:
        return False, str(record.get("error") or "no diagnosis")
    named = " ".join(said["verdict"]["effects"]) or "no effect"
    after = (record.get("fresh") or {}).get("rms_after")
    if fault == "backlash":
        right, more = _backlash(said, record["truth"])
    elif fault == "slip":
        right, more = _unexplained(said, record["truth"], "joint")
    elif fault == "hidden":
        right, more = _unexplained(said, record["truth"], "")
        asks = _finding(said, "thermal_elongation")
        right = right and asks.get("status") == "not_testable" and "temperature" in asks.get("needs", ())
        more += f"; thermal_elongation {asks.get('status', 'is no candidate')}"
    elif fault == "temperature":
        right, more = _names(said, "thermal_elongation"), ""
    elif after is None:
        right, more = False, "nothing predicted"
    elif fault == "later":
        claimed = said["gap"]["held_out"]["rms_after"]
        right = CLAIM[0] <= after / claimed <= CLAIM[1]
        more = f"claims {1e3 * claimed:.3f} mm, reaches {1e3 * after:.3f} mm"
    elif fault == "nothing":
        right = _names(said, "geometric") and after <= WORSE * remainder
        more = f"leaves {1e3 * after:.3f} mm, README {1e3 * remainder:.3f} mm"
    else:
        before = ((control or {}).get("fresh") or {}).get("rms_after")
        cause = {"offset": "joint_offset", "scale": "instrument_scale"}[fault]
        covered = _names(said, "geometric") or _names(said, cause)
        right = covered and before is not None and after < WORSE * before
        than = "no control" if before is None else f"control {1e3 * before:.3f} mm"
        more = f"leaves {1e3 * after:.3f} mm, {than}"
    return bool(right), f"{named}; {more}" if more else named


def _finding(said: Record, effect: str) -> Record:
    found: list[Record] = [e for e in said["effects"] if e["name"] == effect]
    return found[0] if found else {}


def _names(said: Record, effect: str) -> bool:
    return effect in said["verdict"]["effects"] and _finding(said, effect).get("status") == "found"


def _backlash(said: Record, truth: Record) -> tuple[bool, str]:
    part = truth["parts"]["backlash"]
    joint, size = part["places"][0]["name"], part["size"]
    found = _finding(said, "backlash")
    first = found["locations"][0]["name"] if found.get("locations") else "nowhere"
    values = [p["value"] for p in found.get("parameters", ()) if p["name"] == f"lost motion, {joint}"]
    value = values[0] if values and values[0] is not None else 0.0
    right = _names(said, "backlash") and first == joint and abs(value - size) <= SIZE * size
    return right, f"backlash first at {first}, {1e3 * value:.2g} mrad at {joint}"


def _unexplained(said: Record, truth: Record, kind: str) -> tuple[bool, str]:
    """Tell whether it is flagged, with one of the truth's quantities and, where a kind of place is given, places."""
    left = said["unexplained"]
    places = {(p["kind"], p["name"]) for p in truth["places"]}
    first = left["locations"][:1], [d["covariate"] for d in left["depends_on"][:1]]
    laws = [(e["locations"][:1], [e.get("quantity")]) for e in said["effects"] if e["name"].startswith("discovered.")]

    def holds(where: list[Record], quantity: list[Any]) -> bool:
        there = not kind or any((p["kind"], p["name"]) in places for p in where)
        return there and any(q in truth["quantities"] for q in quantity)

    flagged = bool(said["verdict"]["unexplained"])
    hit = [law for law in (*laws, first) if holds(*law)]
    where, quantity = hit[0] if hit else first
    shown = f"{where[0]['name'] if where else 'nowhere'}, {quantity[0] if quantity else 'nothing'}"
    return flagged and bool(hit), f"{'unexplained' if flagged else 'not flagged'}: {shown}"
