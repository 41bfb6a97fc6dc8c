"""Masses behind the fixed frames of a chain: known ones, and the sums over the tree of every arm."""

import io

import numpy as np
import pytest
import yourdfpy

from thermal_robot.robot import load_robot


def link(name, mass, centre="0 0 0"):
    return f"""<link name="{name}"><inertial><origin xyz="{centre}"/><mass value="{mass}"/>
    <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>"""


def joint(name, kind, parent, child, origin):
    return f"""<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/><origin {origin}/>
    <axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>"""


# base - j - body - (fixed) adapter - (fixed) extension - k - hand - (fixed) tool, and a branch held on the adapter
URDF = "".join(
    [
        '<robot name="r"><link name="base"/>',
        link("body", 7, "0.1 0 0"),
        link("adapter", 2, "0 0.1 0"),
        link("branch", 1, "0 0 0.5"),
        link("extension", 3, "0.4 0 0"),
        link("hand", 5),
        link("tool", 0.5, "0 0 0.1"),
        joint("j", "revolute", "base", "body", 'xyz="0 0 1"'),
        joint("flange", "fixed", "body", "adapter", 'xyz="0.3 0 0" rpy="0 0 1.5707963267948966"'),
        joint("held", "revolute", "adapter", "branch", 'xyz="0 0.2 0"'),
        joint("rod", "fixed", "adapter", "extension", 'xyz="0.2 0 0"'),
        joint("k", "revolute", "extension", "hand", 'xyz="0.8 0 0"'),
        joint("grip", "fixed", "hand", "tool", 'xyz="0 0 0.2"'),
        "</robot>",
    ]
)


def test_a_fixed_frame_carries_what_is_fixed_behind_it():
    chain = load_robot(URDF, "tool").chain
    hanging = dict(zip(chain.names, chain.hanging, strict=True))
    assert hanging == pytest.approx({"j": 0.0, "flange": 2 + 1 + 3, "rod": 3.0, "k": 0.0, "grip": 0.5})


def test_its_centre_is_the_weighted_mean_in_its_own_frame():
    chain = load_robot(URDF, "tool").chain
    centres = dict(zip(chain.names, chain.hanging_centres, strict=True))
    # adapter, branch and extension in the frame of the flange; its quarter turn must not show
    parts = 2 * np.array([0, 0.1, 0]) + 1 * np.array([0, 0.2, 0.5]) + 3 * np.array([0.2 + 0.4, 0, 0])
    np.testing.assert_allclose(centres["flange"], parts / 6, atol=1e-14)
    np.testing.assert_allclose(centres["rod"], [0.4, 0, 0], atol=1e-14)
    np.testing.assert_allclose(centres["grip"], [0, 0, 0.1], atol=1e-14)
    np.testing.assert_array_equal(centres["j"], np.zeros(3))


def test_without_masses_nothing_hangs():
    chain = load_robot(URDF.replace("inertial>", "ignored>"), "tool").chain
    assert not chain.hanging.any()
    assert not chain.hanging_centres.any()


def test_what_hangs_is_the_sum_over_the_tree_up_to_the_next_joint_of_the_chain(arm):
    tree = yourdfpy.URDF.load(io.BytesIO(arm.urdf.encode()), load_meshes=False, build_scene_graph=False).robot
    mass = {link.name: link.inertial.mass for link in tree.links if link.inertial is not None}
    below = {}
    for item in tree.joints:
        below.setdefault(item.parent, []).append(item)
    children = {item.name: item.child for item in tree.joints}

    movable = {arm.chain.names[k] for k in arm.chain.movable}

    def beyond(name):
        onward = [item for item in below.get(name, []) if item.name not in movable]
        return mass.get(name, 0.0) + sum(beyond(item.child) for item in onward)

    for k, name in enumerate(arm.chain.names):
        expected = 0.0 if name in movable else beyond(children[name])
        assert arm.chain.hanging[k] == pytest.approx(expected, abs=1e-9)
