"""A URDF with other origins: its text stays, its numbers lose nothing, and nothing is added twice."""

import re

import numpy as np
import pytest
from coupled import joint, link, urdf

from thermal_robot.errors import RobotError
from thermal_robot.kinematics import exp3, exp6, tool_poses
from thermal_robot.kinematics.urdf import rewritten
from thermal_robot.robot import load_robot

POSE = exp6([0.1, -0.2, 0.3, 0.5, -0.4, 0.3])
TEXT = urdf(link("a"), link("b"), joint("j", "revolute", "a", "b", "1 2 3", limits=(-1, 1))).replace(
    '<origin xyz="1 2 3" rpy="0 0 0"/>', "{}"
)


def end(text, frame="b"):
    return tool_poses(load_robot(text, frame), np.zeros(1))[0]


ORIGINS = ["", "<origin/>", '<origin rpy="1 2 3"></origin>', "<!--<origin/>--><origin xyz='1 2 3' />"]


@pytest.mark.parametrize("origin", ORIGINS)
def test_an_origin_is_given_whatever_stood_there(origin):
    after = rewritten(TEXT.format(origin), {"j": POSE})
    np.testing.assert_allclose(end(after), POSE, atol=1e-15)
    tag = re.search(r"<origin [^>]*xyz[^>]*>", re.sub("<!--.*?-->", "", after))[0]
    assert after.replace(tag, "") == TEXT.format(origin).replace(re.sub("<!--.*?-->", "", origin).split("</")[0], "")


@pytest.mark.parametrize("away", [0.0, 1e-15, 1e-12, 1e-9, 1e-8, 1e-6, 1e-3])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_pitch_of_a_quarter_turn_loses_nothing(away, side):
    rng = np.random.default_rng(3)
    for yaw, roll in rng.uniform(-3, 3, (20, 2)):
        pose = np.eye(4)
        pose[:3, :3] = exp3([0, 0, yaw]) @ exp3([0, side * (np.pi / 2 - away), 0]) @ exp3([roll, 0, 0])
        np.testing.assert_allclose(end(rewritten(TEXT.format(""), {"j": pose})), pose, atol=2e-15)


def test_a_link_is_added_once_and_then_placed_anew():
    text = TEXT.format("")
    once = rewritten(text, {}, links={"t": ("b", POSE)})
    np.testing.assert_allclose(end(once, "t"), POSE, atol=1e-15)
    twice = rewritten(once, {}, links={"t": ("b", POSE @ POSE)})
    np.testing.assert_allclose(end(twice, "t"), POSE @ POSE, atol=1e-15)
    assert twice.count("<link") == once.count("<link") == 3
    with pytest.raises(RobotError, match="link 'a' already"):
        rewritten(text, {}, links={"a": ("b", POSE)})
    with pytest.raises(RobotError, match="joint 't_joint' already"):
        rewritten(text.replace('"j"', '"t_joint"'), {}, links={"t": ("b", POSE)})
    with pytest.raises(RobotError, match="no joint 'x'"):
        rewritten(text, {"x": POSE})


def test_names_may_hold_what_xml_escapes():
    text = TEXT.format("").replace('"b"', '"a &amp; &lt;b&gt; &quot;c&quot;"')
    name = 'a & <b> "c"'
    after = rewritten(text, {}, links={f"{name}_target": (name, POSE)})
    np.testing.assert_allclose(end(after, f"{name}_target"), POSE, atol=1e-15)


def test_notes_stand_before_the_robot():
    text = "<?xml version='1.0'?>\n<!-- theirs -->\n" + TEXT.format("")
    after = rewritten(text, {}, notes=["one -- two", "three"])
    assert after == text.replace("<robot", "<!--\none - - two\nthree\n-->\n<robot")
    assert load_robot(after, "b").n == 1
