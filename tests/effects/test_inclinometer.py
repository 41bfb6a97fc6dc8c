"""What inclinometers read: which columns, as which turns."""

import numpy as np
from helpers import SAMPLES, commanded

from thermal_robot.effects import inclinometer
from thermal_robot.observations import observe


def test_each_place_has_its_two_columns():
    assert inclinometer.columns(inclinometer.BASE, "forearm") == (
        "tilt.x",
        "tilt.y",
        "tilt.forearm.x",
        "tilt.forearm.y",
    )


def test_a_reading_is_a_turn_about_x_and_y(rv_m2):
    ramp, still = np.linspace(0.0, 1e-3, SAMPLES), np.full(SAMPLES, 2e-4)
    seen = observe(commanded(rv_m2, {"tilt.forearm.y": ramp, "tilt.forearm.x": 0.1 * ramp, "tilt.y": still}))
    read = inclinometer.turn(seen, "forearm")
    np.testing.assert_array_equal(read, np.column_stack([0.1 * ramp, ramp, 0.0 * ramp]))
    np.testing.assert_array_equal(inclinometer.turn(seen), np.column_stack([0.0 * still, still, 0.0 * still]))
    assert inclinometer.recorded(seen, inclinometer.BASE) == ("tilt.y",)
    assert inclinometer.varies(seen, "forearm")
    assert not inclinometer.varies(seen, inclinometer.BASE, "upper_arm")
    name, unit, values = inclinometer.varying_most(seen, "forearm")
    assert (name, unit) == ("tilt.forearm.y", "rad")
    np.testing.assert_array_equal(values, ramp)
