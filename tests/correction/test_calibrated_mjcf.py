"""The calibrated MJCF: MuJoCo sees the corrected model in it, translated or in a model of the user's own."""

import re
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from conftest import load_arm
from readers import by_mujoco, displaced, held, pose_of

from thermal_robot import CampaignError
from thermal_robot.correction import calibrated_mjcf
from thermal_robot.correction.mujoco_models import mjcf_of_urdf
from thermal_robot.kinematics import exp6, tool_poses
from thermal_robot.robot import load_robot

ROWS = 8
TRANSLATED = ["rv_m2", "awkward", "awkward-from-base", "coupled", "parallelogram", "ur5", "panda", "xarm7", "pr2"]


@pytest.mark.parametrize("name", TRANSLATED)
def test_mujoco_sees_the_displaced_robot(name, configurations):
    arm = load_arm(name)
    robot, q = displaced(arm, 1), configurations(arm, ROWS)
    text = calibrated_mjcf(robot)
    expected = tool_poses(arm, q, robot.displacement) @ robot.target
    seen = by_mujoco(text, arm.root_frame, f"{arm.tool_frame}_target", held(arm, q))
    np.testing.assert_allclose(list(seen), expected, rtol=0, atol=1e-9)
    assert "stiffness" in text[: text.index("-->")]


def site(text, name, rows, root=None):
    """(N, 4, 4) of a site in the world or in a body."""
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    for row in rows:
        for joint, position in row.items():
            data.qpos[model.joint(joint).qposadr[0]] = position
        mujoco.mj_kinematics(model, data)
        whence = np.eye(4) if root is None else pose_of(data.body(root))
        yield np.linalg.inv(whence) @ pose_of(data.site(name))


@pytest.mark.parametrize("name", ["rv_m2", "awkward-from-base", "coupled", "ur5", "panda"])
def test_a_model_of_ones_own_is_placed_anew(name, configurations):
    arm = load_arm(name)
    robot, q = displaced(arm, 2), configurations(arm, ROWS)
    text = calibrated_mjcf(robot, mjcf_of_urdf(arm.urdf))
    expected = tool_poses(arm, q, robot.displacement)
    seen = by_mujoco(text, arm.root_frame, arm.tool_frame, held(arm, q))
    np.testing.assert_allclose(list(seen), expected, rtol=0, atol=1e-9)
    target = site(text, f"{arm.tool_frame}_target", held(arm, q), arm.root_frame)
    np.testing.assert_allclose(list(target), expected @ robot.target, rtol=0, atol=1e-9)


# A URDF, and somebody's MJCF of the same robot: other frames in the bodies, in degrees and Euler angles, joints away
# from their bodies' origins, a ref, a body between, links fused, an actuator, comments that must stay.
ARM = """<robot name="r"><link name="base"/><link name="upper"/><link name="fore"/>
<link name="flange"/><link name="tool"/>
<joint name="one" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.4"/><axis xyz="0 0 1"/>
  <limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
<joint name="two" type="revolute"><parent link="upper"/><child link="fore"/><axis xyz="0 0 1"/>
  <origin xyz="0.1 0 0" rpy="1.57079632679489656 0 0"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
<joint name="slide" type="prismatic"><parent link="fore"/><child link="flange"/><axis xyz="1 0 0"/>
  <origin xyz="0.5 0 0"/><limit lower="-0.1" upper="0.2" effort="1" velocity="1"/></joint>
<joint name="end" type="fixed"><parent link="flange"/><child link="tool"/><origin xyz="0.1 0 0"/></joint></robot>"""
OWN = """<mujoco model="theirs">
  <!-- keep -- me -->
  <compiler angle="degree"/>
  <worldbody>
    <body name="base" pos="1 2 3" euler="0 0 30">
      <body name="a" pos="0 0 0.1" xyaxes="0 1 0 -1 0 0"><!-- a body, not a joint, turned by 90 -->
        <geom type="sphere" size="0.1"/>
        <joint name="one" axis="0 0 1" pos="0 0 0.3" ref="20"/>
        <body name="between" pos="0 0 0.2">
          <geom size="0.05"/>
          <body pos="0 -0.05 0.1" euler="0 0 -70"><geom size="0.1"/>
            <joint name="two" axis="SIDE" pos="OVER"/>
            <body name="b" ><geom size="0.1"/><joint name="slide" type="slide" axis="ALONG"/></body>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator><motor joint="two"/></actuator>
</mujoco>
"""


def own_model():
    """OWN with its second and third axis where ARM has them while all joints are at zero."""
    text = OWN.replace("SIDE", "0 0 1").replace("OVER", "0 0 0").replace("ALONG", "1 0 0")
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    data.qpos[:] = 0.0
    mujoco.mj_kinematics(model, data)
    root = pose_of(data.body("base"))
    body = np.linalg.inv(pose_of(data.body(model.jnt_bodyid[model.joint("two").id]))) @ root
    arm = load_robot(ARM, "tool")
    second = arm.chain.rotations[1] @ arm.chain.axes[1]
    side, over = body[:3, :3] @ second, body @ np.array([0.1, 0.0, 0.4, 1.0])
    text = OWN.replace("SIDE", words(side)).replace("OVER", words(over[:3]))
    return text.replace("ALONG", words(body[:3, :3] @ [1.0, 0.0, 0.0]))


def words(values):
    return " ".join(map(repr, np.asarray(values).tolist()))


