"""Arrows in the scene: where they begin and end, their colours, and one node for all rows."""

import numpy as np
from scene_nodes import Nodes

from thermal_robot.kinematics import quaternion_to_rotation
from thermal_robot.viewer.scene import Cloud, longest
from thermal_robot.viewer.settings import ASIDE, GAP, linear


def ends(node):
    """Where each arrow's tip is."""
    along = np.asarray(node.batched_scales) * [0.0, 0.0, 1.0]
    return node.batched_positions + np.einsum("nij,nj->ni", quaternion_to_rotation(node.batched_wxyzs), along)


def test_arrows_lead_from_predicted_to_measured_when_nothing_is_magnified(scene):
    nodes, rows = Nodes(), np.arange(len(scene.q))
    Cloud(nodes, "/gap/all", scene, scene.gap, GAP).show(rows, 1.0, True)
    node = nodes.added["/gap/all"]
    np.testing.assert_allclose(node.batched_positions, scene.predicted, atol=1e-12)
    np.testing.assert_allclose(ends(node), scene.predicted + scene.gap, atol=1e-12)


def test_rows_set_aside_are_grey(scene):
    nodes, rows = Nodes(), np.arange(len(scene.q))
    Cloud(nodes, "/gap/all", scene, scene.gap, GAP).show(rows, 1.0, True)
    colours = nodes.added["/gap/all"].batched_colors
    np.testing.assert_array_equal((colours == linear(ASIDE)).all(axis=1), scene.aside)
    np.testing.assert_array_equal((colours == linear(GAP)).all(axis=1), ~scene.aside)


def test_another_row_and_magnification_move_the_same_node(scene):
    nodes = Nodes()
    cloud = Cloud(nodes, "/gap/row", scene, scene.gap, GAP)
    for row, magnification, visible in ((0, 100.0, True), (41, 900.0, False), (5, 2.0, True)):
        cloud.show(np.array([row]), magnification, visible)
        node = nodes.added["/gap/row"]
        told = magnification * scene.gap[row]
        assert np.linalg.norm(told) < longest(scene.size)
        np.testing.assert_allclose(ends(node)[0], scene.predicted[row] + told, atol=1e-9)
        assert node.visible is visible
    assert len(nodes.added) == 1
