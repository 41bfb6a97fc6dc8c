"""Which laws are tried: their places, quantities, knots and shapes."""

import numpy as np

from thermal_robot.effects.law import Discovered
from thermal_robot.inference.laws import of_quantity


def test_knots_stand_apart_where_most_values_lie_in_one_spot():
    rng = np.random.default_rng(0)
    values = np.concatenate([1.0 - 1e-6 * rng.random(500), rng.uniform(0.7, 1.0, 20)])
    marks = np.array(of_quantity(Discovered(), values).marks)
    assert np.diff(marks).min() > 0.2 * np.ptp(values) / len(marks)
    spread = rng.uniform(-1.0, 1.0, 500)
    np.testing.assert_allclose(
        of_quantity(Discovered(), spread).marks, np.quantile(spread, np.linspace(0.02, 0.98, 5)), rtol=1e-12
    )
