"""Visual shapes are read where the URDF says, and what cannot be read is named."""

import numpy as np
import pytest

from thermal_robot.errors import RobotError
from thermal_robot.shapes.visuals import parsed, placement, visuals

URDF = """<?xml version="1.0" encoding="utf-16"?><robot name="one"><link name="arm">
<visual><origin xyz="1 0 0"/><geometry><box size="0.1 0.2 0.3"/></geometry></visual>
<visual><geometry><mesh filename="lost.stl"/></geometry></visual></link><link name="bare"/></robot>"""


def test_shapes_and_lost_meshes_stand_by_link(tmp_path):
    drawn, absent = visuals(parsed(URDF), tmp_path)
    assert set(drawn) == {"arm"}
    (box,) = drawn["arm"]
    np.testing.assert_allclose(box.bounds, [[0.95, -0.1, -0.15], [1.05, 0.1, 0.15]])
    assert absent == {"arm": ["lost.stl"]}


def test_what_is_no_shape_is_refused():
    with pytest.raises(RobotError, match="visual"):
        parsed(
            '<robot name="one"><link name="arm"><visual><geometry><box size="big"/></geometry></visual></link></robot>'
        )


def test_no_origin_is_the_identity():
    np.testing.assert_array_equal(placement(None), np.eye(4))
