"""Where every link is: as a whole Pinocchio model says, as the batch kinematics say, and held beside the chain."""

import io

import numpy as np
import pinocchio as pin
import yourdfpy

from thermal_robot.kinematics import chain_frames, link_poses, tool_poses


def test_links_are_where_pinocchio_has_them_in_the_whole_robot(rv_m2, configurations):
    model = pin.buildModelFromXML(rv_m2.urdf)
    data = model.createData()
    q = configurations(rv_m2, 20)
    found = link_poses(rv_m2, q)
    assert found.shape == (20, len(rv_m2.urdf_links), 4, 4)
    for row, configuration in zip(found, q, strict=True):
        pin.framesForwardKinematics(model, data, configuration)
        for link, pose in zip(rv_m2.urdf_links, row, strict=True):
            np.testing.assert_allclose(pose, data.oMf[model.getFrameId(link)].homogeneous, atol=1e-9)


def test_links_of_the_chain_are_where_the_batch_kinematics_have_them(arm, configurations):
    q = configurations(arm, 5)
    found = dict(zip(arm.urdf_links, np.moveaxis(link_poses(arm, q), 1, 0), strict=True))
    np.testing.assert_allclose(found[arm.tool_frame], tool_poses(arm, q), atol=1e-9)
    np.testing.assert_allclose(found[arm.root_frame], np.broadcast_to(np.eye(4), (5, 4, 4)), atol=1e-12)
    frames = chain_frames(arm, q)
    for k, link in enumerate(arm.chain.parent_links):
        placed = found[link][:, :3, :3] @ arm.chain.translations[k] + found[link][:, :3, 3]
        np.testing.assert_allclose(placed, frames.positions[:, k], atol=1e-9)


def test_a_branch_beside_the_chain_stands_where_it_is_held(awkward, awkward_urdf):
    whole = yourdfpy.URDF.load(io.StringIO(awkward_urdf), load_meshes=False, build_scene_graph=True)
    q = 0.5 * (np.maximum(awkward.lower, -1.0) + np.minimum(awkward.upper, 1.0))
    q[awkward.joint_names.index("slide")] = 0.0  # yourdfpy takes an axis for a unit vector, which this one is not
    # the lift below the root frame does not matter here; the branch may turn from −0.9 to −0.3 only: nearest to zero
    whole.update_cfg({**dict(zip(awkward.joint_names, q, strict=True)), "lift": 0.2, "branch_joint": -0.3})
    found = link_poses(awkward, q)[0]
    for link, pose in zip(awkward.urdf_links, found, strict=True):
        np.testing.assert_allclose(pose, whole.get_transform(link, awkward.root_frame), atol=1e-9, err_msg=link)
