"""MuJoCo as somebody's simulator: models are compiled, asked where their bodies are, written with all digits."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.errors import CampaignError
from thermal_robot.kinematics.markup import Edit, changed, encoded, tags, with_values
from thermal_robot.kinematics.mimic import Mimic, mimics

_NO_MASS = {"boundmass": 1e-9, "boundinertia": 1e-12, "balanceinertia": True, "fusestatic": False}
"""Of the compiler: links without masses are let be, and links that do not move stay bodies of their own."""
_MIMIC = re.compile(r"<mimic\b[^>]*>(\s*</mimic>)?")
_MESH = re.compile(r"<(visual|collision)\b(?:(?!</\1>).)*?<mesh\b.*?</\1>", re.DOTALL)


def mujoco_or_error() -> Any:
    """Return the package ``mujoco``.

    Raises
    ------
    CampaignError
        If it is not installed.
    """
    try:
        import mujoco
    except ImportError as error:
        raise CampaignError(
            "MJCF", "needs MuJoCo, which is not installed", expected='pip install "thermal-robot[blind]"'
        ) from error
    return mujoco


def compiled(mjcf: str | Path) -> Any:
    """Return the ``mujoco.MjModel`` of an MJCF: a file, with what it includes, or its text.

    Raises
    ------
    CampaignError
        If there is no such file, or MuJoCo does not take it.
    """
    mujoco = mujoco_or_error()
    try:
        if isinstance(mjcf, Path):
            return mujoco.MjModel.from_xml_path(str(mjcf))
        return mujoco.MjModel.from_xml_string(mjcf)
    except (ValueError, mujoco.FatalError) as error:
        name = str(mjcf) if isinstance(mjcf, Path) else "the MJCF"
        raise CampaignError(name, "MuJoCo does not take it", found=" ".join(str(error).split())) from None


def mjcf_of_urdf(urdf: str) -> str:
    """Translate a URDF by MuJoCo's compiler, with all digits; joints and links keep their names.

    Meshes are left out, as their files are named in ways that MuJoCo does not know; a joint that mimics another becomes
    an equality.

    Raises
    ------
    CampaignError
        If MuJoCo is not installed, or does not take the robot.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> from thermal_robot.correction import mjcf_of_urdf
    >>> mjcf_of_urdf(tr.load_robot("builtin:rv_m2", "tool0").urdf)[:20]
    '<mujoco model="rv_m2'
    """
    mujoco = mujoco_or_error()
    try:
        spec = mujoco.MjSpec.from_string(_MIMIC.sub("", _MESH.sub("", urdf)))
        for name, value in _NO_MASS.items():
            setattr(spec.compiler, name, value)
        model = spec.compile()
        text = spec.to_xml()
    except (ValueError, mujoco.FatalError) as error:
        raise CampaignError("the URDF", "MuJoCo does not take it", found=" ".join(str(error).split())) from None
    return _exact(
        text, model, [_equality(joint, mimic) for joint, mimic in mimics(urdf).items() if _both(model, joint, mimic)]
    )


def _equality(joint: str, mimic: Mimic) -> str:
    """Return what makes a joint follow another: MuJoCo 3.3.0 does not read that from a URDF."""
    numbers = digits([mimic.offset, mimic.multiplier, 0, 0, 0])
    return f'    <joint joint1={quoteattr(joint)} joint2={quoteattr(mimic.joint)} polycoef="{numbers}"/>\n'


def _both(model: Any, joint: str, mimic: Mimic) -> bool:
    """Tell whether both joints move: a fixed one is none of an MJCF."""
    return known(model, "joint", joint) is not None and known(model, "joint", mimic.joint) is not None


def _exact(text: str, model: Any, equalities: Sequence[str]) -> str:
    """Give a model that MuJoCo wrote, in six digits, all of them; and its equalities."""
    content = encoded(text)
    found = tags(content)
    end = found[0].close
    edits: list[Edit] = [(end, end, f"\n  <equality>\n{''.join(equalities)}  </equality>\n")] if equalities else []
    for tag in found:
        values: dict[str, tuple[Array, Sequence[float]]] = {}
        if tag.path[-1] == "body":
            body = model.body(tag.attributes["name"])
            values = {"pos": (body.pos, (0.0, 0.0, 0.0)), "quat": (body.quat, (1.0, 0.0, 0.0, 0.0))}
        elif tag.path[-1] == "joint":
            joint = model.joint(tag.attributes["name"])
            values = {"axis": (joint.axis, (0.0, 0.0, 1.0)), "range": (joint.range, (0.0, 0.0))}
        new = {name: digits(value) for name, (value, usual) in values.items() if value.tolist() != list(usual)}
        edits += [with_values(content, tag, new)] if new else []
    return changed(content, edits)


def digits(values: Any) -> str:
    """Return numbers as MJCF has them, with all digits."""
    return " ".join(repr(float(value)) for value in values)


@dataclass(frozen=True, eq=False)
class Bodies:
    """Where the bodies of a model are while its joints stand somewhere.

    Attributes
    ----------
    model, data
        ``mujoco.MjModel``, and its ``mujoco.MjData``, which changes as joints are moved.
    """

    model: Any
    data: Any

    @classmethod
    def of(cls, model: Any) -> Bodies:
        """Return those of a model, its joints where it starts."""
        bodies = cls(model, mujoco_or_error().MjData(model))
        bodies.move({})
        return bodies

    def move(self, positions: Mapping[str, float]) -> None:
        """Put joints to positions (rad or m) by name; the others stay."""
        for name, position in positions.items():
            self.data.qpos[self.model.joint(name).qposadr[0]] = position
        mujoco_or_error().mj_kinematics(self.model, self.data)

    def pose(self, body: int) -> Array:
        """(4, 4) of a body in the world, m."""
        return _pose(self.data.xpos[body], self.data.xmat[body].reshape(3, 3))

    def site(self, site: int) -> Array:
        """(4, 4) of a site in the world, m."""
        return _pose(self.data.site_xpos[site], self.data.site_xmat[site].reshape(3, 3))

    def line(self, joint: int) -> tuple[Array, Array]:
        """Return a point (3,) of a joint's axis, m, and its direction (3,), in the world."""
        return np.array(self.data.xanchor[joint]), np.array(self.data.xaxis[joint])


def known(model: Any, kind: str, name: str) -> int | None:
    """Return the number of a body, joint or site; ``None`` where a model has none of this name."""
    mujoco = mujoco_or_error()
    number = mujoco.mj_name2id(model, getattr(mujoco.mjtObj, f"mjOBJ_{kind.upper()}"), name)
    return None if number < 0 else int(number)


def _pose(position: Array, rotation: Array) -> Array:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation, position
    return pose
