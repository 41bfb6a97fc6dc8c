"""Steps of an encoder and the scatter that they leave."""

import numpy as np
import pytest
from helpers import commanded

from thermal_robot.effects import EncoderResolution
from thermal_robot.observations import observe


def test_a_step_is_its_factor_times_the_scatter_of_what_is_rounded_to_it():
    step = 3.7e-4
    commands = np.random.default_rng(0).uniform(-2.0, 2.0, 200_000)
    errors = np.round(commands / step) * step - commands
    assert EncoderResolution.factor * errors.std() == pytest.approx(step, rel=5e-3)


def test_it_is_the_same_at_each_repeat_and_needs_none(rv_m2):
    assert EncoderResolution.component == "pose"
    assert EncoderResolution().missing(observe(commanded(rv_m2))) == ()
    assert EncoderResolution.title == "encoders that count in coarse steps"
