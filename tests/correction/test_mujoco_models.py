"""MuJoCo's models: translated without loss, a simulator that is compared with the robot, and the robot written back."""

import re
import sys
from dataclasses import replace
from functools import partial

import mujoco
import numpy as np
import pytest
from conftest import load_arm
from coupled import joint, link, urdf
from floor import NOISE, TARGET, real_robot
from lxml import etree
from readers import by_mujoco, displaced, held, pose_of

from thermal_robot import CampaignError, diagnose, observe
from thermal_robot.campaign import Campaign
from thermal_robot.correction import calibrated, calibrated_mjcf, mjcf_of_urdf, with_simulator
from thermal_robot.inference.registration import register
from thermal_robot.kinematics import exp6, quaternion_to_rotation, tool_poses
from thermal_robot.robot import load_robot

ROWS = 8
TRANSLATED = ["rv_m2", "awkward", "awkward-from-base", "coupled", "parallelogram", "ur5", "panda", "xarm7", "pr2"]
SIMULATED = ["rv_m2", "awkward-from-base", "coupled", "ur5", "panda"]


site = partial(by_mujoco, kind="site")


@pytest.mark.parametrize("name", TRANSLATED)
def test_a_translated_urdf_has_the_same_poses_joints_and_links(name, configurations):
    arm = load_arm(name)
    robot, q = displaced(arm, 1), configurations(arm, ROWS)
    text, moved = mjcf_of_urdf(arm.urdf), calibrated_mjcf(robot)
    rows, tool = held(arm, q), f"{arm.tool_frame}_target"
    seen = list(by_mujoco(text, arm.root_frame, arm.tool_frame, rows))
    np.testing.assert_allclose(seen, tool_poses(arm, q), rtol=0, atol=1e-12)
    seen = list(by_mujoco(moved, arm.root_frame, tool, rows))
    np.testing.assert_allclose(seen, tool_poses(arm, q, robot.displacement) @ robot.target, rtol=0, atol=1e-9)
    assert "stiffness" in moved[: moved.index("-->")]
    model = mujoco.MjModel.from_xml_string(text)
    assert {model.body(k).name for k in range(model.nbody)} | {"world"} == {*arm.urdf_links, "world"}
    assert {model.joint(k).name for k in range(model.njnt)} <= set(arm.urdf_joints)
    assert model.neq == len(re.findall("<mimic ", re.sub("<!--.*?-->", "", arm.urdf, flags=re.DOTALL)))


@pytest.mark.parametrize("name", SIMULATED)
def test_a_model_of_ones_own_is_placed_anew_and_predicts_so(name, configurations):
    arm = load_arm(name)
    robot, q = displaced(arm, 2), configurations(arm, ROWS)
    own = mjcf_of_urdf(arm.urdf)
    text, rows = calibrated_mjcf(robot, own), held(arm, q)
    expected = tool_poses(arm, q, robot.displacement)
    seen = by_mujoco(text, arm.root_frame, arm.tool_frame, rows)
    np.testing.assert_allclose(list(seen), expected, rtol=0, atol=1e-9)
    target = site(text, arm.root_frame, f"{arm.tool_frame}_target", rows)
    np.testing.assert_allclose(list(target), expected @ robot.target, rtol=0, atol=1e-9)

    campaign = Campaign("commands", arm, q, np.zeros((ROWS, 3)), np.tile([1.0, 0, 0, 0], (ROWS, 1)), target=TARGET)
    plain = with_simulator(campaign, own).simulated_position
    np.testing.assert_allclose(plain, (tool_poses(arm, q) @ np.append(TARGET, 1.0))[:, :3], atol=1e-12)
    # of a calibrated model its own target is taken, translated or placed anew
    for model in (calibrated_mjcf(robot), text):
        moved, poses = with_simulator(campaign, model), expected @ robot.target
        np.testing.assert_allclose(moved.simulated_position, poses[:, :3, 3], atol=1e-12)
        np.testing.assert_allclose(quaternion_to_rotation(moved.simulated_orientation), poses[:, :3, :3], atol=1e-12)


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
    mujoco.mj_step(model, data, 20000)
    a, b = (data.qpos[model.joint(name).qposadr[0]] for name in "ab")
    assert a == pytest.approx(1.0, abs=0.01)
    assert b == pytest.approx(0.2 - 0.5 * a, abs=1e-3)


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


