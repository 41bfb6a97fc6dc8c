"""Arrows in the scene: one node, whose arrows are moved rather than made anew."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.viewer.arrows import arrows, unit_arrow
from thermal_robot.viewer.colours import Colour, linear
from thermal_robot.viewer.scene import Scene
from thermal_robot.viewer.settings import ASIDE

Array = NDArray[np.float64]


class Cloud:
    """The arrows of some rows.

    Parameters
    ----------
    nodes
        What adds them: the ``scene`` of a viser server.
    name
        Of the node.
    scene
        What is shown.
    vectors
        (N, 3) displacements of all rows, m, root frame.
    colour
        Of rows that were not set aside.
    thicker
        How many times as thick as usual they are.
    """

    def __init__(
        self, nodes: Any, name: str, scene: Scene, vectors: Array, colour: Colour, thicker: float = 1.0
    ) -> None:
        self._nodes, self._name, self._scene, self._vectors, self._thicker = nodes, name, scene, vectors, thicker
        self._colours = linear(np.where(scene.aside[:, None], ASIDE, colour).astype(np.uint8))
        self._node: Any = None

    def show(self, rows: NDArray[np.intp], magnification: float, visible: bool) -> None:
        """Draw the arrows of k rows, the same number each time, or hide them."""
        scene = self._scene
        drawn = arrows(scene.predicted[rows], self._vectors[rows], magnification, scene.size, self._thicker)
        if self._node is None:
            self._node = self._nodes.add_batched_meshes_simple(
                self._name,
                *unit_arrow(),
                drawn.turns,
                drawn.starts,
                batched_scales=drawn.stretches,
                batched_colors=self._colours[rows],
                cast_shadow=False,
                receive_shadow=False,
                lod="off",
            )
        self._node.batched_positions, self._node.batched_wxyzs = drawn.starts, drawn.turns
        self._node.batched_scales, self._node.batched_colors = drawn.stretches, self._colours[rows]
        self._node.visible = visible
