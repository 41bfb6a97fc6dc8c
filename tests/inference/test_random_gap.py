"""Scatter of a joint that repeats of a pose have in common: an encoder's steps, whatever the number of repeats."""

from dataclasses import replace

import numpy as np
import pytest
from conftest import load_arm
from helpers import some
from simulate import simulate

from thermal_robot import diagnose
from thermal_robot.diagnosis.findings import random_findings
from thermal_robot.effects import choose
from thermal_robot.inference.fit import fit
from thermal_robot.inference.scatter import JointScatter, Scatter, _means, random_gap
from thermal_robot.kinematics import Displacement, frame_jacobians
from thermal_robot.observations import Frames, observe

NOISE = 20e-6  # m
REPEATED = [(2, 60), (3, 40), (4, 30), (5, 45)]  # visits a pose, poses


def visited(name, seed, repeats, poses, size, joint=1, stepped=True):
    """Poses of an arm, each visited several times in mixed order, one joint erring once a pose; and the step, rad.

    The error is that of rounding the command to whole steps, or else normal with the same standard deviation: at the
    target ``size`` times the noise, root mean square.
    """
    robot, rng = load_arm(name), np.random.default_rng([seed, 99])
    once = simulate(robot, samples=poses, seed=seed, noise=NOISE)[0]
    plain, frames = once.take(np.repeat(np.arange(poses), repeats)), Frames.declared(once)
    lever = observe(once, frames).joint_sensitivity[:, :3, joint]
    sigma = size * np.sqrt(3.0) * NOISE / np.sqrt((lever**2).sum(axis=1).mean())
    step, q = np.sqrt(12.0) * sigma, plain.q[:, joint]
    error = np.zeros_like(plain.q)
    normal = np.repeat(sigma * rng.normal(size=poses), repeats)
    error[:, joint] = np.round(q / step) * step - q if stepped else normal
    true = observe(plain, frames, displacement=Displacement(joint=error)).predicted_position
    data = replace(plain, position=true + NOISE * rng.normal(size=true.shape), priors={})
    count = poses * repeats
    data = data.take(rng.permutation(count))
    time = np.linspace(0.0, 7200.0, count)
    covariates = {**data.covariates, "time": time, "temperature": 22.0 + 3.0 * np.sin(time / 1500.0)}
    return replace(data, covariates=covariates, rows=np.arange(2, count + 2)), step


def gap_of(data):
    """Random gap beside a systematic effect that is not at work, and what is said of it."""
    known = fit(data, choose(("joint_offset",), (), ()))
    seen = random_gap(known)
    return seen, random_findings(known, seen)


SEEDED = [(seed, *own) for own in REPEATED for seed in (0, 1)]


@pytest.mark.parametrize(
    ("seed", "repeats", "poses"),
    [pytest.param(*own, marks=() if k == 3 else pytest.mark.slow) for k, own in enumerate(SEEDED)],
)
def test_steps_of_an_encoder_are_found_where_poses_repeat(seed, repeats, poses):
    data, step = visited(("rv_m2", "ur10")[seed], seed, repeats, poses, (2.0, 4.0)[seed])
    seen, (steps, wear) = gap_of(data)
    assert (steps.status, wear.status) == ("found", "not_found")
    assert [place.name for place in steps.locations] == [data.robot.joint_names[1]]
    # the standard deviation of so few flat errors is known to about 10 %: three of it
    assert steps.parameters[0].value == pytest.approx(step, rel=0.3)
    assert seen.explains_size


def spoilt_in_few(name, seed, count, size, whole):
    """Thirty poses, each visited three times, one joint far off in a few visits, or throughout a few poses."""
    rng = np.random.default_rng([seed, 5])
    once = simulate(load_arm(name), samples=30, seed=seed, noise=NOISE)[0]
    plain, frames = once.take(np.repeat(np.arange(30), 3)), Frames.declared(once)
    lever = observe(plain, frames).joint_sensitivity[:, :3, 1]
    error, struck = np.zeros_like(plain.q), rng.permutation(90)[:count]
    if whole:
        struck = (3 * rng.permutation(30)[:count, None] + np.arange(3)).ravel()
    error[struck, 1] = (size * NOISE / np.sqrt((lever**2).sum(axis=1)))[struck]
    true = observe(plain, frames, displacement=Displacement(joint=error)).predicted_position
    data = replace(plain, position=true + NOISE * rng.normal(size=true.shape), rows=np.arange(2, 92))
    return data.take(rng.permutation(90))


@pytest.mark.slow
def test_scatter_that_a_few_rows_carry_is_none():
    """Neither some bad visits nor one or two bad poses make a joint wear, or its encoder coarse."""
    named, carried = 0, 0
    for whole, count in ((False, 3), (False, 4), (True, 1), (True, 2)):
        for seed in range(2):
            for size in (4.0, 5.0):
                seen, found = gap_of(spoilt_in_few("rv_m2", seed, count, size, whole))
                named += any(f.status == "found" for f in found)
                carried += "carried by a few rows" in seen.note
    assert named <= 1
    assert carried >= 3


