"""Effects that a scatter feigned are not chosen beside it."""

from dataclasses import replace

import numpy as np
from simulate import simulate

from thermal_robot import diagnose
from thermal_robot.kinematics import Displacement
from thermal_robot.observations import Frames, observe


def test_steps_of_an_encoder_feign_no_systematic_effect(rv_m2):
    step, names = 1.5e-3, []
    for seed in range(12):
        plain = simulate(rv_m2, samples=130, seed=seed, noise=20e-6)[0]
        error = np.zeros_like(plain.q)
        error[:, 1] = np.round(plain.q[:, 1] / step) * step - plain.q[:, 1]
        true = observe(plain, Frames.declared(plain), displacement=Displacement(joint=error)).predicted_position
        noise = 20e-6 * np.random.default_rng(seed).normal(size=true.shape)
        found = diagnose(replace(plain, position=true + noise, noise_position=None))
        assert found.gap.noise_source == "scatter"
        names.append(found.verdict)
    assert names.count(("encoder_resolution",)) >= 11, names
