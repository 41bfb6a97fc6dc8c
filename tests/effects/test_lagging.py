"""A body behind a recorded temperature, against its differential equation."""

import numpy as np
import pytest

from thermal_robot.effects.thermal_elongation import History


@pytest.mark.parametrize("lag", [30.0, 600.0, 5000.0])
def test_a_lag_obeys_its_differential_equation(lag):
    rng = np.random.default_rng(2)
    times = rng.permutation(np.append(np.sort(rng.uniform(0.0, 7200.0, 80)), [0.0, 3000.0, 3000.0]))
    recorded = 20.0 + 4.0 * np.sin(times / 900.0) + times / 2000.0
    history = History.of(times, recorded)
    fine = np.arange(0.0, times.max(), 0.25)
    driven = np.interp(fine, history.times, history.temperatures)
    link = np.empty_like(fine)
    link[0] = driven[0]
    for i in range(1, len(fine)):
        link[i] = link[i - 1] + 0.25 / lag * ((driven[i] + driven[i - 1]) / 2 - link[i - 1])
    followed = history.followed(lag, times, recorded)
    np.testing.assert_allclose(followed, np.interp(times, fine, link), atol=2e-3 * max(1.0, 300.0 / lag))
    # after the record: it settles to what the row itself says
    after = history.followed(lag, np.array([times.max(), times.max() + 50 * lag]), np.array([0.0, 31.0]))
    np.testing.assert_allclose(after, [followed[times.argmax()], 31.0], atol=1e-6)
    assert history.followed(lag, np.array([-10.0]), np.array([19.0]))[0] == 19.0


def test_a_long_record_is_thinned_and_still_followed():
    times = np.linspace(0.0, 20000.0, 5000)
    recorded = 20.0 + 3.0 * np.sin(times / 3000.0)
    short = History.of(times, recorded)
    assert len(short.times) <= 500
    whole = History(tuple(times.tolist()), tuple(recorded.tolist()))
    np.testing.assert_allclose(
        short.followed(900.0, times, recorded), whole.followed(900.0, times, recorded), atol=1e-3
    )


def test_a_short_lag_is_no_lag_and_a_long_one_stays_where_it_began():
    times = np.linspace(0.0, 3600.0, 40)
    recorded = 20.0 + 5.0 * np.sin(times / 400.0)
    history = History.of(times, recorded)
    np.testing.assert_allclose(history.followed(1e-3, times, recorded), recorded, atol=1e-3)
    np.testing.assert_allclose(history.followed(1e9, times, recorded), recorded[0], atol=1e-3)


def test_rows_of_one_instant_count_as_their_mean_in_any_order():
    history = History.of(np.array([5.0, 0.0, 5.0]), np.array([30.0, 20.0, 20.0]))
    assert history == History((0.0, 5.0), (20.0, 25.0))
