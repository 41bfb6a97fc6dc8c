"""Waves over part of a turn that come out too large give way to an error curve; those that are large stay."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import NOISE
from simulate import simulate

from thermal_robot.diagnosis import credible as room
from thermal_robot.diagnosis.credible import goes_astray, in_full
from thermal_robot.effects import TransmissionError
from thermal_robot.inference.fit import fit
from thermal_robot.kinematics import Displacement
from thermal_robot.observations import Frames, observe

CATALOGUE = 3e-4  # rad, one minute of arc


def waving(robot, seed, orders, size, part):
    """An arm that moves in a part of its range, every joint of which errs by waves of its own position."""
    plain = replace(simulate(robot, seed=seed, noise=NOISE, samples=300)[0], priors={})
    plain, rng = replace(plain, q=part * plain.q), np.random.default_rng([seed, 2])
    error = sum(size * np.sin(k * plain.q + rng.uniform(0.0, 6.28, plain.q.shape[1])) for k in orders)
    true = observe(plain, Frames.declared(plain), displacement=Displacement(joint=error)).predicted_position
    return replace(plain, position=true + NOISE * rng.normal(size=true.shape))


def largest(known):
    """Of the waves' amplitudes; rad."""
    return max(float(np.abs(values).max()) for _, values in known.effects)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("orders", [(3, 5), (4,)])
def test_small_waves_over_part_of_a_turn_do_not_come_out_as_large_ones(rv_m2, orders, seed):
    waves = fit(waving(rv_m2, seed, orders, CATALOGUE, 0.6), [TransmissionError()])
    assert largest(waves) > 10 * CATALOGUE
    curve = in_full(waves, lambda _: None)
    assert largest(curve) < 2 * CATALOGUE
    assert goes_astray(curve) < goes_astray(waves)
    assert goes_astray(curve) == pytest.approx(np.sqrt(3.0) * NOISE, rel=0.15)


@pytest.mark.parametrize("seed", range(3))
def test_a_wheel_that_is_far_off_keeps_its_wave(rv_m2, seed):
    known = fit(waving(rv_m2, seed, (1,), 10 * CATALOGUE, 0.6), [TransmissionError()])
    kept = in_full(known, lambda _: None)
    assert [effect.harmonics for effect, _ in kept.effects] == [effect.harmonics for effect, _ in known.effects]
    assert largest(kept) > 8 * CATALOGUE


def test_sizes_that_robots_have_are_not_asked_about(rv_m2):
    known, said = fit(waving(rv_m2, 0, (1,), CATALOGUE, 1.0), [TransmissionError()]), []
    assert known.effects
    assert in_full(known, said.append) is known
    assert said == []


def test_what_predicts_rows_held_out_worse_is_not_taken(rv_m2, monkeypatch):
    waves = fit(waving(rv_m2, 0, (4,), CATALOGUE, 0.6), [TransmissionError()])
    monkeypatch.setattr(room, "goes_astray", lambda known: 1.0 if known is waves else 1.1)
    assert in_full(waves, lambda _: None) is waves
