"""An arm as ur_description for ROS 2 lays one out, of any lengths, and its kinematics.yaml."""

import numpy as np

JOINTS = ("shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint")
LINKS = ("shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3")
LENGTHS = (0.18, -0.61, -0.57, 0.17, -0.12, 0.115)
"""m: height of the shoulder, both arms, and the three shifts of the wrist."""


def figures(lengths=LENGTHS):
    """x y z roll pitch yaw by link, nominal."""
    d1, a2, a3, d4, d5, d6 = lengths
    turn = np.pi / 2
    rows = [(0, 0, d1, 0, 0, 0), (0, 0, 0, turn, 0, 0), (a2, 0, 0, 0, 0, 0), (a3, 0, d4, 0, 0, 0)]
    rows += [(0, d5, 0, turn, 0, 0), (0, d6, 0, turn, np.pi, np.pi)]
    return dict(zip(LINKS, rows, strict=True))


def urdf(lengths=LENGTHS, prefix=""):
    """The robot from base_link over base_link_inertia, turned by half a turn, to tool0."""
    names = ["base_link", "base_link_inertia", *(f"{link}_link" for link in LINKS), "flange", "tool0"]
    links = "".join(f'<link name="{prefix}{name}"/>' for name in names)
    rows = [("base_link-base_link_inertia", "fixed", (0, 0, 0, 0, 0, np.pi))]
    rows += [(j, "revolute", f) for j, f in zip(JOINTS, figures(lengths).values(), strict=True)]
    rows += [("wrist_3-flange", "fixed", (0, 0, 0, 0, -np.pi / 2, -np.pi / 2))]
    rows += [("flange-tool0", "fixed", (0, 0, 0, np.pi / 2, 0, np.pi / 2))]
    text = ""
    for (name, kind, (x, y, z, *rpy)), parent, child in zip(rows, names[:-1], names[1:], strict=True):
        told = " ".join(repr(float(v)) for v in rpy)
        text += f'<joint name="{prefix}{name}" type="{kind}"><parent link="{prefix}{parent}"/>'
        text += f'<child link="{prefix}{child}"/>'
        text += f'<origin xyz="{x} {y} {z}" rpy="{told}"/><axis xyz="0 0 1"/>'
        text += '<limit lower="-6.28" upper="6.28" effort="1" velocity="1"/></joint>'
    return f'<robot name="arm">{links}{text}</robot>'


def yaml(rows):
    """A kinematics.yaml of figures by link."""
    keys = ("x", "y", "z", "roll", "pitch", "yaw")
    told = "".join(f"  {link}:\n" + "".join(f"    {k}: {v!r}\n" for k, v in zip(keys, row, strict=True))
                   for link, row in rows.items())  # fmt: skip
    return f"kinematics:\n{told}  hash: calib_1\n"
