"""Description of a campaign in words: what `thermal-robot check` and notebooks print."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import zip_longest
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.campaign import names
from thermal_robot.campaign.names import split_name
from thermal_robot.campaign.settings import SAME_CONFIGURATION
from thermal_robot.campaign.targets import of_a_point
from thermal_robot.campaign.units import scale_of, unit_of
from thermal_robot.percents import percent
from thermal_robot.tables import html_table

_MOST_SESSIONS = 8  # Sessions named in one line; more would not fit beside each other on a terminal


def text(campaign: Any) -> str:
    """Describe a campaign in plain text, as blocks of lines: facts, joints, conditions, repetition, warnings."""
    blocks = [
        [f"Campaign {campaign.name}", *aligned(_facts(campaign))],
        ["Joints", *aligned(_joints(campaign))],
        ["Conditions recorded", *aligned(_covariates(campaign)), *_not_recorded(campaign)],
        ["Repetition", *aligned(_repetition(campaign))],
        ["Warnings", *([f"  - {warning}" for warning in campaign.warnings] or ["  none"])],
    ]
    return "\n\n".join("\n".join(block) for block in blocks)


def html(campaign: Any) -> str:
    """Describe a campaign in HTML tables for a notebook, as :func:`text` but for the conditions not recorded."""
    head, *joints = _joints(campaign)
    warned = html_table([[warning] for warning in campaign.warnings], heading="Warnings")
    return (
        html_table(_facts(campaign), heading=f"Campaign {campaign.name}")
        + html_table(joints, head=head)
        + html_table([*_covariates(campaign), *_repetition(campaign)])
        + (warned if campaign.warnings else "")
    )


def _facts(campaign: Any) -> Iterator[Sequence[str]]:
    robot, length, scale = campaign.robot, campaign.units.length, campaign.units.length_scale
    yield "robot", f"{robot.name}, chain from {robot.root_frame} to {robot.tool_frame}, {robot.n} movable joints"
    yield "gravity", f"{_triple(robot.gravity)} m/s² in {robot.root_frame}"
    yield "lengths hold at", f"{campaign.reference_temperature:g} °C"
    if not campaign.measured:
        yield "samples", f"{campaign.samples}, to be predicted"
        return
    if campaign.position is None:
        for kind in campaign.kinds:
            here = campaign.labels["kind"] == kind
            labels = names.KINDS[kind][1]
            shared = (f"{len(np.unique(campaign.labels[label][here]))} of {label!r}" for label in labels)
            yield f"rows of {kind}", ", ".join([str(int(here.sum())), *shared])
        yield "noise of position", _noise_of_position(campaign)
        return
    what = "position and orientation" if campaign.measures == "pose" else "position only"
    what = what if campaign.targets is None else f"{len(campaign.targets.numbers)} targets, which tell a pose"
    yield "measurements", f"{campaign.samples}, {what}, in {length}"
    extent = np.ptp(campaign.position, axis=0) / scale
    yield "measured volume", f"{extent[0]:.6g} x {extent[1]:.6g} x {extent[2]:.6g} {length}"
    unknown = "unknown: measured in the instrument's own frame, place and direction are fitted"
    yield "base frame", f"known: measured in {robot.root_frame}" if campaign.base_known else unknown
    if campaign.targets is not None:
        yield "targets", f"move against each other by {_noise(campaign.targets.sigma / scale, length)}"
    target = f"{_triple(campaign.target / scale)} {length} on {robot.tool_frame}"
    yield "target", f"known: {target}" if campaign.tool_known else f"unknown: fitted, starting from {target}"
    yield "noise of position", _noise_of_position(campaign)
    if campaign.measures == "pose":
        yield "noise of orientation", _noise(campaign.noise_orientation, "rad")
    if "payload" in campaign.covariates:
        yield "payload's centre", f"{_triple(campaign.payload_com / scale)} {length} in {robot.tool_frame}"
    if campaign.simulated_position is not None:
        yield "prediction", "from the simulator's columns sim.*, not from the URDF"
    if campaign.about:
        yield "about", ", ".join(f"{name.replace('_', ' ')} {said}" for name, said in campaign.about.items())
    for name, sizes in (("gear ratios", campaign.gears), ("expected sizes", campaign.priors)):
        if sizes:
            yield name, ", ".join(f"{of} {size:g}" for of, size in sizes.items())


def _joints(campaign: Any) -> Iterator[Sequence[str]]:
    robot = campaign.robot
    yield "joint", "type", "commanded", "limits", "unit", "range used"
    for j, (name, kind) in enumerate(zip(robot.joint_names, robot.joint_types, strict=True)):
        scale = campaign.units.joint_scale(kind)
        q, lower, upper = campaign.q[:, j] / scale, float(robot.lower[j]) / scale, float(robot.upper[j]) / scale
        limits, used = "none", ""
        if np.isfinite(lower) and np.isfinite(upper) and upper > lower:
            limits, used = _range(lower, upper), percent(np.ptp(q) / (upper - lower), 0)
        yield name, kind, _range(q.min(), q.max()), limits, campaign.units.joint_unit(kind), used


def _covariates(campaign: Any) -> Iterator[Sequence[str]]:
    """Yield a table row for each recorded condition: quantity, place, range, unit, gaps; its joints share one row."""
    if not campaign.covariates:
        yield ("none",)
        return
    yield "quantity", "of", "range", "unit", "gaps"
    robot, units = campaign.robot, campaign.units
    groups: dict[tuple[str, str], list[str]] = {}
    for column in campaign.covariates:
        quantity, place = split_name(column)
        joint = place in robot.joint_names and quantity in names.PER_JOINT and column not in campaign.extra
        unit = "0..1" if column == "speed" else unit_of(column, robot, units)
        unit = "as given" if column in campaign.extra else unit
        groups.setdefault((quantity if joint else column, unit), []).append(column)
    for (quantity, unit), columns in groups.items():
        of = "not defined by the format" if quantity in campaign.extra else ""
        if not of and quantity in names.PER_JOINT:
            whole = len(columns) == robot.n > 1
            of = f"all {robot.n} joints" if whole else ", ".join(split_name(column)[1] for column in columns)
            of += ", from the order of rows" if set(columns) <= set(campaign.derived) else ""
        values = np.concatenate([campaign.covariates[c] / scale_of(c, robot, units) for c in columns])
        gaps = sum(int(campaign.missing[column].sum()) for column in columns if column in campaign.missing)
        spread = _range(values.min(), values.max()) if np.ptp(values) > 0 else f"{values[0]:.6g}, does not vary"
        yield quantity, of, spread, unit, f"{gaps} filled" if gaps else "none"


def _not_recorded(campaign: Any) -> Iterator[str]:
    recorded = {split_name(column)[0] for column in campaign.covariates}
    recorded |= {"order"} if "time" in recorded else set()
    known = (*names.PLAIN_COVARIATES, *(f"{quantity}.<joint>" for quantity in names.PER_JOINT))
    absent = [name for name in known if split_name(name)[0] not in recorded]
    if absent:
        yield f"  not recorded: {', '.join(absent)}"


def _repetition(campaign: Any) -> Iterator[Sequence[str]]:
    _, counts = np.unique(np.round(campaign.q, SAME_CONFIGURATION), axis=0, return_counts=True)
    yield "identical commands", _repeated(counts)
    if (labels := campaign.pose_labels) is not None:
        yield "same pose label", _repeated(np.unique(labels[labels != ""], return_counts=True)[1])
    if "session" not in campaign.labels:
        yield "sessions", "no label: taken as one run"
        return
    sessions = zip(*np.unique(campaign.labels["session"], return_counts=True), strict=True)
    shown = [f"{str(name) or '(no label)'} ({count} row{'s' if count > 1 else ''})" for name, count in sessions]
    more = f" and {len(shown) - _MOST_SESSIONS} more" if len(shown) > _MOST_SESSIONS else ""
    yield "sessions", f"{len(shown)}: {', '.join(shown[:_MOST_SESSIONS])}{more}"


def _repeated(counts: NDArray[np.int64]) -> str:
    repeated = counts[counts > 1]
    if not len(repeated):
        return "no pose is repeated"
    return f"{len(repeated)} pose{'s' if len(repeated) > 1 else ''} repeated, {int(repeated.sum())} rows in all"


def _noise_of_position(campaign: Any) -> str:
    units, each, noise = campaign.units, campaign.noise_of_rows, campaign.noise_position
    if each is not None:
        low, high = each.min() / units.length_scale, each.max() / units.length_scale
        return f"{low:.4g} .. {high:.4g} {units.length} per axis (one sigma), of each row"
    return _noise(None if noise is None else of_a_point(noise, campaign.targets) / units.length_scale, units.length)


def _noise(sigma: float | None, unit: str) -> str:
    return "not given: estimated from the data" if sigma is None else f"{sigma:.4g} {unit} per axis (one sigma)"


def _triple(vector: Sequence[float] | NDArray[np.float64]) -> str:
    return "(" + ", ".join(f"{value + 0.0:.6g}" for value in vector) + ")"


def _range(low: float, high: float) -> str:
    return f"{low:.6g} .. {high:.6g}"


def aligned(rows: Iterator[Sequence[str]]) -> list[str]:
    """Return the rows as lines, indented, every column as wide as its widest cell."""
    table = list(rows)
    widths = [max(map(len, column)) for column in zip_longest(*table, fillvalue="")]
    lines = [[cell.ljust(width) for cell, width in zip(row, widths, strict=False)] for row in table]
    return [f"  {'   '.join(line)}".rstrip() for line in lines]
