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
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from thermal_robot.campaign.document import is_yaml, read_yaml
from thermal_robot.campaign.importers.plan import IN_SI, Format, Plan, Source, files_of, planned
from thermal_robot.campaign.importers.table import joined
from thermal_robot.campaign.names import listed
from thermal_robot.campaign.table import Table, read_table, table_from_frame
from thermal_robot.errors import CampaignError

_POSE = "joints and as many positions, numbers"
_SAMPLE = "joint_states, and observations with a sensor_name and a list of features, points of x, y and z"


def _read_calibration(files: Sequence[Path], plan: Plan) -> Source:
    """Read samples of ROS robot_calibration, or capture poses joined with a table of measured points row by row.

    The target in a sample is the first feature, or number ``feature``, of the sensor in ``[recording]`` of the mapping.
    """
    file = next((file for file in files if is_yaml(file)), files[0])
    documents = read_yaml(file)
    listed_once = documents[0] if len(documents) == 1 and isinstance(documents[0], list) else []
    if any(isinstance(item, dict) and "observations" in item for item in listed_once):
        documents = listed_once  # samples in one list rather than in documents of their own
    elif listed_once or documents == [[]]:
        commands = _table(str(file), listed_once, _positions, _POSE)
        tables = [each for each in files if each != file]
        if not tables:
            expected = "the table of measured points as a second file"
            raise CampaignError(str(file), "holds poses and no measurements", expected=expected)
        both, notes = joined(read_table(tables[0], plan.layout()), commands)
        return Source(both, planned(IN_SI), notes)
    files_of(files, "SAMPLES.yaml, or POSES.yaml MEASURED.csv", 1, 1)
    sensor = plan.get("recording", "sensor") or _only_sensor(str(file), documents)
    feature = plan.get("recording", "feature", 1)
    table = _table(str(file), documents, partial(_sample, sensor=sensor, feature=feature), _SAMPLE)
    return Source(table, planned(IN_SI), (f"feature {feature} of sensor {sensor!r} taken as the target",))


def _table(file: str, items: Sequence[Any], row: Callable[[Any], dict[str, float]], expected: str) -> Table:
    """Build a table of the numbers that ``row`` reads from each item, rows counted from 1; a wrong item is refused."""
    import pandas as pd

    rows = []
    for k, item in enumerate(items):
        try:
            rows.append(row(item))
        except (TypeError, KeyError, ValueError, AttributeError) as error:
            found = repr(item)[:80]
            raise CampaignError(file, "is no sample", key=f"[{k}]", found=found, expected=expected) from error
    return table_from_frame(pd.DataFrame(rows, index=range(1, len(rows) + 1)), file)


def _positions(pose: Any, names: str = "joints", positions: str = "positions") -> dict[str, float]:
    """Joint positions by name, of a capture pose or of a sample's joint states."""
    return dict(zip(map(str, pose[names]), map(float, pose[positions]), strict=True))


def _sample(sample: Any, sensor: str, feature: int) -> dict[str, float]:
    """Joint positions and measured point of one sample; without the point where it was not seen."""
    row = _positions(sample["joint_states"], "name", "position")
    seen = {each["sensor_name"]: each.get("features") for each in _observations(sample)}
    features = list(seen.get(sensor) or [])
    if len(features) < feature:
        return row
    return {**row, **{axis: float(features[feature - 1]["point"][axis]) for axis in "xyz"}}


def _observations(sample: Any) -> list[Any]:
    found = sample.get("observations") if isinstance(sample, dict) else None
    found = found if isinstance(found, list) else []
    return [each for each in found if isinstance(each, dict) and isinstance(each.get("sensor_name"), str)]


def _only_sensor(file: str, documents: Sequence[Any]) -> str:
    """Name of the one sensor of all observations; none or several are refused."""
    sensors = sorted({each["sensor_name"] for sample in documents for each in _observations(sample)})
    if len(sensors) != 1:
        problem = "it is not clear which sensor measured" if sensors else "there are no observations"
        expected = "[recording] sensor in the mapping" if sensors else "samples of robot_calibration"
        raise CampaignError(file, problem, found=listed(sensors) if sensors else None, expected=expected)
    return str(sensors[0])


ROBOT_CALIBRATION = Format(
    "samples of ROS robot_calibration as YAML; or its capture poses, and a table of measured points",
    "SAMPLES.yaml, or POSES.yaml MEASURED.csv",
    _read_calibration,
)


_UNIVERSE = "universe"  # What Pinocchio calls the frame before the first joint: the root of the URDF


def _read_figaroh(files: Sequence[Path], plan: Plan) -> Source:
    """Read FIGAROH's CSV data, marker 1 being the target, with frames and target place from its YAML if given."""
    tables, configurations = ([file for file in files if is_yaml(file) == wanted] for wanted in (False, True))
    files_of(tables, "DATA.csv [CONFIG.yaml]", 1, 1)
    table = read_table(tables[0], plan.layout())
    sections = {**IN_SI, "columns": {axis: f"{axis}1" for axis in "xyz"}}
    sections |= _configured(configurations[0]) if configurations else {}
    markers = sum(re.fullmatch(r"x\d{1,4}", name) is not None for name in table.columns)
    notes = [f"marker 1 of {markers} taken; [columns] in the mapping takes another"] if markers > 1 else []
    if "phix1" in table.columns and not plan.sections.get("orientation"):
        notes.append("phix1 phiy1 phiz1 left out: angles or a rotation vector? [orientation] in the mapping says")
    return Source(table, planned(sections, str(files[-1])), tuple(notes))


def _configured(file: Path) -> dict[str, dict[str, Any]]:
    """Read tool frame, root frame and target place from FIGAROH's YAML, in either layout, as sections of a mapping."""
    whole = next(iter(read_yaml(file)), None)
    task = _within(whole, "tasks", "calibration") or _within(whole, "calibration")
    if not task:
        expected = "tasks.calibration, or calibration"
        raise CampaignError(str(file), "is no configuration of FIGAROH", key="calibration", expected=expected)
    chain = _within(task, "kinematics") or task
    pose = _within(task, "measurements", "poses").get("tool_pose", task.get("tip_pose"))
    ends = {"tool_frame": chain.get("tool_frame"), "root_frame": chain.get("base_frame")}
    robot = {key: frame for key, frame in ends.items() if isinstance(frame, str) and frame != _UNIVERSE}
    return {"robot": robot, "frames": {"target": pose[:3]} if isinstance(pose, list) and len(pose) == 6 else {}}


def _within(content: Any, *keys: str) -> dict[str, Any]:
    """Nested mapping at some keys; empty where it is missing."""
    for key in keys:
        content = content.get(key) if isinstance(content, dict) else None
    return content if isinstance(content, dict) else {}


FIGAROH = Format("calibration data of FIGAROH", "DATA.csv [CONFIG.yaml]", _read_figaroh)
