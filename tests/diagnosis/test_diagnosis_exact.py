"""The corrected model is exact, not linear: effects ten times their usual size, noise of a nanometre."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import some
from simulate import random_motion, simulate

from thermal_robot import diagnose
from thermal_robot.effects import library
from thermal_robot.effects.apply import displacement
from thermal_robot.kinematics import exp3, rotation_to_quaternion
from thermal_robot.observations import Frames, observe

on_arms = pytest.mark.parametrize("arm", some(("rv_m2", "ur10", "panda"), 3), indirect=True)


def measured(robot, sizes, seed, noise, turning=None):
    """A campaign of a robot with normally distributed parameters of these sizes; 40 rows more, and where they are."""
    rng = np.random.default_rng(seed)
    plain = simulate(robot, seed=seed, noise=noise, samples=160, turning=turning)[0]
    frames = Frames(random_motion(rng, 2.0), random_motion(rng, 0.1))
    nominal = observe(plain, frames)
    chosen = []
    for name, size in sizes.items():
        effect = library()[name]
        parameters = effect.parameters(nominal)
        drawn = size * rng.normal(size=len(parameters))
        chosen.append((effect, np.where([p.positive for p in parameters], np.abs(drawn), drawn)))
    change, instrument = displacement(nominal, chosen)
    real = observe(plain, frames, displacement=change)
    place = real.predicted_position + (0.0 if instrument is None else instrument)
    position = place + noise * rng.normal(size=place.shape)
    orientation = None
    if turning is not None:
        spin = exp3(turning * rng.normal(size=place.shape))
        orientation = rotation_to_quaternion(spin @ frames.base[:3, :3] @ real.rotation)
    campaign = replace(plain, position=position, orientation=orientation)
    fresh = replace(campaign.take(np.arange(120, 160)), position=None, orientation=None)
    return campaign.take(np.arange(120)), fresh, place[120:]


@on_arms
@pytest.mark.parametrize(
    "sizes",
    [
        {"joint_offset": 5e-3},
        pytest.param({"geometric": 5e-3}, marks=pytest.mark.slow),
        pytest.param(
            {"joint_offset": 5e-3, "backlash": 2e-3, "thermal_elongation": 1e-4},
            marks=pytest.mark.xfail(
                run=False,
                reason="strains of 18 times their expected size, at a nanometre of noise: since sizes and signs hold, "
                "the choice wanders for minutes among effects that stand in for terms of second order",
            ),
        ),
    ],
    ids="-".join,
)
def test_large_effects_are_corrected_to_the_nanometre(arm, sizes):
    if (arm.name, *sizes) == ("panda", "geometric"):
        pytest.xfail("it is exact, but effects that stand in for terms of second order join it at a nanometre of noise")
    campaign, fresh, place = measured(arm, sizes, seed=1, noise=1e-9)
    found = diagnose(campaign)
    assert found.gap.rms_before > 1e-4
    assert found.gap.rms_after < 1e-8
    assert found.gap.held_out.rms_before > 1e-4
    assert np.abs(found.model.prediction(fresh)[0] - place).max() < 1e-7
    assert found.outliers == ()
    assert not found.unexplained.flagged


@pytest.mark.slow
def test_large_effects_are_corrected_in_poses_too(rv_m2):
    campaign, fresh, place = measured(rv_m2, {"geometric": 5e-3}, seed=2, noise=1e-9, turning=1e-9)
    found = diagnose(campaign)
    assert found.gap.rms_after < 3e-9
    assert found.gap.orientation_before > 1e-3
    assert found.gap.orientation_after < 3e-9
    assert np.abs(found.model.prediction(fresh)[0] - place).max() < 1e-7


@pytest.mark.slow
@pytest.mark.parametrize(("arm", "size"), [("ur10", 0.1), ("panda", 1e-2)], indirect=["arm"])
def test_an_offset_of_ten_times_its_usual_size_or_of_six_degrees_is_still_an_offset(arm, size):
    right = [diagnose(measured(arm, {"joint_offset": size}, s, 25e-6)[0]).verdict for s in range(3)]
    assert right.count(("joint_offset",)) >= 2


@pytest.mark.slow
def test_exactness_does_not_add_effects_that_are_not_at_work(rv_m2):
    """At 10 nm, a thousandth of a laser tracker's noise.

    At 1 nm the choice is made by rounding, not by the data. The evidence comes from a Gram matrix, as the sum of
    squares of the gap less what an explanation takes of it. Here the gap is 0.7 to 2.1 mm per axis: at 1 nm that sum is
    2e14 to 2e15 squares of the noise, of which double precision knows the last 0.04 to 0.35 nat. Solving for the
    parameters makes that 0.1 to 0.9 nat with effects as large as expected (against a singular value decomposition of
    the columns themselves), and several 1e4 nats with scales fitted to columns that are nearly alike, such as gains
    and eccentricities over part of a turn. At 10 nm all of it is a hundred times less.
    """
    assert named_at(rv_m2, 1e-8) == 4


def named_at(robot, noise):
    """In how many of four campaigns two effects are named and no other."""
    both = {"transmission_error": 5e-3, "instrument_scale": 1e-3}
    return sum(set(diagnose(measured(robot, both, seed, noise)[0]).verdict) == set(both) for seed in range(4))


@pytest.mark.slow
@pytest.mark.xfail(reason="at 1 nm double precision decides, see the test at 10 nm", strict=False)
def test_exactness_adds_nothing_at_a_nanometre_either(rv_m2):
    assert named_at(rv_m2, 1e-9) >= 3