@pytest.fixture(scope="module")
def arm():
    return load_robot(ARM, "tool")


@pytest.fixture(scope="module")
def own(arm):
    """OWN with its second and third axis where ARM has them while all joints are at zero."""
    text = OWN.replace("SIDE", "0 0 1").replace("OVER", "0 0 0").replace("ALONG", "1 0 0")
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    data.qpos[:] = 0.0
    mujoco.mj_kinematics(model, data)
    body = np.linalg.inv(pose_of(data.body(model.jnt_bodyid[model.joint("two").id]))) @ pose_of(data.body("base"))
    side, over = body[:3, :3] @ arm.chain.rotations[1] @ arm.chain.axes[1], body @ np.array([0.1, 0.0, 0.4, 1.0])
    text = OWN
    for word, values in (("SIDE", side), ("OVER", over[:3]), ("ALONG", body[:3, 0])):
        text = text.replace(word, " ".join(map(repr, values.tolist())))
    return text


def without_places(text):
    """Its XML without targets, the notes, and where bodies are; equal whatever blanks stand between tags."""
    root = etree.fromstring(text, etree.XMLParser(recover=True, remove_blank_text=True))
    for each in root.xpath("//site"):
        each.getparent().remove(each)
    for body in root.iter("body"):
        places = {key: body.attrib.pop(key) for key in ("pos", "quat", "euler", "xyaxes") if key in body.attrib}
        assert body.get("name") != "base" or places == {"pos": "1 2 3", "euler": "0 0 30"}
    return etree.tostring(root)


def test_frames_of_its_own_are_no_matter_and_all_else_stays(arm, own, tmp_path):
    robot = displaced(arm, 5)
    after = calibrated_mjcf(robot, own)
    q = np.random.default_rng(0).uniform(-1, 1, (ROWS, 3)) * [2.0, 1.5, 0.1]
    seen = site(after, "base", "tool_target", held(arm, q))
    expected = tool_poses(arm, q, robot.displacement) @ robot.target
    np.testing.assert_allclose(list(seen), expected, rtol=0, atol=1e-9)
    assert "<!-- keep -- me -->" in after
    assert without_places(after) == without_places(own)
    # a file is read with what it includes, which is not written
    part = re.search(r"  <actuator>.*?</actuator>\n", own, re.DOTALL)[0]
    (tmp_path / "motors.xml").write_text(f"<mujoco>{part}</mujoco>")
    (tmp_path / "own.xml").write_text(own.replace(part, '  <include file="motors.xml"/>\n'))
    assert calibrated_mjcf(robot, tmp_path / "own.xml").replace('  <include file="motors.xml"/>\n', part) == after


def test_a_target_stands_on_the_models_own_tool_frame(arm):
    """Where the model has other lengths than the URDF, its own tool frame carries the target: as a body, or a site."""
    robot = displaced(arm, 5, size=1e-4)
    longer = mjcf_of_urdf(ARM.replace("0.5 0 0", "0.505 0 0"))
    as_site = re.sub(r'<body name="tool"([^>]*)/>', r'<site name="tool"\1/>', longer)
    rows, nominal = [{"one": 0.0, "two": 0.0, "slide": 0.0}], tool_poses(arm, np.zeros((1, 3)))[0]
    for text, see in ((longer, by_mujoco), (as_site, site)):
        (before,) = see(text, "base", "tool", rows)
        written = calibrated_mjcf(robot, text)
        (after,), (tool,) = site(written, "base", "tool_target", rows), see(written, "base", "tool", rows)
        np.testing.assert_allclose(tool @ robot.target, after, atol=1e-12)
        moved = tool_poses(arm, np.zeros((1, 3)), robot.displacement)[0] @ robot.target
        np.testing.assert_allclose(after, before @ np.linalg.inv(nominal) @ moved, atol=2e-6)