@pytest.mark.slow
def test_a_step_that_many_poses_show_is_measured_by_its_period():
    data, step = visited("rv_m2", 3, 2, 150, 3.0)
    _, (steps, _) = gap_of(data)
    assert steps.parameters[0].value == pytest.approx(step, rel=1e-3)


@pytest.mark.slow
def test_errors_of_a_pose_that_follow_no_steps_are_no_encoder():
    for seed, name in enumerate(["rv_m2", "ur10"]):
        seen, (steps, _) = gap_of(visited(name, seed, 3, 160, 3.0, stepped=False)[0])
        assert steps.status == "not_found"
        assert not seen.explains_size
        (factor,) = seen.steps.values()
        assert factor < np.log(1e-3)
        assert seen.stepped < 0.5


def test_the_error_of_a_pose_varies_as_its_variance_says(rv_m2):
    """Over many draws, for poses visited once, thrice and nine times, beside a joint that wears and one with steps."""
    rng = np.random.default_rng(0)
    q = rng.uniform(np.maximum(rv_m2.lower, -2.0), np.minimum(rv_m2.upper, 2.0), (9, rv_m2.n))
    visits = np.repeat([1, 3, 9], 3)
    number = np.repeat(np.arange(9), visits)
    sensitivity = frame_jacobians(rv_m2, q, point=[0, 0, 0.08])[number][:, :3]
    own, steps, wear, own_wear, common = 1e-4, 2e-4, 3e-4, 1e-4, 0.5
    parts = (("pose", 1, own), ("pose", 2, steps), ("visit", 3, wear), ("visit", 1, own_wear))
    components = tuple(JointScatter(kind, j, sigma, 0.0, 1.0) for kind, j, sigma in parts)
    noise = np.full(3, NOISE)
    scatter = Scatter(("visit", "pose"), components, {"visit": 1.0, "pose": 1.0}, noise, common * noise)
    ratios = []
    for _ in range(800):
        true = own * rng.normal(size=9)
        gap = NOISE * rng.normal(size=(len(number), 3)) + (common * NOISE * rng.normal(size=(9, 3)))[number]
        joint = np.zeros((len(number), rv_m2.n))
        joint[:, 1] = true[number] + own_wear * rng.normal(size=len(number))
        joint[:, 2] = steps * rng.normal(size=9)[number]
        joint[:, 3] = wear * rng.normal(size=len(number))
        gap = gap + np.einsum("nij,nj->ni", sensitivity, joint)
        errors, variance = scatter.errors(1, _means(gap, number), _means(sensitivity, number), visits)
        ratios.append((errors - true) ** 2 / variance)
    # a χ² of one degree of freedom varies by 2: its mean over 800 draws by 0.05
    np.testing.assert_allclose(np.mean(ratios, axis=0), 1.0, atol=0.2)


@pytest.mark.slow
def test_steps_are_the_verdict_where_poses_repeat():
    named = []
    for seed in range(16):
        (repeats, poses), block = REPEATED[seed // 4], seed // 4
        size, name = [2.0, 3.0, 5.0, 8.0][(seed + block) % 4], ["rv_m2", "ur10", "panda", "z1"][seed % 4]
        data, _ = visited(name, seed, repeats, poses, size, joint=1 + (seed + block) % 2)
        named.append(diagnose(data).verdict)
    # thirty errors of a pose, each seen four times, may look like systematic effects by chance
    assert named.count(("encoder_resolution",)) >= 13, named


@pytest.mark.parametrize("repeats", some([3, 1], 2))
def test_rows_of_unlike_noise_are_no_scatter(repeats):
    """Whether the noisy rows are visits of a pose beside quiet ones, or whole poses."""
    for seed in range(3):
        data, _ = visited("rv_m2", seed, repeats, 90 // repeats, 1e-9, stepped=False)
        rng = np.random.default_rng([seed, 3])
        sigmas = NOISE * rng.choice([1.0, 8.0], data.samples)
        further = rng.normal(size=data.position.shape) * np.sqrt(sigmas**2 - NOISE**2)[:, None]
        data = replace(data, position=data.position + further, noise_position=None, noise_of_rows=sigmas)
        assert gap_of(data)[0].kept == ()


@pytest.mark.slow
def test_a_joint_that_scatters_is_measured_in_rows_of_unlike_noise():
    """Its standard deviation, as of quiet rows alone."""
    for seed in range(2):
        data, step = visited("rv_m2", seed, 1, 200, 4.0, stepped=False)
        rng = np.random.default_rng([seed, 4])
        sigmas = NOISE * rng.choice([1.0, 20.0], data.samples)
        further = rng.normal(size=data.position.shape) * np.sqrt(sigmas**2 - NOISE**2)[:, None]
        data = replace(data, position=data.position + further, noise_position=None, noise_of_rows=sigmas)
        (kept,) = gap_of(data)[0].kept
        assert kept.component.joint == 1
        assert kept.component.sigma == pytest.approx(step / np.sqrt(12.0), rel=0.25)
