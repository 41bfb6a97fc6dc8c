"""Importer of calibration data: ROS robot_calibration samples or capture poses, FIGAROH markers and joints.

Sources. ROS: github.com/mikeferguson/robot_calibration: ``robot_calibration_msgs/msg/CalibrationData.msg`` and
``Observation.msg`` (joint_states; observations, each with a sensor_name and features, which are points with x y z), as
text of ``rostopic echo`` or ``ros2 topic echo``, documents separated by ---; and the capture poses that
``robot_calibration/src/util/poses_from_yaml.cpp`` reads: a list of joints, positions and features. In rad and m, as
everywhere in ROS.

The capture poses are commands alone: a second file has the measured points, row by row.

FIGAROH: github.com/thanhndv212/figaroh-plus, ``src/figaroh/calibration/data_loader.py``, ``load_data`` (columns x1 y1
z1 phix1 phiy1 phiz1 for marker 1, and so on, then one per joint by its name in the URDF), ``config.py`` (both layouts
of the YAML) and ``examples/tiago/config`` in github.com/thanhndv212/figaroh-examples. Positions are in m, joints in
rad.

What phix phiy phiz are differs between versions: ``calibration_tools.py`` takes roll, pitch and yaw
(``pin.rpy.matrixToRpy``), a later guide speaks of rotation vectors. They are left out unless ``[orientation]`` in the
mapping says which.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from thermal_robot.campaign.document import is_yaml, read_yaml
from thermal_robot.campaign.importers.plan import Format, Plan, Source, files_of, planned
from thermal_robot.campaign.importers.table import joined
from thermal_robot.campaign.names import listed
from thermal_robot.campaign.table import Table, read_table, table_from_frame
from thermal_robot.errors import CampaignError

_UNITS = {"measurements": {"angle_unit": "rad", "length_unit": "m"}}


def _read_calibration(files: Sequence[Path], plan: Plan) -> Source:
    """Read samples; the first feature of ``[recording] sensor`` is the target unless ``feature`` says another."""
    file = next((file for file in files if is_yaml(file)), files[0])
    documents = read_yaml(file)
    listed_once = documents[0] if len(documents) == 1 and isinstance(documents[0], list) else []
    if any(isinstance(item, dict) and "observations" in item for item in listed_once):
        documents = listed_once  # samples in one list rather than in documents of their own
    elif listed_once or documents == [[]]:
        commands = _table(str(file), [_positions(str(file), k, pose) for k, pose in enumerate(listed_once)])
        tables = [each for each in files if each != file]
        if not tables:
            expected = "the table of measured points as a second file"
            raise CampaignError(str(file), "holds poses and no measurements", expected=expected)
        both, notes = joined(read_table(tables[0], plan.layout()), commands)
        return Source(both, planned(_UNITS), notes)
    files_of(files, "SAMPLES.yaml, or POSES.yaml MEASURED.csv", 1, 1)
    sensor = plan.get("recording", "sensor") or _only_sensor(str(file), documents)
    feature = plan.get("recording", "feature", 1)
    rows = [_sample(str(file), k, sample, sensor, feature) for k, sample in enumerate(documents)]
    return Source(
        _table(str(file), rows), planned(_UNITS), (f"feature {feature} of sensor {sensor!r} taken as the target",)
    )


def _table(file: str, rows: Sequence[Mapping[str, float]]) -> Table:
    """Table of rows of numbers by name; rows are counted from 1."""
    import pandas as pd

    return table_from_frame(pd.DataFrame(rows, index=range(1, len(rows) + 1)), file)


def _positions(file: str, index: int, pose: Any, keys: tuple[str, str] = ("joints", "positions")) -> dict[str, float]:
    """Joint positions by name, of a capture pose or of a sample's joint states."""
    if not isinstance(pose, dict):
        raise _odd(file, index, pose, "joints and positions")
    given: list[Any] = [pose.get(key) for key in keys]
    names, positions = given
    fits = isinstance(names, list) and isinstance(positions, list) and len(names) == len(positions) > 0
    if not fits or not all(isinstance(p, (int, float)) for p in positions):
        raise _odd(file, index, {"joints": names, "positions": positions}, "as many positions as joints, numbers")
    return {str(name): float(position) for name, position in zip(names, positions, strict=True)}


def _sample(file: str, index: int, sample: Any, sensor: str, feature: int) -> dict[str, float]:
    """Joint positions and measured point of one sample; without the point where it was not seen."""
    state = sample.get("joint_states") if isinstance(sample, dict) else None
    if not isinstance(state, dict):
        raise _odd(file, index, sample, "joint_states and observations")
    row = _positions(file, index, state, ("name", "position"))
    seen = {each["sensor_name"]: each.get("features") or [] for each in _observations(sample)}
    features = seen.get(sensor, [])
    if not isinstance(features, list):
        raise _odd(file, index, features, "a list of features")
    if len(features) < feature:
        return row
    point = features[feature - 1].get("point") if isinstance(features[feature - 1], dict) else None
    if not isinstance(point, dict) or not all(isinstance(point.get(axis), (int, float)) for axis in "xyz"):
        raise _odd(file, index, features[feature - 1], "a feature with a point of x, y and z")
    return {**row, **{axis: float(point[axis]) for axis in "xyz"}}


def _observations(sample: Any) -> list[Any]:
    found = sample.get("observations") if isinstance(sample, dict) else None
    found = found if isinstance(found, list) else []
    return [each for each in found if isinstance(each, dict) and isinstance(each.get("sensor_name"), str)]


def _only_sensor(file: str, documents: Sequence[Any]) -> str:
    """Name of the sensor, if all observations have the same."""
    sensors = sorted({each["sensor_name"] for sample in documents for each in _observations(sample)})
    if len(sensors) != 1:
        problem = "it is not clear which sensor measured" if sensors else "there are no observations"
        expected = "[recording] sensor in the mapping" if sensors else "samples of robot_calibration"
        raise CampaignError(file, problem, found=listed(sensors) if sensors else None, expected=expected)
    return str(sensors[0])


def _odd(file: str, index: int, found: Any, expected: str) -> CampaignError:
    return CampaignError(file, "is no sample", key=f"[{index}]", found=repr(found)[:80], expected=expected)


ROBOT_CALIBRATION = Format(
    "samples of ROS robot_calibration as YAML; or its capture poses, and a table of measured points",
    "SAMPLES.yaml, or POSES.yaml MEASURED.csv",
    _read_calibration,
)


_UNIVERSE = "universe"  # What Pinocchio calls the frame before the first joint: the root of the URDF


def _read_figaroh(files: Sequence[Path], plan: Plan) -> Source:
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
    return Source(table, planned(sections, str(files[-1])), tuple(notes))


def _configured(file: Path) -> dict[str, dict[str, Any]]:
    """Chain and marker in the YAML, in either layout."""
    documents = read_yaml(file)
    whole = documents[0] if documents and isinstance(documents[0], dict) else {}
    task = _within(whole, "tasks", "calibration") or _within(whole, "calibration")
    if not task:
        expected = "tasks.calibration, or calibration"
        raise CampaignError(str(file), "is no configuration of FIGAROH", key="calibration", expected=expected)
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
    """Nested mapping at some keys; empty where it is missing."""
    for key in keys:
        content = content.get(key) if isinstance(content, dict) else None
    return content if isinstance(content, dict) else {}


FIGAROH = Format("calibration data of FIGAROH", "DATA.csv [CONFIG.yaml]", _read_figaroh)
