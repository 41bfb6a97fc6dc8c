"""From a campaign with repeats to the criteria of ISO 9283."""

from __future__ import annotations

from collections.abc import Sequence

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.errors import CampaignError, require
from thermal_robot.iso9283.criteria import along_path, drift_of, of_noise, repeatability, variation
from thermal_robot.iso9283.groups import CYCLES, FEWEST, Repeats, directions, repeats, times
from thermal_robot.iso9283.notes import notes_of
from thermal_robot.iso9283.parts import PathCriteria, PoseCriteria
from thermal_robot.iso9283.performance import Performance
from thermal_robot.iso9283.seen import Seen
from thermal_robot.observations import Frames


def performance(
    campaign: Campaign, *, frames: Frames | None = None, predicted: tuple[Array, Array | None] | None = None
) -> Performance:
    """Compute the criteria of ISO 9283 that the repeats of a campaign tell.

    Parameters
    ----------
    campaign
        With measurements. Rows with the same ``pose`` label are cycles of one pose, without that column those with the
        same commands; a ``path`` label makes them points of a path.
    frames
        Base and tool; where absent, unknown ones are fitted to the nominal robot by least squares of all rows.
    predicted
        What a corrected model predicts of the same rows, as :meth:`CorrectedModel.predict` returns it: (N, 3)
        positions, m, and (N, 4) orientations or ``None``, in the measurement frame. Rows that are NaN do not count.

    Returns
    -------
    Performance
        Prints as a table.

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
        raise CampaignError(
            campaign.name,
            "no pose is repeated",
            column="pose",
            found=f"{campaign.samples} rows, each another pose",
            expected=f"the same label in rows that repeat a pose, {CYCLES} of each for the standard",
        )
    seen = Seen.of(campaign, frames, predicted)
    at_rest = [_pose(seen, group) for group in groups if not group.path]
    along = dict.fromkeys(group.path for group in groups if group.path)
    paths = [_path(seen, path, [group for group in groups if group.path == path]) for path in along]
    sigma = campaign.noise_position
    alone_shows = None if sigma is None else of_noise(sigma)
    notes = tuple(notes_of(seen, groups, at_rest, paths, alone))
    robot = campaign.robot
    return Performance(
        campaign.name, robot.name, robot.tool_frame, tuple(at_rest), tuple(paths), seen.fitted, alone_shows, notes
    )


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
        accuracy=seen.accuracy(rows),
        corrected=seen.after(rows),
        variation=variation([seen.attained.take(part) for part in counting]) if several else None,
        variation_cycles=tuple(len(part) for part in counting) if several else (),
        drift=drift_of(attained, commanded) if at else None,
        drift_cycles=tuple(len(part) for part in at),
    )


def _path(seen: Seen, path: str, points: Sequence[Repeats]) -> PathCriteria:
    away = [found for point in points if (found := seen.accuracy(point.rows))]
    after = [found for point in points if (found := seen.after(point.rows))]
    return PathCriteria(
        path=path,
        points=len(points),
        cycles=min(len(point.rows) for point in points),
        repeatability=along_path([repeatability(seen.attained.take(point.rows)) for point in points]),
        accuracy=along_path(away) if away else None,
        corrected=along_path(after) if after else None,
    )
