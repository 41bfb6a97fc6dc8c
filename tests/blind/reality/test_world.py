"""The robot in MuJoCo: Pinocchio's where nothing is wrong, textbook statics where something yields."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("mujoco", reason='the blind trial needs "thermal-robot[blind]"')

from conftest import AWKWARD

from thermal_robot.blind.plan import PARALLELOGRAMS, ROBOTS
from thermal_robot.blind.reality import World
from thermal_robot.blind.reality.world import cross_axes
from thermal_robot.campaign import Campaign
from thermal_robot.effects.compliance import overturning
from thermal_robot.kinematics import gravity_torques, tool_poses
from thermal_robot.observations import observe
from thermal_robot.robot import load_robot

NAMED = {name: (urdf, tool) for name, urdf, tool in ROBOTS}
BEAM = """<robot name="beam"><link name="wall"/>
  <link name="arm"><inertial><origin xyz="0.4 0 0"/><mass value="4"/></inertial></link><link name="end"/>
  <joint name="turn" type="revolute"><parent link="wall"/><child link="arm"/><axis xyz="0 -1 0"/>
    <limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
  <joint name="tip" type="fixed"><parent link="arm"/><child link="end"/><origin xyz="0.8 0 0"/></joint></robot>"""


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
    poses, torque = world.poses(q, np.zeros(60), world.sound(60))
    np.testing.assert_allclose(poses, tool_poses(robot, q), atol=1e-9)
    np.testing.assert_allclose(torque, gravity_torques(robot, q), atol=1e-8)


def test_a_joint_that_slides_is_known_as_one():
    world = World(AWKWARD, "tip")
    assert dict(zip(world.names, world.slides, strict=True)) == {
        "lift": True,
        "turret": False,
        "slide": True,
        "roll_joint": False,
        "rail_joint": True,
        "hand_joint": False,
    }


def test_the_overturning_moment_is_weight_times_lever():
    """An arm of 4 kg, level, with its weight 0.4 m from the wall and a payload 0.8 m from it; upright, with none."""
    world = World(BEAM, "end", payload_com=(0.0, 0.0, 0.0))
    moments = world.overturning(np.array([[0.0], [0.0], [np.pi / 2]]), np.array([0.0, 2.0, 2.0]))
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


def test_hinges_of_the_beams_move_nothing_while_they_are_stiff(ur10):
    q = drawn(ur10, 30, 2)
    body = ur10.sound(30)
    body.bow[:] = 1e-300  # enough to build the beams, too little to bend them
    np.testing.assert_allclose(
        ur10.poses(q, np.zeros(30), body)[0], ur10.poses(q, np.zeros(30), ur10.sound(30))[0], atol=1e-12
    )


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


def test_a_cantilever_bends_as_the_textbook_says():
    """F L³/3EI, but for what lumping into three hinges leaves out: the midpoint rule, 1/4 of (1/3)²."""
    length, weight, stiffness = 0.8, 5.0, 4e3
    urdf = BEAM.replace('<axis xyz="0 -1 0"/>', '<axis xyz="0 0 1"/>').replace('mass value="4"', 'mass value="0"')
    world = World(urdf, "end", payload_com=(0.0, 0.0, 0.0))
    body = world.sound(1)
    body.beams[:] = 1.0 / stiffness
    pose, _ = world.poses(np.zeros((1, 1)), np.array([weight]), body)
    lumped = 1.0 - 1.0 / (4 * 3**2)  # Σ (L/3) x_k² over three midpoints against ∫ x² dx
    expected = weight * 9.81 * length**3 / (3 * stiffness) * lumped
    assert -pose[0, 2, 3] == pytest.approx(expected, rel=1e-4)


def test_what_holds_an_arm_is_weight_times_arm():
    world = World(BEAM, "end", payload_com=(0.0, 0.0, 0.0))
    angle, payload = np.array([0.0, 0.5, -1.2]), np.array([0.0, 3.0, 1.0])
    torque = world.poses(angle[:, None], payload, world.sound(3))[1][:, 0]
    np.testing.assert_allclose(torque, 9.81 * np.cos(angle) * (4.0 * 0.4 + payload * 0.8), rtol=1e-12)


def test_a_bowed_link_turns_its_end_by_curvature_times_length():
    world = World(BEAM, "end")
    body = world.sound(1)
    body.bow[0, 0] = 1e-3, 2e-3
    turned = world.poses(np.zeros((1, 1)), np.zeros(1), body)[0][0, :3, :3]
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


@pytest.mark.parametrize("direction", [[1.0, 0, 0], [0, -2.0, 0], [0.3, 0.3, 0.3]])
def test_cross_axes_are_across(direction):
    axes = np.array([np.array(direction) / np.linalg.norm(direction), *cross_axes(np.array(direction))])
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-15)


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
