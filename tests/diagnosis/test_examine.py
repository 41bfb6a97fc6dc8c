"""Whether a remainder is noise: by size, repeats, neighbours, laws, and rows set aside in a row."""

from dataclasses import replace

import numpy as np
from simulate import simulate

from thermal_robot import diagnose
from thermal_robot.observations import Frames, observe


def test_rows_set_aside_one_after_the_other_are_no_gross_errors(rv_m2):
    """A target that was knocked late leaves few rows, which look spoilt; spoilt rows do not follow each other."""
    plain = simulate(rv_m2, samples=100, seed=5)[0]
    rng = np.random.default_rng(5)
    late = np.arange(100) >= 85
    knocked = simulate(rv_m2, samples=100, seed=5)[0]
    order = {"time": np.arange(100.0)}
    target = np.array([0.0, 1e-3, 0.0])
    turned = observe(plain, Frames.declared(plain)).chain.tool_rotation @ target
    data = replace(knocked, position=knocked.position + np.where(late[:, None], turned, 0.0), covariates=order)
    found = diagnose(data)
    assert found.unexplained.flagged
    assert found.finding("discovered.1").quantity == "time"
    spoilt = np.where(np.isin(np.arange(100), rng.permutation(100)[:6])[:, None], 2e-3, 0.0)
    scattered = diagnose(replace(plain, position=plain.position + spoilt, covariates=order))
    assert not scattered.unexplained.flagged
    assert len(scattered.outliers) == 6
