"""Calibration data of FIGAROH: a CSV of markers and joints, and its YAML, which names the ends of the chain.

Sources: github.com/thanhndv212/figaroh-plus, ``src/figaroh/calibration/data_loader.py``, ``load_data`` (columns
x1 y1 z1 phix1 phiy1 phiz1 for marker 1, and so on, then one per joint by its name in the URDF), ``config.py`` (both
layouts of the YAML) and ``examples/tiago/config`` in github.com/thanhndv212/figaroh-examples. Positions are in m,
joints in rad.

What phix phiy phiz are differs between versions: ``calibration_tools.py`` takes roll, pitch and yaw
(``pin.rpy.matrixToRpy``), a later guide speaks of rotation vectors. They are left out unless ``[orientation]`` in the
mapping says which.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from thermal_robot.campaign.importers.given import is_yaml, read_yaml
from thermal_robot.campaign.importers.mapped import Format, Source, files_of
from thermal_robot.campaign.importers.plan import Plan, planned
from thermal_robot.campaign.tabular import read_table
from thermal_robot.errors import CampaignError

_UNIVERSE = "universe"
"""What Pinocchio calls the frame before the first joint: the root of the URDF."""


def _read(files: Sequence[Path], plan: Plan) -> Source:
    """Read the data; the first marker is the target."""
    tables = [file for file in files if not is_yaml(file)]
    configurations = [file for file in files if is_yaml(file)]
    files_of(tables, "DATA.csv [CONFIG.yaml]", 1, 1)
    table = read_table(tables[0], plan.layout())
    sections = _configured(configurations[0]) if configurations else {}
    sections["measurements"] = {"angle_unit": "rad", "length_unit": "m"}
    sections["columns"] = {axis: f"{axis}1" for axis in "xyz"}
    markers = {int(name[1:]) for name in table.columns if re.fullmatch(r"x\d{1,4}", name)}
    notes = []
    if len(markers) > 1:
        notes.append(f"marker 1 of {len(markers)} taken; [columns] in the mapping takes another")
    if "phix1" in table.columns and not plan.sections.get("orientation"):
        notes.append("phix1 phiy1 phiz1 left out: angles or a rotation vector? [orientation] in the mapping says")
    return Source(table, planned(sections), tuple(notes))


def _configured(file: Path) -> dict[str, dict[str, Any]]:
    """Return what the YAML says of the chain and of the marker, in either layout."""
    documents = read_yaml(file)
    whole = documents[0] if documents and isinstance(documents[0], dict) else {}
    task = _within(whole, "tasks", "calibration") or _within(whole, "calibration")
    if not task:
        raise CampaignError(
            str(file), "is no configuration of FIGAROH", key="calibration", expected="tasks.calibration, or calibration"
        )
    chain = _within(task, "kinematics") or task
    pose = _within(task, "measurements", "poses").get("tool_pose", task.get("tip_pose"))
    sections: dict[str, dict[str, Any]] = {"robot": {}, "frames": {}}
    for key, name in (("tool_frame", "tool_frame"), ("root_frame", "base_frame")):
        frame = chain.get(name)
        if isinstance(frame, str) and frame != _UNIVERSE:
            sections["robot"][key] = frame
    if isinstance(pose, list) and len(pose) == 6 and all(isinstance(v, (int, float)) for v in pose):
        sections["frames"]["target"] = pose[:3]
    return sections


def _within(content: Any, *keys: str) -> dict[str, Any]:
    """Return a mapping inside mappings; empty where there is none."""
    for key in keys:
        content = content.get(key) if isinstance(content, dict) else None
    return content if isinstance(content, dict) else {}


FORMAT = Format("calibration data of FIGAROH", "DATA.csv [CONFIG.yaml]", _read)
