"""When campaigns were measured: dates as users write them, in days since the first."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import date, datetime, timedelta, timezone
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.errors import CampaignError

DAY = 86400.0
"""Seconds."""
_EXPECTED = "a date such as 2026-03-01, with an hour if need be, such as 2026-03-01T14:30"


def moment(given: Any) -> datetime:
    """Return a date as a moment: midnight where it has no hour, UTC where it has a time zone.

    Parameters
    ----------
    given
        ISO 8601 text, or a ``date`` or ``datetime``.

    Raises
    ------
    CampaignError
        If it is no date.
    """
    if isinstance(given, str):
        try:
            given = datetime.fromisoformat(given.strip())
        except ValueError:
            raise CampaignError("wear", "is no date", column="dates", found=repr(given), expected=_EXPECTED) from None
    if not isinstance(given, date):
        raise CampaignError("wear", "is no date", column="dates", found=repr(given), expected=_EXPECTED)
    if not isinstance(given, datetime):
        return datetime(given.year, given.month, given.day)
    return given if given.tzinfo is None else given.astimezone(timezone.utc).replace(tzinfo=None)


def days_since(moments: Sequence[datetime]) -> NDArray[np.float64]:
    """(K,) days of moments since the first of them."""
    first = min(moments)
    return np.array([(each - first).total_seconds() / DAY for each in moments])


def in_words(first: datetime, day: float) -> str:
    """Return the date of so many days after the first, rounded to a day; an hour is more than is known."""
    try:
        return (first + timedelta(days=round(day, 6))).date().isoformat()
    except OverflowError:  # the year 10000 is as good as never
        return "later than 9999"
