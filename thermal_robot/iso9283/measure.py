"""ISO 9283 criteria of a campaign with repeats, and remarks on their validity.

The standard compares attained with commanded poses in the axes of the base.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.campaign.names import listed
from thermal_robot.campaign.plausible import SAME_COMMAND
from thermal_robot.errors import CampaignError, require
from thermal_robot.inference.registration import register
from thermal_robot.iso9283.criteria import (
    Accuracy,
    Attained,
    PathCriteria,
    PoseCriteria,
    accuracy,
    along_path,
    drift_of,
    of_noise,
    repeatability,
    variation,
)
from thermal_robot.iso9283.groups import CYCLES, FEWEST, PATH_CYCLES, Repeats, directions, repeats, times
from thermal_robot.iso9283.performance import Performance
from thermal_robot.kinematics import quaternion_to_rotation
from thermal_robot.observations import Frames, observe

Rows = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Seen:
    """Measured, commanded and predicted poses of a campaign in the axes of the base.

    ``attained`` was measured, ``commanded`` are the nominal robot's poses (``None`` where the unknown frames have as
    many unknowns as there are figures, or more), ``corrected`` those that a model predicts. ``fitted`` names the frames
    fitted to the same rows, ``unknowns`` counts their parameters, ``figures`` the measured numbers of different poses.
    """

    campaign: Campaign
    attained: Attained
    commanded: Attained | None
    corrected: Attained | None
    fitted: tuple[str, ...]
    unknowns: int
    figures: int

    def near(self, rows: Rows) -> Accuracy | None:
        """Pose accuracy AP of some rows against the commanded poses; ``None`` where these are unknown."""
        return None if self.commanded is None else accuracy(self.attained.take(rows), self.commanded.take(rows))

    def after(self, rows: Rows) -> Accuracy | None:
        """Pose accuracy AP of the rows that the corrected model predicts, against it; ``None`` if it predicts none."""
        if self.corrected is None:
            return None
        rows = rows[np.isfinite(self.corrected.position[rows]).all(axis=1)]
        return accuracy(self.attained.take(rows), self.corrected.take(rows)) if len(rows) else None


def _seen(campaign: Campaign, frames: Frames | None, predicted: tuple[Array, Array | None] | None) -> Seen:
    """Transform measured, commanded and predicted poses to the base; unknown frames are fitted by least squares."""
    each = 3 if campaign.orientation is None else 6
    held = campaign.tool_known or campaign.simulated_position is not None
    unknown = {"base": 0 if campaign.base_known else 6, "tool": 0 if held else each}
    taken, figures = sum(unknown.values()), each * len(np.unique(np.round(campaign.q / SAME_COMMAND), axis=0))
    told = taken < figures
    if frames is None:
        # by least squares, as surveyors align two systems: the standard sets no cycle aside
        frames = register(campaign, np.ones(campaign.samples, dtype=bool)) if told else Frames.declared(campaign)
    found = observe(campaign, frames) if told else None
    should = None if found is None else Attained(found.position, found.rotation)
    is_ = _in_base(frames.base, np.asarray(campaign.position), campaign.orientation)
    after = None if predicted is None else _in_base(frames.base, *_checked(campaign, predicted))
    return Seen(campaign, is_, should, after, tuple(n for n, count in unknown.items() if count), taken, figures)


def _in_base(base: Array, position: Array, orientation: Array | None) -> Attained:
    """Transform positions (N, 3) and quaternions (N, 4) from the measurement frame to the base, whose pose is given."""
    turn, origin = base[:3, :3], base[:3, 3]
    rotation = None if orientation is None else turn.T @ quaternion_to_rotation(orientation)
    return Attained((position - origin) @ turn, rotation)


def _checked(campaign: Campaign, predicted: tuple[Array, Array | None]) -> tuple[Array, Array | None]:
    """Validate a model's predictions: one position and orientation (or ``None``) for each row, else a CampaignError."""
    kind = "positions (N, 3) and orientations (N, 4) or None, as prediction() returns them"
    require("performance(), predicted", predicted, (tuple, list), kind)
    position, orientation = (None if part is None else np.asarray(part, dtype=float) for part in predicted[:2])
    wrong = position is None or position.shape != (campaign.samples, 3)
    if wrong or (orientation is not None and orientation.shape != (campaign.samples, 4)):
        found = " and ".join("None" if part is None else str(part.shape) for part in (position, orientation))
        expected = f"{kind}, with N = {campaign.samples}"
        raise CampaignError("performance(), predicted", "other rows were predicted", found=found, expected=expected)
    return np.asarray(position), None if campaign.orientation is None else orientation


_NAMED = 5