def test_frames_of_its_own_are_no_matter():
    arm, text = load_robot(ARM, "tool"), own_model()
    robot = displaced(arm, 5)
    after = calibrated_mjcf(robot, text)
    q = np.random.default_rng(0).uniform(-1, 1, (ROWS, 3)) * [2.0, 1.5, 0.1]
    seen = site(after, "tool_target", held(arm, q), "base")
    expected = tool_poses(arm, q, robot.displacement) @ robot.target
    np.testing.assert_allclose(list(seen), expected, rtol=0, atol=1e-9)
    assert "<!-- keep -- me -->" in after
    kept = re.sub(r"<!--\nCalibrated.*?-->\n|<site [^>]*>|\n *(?=<site)", "", after, count=1, flags=re.DOTALL)
    bodies = re.compile(r"<body\b[^>]*>")
    assert re.sub(r"\n *<site[^>]*>", "", bodies.sub("", kept)) == bodies.sub("", text)
    assert bodies.findall(after)[0] == '<body name="base" pos="1 2 3" euler="0 0 30">'


def test_a_target_stands_on_the_models_own_tool_frame():
    """Where the model has other lengths than the URDF, its own tool frame carries the target: as a body, or a site."""
    arm = load_robot(ARM, "tool")
    robot = displaced(arm, 5, size=1e-4)
    longer = calibrated_mjcf(
        displaced(load_robot(ARM.replace("0.5 0 0", "0.505 0 0"), "tool"), 0, size=0.0, target=False)
    )
    longer = re.sub("<!--.*?-->", "", longer, flags=re.DOTALL)
    as_site = re.sub(r'<body name="tool"([^>]*)/>', r'<site name="tool"\1/>', longer)
    rows = [{"one": 0.0, "two": 0.0, "slide": 0.0}]
    for text, see in ((longer, by_mujoco), (as_site, lambda t, r, link, q: site(t, link, q, r))):
        before = next(iter(see(text, "base", "tool", rows)))
        after = next(site(calibrated_mjcf(robot, text), "tool_target", rows, "base"))
        tool = next(iter(see(calibrated_mjcf(robot, text), "base", "tool", rows)))
        np.testing.assert_allclose(tool @ robot.target, after, atol=1e-12)
        moved = tool_poses(arm, np.zeros((1, 3)), robot.displacement)[0] @ robot.target
        there = before @ np.linalg.inv(tool_poses(arm, np.zeros((1, 3)))[0]) @ moved
        np.testing.assert_allclose(after, there, atol=2e-6)


def test_a_file_is_read_with_what_it_includes(tmp_path):
    text = own_model()
    part = re.search(r"  <actuator>.*?</actuator>\n", text, re.DOTALL)[0]
    (tmp_path / "motors.xml").write_text(f"<mujoco>{part}</mujoco>")
    (tmp_path / "own.xml").write_text(text.replace(part, '  <include file="motors.xml"/>\n'))
    robot = displaced(load_robot(ARM, "tool"), 5)
    after = calibrated_mjcf(robot, tmp_path / "own.xml")
    assert '<include file="motors.xml"/>' in after
    assert after.replace('  <include file="motors.xml"/>\n', part) == calibrated_mjcf(robot, text)


def test_a_second_calibration_moves_the_target_and_adds_none():
    robot = displaced(load_robot(ARM, "tool"), 5, size=1e-4)
    once = calibrated_mjcf(robot, own_model())
    again = calibrated_mjcf(replace(robot, target=exp6([0.3, 0, 0, 0, 0, 0])), once)
    assert again.count("<site") == 1
    inside = once.replace('<geom size="0.05"/>', '<geom size="0.05"/><site name="tool_target"/>', 1)
    inside = re.sub(r'\n *<site name="tool_target" pos[^>]*>', "", inside)
    with pytest.raises(CampaignError, match="site 'tool_target'"):
        calibrated_mjcf(robot, inside)


def framed(text):
    text = text.replace('<body name="a"', '<frame><body name="a"')
    return text.replace("</body>\n  </worldbody>", "</frame></body>\n  </worldbody>")


WRONG = {
    "no joint 'two'": [('name="two"', 'name="second"'), ('joint="two"', 'joint="second"')],
    "axis of 'two'": [('pos="0 0 0.2"', 'pos="0 0.3 0.2"')],
    "axis of 'one'": [('axis="0 0 1" pos="0 0 0.3"', 'axis="0 0 -1" pos="0 0 0.3"')],
    "shares one": [('<joint name="one"', '<joint name="spare" axis="1 0 0"/><joint name="one"')],
    "<frame>": [("", "")],
    "MuJoCo does not take it": [("</worldbody>", "")],
}


def test_a_text_of_another_encoding_is_refused(tmp_path):
    (tmp_path / "own.xml").write_bytes(own_model().replace("keep", "ké").encode("latin-1"))
    with pytest.raises(CampaignError, match=r"own\.xml.*UTF-8"):
        calibrated_mjcf(displaced(load_robot(ARM, "tool"), 5), tmp_path / "own.xml")


@pytest.mark.parametrize("word", WRONG)
def test_another_robot_is_refused(word):
    text = framed(own_model()) if word == "<frame>" else own_model()
    for old, new in WRONG[word]:
        text = text.replace(old, new)
    with pytest.raises(CampaignError, match=re.escape(word)):
        calibrated_mjcf(displaced(load_robot(ARM, "tool"), 5), text)
