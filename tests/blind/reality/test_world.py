"""The robot in MuJoCo: Pinocchio's where nothing is wrong, textbook statics where something yields."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("mujoco", reason='the blind trial needs "thermal-robot[blind]"')

from conftest import AWKWARD

from thermal_robot.blind.plan import PARALLELOGRAMS, ROBOTS
from thermal_robot.blind.reality import World
from thermal_robot.blind.reality.world import (
    anywhere,
    cross_axes,
    free_columns,
    from_vector,
    quaternion,
    rpy_matrix,
    slopes,
)
from thermal_robot.campaign import Campaign
from thermal_robot.effects.compliance import overturning
from thermal_robot.kinematics import exp3, gravity_torques, tool_poses
from thermal_robot.observations import observe
from thermal_robot.robot import load_robot

NAMED = {name: (urdf, tool) for name, urdf, tool in ROBOTS}


def drawn(world, samples, seed):
    rng = np.random.default_rng(seed)
    lower, upper = np.maximum(world.lower, -2.8), np.minimum(world.upper, 2.8)
    return rng.uniform(lower, upper, (samples, world.n))


@pytest.mark.parametrize("name", [*NAMED, "awkward"])
def test_a_sound_robot_stands_where_pinocchio_has_it(name):
    urdf, tool = NAMED.get(name, (AWKWARD, "tip"))
    robot = load_robot(urdf, tool)
    world = World(robot.urdf, tool)
    q = drawn(world, 60, 1)
    assert world.names == robot.joint_names
    assert world.slides.tolist() == [j.kind == "prismatic" for j in world.joints]
    np.testing.assert_array_equal([world.lower, world.upper], [robot.lower, robot.upper])
    poses, torque = world.poses(q, np.zeros(60), world.sound(60))
    np.testing.assert_allclose(poses, tool_poses(robot, q), atol=1e-9)
    np.testing.assert_allclose(torque, gravity_torques(robot, q), atol=1e-8)


def test_the_overturning_moment_is_weight_times_lever(beam):
    """An arm of 4 kg, level, with its weight 0.4 m from the wall and a payload 0.8 m from it; upright, with none."""
    moments = beam.overturning(np.array([[0.0], [0.0], [np.pi / 2]]), np.array([0.0, 2.0, 2.0]))
    np.testing.assert_allclose(moments[:, 1], 9.81 * np.array([1.6, 3.2, 0.0]), atol=1e-12)
    np.testing.assert_allclose(moments[:, [0, 2]], 0.0, atol=1e-12)


@pytest.mark.parametrize("name", [*NAMED, "awkward"])
def test_the_overturning_moment_varies_as_the_program_has_it(name):
    """But for a link that nothing moves."""
    urdf, tool = NAMED.get(name, (AWKWARD, "tip"))
    robot = load_robot(urdf, tool)
    world = World(robot.urdf, tool, payload_com=(0.02, -0.01, 0.05))
    q, payload = drawn(world, 40, 5), np.linspace(0.0, 3.0, 40)
    place = np.array([0.02, -0.01, 0.05])
    campaign = Campaign("commands", robot, q, covariates={"payload": payload}, payload_com=place, target=place)
    moments, program = world.overturning(q, payload), overturning(observe(campaign))
    np.testing.assert_allclose(moments - moments[0], program - program[0], atol=1e-8)


def test_stretching_a_sound_robot_leaves_no_trace_in_the_next_run(ur10):
    q = drawn(ur10, 10, 4)
    before = ur10.poses(q, np.zeros(10), ur10.sound(10))[0]
    body = ur10.sound(10)
    body.growth[:] = 1e-3
    body.placements = np.full((10, len(ur10.chain), 6), 1e-3)
    ur10.poses(q, np.full(10, 3.0), body)
    np.testing.assert_array_equal(ur10.poses(q, np.zeros(10), ur10.sound(10))[0], before)


def test_a_spring_yields_by_its_torque(ur10):
    """A joint on a spring stands where spring and gravity balance: q = q_command − c τ(q)."""
    q, load = drawn(ur10, 20, 5), np.full(20, 4.0)
    body = ur10.sound(20)
    body.springs[1] = 2e-5
    soft, torque = ur10.poses(q, load, body)
    yielded = q.copy()
    yielded[:, 1] -= 2e-5 * torque[:, 1]
    stiff, same = ur10.poses(yielded, load, ur10.sound(20))
    np.testing.assert_allclose(soft, stiff, atol=1e-12)
    np.testing.assert_allclose(torque, same, atol=1e-9)
    assert np.abs(torque[:, 1]).max() > 50.0


def test_a_cantilever_bends_as_the_textbook_says(beam_urdf):
    """F L³/3EI, but for what lumping into three hinges leaves out: the midpoint rule, 1/4 of (1/3)²."""
    length, weight, stiffness = 0.8, 5.0, 4e3
    urdf = beam_urdf.replace('<axis xyz="0 -1 0"/>', '<axis xyz="0 0 1"/>').replace('mass value="4"', 'mass value="0"')
    world = World(urdf, "end", payload_com=(0.0, 0.0, 0.0))
    body = world.sound(1)
    body.beams[:] = 1.0 / stiffness
    pose, _ = world.poses(np.zeros((1, 1)), np.array([weight]), body)
    lumped = 1.0 - 1.0 / (4 * 3**2)  # Σ (L/3) x_k² over three midpoints against ∫ x² dx
    expected = weight * 9.81 * length**3 / (3 * stiffness) * lumped
    assert -pose[0, 2, 3] == pytest.approx(expected, rel=1e-4)


def test_what_holds_an_arm_is_weight_times_arm(beam):
    angle, payload = np.array([0.0, 0.5, -1.2]), np.array([0.0, 3.0, 1.0])
    torque = beam.poses(angle[:, None], payload, beam.sound(3))[1][:, 0]
    np.testing.assert_allclose(torque, 9.81 * np.cos(angle) * (4.0 * 0.4 + payload * 0.8), rtol=1e-12)


def test_a_bowed_link_turns_its_end_by_curvature_times_length(beam):
    body = beam.sound(1)
    body.bow[0, 0] = 1e-3, 2e-3
    turned = beam.poses(np.zeros((1, 1)), np.zeros(1), body)[0][0, :3, :3]
    angle = np.arccos((np.trace(turned) - 1.0) / 2.0)
    assert angle == pytest.approx(0.8 * np.hypot(1e-3, 2e-3), rel=1e-4)


def test_motions_of_base_and_target_are_made_one_after_the_other(ur10):
    body = ur10.sound(2)
    quarter = np.array([[0.0, 0.0, 0.0, 0.0, 0.0, np.pi / 2]] * 2)
    body.move("base", quarter)
    body.move("base", np.array([[1.0, 0.0, 0.0, 0.0, 0.0, 0.0]] * 2))  # along the base as it stands then
    np.testing.assert_allclose(body.base[:, :3, 3], [[0.0, 1.0, 0.0]] * 2, atol=1e-15)
    np.testing.assert_array_equal(body.tool, np.tile(np.eye(4), (2, 1, 1)))
    body.move("tool", quarter)
    np.testing.assert_allclose(body.tool[0, :3, 0], [0.0, 1.0, 0.0], atol=1e-15)


@pytest.fixture(scope="module")
def parallelograms():
    return World(Path(PARALLELOGRAMS[1]).read_text(), PARALLELOGRAMS[2])


def test_a_passive_joint_follows_its_driver_and_has_no_command(parallelograms):
    world = parallelograms
    assert world.names == ("swing", "upper", "fore", "turn")
    assert [j.name for j in world.moving] == ["swing", "upper", "upper_bar", "fore", "fore_bar", "turn"]
    q = drawn(world, 20, 3)
    poses, _ = world.poses(q, np.zeros(20), world.sound(20))
    # two parallelograms keep the flange level, whatever upper arm and forearm do
    np.testing.assert_allclose(poses[:, 2, 2], -1.0, atol=1e-12)
    np.testing.assert_allclose(poses[:, 2, :2], 0.0, atol=1e-12)
    # the far end of a bar moves as if upper arm and forearm turned about the ground
    reach = 0.28 + 1.0 * np.sin(q[:, 1]) + 1.05 * np.cos(q[:, 2]) + 0.18
    np.testing.assert_allclose(np.hypot(poses[:, 0, 3], poses[:, 1, 3]), np.abs(reach), atol=1e-9)


def test_an_error_of_a_driver_moves_its_follower_and_so_does_its_spring(parallelograms):
    world = parallelograms
    q, load = drawn(world, 15, 4), np.full(15, 5.0)
    wrong = world.sound(15)
    wrong.joints[:, 1] = 1e-3
    shifted = q + np.array([0.0, 1e-3, 0.0, 0.0])
    sound = world.sound(15)
    np.testing.assert_allclose(world.poses(q, load, wrong)[0], world.poses(shifted, load, sound)[0], atol=1e-12)
    soft = world.sound(15)
    soft.springs[1] = 1e-6
    yielded, torque = world.poses(q, load, soft)
    settled = q - np.outer(1e-6 * torque[:, 1], [0.0, 1.0, 0.0, 0.0])
    np.testing.assert_allclose(yielded, world.poses(settled, load, sound)[0], atol=1e-9)


def test_what_holds_a_driver_is_what_its_motion_lifts(parallelograms):
    """Virtual work: the torque of each command is the slope of the weight's energy by it."""
    import mujoco

    world = parallelograms
    q, load, step = drawn(world, 6, 5), np.full(6, 4.0), 1e-6
    _, torque = world.poses(q, load, world.sound(6))
    model = world.compile(False, None)
    model.body_mass[model.body("payload").id] = 4.0
    data = mujoco.MjData(model)

    def energy(command):
        data.qpos[world.address(model)] = world.coupling @ command + world.rest
        mujoco.mj_kinematics(model, data)
        return 9.81 * float(model.body_mass @ data.xipos[:, 2])

    for row in range(6):
        slope = [(energy(q[row] + d) - energy(q[row] - d)) / (2 * step) for d in step * np.eye(world.n)]
        np.testing.assert_allclose(torque[row], slope, rtol=1e-5, atol=1e-4)
    model.body_mass[model.body("payload").id] = 0.0


