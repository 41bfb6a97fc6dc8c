"""Dates as users write them."""

from datetime import date, datetime, timedelta, timezone

import numpy as np
import pytest

from thermal_robot import CampaignError
from thermal_robot.fleet.wear import _days_since, _in_words, _moment


@pytest.mark.parametrize(
    ("given", "meant"),
    [
        ("2026-03-01", datetime(2026, 3, 1)),
        (" 2026-03-01T14:30 ", datetime(2026, 3, 1, 14, 30)),
        (date(2026, 3, 1), datetime(2026, 3, 1)),
        (datetime(2026, 3, 1, 6), datetime(2026, 3, 1, 6)),
        (datetime(2026, 3, 1, 6, tzinfo=timezone(timedelta(hours=2))), datetime(2026, 3, 1, 4)),
    ],
)
def test_a_date_is_a_moment(given, meant):
    assert _moment(given) == meant


@pytest.mark.parametrize("given", ["first of March", "2026-13-01", 20260301, None, ""])
def test_what_is_no_date_is_told_with_an_example(given):
    with pytest.raises(CampaignError, match=r"is no date.*2026-03-01"):
        _moment(given)


def test_days_count_from_the_first_through_a_leap_day():
    days = _days_since([datetime(2028, 3, 1), datetime(2028, 2, 28), datetime(2028, 2, 28, 12)])
    np.testing.assert_allclose(days, [2.0, 0.0, 0.5])


def test_a_day_is_told_as_a_date():
    assert _in_words(datetime(2028, 2, 28), 2.0) == "2028-03-01"
    assert _in_words(datetime(2028, 2, 28), 1e12) == "later than 9999"
