"""A rate and its interval."""

import pytest

from thermal_robot.blind.score import Rate, rate


@pytest.mark.parametrize(
    ("successes", "trials", "low", "high"),
    # Newcombe 1998, Statistics in Medicine 17, 857, table I: method 3
    [(81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0, 0.1611), (1, 29, 0.0061, 0.1718)],
)
def test_wilsons_interval_is_that_of_the_textbook(successes, trials, low, high):
    found = Rate(successes, trials)
    assert found.value == successes / trials
    assert found.interval == pytest.approx((low, high), abs=5e-5)


def test_nothing_asked_is_no_rate():
    assert (Rate(0, 0).value, Rate(0, 0).interval) == (None, None)


def test_outcomes_are_counted_once_each():
    assert rate(outcome for outcome in (True, False, True, True)) == Rate(3, 4)
    assert rate([]) == Rate(0, 0)


@pytest.mark.parametrize("trials", [1, 7, 60, 1000])
def test_the_interval_holds_the_share_and_failures_mirror_successes(trials):
    for successes in {0, 1, trials // 3, trials}:
        low, high = Rate(successes, trials).interval
        assert 0.0 <= low <= successes / trials <= high <= 1.0
        mirrored = Rate(trials - successes, trials).interval
        assert (1.0 - high, 1.0 - low) == pytest.approx(mirrored, abs=1e-12)


def test_a_hundred_times_the_trials_tell_ten_times_as_much():
    few, many = (Rate(30 * k, 100 * k).interval for k in (1, 100))
    assert few[1] - few[0] == pytest.approx(10.0 * (many[1] - many[0]), rel=0.05)