def test_a_second_calibration_moves_the_target_and_adds_none(arm, own):
    robot = displaced(arm, 5, size=1e-4)
    once = calibrated_mjcf(robot, own)
    assert calibrated_mjcf(replace(robot, target=exp6([0.3, 0, 0, 0, 0, 0])), once).count("<site") == 1
    elsewhere = re.sub(r'<site name="tool_target"[^>]*>', "", once)
    elsewhere = elsewhere.replace('<geom size="0.05"/>', '<geom size="0.05"/><site name="tool_target"/>', 1)
    with pytest.raises(CampaignError, match="site 'tool_target'"):
        calibrated_mjcf(robot, elsewhere)


WRONG = {
    "no joint 'two'": [('name="two"', 'name="second"'), ('joint="two"', 'joint="second"')],
    "axis of 'two'": [('pos="0 0 0.2"', 'pos="0 0.3 0.2"')],
    "axis of 'one'": [('axis="0 0 1" pos="0 0 0.3"', 'axis="0 0 -1" pos="0 0 0.3"')],
    "shares one": [('<joint name="one"', '<joint name="spare" axis="1 0 0"/><joint name="one"')],
    "<frame>": [('<body name="a"', '<frame><body name="a"'), ("</body>\n  </world", "</frame></body>\n  </world")],
    "MuJoCo does not take it": [("</worldbody>", "")],
}


@pytest.mark.parametrize("word", WRONG)
def test_another_robot_is_refused(word, arm, own):
    for old, new in WRONG[word]:
        own = own.replace(old, new)
    with pytest.raises(CampaignError, match=re.escape(word)):
        calibrated_mjcf(displaced(arm, 5), own)


def test_what_cannot_be_used_is_told(rv_m2, arm, own, tmp_path, monkeypatch):
    (tmp_path / "own.xml").write_bytes(own.replace("keep", "ké").encode("latin-1"))
    with pytest.raises(CampaignError, match=r"own\.xml.*UTF-8"):
        calibrated_mjcf(displaced(arm, 5), tmp_path / "own.xml")
    with pytest.raises(CampaignError, match="the MJCF: is no XML"):  # MuJoCo reads the first root alone
        calibrated_mjcf(displaced(arm, 5), own + "<mujoco/>")
    campaign, text = Campaign("commands", rv_m2, np.zeros((2, 5))), mjcf_of_urdf(rv_m2.urdf)
    (tmp_path / "m.xml").write_text("<mujoco")
    jointed = "<mujoco><worldbody><body><joint/></body></worldbody></mujoco>"
    for model, told in (
        (text.replace('"joint_3"', '"elbow"'), "no joint 'joint_3'"),
        (text.replace('"tool0"', '"flange"'), "no tool frame 'tool0'"),
        (jointed, "the MJCF: MuJoCo does not take it"),
        (tmp_path / "m.xml", r"m\.xml.*MuJoCo does not take it"),
        (tmp_path / "no.xml", r"no\.xml"),
    ):
        with pytest.raises(CampaignError, match=told):
            with_simulator(campaign, model)
    with pytest.raises(CampaignError, match="MuJoCo does not take it"):
        mjcf_of_urdf('<robot name="r"><link/></robot>')
    monkeypatch.setitem(sys.modules, "mujoco", None)
    for call in (lambda: with_simulator(campaign, text), lambda: mjcf_of_urdf(rv_m2.urdf)):
        with pytest.raises(CampaignError, match=r"pip install \"thermal-robot\[blind\]\""):
            call()


def gap(campaign):
    """Rms distance of the robot from what is predicted of it, the base fitted, m."""
    left = observe(campaign, register(campaign)).gap[:, :3]
    return np.sqrt((left**2).sum(axis=1).mean())