# ---- rigid motions

RNG = np.random.default_rng(8)


def test_turns_and_quaternions_follow_their_conventions():
    twists = RNG.normal(size=(20, 6))
    np.testing.assert_allclose(from_vector(twists)[:, :3], np.dstack([exp3(twists[:, 3:]), twists[:, :3]]), atol=1e-14)
    motion = from_vector(np.array([[1.0, 2.0, 3.0, 0.0, 0.0, np.pi / 2]]))[0]
    np.testing.assert_allclose(motion @ [1.0, 0.0, 0.0, 1.0], [1.0, 3.0, 3.0, 1.0], atol=1e-15)
    # roll, pitch, yaw: about the fixed axes x, then y, then z
    about = [from_vector(np.eye(6)[3 + k][None] * angle)[0, :3, :3] for k, angle in enumerate((0.3, -0.7, 1.1))]
    np.testing.assert_allclose(rpy_matrix(np.array([0.3, -0.7, 1.1])), about[2] @ about[1] @ about[0], atol=1e-15)
    # a quaternion has its scalar first
    turned = quaternion(rpy_matrix(np.array([0.0, 0.0, 0.4])))
    assert turned == pytest.approx([np.cos(0.2), 0.0, 0.0, np.sin(0.2)])
    for direction in ([1.0, 0, 0], [0, -2.0, 0], [0.3, 0.3, 0.3]):
        axes = np.array([np.array(direction) / np.linalg.norm(direction), *cross_axes(np.array(direction))])
        np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-15)
    poses = np.array([anywhere(np.random.default_rng(seed), 2.0) for seed in range(400)])
    assert np.abs(poses[:, :3, 3]).max() <= 2.0
    np.testing.assert_allclose(np.linalg.det(poses[:, :3, :3]), 1.0)
    # the mean of 400 unit vectors in no direction: 1/sqrt(400 · 3) a component
    assert np.abs(poses[:, :3, :3].mean(axis=0)).max() < 4.5 / np.sqrt(1200.0)