def _notes(
    seen: Seen, groups: Sequence[Repeats], poses: Sequence[PoseCriteria], paths: Sequence[PathCriteria], alone: int
) -> Iterator[str]:
    """Yield remarks on the validity of the criteria; ``alone`` is the number of rows that repeat no other."""
    campaign, many = seen.campaign, len(seen.fitted) > 1
    frames = f"{' and '.join(seen.fitted)} frame{'s' if many else ''}"
    if seen.commanded is None:
        yield (
            f"AP and AT cannot be told: the unknown {frames} {'have' if many else 'has'} {seen.unknowns} unknowns, and "
            f"{seen.figures} figures of different poses were measured."
        )
    elif seen.fitted:
        yield (
            f"AP and AT are after registration: the {frames} {'are' if many else 'is'} fitted to the same measurements "
            f"({seen.unknowns} unknowns, {seen.figures} figures of different poses). They are smaller than against "
            "frames that are measured by themselves. RP, vAP and RT do not depend on it."
        )
    for name, standard, cycles in (
        ("poses", CYCLES, [p.cycles for p in poses]),
        ("paths", PATH_CYCLES, [p.cycles for p in paths]),
    ):
        if few := sum(count < standard for count in cycles):
            yield f"Fewer cycles than the standard's {standard}: {few} of {len(cycles)} {name}."
    if several := [p.pose for p in poses if (p.directions or 0) > 1]:
        yield (
            "Reached from several directions, so that RP holds what vAP tells and is larger than the standard's, which "
            f"comes from one: {listed(several, _NAMED)}."
        )
    if apart := [g.label for g in groups if np.ptp(campaign.q[g.rows], axis=0).max() > SAME_COMMAND]:
        yield f"Rows of one label have different joint commands, which counts as scatter: {listed(apart, _NAMED)}."
    if campaign.noise_position:
        alone_shows = 1e3 * of_noise(campaign.noise_position)
        yield f"RP_l holds the noise of the instrument, which alone would show {alone_shows:.3g} mm."
    if alone:
        yield f"{alone} of {campaign.samples} rows repeat nothing, and count for the registration only."


def performance(
    campaign: Campaign, *, frames: Frames | None = None, predicted: tuple[Array, Array | None] | None = None
) -> Performance:
    """ISO 9283 performance criteria (AP, RP, vAP, drift, AT, RT) from the repeats of a campaign.

    Parameters
    ----------
    campaign
        Campaign with measurements. Rows with the same ``pose`` label are cycles of one pose; without that column, rows
        with the same joint commands. A ``path`` label makes them points of a path.
    frames
        Base and tool frame; where absent, unknown ones are fitted to the nominal robot by least squares of all rows.
    predicted
        Predictions of a corrected model for the same rows, as :meth:`CorrectedModel.prediction` returns them: (N, 3)
        positions, m, and (N, 4) orientations or ``None``, in the measurement frame. Rows that are NaN do not count.

    Returns
    -------
    Performance
        The criteria of each pose and path; prints as tables.

    Raises
    ------
    CampaignError
        If nothing was measured or repeated, or predictions do not fit the rows.
    EstimationError
        If there are too few rows for the unknown frames.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> from thermal_robot.iso9283 import performance
    >>> tested = tr.simulate("builtin:rv_m2", {"excess_repeatability": 1e-4}, tool_frame="tool0", rows=90, repeats=30)
    >>> found = performance(tested)
    >>> found.summary
    'ISO 9283, the worst of 3 poses of 30 cycles (the standard: 30): AP_p ... mm; RP_l ... mm'
    """
    require("performance()", campaign, (Campaign,), "a campaign")
    if campaign.position is None:
        raise CampaignError(campaign.name, "nothing was measured", column="x", expected="measured positions")
    groups, alone = repeats(campaign)
    if not groups:
        found = f"{campaign.samples} rows, each another pose"
        expected = f"the same label in rows that repeat a pose, {CYCLES} of each for the standard"
        raise CampaignError(campaign.name, "no pose is repeated", column="pose", found=found, expected=expected)
    seen = _seen(campaign, frames, predicted)
    at_rest = [_pose(seen, group) for group in groups if not group.path]
    along = dict.fromkeys(group.path for group in groups if group.path)
    paths = [_path(seen, path, [group for group in groups if group.path == path]) for path in along]
    notes = tuple(_notes(seen, groups, at_rest, paths, alone))
    sigma, robot = campaign.noise_position, campaign.robot
    shown = None if sigma is None else of_noise(sigma)
    named = (campaign.name, robot.name, robot.tool_frame)
    return Performance(*named, tuple(at_rest), tuple(paths), seen.fitted, shown, notes)


def _pose(seen: Seen, group: Repeats) -> PoseCriteria:
    campaign, rows = seen.campaign, group.rows
    approached = directions(campaign, rows)
    counting = [part for part in approached or [] if len(part) >= FEWEST]
    several = len(counting) > 1
    at = times(campaign, rows)
    attained = [seen.attained.take(part) for part in at]
    commanded = None if seen.commanded is None else [seen.commanded.take(part) for part in at]
    return PoseCriteria(
        pose=group.label,
        cycles=len(rows),
        directions=None if approached is None else len(approached),
        repeatability=repeatability(seen.attained.take(rows)),
        accuracy=seen.near(rows),
        corrected=seen.after(rows),
        variation=variation([seen.attained.take(part) for part in counting]) if several else None,
        variation_cycles=tuple(len(part) for part in counting) if several else (),
        drift=drift_of(attained, commanded) if at else None,
        drift_cycles=tuple(len(part) for part in at),
    )


def _path(seen: Seen, path: str, points: Sequence[Repeats]) -> PathCriteria:
    away = [found for point in points if (found := seen.near(point.rows))]
    after = [found for point in points if (found := seen.after(point.rows))]
    return PathCriteria(
        path=path,
        points=len(points),
        cycles=min(len(point.rows) for point in points),
        repeatability=along_path([repeatability(seen.attained.take(point.rows)) for point in points]),
        accuracy=along_path(away) if away else None,
        corrected=along_path(after) if after else None,
    )
