"""MuJoCo's models: translated without loss, asked where bodies are, refused in one line."""

import sys

import mujoco
import numpy as np
import pytest
from conftest import load_arm
from coupled import joint, link, urdf
from readers import by_mujoco, held, pose_of

from thermal_robot import CampaignError
from thermal_robot.correction.mujoco_models import Bodies, compiled, digits, known, mjcf_of_urdf
from thermal_robot.kinematics import tool_poses

TWO = """<mujoco><worldbody><body name="a" pos="0 0 1"><geom size="0.1"/><joint name="j" axis="0 0 1" pos="0.1 0 0"/>
<site name="s" pos="0 0 0.5"/></body></worldbody></mujoco>"""


@pytest.mark.parametrize("name", ["coupled", "awkward", "ur10", "panda"])
def test_a_translated_urdf_has_the_same_poses_joints_and_links(name, configurations):
    arm = load_arm(name)
    text = mjcf_of_urdf(arm.urdf)
    q = configurations(arm, 10)
    seen = by_mujoco(text, arm.root_frame, arm.tool_frame, held(arm, q))
    np.testing.assert_allclose(list(seen), tool_poses(arm, q), rtol=0, atol=1e-12)
    model = mujoco.MjModel.from_xml_string(text)
    bodies = {model.body(k).name for k in range(1, model.nbody)}
    assert bodies | {"world"} == {*arm.urdf_links, "world"}
    assert {model.joint(k).name for k in range(model.njnt)} <= set(arm.urdf_joints)
    assert model.neq == arm.urdf.count("<mimic ")


def test_a_mimicking_joint_follows_in_a_simulation():
    """Let go, both fall to where the one is held: a spring pulls the driver, nothing the follower but the equality."""
    limits, follows = (-3, 3), 'joint="a" multiplier="-0.5" offset="0.2"'
    text = urdf(
        *(link(name, 1.0, "0 0 0.1") for name in ("base", "one", "two")),
        joint("a", "revolute", "base", "one", limits=limits),
        joint("b", "revolute", "one", "two", "0 0 0.3", limits=limits, mimic=follows),
    )
    model = mujoco.MjModel.from_xml_string(mjcf_of_urdf(text))
    data = mujoco.MjData(model)
    model.opt.gravity[:] = 0.0
    model.jnt_stiffness[model.joint("a").id], model.qpos_spring[0] = 50.0, 1.0
    model.dof_damping[:] = 5.0
    for _ in range(20000):
        mujoco.mj_step(model, data)
    a, b = (data.qpos[model.joint(name).qposadr[0]] for name in "ab")
    assert a == pytest.approx(1.0, abs=0.01)
    assert b == pytest.approx(0.2 - 0.5 * a, abs=1e-3)


def test_bodies_and_axes_are_where_mujoco_has_them():
    model = compiled(TWO)
    bodies = Bodies.of(model)
    np.testing.assert_array_equal(bodies.pose(1)[:3, :3], np.eye(3))
    bodies.move({"j": np.pi / 2})
    data = mujoco.MjData(model)
    data.qpos[0] = np.pi / 2
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(bodies.pose(1), pose_of(data.body("a")), atol=1e-15)
    np.testing.assert_allclose(bodies.site(0), pose_of(data.site("s")), atol=1e-15)
    point, direction = bodies.line(0)
    np.testing.assert_allclose(point, [0.1, 0, 1], atol=1e-15)
    np.testing.assert_allclose(direction, [0, 0, 1], atol=1e-15)
    assert known(model, "body", "a") == 1
    assert known(model, "joint", "nobody") is None


def test_numbers_keep_their_digits():
    value = 1 / 3
    assert float(digits([value, 2])[: digits([value, 2]).index(" ")]) == value


@pytest.mark.parametrize("text", ["<mujoco><worldbody><body><joint/></body></worldbody></mujoco>", "<mujoco"])
def test_what_mujoco_does_not_take_is_told_in_its_words(text, tmp_path):
    with pytest.raises(CampaignError, match="MuJoCo does not take it"):
        compiled(text)
    (tmp_path / "m.xml").write_text(text)
    with pytest.raises(CampaignError, match=r"m\.xml"):
        compiled(tmp_path / "m.xml")
    with pytest.raises(CampaignError, match=r"no\.xml"):
        compiled(tmp_path / "no.xml")


def test_a_urdf_that_it_does_not_take_is_told(rv_m2):
    with pytest.raises(CampaignError, match="MuJoCo does not take it"):
        mjcf_of_urdf(rv_m2.urdf.replace("</robot>", ""))


def test_without_mujoco_one_line_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    for call in (compiled, mjcf_of_urdf):
        with pytest.raises(CampaignError, match=r"pip install \"thermal-robot\[blind\]\""):
            call(TWO)
