"""A model says which column, and which cell, it lacks in samples."""

from dataclasses import replace

import numpy as np
import pytest

from thermal_robot import CampaignError, simulate
from thermal_robot.correction.model import require_finite, require_needed
from thermal_robot.effects import Drift, ThermalElongation


@pytest.fixture(scope="module")
def samples(rv_m2):
    return simulate(rv_m2, rows=4)


def test_samples_that_have_what_is_needed_pass(samples):
    require_needed(samples, ("time", "temperature"), (Drift(),), False)
    require_finite(samples, samples.position)
    seen = replace(samples, simulated_position=samples.position)
    require_needed(seen, (), (), True)


def test_what_is_lacking_is_named(samples):
    bare = samples.drop_covariate("time")
    with pytest.raises(CampaignError, match=r"column 'time': the model \(drift\) needs this column.*no such column"):
        require_needed(bare, ("temperature", "time"), (Drift(), ThermalElongation()), False)
    with pytest.raises(CampaignError, match=r"column 'sim.x': the model corrects the prediction of your simulator"):
        require_needed(samples, (), (), True)


def test_an_empty_cell_is_named_with_its_row(samples):
    gaps = replace(samples, missing={"time": np.array([False, False, True, False])})
    require_needed(gaps, ("temperature",), (), False)
    with pytest.raises(CampaignError, match=r"row 4, column 'time'.*an empty cell"):
        require_needed(gaps, ("time",), (), False)


def test_a_row_without_a_finite_position_is_named(samples):
    position = samples.position.copy()
    position[1:3, 2] = np.inf
    with pytest.raises(CampaignError, match="row 3: the values of this row lead to no finite position"):
        require_finite(samples, position)
