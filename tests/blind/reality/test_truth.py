"""Which answers about a case are right."""

import numpy as np
import pytest

pytest.importorskip("mujoco", reason='the blind trial needs "thermal-robot[blind]"')

from thermal_robot.blind.cases import Case
from thermal_robot.blind.plan import robots
from thermal_robot.blind.reality import FAULTS, make
from thermal_robot.blind.reality.fault import Fault
from thermal_robot.blind.reality.setting import draw_setting
from thermal_robot.blind.reality.sizes import near
from thermal_robot.campaign import read_campaign
from thermal_robot.effects import gate, library
from thermal_robot.observations import observe


@pytest.fixture(scope="module")
def arm():
    return robots([("ur10", "example-robot-data:ur10", "tool0")])[0]


def test_beside_a_joint_are_its_links_and_the_joints_before_and_after(ur10):
    beside = near(ur10, [("joint", "elbow_joint")])
    assert {name for kind, name in beside if kind == "joint"} == {
        "shoulder_lift_joint", "elbow_joint", "wrist_1_joint",
    }  # fmt: skip
    assert {name for kind, name in beside if kind == "link"} == {"upper_arm_link", "forearm_link"}
    assert ("base", "base") not in beside
    assert ("base", "base") in near(ur10, [("joint", "shoulder_pan_joint")])
    assert ("tool", "tool") in near(ur10, [("joint", "wrist_3_joint")])


def test_beside_a_link_are_the_joints_at_its_ends_and_the_links_beyond(ur10):
    beside = set(near(ur10, [("link", "forearm_link")]))
    assert beside >= {("joint", "elbow_joint"), ("joint", "wrist_1_joint"), ("link", "upper_arm_link")}
    assert ("joint", "shoulder_lift_joint") not in beside


def test_beside_base_and_tool_is_what_they_carry_or_hang_on(ur10):
    first, last = near(ur10, [("base", "base")]), near(ur10, [("tool", "tool")])
    assert [name for _, name in first if name in ur10.names] == ["shoulder_pan_joint"]
    assert [name for _, name in last if name in ur10.names] == ["wrist_3_joint"]
    assert near(ur10, []) == []


def test_true_parameters_have_the_names_that_the_diagnosis_has_for_them(arm, ur10, tmp_path):
    asked = {"samples": (30, 30), "wants": ("moving", "sensor:links", "repeats", "base_known")}
    make(Case("c1", 5, "null", arm, **asked), tmp_path)
    observed = observe(read_campaign(tmp_path))
    setting = draw_setting(ur10, 30, np.random.default_rng(1), moving=True, sensor="links")
    for name, effect in library().items():
        fault: Fault = FAULTS[name]
        true = fault.known_as(setting, fault.draw(setting, np.random.default_rng(2)))
        known = {p.name for v in gate.variants(effect, observed) for p in gate.checked(v, observed)}
        if not effect.random and not any("order 6" in p for p in true):
            assert {p for p in true if "order" not in p or known & {p}} <= known, name
            assert not true or known & set(true), name


def test_a_true_parameter_is_the_size_that_it_had(arm, tmp_path):
    """A scale of 1 part in 10⁴ leaves, over rows that lie a metre from the middle, a tenth of a millimetre."""
    truth = make(Case("c1", 3, "single", arm, effects=("instrument_scale",), samples=(60, 60)), tmp_path)
    scale = truth["truth"]["parameters"]["instrument_scale"]["scale error, instrument"]
    position = np.array(truth["fresh_position"])
    spread = np.sqrt(((position - position.mean(axis=0)) ** 2).mean())
    left = truth["truth"]["parts"]["instrument_scale"]["ratio"] * truth["noise"]
    assert abs(scale) * spread == pytest.approx(left, rel=0.4)  # frames take some of it


def test_a_cause_that_follows_nothing_says_so_and_an_effect_beside_it_is_asked_for(arm, tmp_path):
    asked = Case("c1", 4, "both", arm, effects=("joint_gain",), unlisted="coolant", samples=(60, 60))
    truth = make(asked, tmp_path)["truth"]
    assert truth["effects"] == ["joint_gain"]
    assert truth["quantities"] == ["none"]
    assert len(truth["places"]) == 1
    assert truth["places"][0] in truth["near"]
    assert set(truth["parts"]) == {"joint_gain", "coolant"}
    assert set(truth["parameters"]) == {"joint_gain"}
