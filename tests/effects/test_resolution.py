"""What is rounding, and what is rest, is no quantity that anything can follow; nor is what another one says already."""

import numpy as np
import pytest

from thermal_robot.effects.quantities import resolution, varies, without_twins

RNG = np.random.default_rng(4)
STILL = 0.7 + 7e-7 * RNG.uniform(-1.0, 1.0, 200)  # to 1.4 µrad, however many digits


@pytest.mark.parametrize(
    ("values", "unit", "said"),
    [
        (STILL, "rad", False),
        (np.where(RNG.random(200) < 0.5, 21.0, 21.125), "°C", False),  # the last digit of a sensor
        (np.round(RNG.uniform(21.0, 21.6, 200), 1), "°C", True),
        (np.where(RNG.random(200) < 0.5, 20.0, 35.0), "°C", True),  # two days, not two digits
        (np.where(RNG.random(200) < 0.5, 0.0, 1.0), "rad", True),  # two poses
        (np.where(RNG.random(200) < 0.5, 0.0, 1.2), "kg", True),
        (np.where(RNG.random(200) < 0.5, -1.0, 1.0), "", True),
        (RNG.uniform(-1.0, 1.0, 200), "rad", True),
        (np.full(200, 3.0), "kg", False),
        (np.array([]), "rad", False),
    ],
)
def test_what_varies_by_no_more_than_it_is_read_to_does_not_vary(values, unit, said):
    assert varies(values, resolution(values, unit)) is said


def test_digits_beyond_what_an_instrument_tells_do_not_count():
    fine, coarse = np.round(RNG.uniform(20.0, 30.0, 500), 6), np.arange(0.0, 100.0, 5.0)
    assert resolution(fine, "°C") == 0.05
    assert resolution(np.round(fine, 1), "°C") == pytest.approx(0.1)
    assert resolution(coarse, "°C") == 0.5


def test_a_twin_goes_and_what_says_more_stays():
    q = RNG.uniform(-1.0, 1.0, 300)
    readings = {
        "elbow": q,
        "shoulder": q[::-1],
        "encoder.elbow": q + 1e-3 * RNG.standard_normal(300),
        "encoder.shoulder": q,  # of another joint's motion: somebody exchanged the columns, and it says more
        "temperature": 20.0 + q,
        "temperature.arm": 20.0 + q,
        "temperature.hand": 20.0 + q**2,
        "encoder.nobody": q,
    }
    assert set(without_twins(readings, ("elbow", "shoulder"))) == set(readings) - {"encoder.elbow", "temperature.arm"}


def test_a_reading_without_its_twin_stays():
    assert set(without_twins({"encoder.elbow": STILL, "temperature.arm": STILL}, ("elbow",))) == {
        "encoder.elbow",
        "temperature.arm",
    }
