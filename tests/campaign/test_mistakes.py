"""An everyday mistake is told by name, in one sentence, and a sound campaign of none."""

from dataclasses import replace

import numpy as np
import pytest
from conftest import load_arm
from simulate import simulate

from thermal_robot import demo_campaign
from thermal_robot.campaign.plausible import doubts
from thermal_robot.kinematics import tool_poses


@pytest.fixture(scope="module")
def demo():
    return demo_campaign()


@pytest.fixture(scope="module")
def sliding():
    return simulate(load_arm("awkward"), seed=2, samples=40)[0]


def covariate(campaign, name, values):
    return replace(campaign, covariates={**campaign.covariates, name: values})


def simulated(campaign, scale):
    """What a simulator of the robot says, its lengths scaled, in a frame of its own."""
    poses = tool_poses(campaign.robot, campaign.q)
    place = scale * poses[:, :3, 3] + poses[:, :3, :3] @ campaign.target
    turned = place @ np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]) + [1.0, 2.0, 3.0]
    return replace(campaign, simulated_position=turned)


def rounded(values, step):
    return np.round(values / step) * step


MISTAKES = {
    "Fahrenheit": (
        lambda c: covariate(c, "temperature", 32.0 + 1.8 * c.covariates["temperature"]), ["temperature", "Fahrenheit"]
    ),
    "kelvin": (lambda c: covariate(c, "temperature", 273.15 + c.covariates["temperature"]), ["temperature", "kelvin"]),
    "a reference in kelvin": (lambda c: replace(c, reference_temperature=293.15), ["reference temperature", "kelvin"]),
    "a reference in Fahrenheit": (
        lambda c: replace(c, reference_temperature=68.0), ["reference temperature", "Fahrenheit"]
    ),
    "grams": (lambda c: covariate(c, "payload", np.full(c.samples, 1500.0)), ["payload", "1500 kg", "grams"]),
    "joints on a grid": (lambda c: replace(c, q=rounded(c.q, np.radians(0.1))), ["multiples of 0.1 deg", "rounded"]),
    "rounded positions": (lambda c: replace(c, position=rounded(c.position, 1e-3)), ["rounded to 1 mm", "0.29 mm"]),
    "degrees of noise": (lambda c: replace(c, noise_orientation=1.7), ["1.7 rad", "is it in rad?"]),
    "metres of noise": (lambda c: replace(c, noise_position=2e-8), ["0.02 µm", "length_unit"]),
    "another robot's simulator": (lambda c: simulated(c, 1.3), ["sim.x", "another robot"]),
}  # fmt: skip


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_is_told_in_one_sentence(demo, name):
    spoil, words = MISTAKES[name]
    sound = replace(demo, units=replace(demo.units, angle="deg"))
    told = doubts(spoil(sound))
    assert doubts(sound) == []
    assert len(told) == 1, told
    assert all(word in told[0] for word in words), told
    assert "\n" not in told[0]


def test_slides_in_another_unit_are_told(sliding):
    slides = np.array(sliding.robot.joint_types) == "prismatic"
    told = [t for t in doubts(replace(sliding, q=np.where(slides, 1e3 * sliding.q, sliding.q))) if "length_unit" in t]
    names = np.array(sliding.robot.joint_names)[slides]
    assert doubts(sliding) == []
    assert any(repr(str(name)) in sentence for name in names for sentence in told)
    assert not any("reaches" in sentence for sentence in told)


def test_the_same_robots_simulator_is_no_mistake_wherever_it_stands(demo):
    assert doubts(simulated(demo, 1.0)) == []
    assert doubts(simulated(demo, 1.002)) == []


def test_commands_that_somebody_typed_are_no_mistake(demo):
    degrees = replace(demo, units=replace(demo.units, angle="deg"))
    typed = np.radians(np.random.default_rng(3).choice([-30.0, 0.0, 15.0, 40.0], demo.q.shape))
    assert not any("multiples" in told for told in doubts(replace(degrees, q=typed)))


def test_figures_that_are_finer_than_the_noise_are_no_mistake(demo):
    assert doubts(replace(demo, position=rounded(demo.position, 1e-5))) == []
    assert doubts(replace(demo, noise_position=None, position=rounded(demo.position, 1e-4))) == []
