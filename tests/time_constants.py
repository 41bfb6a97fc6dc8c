"""Campaigns of an arm with one large effect that has a time constant."""

from dataclasses import replace

import numpy as np
from conftest import load_arm
from simulate import remaining, simulate

from thermal_robot.effects.apply import displacement
from thermal_robot.effects.drift import Drift
from thermal_robot.effects.thermal_elongation import History, ThermalElongation
from thermal_robot.observations import Frames, observe

NOISE = 25e-6  # m
LAG, DRIFT = "thermal_elongation", "drift"


def campaign(name, seed, kind, constant, ratio):
    """A lag in s, or a drift's constant as a share of the campaign; the effect leaves ``ratio`` times the noise."""
    plain = simulate(load_arm(name), samples=120, seed=seed, noise=NOISE)[0]
    rng, frames = np.random.default_rng([seed, 7]), Frames.declared(plain)
    nominal, time = observe(plain, frames), plain.covariates["time"]
    if kind == LAG:
        record = History.of(time, plain.covariates["temperature"])
        effect = ThermalElongation(True, constant, record.times, record.temperatures)
        values = np.array([1.5e-5])
    else:
        effect = Drift(float(time.min()), float(np.ptp(time)), constant)
        values = 1e-4 * rng.normal(size=6)
    values = values * (ratio * np.sqrt(3.0) * NOISE / remaining(plain, nominal, effect, values))
    true = observe(plain, frames, displacement=displacement(nominal, [(effect, values)])[0]).predicted_position
    return replace(plain, position=true + NOISE * rng.normal(size=true.shape), priors={})