ZEROS = ("joint_offset", "geometric", "joint_gain")


def test_zeros_that_are_found_against_the_simulator_mend_it(tmp_path):
    """The simulator has the robot's true lengths, the URDF has not: only the zeros are at fault."""
    arm = load_arm("ur5")
    zeros = np.array([0.0, 1.2e-3, -0.8e-3, 1.5e-3, 0.9e-3, 0.0])
    campaign = real_robot(arm, 4, zeros=zeros)
    file = tmp_path / "simulator.xml"
    file.write_text(mjcf_of_urdf(arm.urdf))
    forearm = re.search(r'<joint name="wrist_1_joint".*?xyz="[^" ]+ [^" ]+ ([\d.]+)"', arm.urdf, re.DOTALL)
    wrong = arm.urdf[: forearm.start(1)] + f"{float(forearm[1]) + 2e-3}" + arm.urdf[forearm.end(1) :]
    campaign = replace(campaign, robot=load_robot(wrong, arm.tool_frame, root_frame=arm.root_frame))
    against = with_simulator(campaign, file)
    found = diagnose(against, only=ZEROS)
    assert found.verdict == ("joint_offset",)
    known = {p.name.split(", ")[1]: p for p in found.finding("joint_offset").parameters if p.identified}
    true = dict(zip(arm.joint_names, zeros, strict=True))
    assert all(abs(parameter.value - true[name]) < 4 * parameter.std for name, parameter in known.items())
    mended = with_simulator(campaign, calibrated_mjcf(calibrated(found.model), file))
    assert gap(against) > 10 * NOISE
    assert gap(mended) < 1.05 * np.sqrt(3.0) * NOISE
    assert diagnose(mended, only=ZEROS).verdict == ()


@pytest.mark.slow
def test_geometry_that_is_found_mends_the_simulator_where_nothing_was_measured():
    arm = load_arm("rv_m2")
    campaign = real_robot(arm, 5, misplaced=4e-4, samples=240)
    train, rest = campaign.take(np.arange(0, 240, 2)), campaign.take(np.arange(1, 240, 2))
    text = mjcf_of_urdf(arm.urdf)
    found = diagnose(with_simulator(train, text))
    assert found.verdict == ("geometric",)
    assert gap(with_simulator(rest, text)) > 10 * NOISE
    for sigma in (None, 2.0):
        robot = calibrated(found.model, min_sigma=sigma)
        assert gap(with_simulator(rest, calibrated_mjcf(robot, text))) < 1.3 * np.sqrt(3.0) * NOISE, sigma


@pytest.mark.slow
def test_a_simulator_is_mended_again_and_again():
    """What the first calibration missed, or came later, is added to it: tool and zeros."""
    arm, text = load_arm("rv_m2"), mjcf_of_urdf(load_arm("rv_m2").urdf)
    worn = real_robot(arm, 6, zeros=np.array([0.0, 1e-3, -1e-3, 2e-3, 0.0]))
    # the target sits elsewhere than declared, too
    first = replace(worn, target=TARGET + 2e-3)
    for _ in range(2):
        found = diagnose(with_simulator(first, text))
        text = calibrated_mjcf(calibrated(found.model), text)
        assert gap(with_simulator(first, text)) < 1.1 * np.sqrt(3.0) * NOISE
    crashed = replace(real_robot(arm, 6, zeros=np.array([0.0, 1e-3, 2e-3, 2e-3, 0.0])), target=first.target)
    assert gap(with_simulator(crashed, text)) > 10 * NOISE
    found = diagnose(with_simulator(crashed, text))
    known = {p.name: p.value for p in found.finding("joint_offset").parameters}
    assert known["zero offset, joint_3"] == pytest.approx(3e-3, abs=2e-4)
    mended = calibrated_mjcf(calibrated(found.model), text)
    assert gap(with_simulator(crashed, mended)) < 1.1 * np.sqrt(3.0) * NOISE