def test_columns_of_the_frames_are_what_a_small_motion_does():
    points, turns, step = RNG.normal(size=(15, 3)), from_vector(RNG.normal(size=(15, 6)))[:, :3, :3], 1e-6
    columns = free_columns(points, turns, True, True)
    assert columns.shape == (45, 9)
    centre = points.mean(axis=0)
    for k, twist in enumerate(step * np.eye(6)):
        motion = from_vector(twist[None])[0]
        moved = (points - centre) @ motion[:3, :3].T + motion[:3, 3] + centre
        np.testing.assert_allclose(columns[:, k], (moved - points).ravel() / step, atol=1e-5)
    for k, offset in enumerate(np.eye(3)):
        np.testing.assert_allclose(columns[:, 6 + k], (turns @ offset).ravel())
    for base, tool, freedoms in ((True, False, 6), (False, True, 3), (False, False, 0)):
        assert free_columns(points, turns, base, tool).shape == (45, freedoms)


# ---- slopes of a sound robot, against small faults of the whole one

SMALL = 1e-6
TARGET = np.array([0.03, -0.02, 0.11])


@pytest.fixture(scope="module")
def linear(setting):
    return slopes(setting.world, setting.q, setting.payload, TARGET)


def exact(setting, body):
    poses, _ = setting.world.poses(setting.q, setting.payload, body)
    poses = body.base @ poses @ body.tool
    return (poses[:, :3, :3] @ TARGET + poses[:, :3, 3]) * (1.0 + body.scale)


