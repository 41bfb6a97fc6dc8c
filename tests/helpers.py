"""Robots without masses, commands without measurements, tools with an effect at work: what several tests use."""

import re
from dataclasses import replace

import numpy as np
import pytest
from simulate import commands, simulate

from thermal_robot.campaign import Campaign
from thermal_robot.effects.apply import displacement
from thermal_robot.inference.registration import register
from thermal_robot.kinematics import Displacement, tool_poses
from thermal_robot.observations import Frames, observe
from thermal_robot.robot import load_robot

SAMPLES = 10  # rows of a campaign that only a law is checked on
NOISE = 25e-6  # m


def without_masses(robot, gravity=None):
    """The same robot from a URDF that gives no masses."""
    bare = re.sub(r"<inertial>.*?</inertial>", "", robot.urdf, flags=re.DOTALL)
    return load_robot(bare, robot.tool_frame, root_frame=robot.root_frame, gravity=gravity)


def commanded(robot, covariates=None, **declared):
    """Commands with conditions, and nothing measured."""
    q = commands(robot, SAMPLES, np.random.default_rng(5))
    return Campaign("commands", robot, q, covariates=covariates or {}, **declared)


def tool_with(campaign, effect, values, frames=None):
    """Positions that the instrument shows, measurement frame, with an effect at work."""
    frames = frames or Frames.declared(campaign)
    nominal = observe(campaign, frames)
    change, instrument = displacement(nominal, [(effect, np.asarray(values, dtype=float))])
    seen = observe(campaign, frames, displacement=change)
    return seen.predicted_position + (0.0 if instrument is None else instrument)


def tool_at(robot, q):
    """Positions of the tool frame, root frame, m."""
    return tool_poses(robot, q)[:, :3, 3]


def with_law(robot, law, values, seed, samples=120, fresh=100):
    """A campaign of a robot with one law at work, and further rows with where the target really is."""
    plain = simulate(robot, samples=samples + fresh, seed=seed, noise=NOISE)[0]
    rng = np.random.default_rng(seed)
    plain = replace(plain, covariates={**plain.covariates, "speed": rng.uniform(0.1, 1.0, samples + fresh)})
    frames = Frames.declared(plain)
    moved, _ = displacement(observe(plain, frames), [(law, np.asarray(values))])
    true = observe(plain, frames, displacement=moved).predicted_position
    whole = replace(plain, position=true + NOISE * rng.normal(size=true.shape), priors={})
    mine = np.sort(rng.permutation(samples + fresh)[:samples])
    rest = np.setdiff1d(np.arange(samples + fresh), mine)
    data = replace(whole.take(mine), rows=np.arange(2, samples + 2))
    return data, replace(whole.take(rest), position=None), true[rest]


def erring(campaign, seed, noise=NOISE, **twists):
    """The campaign measured anew in its declared frames, with displacements of joints, base or tool at work."""
    displaced = observe(campaign, Frames.declared(campaign), displacement=Displacement(**twists))
    drawn = np.random.default_rng(seed).normal(size=displaced.predicted_position.shape)
    return replace(campaign, position=displaced.predicted_position + noise * drawn)


def disturbed(campaign, effects=(), **twists):
    """The campaign with more at work: what effects, or displacements, add to its positions."""
    here = observe(campaign, register(campaign))
    moved = displacement(here, effects)[0] if effects else Displacement(**twists)
    there = observe(campaign, here.frames, displacement=moved)
    return replace(campaign, position=campaign.position + there.predicted_position - here.predicted_position)


def numbers(value):
    """Every number of a plain structure."""
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list):
        return [n for v in value for n in numbers(v)]
    return [value] if isinstance(value, float) else []


def some(cases, every):
    """Parameters of a test: each so-many-th case in an ordinary run, the others among the slow tests."""
    own = (case if isinstance(case, tuple) else (case,) for case in cases)
    return [pytest.param(*case, marks=pytest.mark.slow if k % every else ()) for k, case in enumerate(own)]
