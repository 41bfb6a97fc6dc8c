"""Campaigns of one robot put end to end, as one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from thermal_robot.campaign.campaign import Campaign
from thermal_robot.errors import CampaignError

_PER_SAMPLE = ("q", "position", "orientation", "simulated_position", "simulated_orientation", "noise_of_rows", "rows")


def appended(campaigns: Sequence[Campaign]) -> Campaign:
    """Return the rows of several campaigns of one robot as one campaign, with the declarations of the first.

    Parameters
    ----------
    campaigns
        At least one; of the same joints. What is measured must be the same in all; covariates and labels that not
        all have are left out.

    Returns
    -------
    Campaign
        Each row keeps its number, its side of approach, and how far its joints had gone since they last turned: of the
        move from one campaign to the next nothing is known.

    Raises
    ------
    CampaignError
        If one has columns of measurements that another has not, or several targets of each pose, whose places on the
        tool are found from all rows together.

    Examples
    --------
    >>> import numpy as np
    >>> import thermal_robot as tr
    >>> from thermal_robot.campaign.appended import appended
    >>> campaign = tr.demo_campaign()
    >>> both = appended([campaign.take(np.arange(100)), campaign.take(np.arange(100, 120))])
    >>> both.samples, bool((both.q == campaign.q).all())
    (120, True)
    """
    first = campaigns[0]
    if len(campaigns) == 1:
        return first
    changes: dict[str, Any] = {}
    for key in _PER_SAMPLE:
        values = [getattr(one, key) for one in campaigns]
        held = [value is not None for value in values]
        if any(held) and not all(held):
            expected = f"the same columns as in {first.name}"
            raise CampaignError(campaigns[held.index(not held[0])].name, f"differs in {key}", expected=expected)
        if held[0]:
            changes[key] = np.concatenate(values)
    if any(one.targets is not None for one in campaigns):
        raise CampaignError(first.name, "has several targets of each pose: rows of another file cannot be put to them")
    for key in ("covariates", "labels"):
        changes[key] = _joined([getattr(one, key) for one in campaigns])
    changes["missing"] = _missing(campaigns, changes["covariates"])
    changes["travelled"] = _joined([one.since_turn for one in campaigns])
    names = changes["covariates"]
    changes["extra"] = tuple(name for name in first.extra if name in names)
    changes["derived"] = tuple(name for name in first.derived if name in names)
    return replace(first, **changes)


def _joined(by_name: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    names = [name for name in by_name[0] if all(name in other for other in by_name)]
    return {name: np.concatenate([own[name] for own in by_name]) for name in names}


def _missing(campaigns: Sequence[Campaign], covariates: Mapping[str, Any]) -> dict[str, Any]:
    """Return which cells were filled in, of the columns where any was."""
    names = dict.fromkeys(name for one in campaigns for name in one.missing if name in covariates)
    none = {id(one): np.zeros(one.samples, dtype=bool) for one in campaigns}
    return {name: np.concatenate([one.missing.get(name, none[id(one)]) for one in campaigns]) for name in names}