def spoilt(body, name, rng):
    """The body with one kind of small error."""
    if name == "move":
        twists = SMALL * rng.normal(size=(2, len(body.joints), 6))
        return replace(body, base=from_vector(twists[0]), tool=from_vector(twists[1]), scale=SMALL)
    values = getattr(body, name)
    size = 1e-9 if name in ("springs", "beams") else SMALL
    return replace(body, **{name: size * rng.uniform(0.5, 1.0, values.shape)})


@pytest.mark.parametrize("name", ["joints", "springs", "beams", "bow", "growth", "placements", "move"])
def test_a_small_error_moves_the_target_by_its_slope(linear, setting, body, name):
    sound = exact(setting, setting.world.sound(setting.samples))
    wrong = spoilt(body, name, np.random.default_rng(5))
    moved = exact(setting, wrong) - sound
    assert np.abs(moved).max() > 1e-8
    np.testing.assert_allclose(linear.place(wrong) - sound, moved, atol=2e-4 * np.abs(moved).max())


def test_placements_that_come_and_go_count_in_their_rows(linear, setting, body):
    late = np.arange(setting.samples) > 40
    one = SMALL * np.ones((len(setting.world.chain), 6))
    always = linear.place(replace(body, placements=one))
    sometimes = linear.place(replace(body, placements=late[:, None, None] * one))
    np.testing.assert_allclose(sometimes[late], always[late], atol=1e-15)
    np.testing.assert_allclose(sometimes[~late], linear.place(body)[~late], atol=1e-15)
    # what is linear about the sound robot has its torque and poses
    np.testing.assert_allclose(linear.torque, setting.torque, atol=1e-9)
    np.testing.assert_allclose(linear.poses, setting.poses, atol=1e-12)
