"""Where other programs see the links of a robot file: Pinocchio, yourdfpy, MuJoCo; and models to write from."""

import io
import re

import mujoco
import numpy as np
import pinocchio
import yourdfpy

from thermal_robot.campaign import Settings
from thermal_robot.correction import Calibrated, CorrectedModel
from thermal_robot.kinematics import Displacement, exp6
from thermal_robot.observations import Frames

BARE = re.compile(r"<(visual|collision|inertial)\b.*?</\1>|<mimic\b[^>]*>", re.DOTALL)
LOOSE = '<mujoco><compiler fusestatic="false" boundmass="1e-6" boundinertia="1e-9" balanceinertia="true"/></mujoco>'


def held(robot, q):
    """Positions of all movable joints of the chain by name, mimicking ones too, for each row."""
    names = [robot.chain.names[k] for k in robot.chain.movable]
    return [dict(zip(names, row, strict=True)) for row in robot.chain.coupling.positions(np.atleast_2d(q)).tolist()]


def by_pinocchio(urdf, root, link, rows):
    # its parser asks for limits that it does not need here
    text = re.sub(r"<limit[^>]*>", "", BARE.sub("", urdf))
    text = text.replace("</joint>", '<limit effort="0" velocity="0"/></joint>')
    model = pinocchio.buildModelFromXML(text)
    data = model.createData()
    for row in rows:
        q = pinocchio.neutral(model)
        for name, position in row.items():
            joint = model.joints[model.getJointId(name)]
            both = joint.nq == 2
            q[joint.idx_q : joint.idx_q + joint.nq] = [np.cos(position), np.sin(position)] if both else position
        pinocchio.framesForwardKinematics(model, data, q)
        ends = (data.oMf[model.getFrameId(name, pinocchio.FrameType.BODY)] for name in (root, link))
        yield next(ends).actInv(next(ends)).homogeneous


def unit(numbers):
    """A unit vector, as the URDF's specification asks for: yourdfpy moves a slide by the length of its axis."""
    axis = np.array(numbers[0].split(), dtype=float)
    return " ".join(map(repr, (axis / (np.linalg.norm(axis) or 1.0)).tolist()))


def by_yourdfpy(urdf, root, link, rows):
    text = re.sub(r"<mimic\b[^>]*>", "", re.sub(r'(?<=<axis xyz=")[^"]*', unit, urdf))
    read = yourdfpy.URDF.load(io.BytesIO(text.encode()), load_meshes=False, build_collision_scene_graph=False)
    for row in rows:
        read.update_cfg(row)
        yield read.get_transform(link, root)


def by_mujoco(xml, root, link, rows, kind="body"):
    """Of a URDF or an MJCF; ``link`` is a body or a site."""
    text = re.sub(r"(<robot\b[^>]*>)", rf"\1{LOOSE}", BARE.sub("", xml)) if "<robot" in xml else xml
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    for row in rows:
        for name, position in row.items():
            data.qpos[model.joint(name).qposadr[0]] = position
        mujoco.mj_kinematics(model, data)
        yield np.linalg.inv(pose_of(data.body(root))) @ pose_of(getattr(data, kind)(link))


def pose_of(placed):
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = placed.xmat.reshape(3, 3), placed.xpos
    return pose


READERS = {"pinocchio": by_pinocchio, "yourdfpy": by_yourdfpy, "mujoco": by_mujoco}


def displaced(robot, seed, size=1e-2, target=True):
    """The robot with random displacements everywhere, far larger than real ones."""
    rng = np.random.default_rng(seed)
    moved = Displacement(size * rng.normal(size=robot.n), size * rng.normal(size=(len(robot.segments), 6)))
    sits = exp6(np.concatenate([0.2 * rng.normal(size=3), rng.normal(size=3)])) if target else np.eye(4)
    return Calibrated(robot, moved, np.eye(4), sits, 20.0, (), (), ())


def model_of(robot, *effects, frames=None, needs=(), **settings):
    """A model that nobody fitted."""
    frames = frames or Frames(np.eye(4), np.eye(4))
    said = Settings("", robot.tool_frame, robot.root_frame, **settings)
    pairs = tuple((effect, np.asarray(values, dtype=float)) for effect, values in effects)
    return CorrectedModel(robot, said, frames, pairs, "position", needs)
