"""Waves that the remainder of a fit shows: those that are at work, at their orders, and none of noise."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import NOISE, some, tool_with
from simulate import simulate

from thermal_robot.effects import JointRipple, choose
from thermal_robot.effects.law import Discovered
from thermal_robot.inference.algebra import equations_of, orthonormal, without
from thermal_robot.inference.columns import block
from thermal_robot.inference.fit import fit
from thermal_robot.inference.generate import alike, as_ripple, waves

SAMPLES = 200


def rippling(robot, found, amplitudes, seed):
    """A campaign of a robot whose joints err by waves of these amplitudes, rad; a sine each."""
    plain = simulate(robot, samples=SAMPLES, seed=seed, noise=NOISE)[0]
    values = np.column_stack([amplitudes, np.zeros(len(amplitudes))]).ravel()
    noise = NOISE * np.random.default_rng(seed).normal(size=(SAMPLES, 3))
    return replace(plain, position=tool_with(plain, found, values) + noise)


@pytest.mark.parametrize("seed", some(range(3), 3))
def test_waves_are_found_in_their_joints_at_their_orders(rv_m2, seed):
    true = JointRipple().having("joint_2", 26.6, 1.0).having("joint_1", 11.9, 1.0)
    found = waves(fit(rippling(rv_m2, true, (2e-4, 3e-4), seed), choose(only=("joint_offset", "joint_ripple"))))
    assert sorted(found.joints) == ["joint_1", "joint_2"]
    for joint, order in zip(found.joints, found.orders, strict=True):
        # the peak of a wave over some four radians is 1.6 wide
        assert order == pytest.approx({"joint_2": 26.6, "joint_1": 11.9}[joint], abs=0.1)
    assert found.share < 1e-4  # either was one of hundreds


@pytest.mark.parametrize("seed", some(range(6), 3))
def test_noise_has_no_waves(rv_m2, seed):
    plain = rippling(rv_m2, JointRipple(), (), seed)
    assert waves(fit(plain, choose(only=("joint_offset", "joint_ripple")))) == JointRipple()


def test_a_wave_that_comes_round_twice_is_no_ripple(rv_m2):
    oval = JointRipple().having("joint_2", 2.0, 1.0)
    found = waves(fit(rippling(rv_m2, oval, (4e-4,), 1), choose(only=("transmission_error", "joint_ripple"))))
    assert found == JointRipple()


def test_ripples_are_alike_whatever_the_order_in_which_waves_were_found():
    one = JointRipple().having("joint_1", 12.0, 10.0).having("joint_2", 26.6, 20.0)
    other = JointRipple().having("joint_2", 26.61, 20.0).having("joint_1", 12.0, 10.0)
    assert alike(one, other)
    assert not alike(one, other.having("joint_3", 5.0, 10.0))
    assert not alike(one, JointRipple().having("joint_1", 12.0, 10.0).having("joint_2", 27.0, 20.0))
    assert alike(JointRipple(), JointRipple())


def test_a_law_that_is_a_wave_of_its_own_joint_is_ripple(rv_m2):
    found = fit(rippling(rv_m2, JointRipple(), (), 2), choose(only=("joint_offset", "joint_ripple")))
    wave = Discovered(place="joint_2", quantity="joint_2", shape="harmonic", marks=(26.6,), tried=300.0)
    ripple = as_ripple(wave, found)
    law, own = (equations_of(block(found.nominal, effect).columns) for effect in (wave, ripple))
    assert np.abs(without(own, orthonormal(law))).max() < 1e-9 * np.abs(own).max()  # it does what the law does
    assert ripple.share == pytest.approx(wave.share)


@pytest.mark.parametrize("order", [26.6, 26.63])
def test_a_wave_that_ripple_holds_is_not_added_twice(rv_m2, order):
    found = fit(rippling(rv_m2, JointRipple(), (), 2), choose(only=("joint_offset", "joint_ripple")))
    held = JointRipple().having("joint_1", 26.6, 1.0).having("joint_2", 26.6, 1.0)
    rippled = replace(found, effects=((held, np.zeros(4)),))
    wave = Discovered(place="joint_2", quantity="joint_2", shape="harmonic", marks=(order,))
    assert as_ripple(wave, rippled) == held
    assert as_ripple(replace(wave, marks=(28.0,)), rippled).orders == (26.6, 26.6, 28.0)


@pytest.mark.parametrize(
    "other", [{"quantity": "joint_1"}, {"kind": "link"}, {"shape": "smooth", "marks": ()}, {"marks": (1.5,)}]
)
def test_other_laws_are_no_ripple(rv_m2, other):
    candidates = choose(only=("joint_offset", "joint_ripple"))
    found = fit(rippling(rv_m2, JointRipple(), (), 2), candidates)
    wave = Discovered(place="joint_2", quantity="joint_2", shape="harmonic", marks=(26.6,))
    assert as_ripple(replace(wave, **other), found) is None
    assert as_ripple(wave, fit(found.campaign, choose(only="joint_offset"))) is None
