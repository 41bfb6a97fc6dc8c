"""A campaign in words: what `thermal-robot check` prints."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from thermal_robot.campaign import names
from thermal_robot.campaign.campaign import Campaign
from thermal_robot.campaign.names import split_name
from thermal_robot.campaign.read import SAME_CONFIGURATION
from thermal_robot.campaign.targets import of_a_point
from thermal_robot.campaign.units import covariate_scale, unit_of
from thermal_robot.errors import require
from thermal_robot.percents import percent
from thermal_robot.tables import html_table

_MOST_SESSIONS = 8
"""Sessions named in one line; more would not fit beside each other on a terminal."""


def describe(campaign: Campaign) -> str:
    """Describe a campaign to the person who measured it, in the units of the file.

    Returns
    -------
    str
        Plain text of several lines: robot, what was measured, frames, noise, joints against their limits,
        covariates with their ranges and gaps, repeats, sessions, warnings.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> print(tr.describe(tr.demo_campaign()))
    Campaign demo
      robot   rv_m2, chain from base_link to tool0, 5 movable joints
    ...
    """
    require("describe()", campaign, (Campaign,), "a campaign")
    blocks = [
        [f"Campaign {campaign.name}", *_aligned(_facts(campaign))],
        ["Joints", *_aligned(_joints(campaign))],
        ["Conditions recorded", *_aligned(_covariates(campaign)), *_not_recorded(campaign)],
        ["Repetition", *_aligned(_repetition(campaign))],
        ["Warnings", *([f"  - {warning}" for warning in campaign.warnings] or ["  none"])],
    ]
    return "\n\n".join("\n".join(block) for block in blocks)


def described_html(campaign: Campaign) -> str:
    """Describe a campaign as tables of a notebook: what :func:`describe` says."""
    head, *joints = _joints(campaign)
    tables = [
        html_table(_facts(campaign), heading=f"Campaign {campaign.name}"),
        html_table(joints, head=head),
        html_table([*_covariates(campaign), *_repetition(campaign)]),
        html_table([[warning] for warning in campaign.warnings], heading="Warnings") if campaign.warnings else "",
    ]
    return "".join(tables)


def _facts(campaign: Campaign) -> Iterator[Sequence[str]]:
    robot, units = campaign.robot, campaign.units
    yield (
        "robot",
        f"{robot.name}, chain from {robot.root_frame} to {robot.tool_frame}, {robot.n} movable joints",
    )
    yield "gravity", f"{_triple(robot.gravity)} m/s² in {robot.root_frame}"
    yield "lengths hold at", f"{campaign.reference_temperature:g} °C"
    if campaign.position is None:
        yield "samples", f"{campaign.samples}, to be predicted"
        return
    what = "position and orientation" if campaign.measures == "pose" else "position only"
    what = what if campaign.targets is None else f"{len(campaign.targets.numbers)} targets, which tell a pose"
    yield "measurements", f"{campaign.samples}, {what}, in {units.length}"
    extent = np.ptp(campaign.position, axis=0) / units.length_scale
    yield "measured volume", f"{extent[0]:.6g} x {extent[1]:.6g} x {extent[2]:.6g} {units.length}"
    if campaign.base_known:
        yield "base frame", f"known: measured in {robot.root_frame}"
    else:
        yield "base frame", "unknown: measured in the instrument's own frame, place and direction are fitted"
    if campaign.targets is not None:
        moving = campaign.targets.sigma / units.length_scale
        yield "targets", f"move against each other by {moving:.4g} {units.length} per axis (one sigma)"
    target = f"{_triple(campaign.target / units.length_scale)} {units.length} on {robot.tool_frame}"
    yield "target", f"known: {target}" if campaign.tool_known else f"unknown: fitted, starting from {target}"
    yield "noise of position", _noise_of_position(campaign)
    if campaign.measures == "pose":
        yield "noise of orientation", _noise(campaign.noise_orientation, "rad")
    if "payload" in campaign.covariates:
        yield (
            "payload's centre",
            f"{_triple(campaign.payload_com / units.length_scale)} {units.length} in {robot.tool_frame}",
        )
    if campaign.simulated_position is not None:
        yield "prediction", "from the simulator's columns sim.*, not from the URDF"
    if campaign.gears:
        yield "gear ratios", ", ".join(f"{joint} {ratio:g}" for joint, ratio in campaign.gears.items())
    if campaign.priors:
        yield "expected sizes", ", ".join(f"{effect} {size:g}" for effect, size in campaign.priors.items())


def _joints(campaign: Campaign) -> Iterator[Sequence[str]]:
    robot = campaign.robot
    yield "joint", "type", "commanded", "limits", "unit", "range used"
    for j, (name, kind) in enumerate(zip(robot.joint_names, robot.joint_types, strict=True)):
        scale = campaign.units.joint_scale(kind)
        q = campaign.q[:, j] / scale
        lower, upper = float(robot.lower[j]) / scale, float(robot.upper[j]) / scale
        if np.isfinite(lower) and np.isfinite(upper) and upper > lower:
            limits, used = _range(lower, upper), percent(np.ptp(q) / (upper - lower), 0)
        else:
            limits, used = "none", ""
        yield name, kind, _range(q.min(), q.max()), limits, campaign.units.joint_unit(kind), used


def _covariates(campaign: Campaign) -> Iterator[Sequence[str]]:
    """Yield a line per quantity; the joints of one quantity share a line, links have their own."""
    if not campaign.covariates:
        yield ("none",)
        return
    yield "quantity", "of", "range", "unit", "gaps"
    groups: dict[tuple[str, str], list[str]] = {}
    for column in campaign.covariates:
        quantity, place = split_name(column)
        joint = place in campaign.robot.joint_names and quantity in names.PER_JOINT and column not in campaign.extra
        key = (quantity if joint else column, _unit(campaign, column))
        groups.setdefault(key, []).append(column)
    for (quantity, unit), columns in groups.items():
        places = [split_name(column)[1] for column in columns]
        of = ""
        if quantity in campaign.extra:
            of = "not defined by the format"
        elif quantity in names.PER_JOINT:
            of = f"all {len(places)} joints" if len(places) == campaign.robot.n > 1 else ", ".join(places)
            of += ", from the order of rows" if set(columns) <= set(campaign.derived) else ""
        values = np.concatenate(
            [campaign.covariates[c] / covariate_scale(c, campaign.robot, campaign.units) for c in columns]
        )
        gaps = sum(int(campaign.missing[column].sum()) for column in columns if column in campaign.missing)
        spread = _range(values.min(), values.max()) if np.ptp(values) > 0 else f"{values[0]:.6g}, does not vary"
        yield quantity, of, spread, unit, f"{gaps} filled" if gaps else "none"


def _not_recorded(campaign: Campaign) -> Iterator[str]:
    recorded = {split_name(column)[0] for column in campaign.covariates}
    clock = {"order"} if "time" in recorded else set()
    absent = [
        name
        for name in (*names.PLAIN_COVARIATES, *(f"{quantity}.<joint>" for quantity in names.PER_JOINT))
        if split_name(name)[0] not in recorded | clock
    ]
    if absent:
        yield f"  not recorded: {', '.join(absent)}"


def _repetition(campaign: Campaign) -> Iterator[Sequence[str]]:
    _, counts = np.unique(np.round(campaign.q, SAME_CONFIGURATION), axis=0, return_counts=True)
    yield "identical commands", _repeated(counts)
    if (labels := campaign.pose_labels) is not None:
        yield "same pose label", _repeated(np.unique(labels[labels != ""], return_counts=True)[1])
    if "session" in campaign.labels:
        sessions, counts = np.unique(campaign.labels["session"], return_counts=True)
        shown = [
            f"{str(name) or '(no label)'} ({count} row{'s' if count > 1 else ''})"
            for name, count in zip(sessions, counts, strict=True)
        ]
        more = f" and {len(shown) - _MOST_SESSIONS} more" if len(shown) > _MOST_SESSIONS else ""
        yield "sessions", f"{len(shown)}: {', '.join(shown[:_MOST_SESSIONS])}{more}"
    else:
        yield "sessions", "no label: taken as one run"


def _repeated(counts: NDArray[np.int64]) -> str:
    repeated = counts[counts > 1]
    if not len(repeated):
        return "no pose is repeated"
    return f"{len(repeated)} pose{'s' if len(repeated) > 1 else ''} repeated, {int(repeated.sum())} rows in all"


def _unit(campaign: Campaign, column: str) -> str:
    if column in campaign.extra:
        return "as given"
    return "0..1" if column == "speed" else unit_of(column, campaign.robot, campaign.units)


def _noise_of_position(campaign: Campaign) -> str:
    units, each = campaign.units, campaign.noise_of_rows
    if each is None:
        noise = campaign.noise_position
        point = None if noise is None else of_a_point(noise, campaign.targets)
        return _noise(None if point is None else point / units.length_scale, units.length)
    low, high = each.min() / units.length_scale, each.max() / units.length_scale
    return f"{low:.4g} .. {high:.4g} {units.length} per axis (one sigma), of each row"


def _noise(sigma: float | None, unit: str) -> str:
    return "not given: estimated from the data" if sigma is None else f"{sigma:.4g} {unit} per axis (one sigma)"


def _triple(vector: Sequence[float] | NDArray[np.float64]) -> str:
    return "(" + ", ".join(f"{value + 0.0:.6g}" for value in vector) + ")"


def _range(low: float, high: float) -> str:
    return f"{low:.6g} .. {high:.6g}"


def _aligned(rows: Iterator[Sequence[str]]) -> list[str]:
    """Return the rows as lines, indented, every column as wide as its widest cell."""
    table = list(rows)
    columns = max(len(row) for row in table)
    widths = [max(len(row[i]) for row in table if i < len(row)) for i in range(columns)]
    return [
        ("  " + "   ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=False))).rstrip()
        for row in table
    ]
