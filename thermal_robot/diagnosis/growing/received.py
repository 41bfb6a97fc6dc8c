"""New rows: a campaign of the same robot and kind, or a table of them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from thermal_robot.campaign import Campaign
from thermal_robot.campaign.tabular import table_from_frame
from thermal_robot.campaign.turned import read_alike
from thermal_robot.campaign.validate import build_campaign
from thermal_robot.diagnosis.growing import settings
from thermal_robot.diagnosis.growing.choice import Choice
from thermal_robot.diagnosis.growing.linearised import Seen
from thermal_robot.diagnosis.growing.settled import Single
from thermal_robot.errors import CampaignError, require
from thermal_robot.inference.robust import distance_limit, tail_weight
from thermal_robot.robot import Robot

if TYPE_CHECKING:
    import pandas as pd

WHERE = "update(), rows"


def received(old: Campaign, rows: Campaign | pd.DataFrame, needs: tuple[str, ...]) -> Campaign:
    """Return new rows, a campaign or a table of the old one's columns and units, as a campaign that can be put to it.

    Raises :class:`CampaignError` if they are of another robot or kind, or lack a column that the chosen effects read
    (``needs``).
    """
    if not isinstance(rows, Campaign):
        import pandas as pd

        require(WHERE, rows, (pd.DataFrame,), "a campaign of the same robot, or a pandas DataFrame of its columns")
        rows = build_campaign(table_from_frame(rows, "<rows>"), old.settings, old.robot, name="rows")
    _same_robot(old.robot, rows.robot, rows.name)
    for what, mine, theirs in _kinds(old, rows):
        if mine != theirs:
            raise CampaignError(rows.name, f"another {what}", found=str(theirs), expected=f"{mine}, as of {old.name}")
    if old.targets is not None or rows.targets is not None:
        expected = "rows of one target; diagnose all rows together"
        raise CampaignError(rows.name, "several targets of each pose, whose places all rows tell", expected=expected)
    rows = read_alike(rows, old.robot, old.turned)
    for column in needs:
        if column not in rows.covariates:
            raise CampaignError(rows.name, "lacks what the chosen effects read", column=column, expected="this column")
    return rows


def weighed(choice: Choice, rows: Campaign) -> Single:
    """Return rows with the weights with which they come: in full where each fit weighs them, else by the diagnosis."""
    count, judge = rows.samples, choice.judge
    if judge is None or not count:
        return Single(rows, np.ones(count), np.zeros(count, dtype=bool))
    gap = Seen.at(rows, judge.point, replace(choice, rivals=())).alike[:, :, -1]
    distance2 = ((gap / judge.sigma) ** 2).sum(axis=1)
    aside = distance2 > distance_limit(choice.measures, judge.rows)
    return Single(rows, np.where(aside, 0.0, tail_weight(distance2, choice.measures)), aside)


def _kinds(old: Campaign, rows: Campaign) -> list[tuple[str, object, object]]:
    """Return what must be the same in both: its name, the old one's and the new one's."""
    return [
        ("kind of measurement", old.measures, rows.measures),
        ("base frame", _word(old.base_known), _word(rows.base_known)),
        ("tool frame", _word(old.tool_known), _word(rows.tool_known)),
        ("target", old.target.tolist(), rows.target.tolist()),
        ("noise of positions", _noise(old), _noise(rows)),
        ("noise of orientations", old.noise_orientation, rows.noise_orientation),
        ("reference temperature", old.reference_temperature, rows.reference_temperature),
        ("prediction", _simulated(old), _simulated(rows)),
    ]


def _word(known: bool) -> str:
    return "known" if known else "unknown"


def _simulated(campaign: Campaign) -> str:
    return "of the URDF" if campaign.simulated_position is None else "of the user's simulator"


def _noise(campaign: Campaign) -> object:
    """Return the stated noise; where each row has its own, that it has."""
    return campaign.noise_position if campaign.noise_of_rows is None else "of each row"


def _same_robot(old: Robot, new: Robot, name: str) -> None:
    """Refuse rows of another chain: other joints, or the same joints put the tool frame elsewhere."""
    if new is old:
        return
    if new.joint_names != old.joint_names:
        found, expected = ", ".join(new.joint_names), ", ".join(old.joint_names)
        raise CampaignError(name, "another robot: its joints differ", found=found, expected=expected)
    q = np.array([np.zeros(old.n), *np.eye(old.n), np.ones(old.n)])
    if np.abs(new.forward(q) - old.forward(q)).max() > settings.SAME_PLACE:
        raise CampaignError(name, "another nominal model", expected="the same URDF and tool frame")
