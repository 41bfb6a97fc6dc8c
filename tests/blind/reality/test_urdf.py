"""The reality's own reading of a URDF."""

import numpy as np
import pytest

pytest.importorskip("mujoco", reason='the blind trial needs "thermal-robot[blind]"')

from conftest import AWKWARD

from thermal_robot.blind.reality.world import read


@pytest.fixture(scope="module")
def tree():
    return read('<?xml version="1.0" encoding="utf-8"?>' + AWKWARD)


def test_joints_of_the_chain_lead_from_the_root_to_the_tool(tree):
    chain = tree.chain("tip")
    assert tree.root == chain[0].parent == "ground"
    assert [j.child for j in chain[:-1]] == [j.parent for j in chain[1:]]
    assert chain[-1].child == "tip"
    assert [j.name for j in chain if j.movable] == ["lift", "turret", "slide", "roll_joint", "rail_joint", "hand_joint"]
    assert tree.chain("ground") == ()


def test_a_joint_comes_after_the_one_that_carries_it(tree):
    seen = {tree.root}
    for joint in tree.joints:
        assert joint.parent in seen
        seen.add(joint.child)
    assert seen == set(tree.mass)


def test_axes_are_unit_vectors_and_along_x_where_none_is_given(tree):
    axes = {j.name: j.axis for j in tree.joints}
    np.testing.assert_allclose([np.linalg.norm(axis) for axis in axes.values()], 1.0)
    np.testing.assert_allclose(axes["turret"], np.array([1.0, 2.0, -3.0]) / np.sqrt(14.0))
    np.testing.assert_array_equal(axes["tip_joint"], [1.0, 0.0, 0.0])


def test_only_a_continuous_joint_has_no_limits(tree):
    joints = {j.name: j for j in tree.joints}
    assert (joints["turret"].lower, joints["turret"].upper) == (-2.0, 2.5)
    assert (joints["hand_joint"].lower, joints["hand_joint"].upper) == (-np.inf, np.inf)


@pytest.mark.parametrize(
    ("name", "place"), [("lift", 0.2), ("branch_joint", -0.3), ("turret", 0.0), ("hand_joint", 0.0)]
)
def test_a_joint_that_nobody_moves_is_held_nearest_to_zero(tree, name, place):
    assert next(j for j in tree.joints if j.name == name).held == place


def test_a_link_without_inertia_weighs_nothing(tree):
    assert tree.mass["rail"] == 0.0
    np.testing.assert_array_equal(tree.centre["rail"], 0.0)
    assert tree.mass["turret"] == 3.0
    np.testing.assert_array_equal(tree.centre["turret"], [0.02, 0.0, 0.1])


def test_a_link_carries_itself_and_all_branches_beyond_it(tree):
    assert tree.carried(tree.root) == pytest.approx(sum(tree.mass.values()))
    assert tree.carried("slide") == pytest.approx(2.0 + 1.0 + 1.5 + 0.5)  # the held branch, too
    assert tree.carried("tip") == 0.0
