"""Robots that several tests use, and diagnoses that are made once."""

import hashlib
import os
import pickle

import numpy as np
import pytest
from coupled import COUPLED, PARALLELOGRAM

from thermal_robot import diagnose
from thermal_robot.campaign import Campaign, read_campaign
from thermal_robot.robot import load_robot

# Every way in which a chain can be awkward: axes along nothing in particular, prismatic and continuous
# joints, a turned root behind a joint that cannot be at zero, a fixed frame with a length, a held branch with
# a mass, a joint and a link that share a name, a mesh that does not exist.
AWKWARD = """
<robot name="awkward">
  <link name="ground"/>
  <link name="base"/>
  <link name="turret"><inertial><origin xyz="0.02 0 0.1" rpy="0.1 0 0"/><mass value="3"/>
    <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="slide"><inertial><origin xyz="0 0.1 0"/><mass value="2"/>
    <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>
    <visual><geometry><mesh filename="package://nowhere/no.stl"/></geometry></visual></link>
  <link name="branch"><inertial><origin xyz="0.3 0 0"/><mass value="1"/>
    <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="post"/>
  <link name="roll"><inertial><origin xyz="0 0 0.2"/><mass value="1.5"/>
    <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="rail"/>
  <link name="hand"><inertial><origin xyz="0 0.05 0"/><mass value="0.5"/>
    <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="lift" type="prismatic"><parent link="ground"/><child link="base"/>
    <origin xyz="0.1 0.2 0.3" rpy="0.4 -0.5 0.6"/><axis xyz="0 0 1"/>
    <limit lower="0.2" upper="1" effort="1" velocity="1"/></joint>
  <joint name="turret" type="revolute"><parent link="base"/><child link="turret"/>
    <origin xyz="0 0 0.4" rpy="0.3 0.2 -0.1"/><axis xyz="1 2 -3"/>
    <limit lower="-2" upper="2.5" effort="1" velocity="1"/></joint>
  <joint name="slide" type="prismatic"><parent link="turret"/><child link="slide"/>
    <origin xyz="0.1 0.3 -0.2" rpy="1.2 0 0.7"/><axis xyz="3 -1 1"/>
    <limit lower="-0.5" upper="0.8" effort="1" velocity="1"/></joint>
  <joint name="branch_joint" type="revolute"><parent link="slide"/><child link="branch"/>
    <origin xyz="0.2 0 0" rpy="0 0.5 0"/><axis xyz="0 1 0"/>
    <limit lower="-0.9" upper="-0.3" effort="1" velocity="1"/></joint>
  <joint name="post_joint" type="fixed"><parent link="slide"/><child link="post"/>
    <origin xyz="0.05 -0.3 0.1" rpy="0.5 0.6 0.7"/></joint>
  <joint name="roll_joint" type="continuous"><parent link="post"/><child link="roll"/>
    <origin xyz="0 0 0" rpy="0 0.2 0"/><axis xyz="-1 1 2"/></joint>
  <joint name="rail_joint" type="prismatic"><parent link="roll"/><child link="rail"/>
    <origin xyz="0 0.2 0" rpy="0 0 1"/><axis xyz="0 -1 0"/>
    <limit lower="0" upper="0.3" effort="1" velocity="1"/></joint>
  <joint name="hand_joint" type="continuous"><parent link="rail"/><child link="hand"/>
    <origin xyz="0.1 0 0.1" rpy="-1 0 0"/><axis xyz="0 -1 0"/></joint>
  <link name="tip"/>
  <joint name="tip_joint" type="fixed"><parent link="hand"/><child link="tip"/>
    <origin xyz="0.02 0.03 0.12" rpy="0.1 0.2 0.3"/></joint>
</robot>
"""

# Name of the test, robot, tool frame, root frame (None: the root of the URDF).
ARMS = {
    "rv_m2": ("builtin:rv_m2", "tool0", None),
    "awkward": (AWKWARD, "tip", None),
    "awkward-from-base": (AWKWARD, "tip", "base"),
    "parallelogram": (PARALLELOGRAM, "tool", None),
    "coupled": (COUPLED, "tip", None),
    "ur3": ("example-robot-data:ur3", "tool0", None),
    "ur5": ("example-robot-data:ur5", "tool0", "base_link"),
    "ur10": ("example-robot-data:ur10", "tool0", None),
    "panda": ("example-robot-data:panda", "panda_hand", None),
    "kinova": ("example-robot-data:kinova", "j2s6s200_end_effector", None),
    "xarm7": ("example-robot-data:xarm7", "link_eef", None),
    "z1": ("example-robot-data:z1", "gripperStator", None),
    "z1-with-gripper": ("example-robot-data:z1", "gripperMover", "link01"),
    "so101": ("example-robot-data:so101", "gripper_frame_link", None),
    "tiago": ("example-robot-data:tiago", "arm_tool_link", None),
    "tiago-from-torso": ("example-robot-data:tiago", "arm_tool_link", "torso_lift_link"),
    "tiago_pro": ("example-robot-data:tiago_pro", "gripper_left_base_link", None),
    "tiago_dual-right": ("example-robot-data:tiago_dual", "arm_right_tool_link", "torso_lift_link"),
    "talos_arm": ("example-robot-data:talos_arm", "wrist_left_ft_tool_link", None),
    "talos-right": ("example-robot-data:talos", "wrist_right_ft_tool_link", "torso_2_link"),
    "baxter-left": ("example-robot-data:baxter", "left_gripper", "torso"),
    "baxter-right": ("example-robot-data:baxter", "right_gripper", "right_arm_mount"),
    "pr2": ("example-robot-data:pr2", "l_gripper_tool_frame", "base_link"),
}
"""Arms on which a law must hold."""
QUICK = ("rv_m2", "awkward-from-base", "coupled", "parallelogram", "ur10", "panda")
"""Those of every commit: the paper's, one with all that is awkward, mimics, six joints and seven; others are slow."""


def load_arm(name):
    source, tool, root = ARMS[name]
    if source.startswith("example-robot-data:"):
        pytest.importorskip("example_robot_data", reason="this arm is in the package example-robot-data-loaders")
    return load_robot(source, tool, root_frame=root)


@pytest.fixture(
    scope="session", params=[name if name in QUICK else pytest.param(name, marks=pytest.mark.slow) for name in ARMS]
)
def arm(request):
    """Each arm in turn."""
    return load_arm(request.param)


@pytest.fixture(scope="session")
def rv_m2():
    """The robot of the paper."""
    return load_robot("builtin:rv_m2", "tool0")


@pytest.fixture(scope="session")
def awkward():
    """The arm with everything that can be awkward."""
    return load_robot(AWKWARD, "tip", root_frame="base")


@pytest.fixture(scope="session")
def awkward_urdf():
    """Its URDF text."""
    return AWKWARD


@pytest.fixture(scope="session")
def configurations():
    """Draw configurations within the limits of a robot."""

    def draw(robot, rows, seed=0):
        rng = np.random.default_rng(seed)
        return rng.uniform(np.maximum(robot.lower, -4.0), np.minimum(robot.upper, 4.0), (rows, robot.n))

    return draw


@pytest.fixture(scope="session")
def diagnosed_once(tmp_path_factory):
    """Diagnose as :func:`thermal_robot.diagnose`, each campaign once in a run: by content, for all its processes."""
    base = tmp_path_factory.getbasetemp()
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "diagnoses"
    folder.mkdir(exist_ok=True)

    def diagnosed(campaign, *, progress=lambda stage: None, **asked):
        campaign = campaign if isinstance(campaign, Campaign) else read_campaign(campaign)
        file = folder / hashlib.sha256(pickle.dumps((campaign, sorted(asked.items())))).hexdigest()
        if not file.exists():
            stages = []
            answer = pickle.dumps((diagnose(campaign, progress=stages.append, **asked), stages))
            unfinished = file.with_suffix(f".{os.getpid()}")
            unfinished.write_bytes(answer)
            unfinished.replace(file)
        found, stages = pickle.loads(file.read_bytes())  # everyone has arrays of their own to change
        for stage in stages:
            progress(stage)
        return found

    return diagnosed
