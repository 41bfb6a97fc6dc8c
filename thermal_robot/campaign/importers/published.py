"""Public data sets in the tables that their authors published: a mapping each.

Sources. P. Jacobi, github.com/pauljac7700/serial_robots_datasets, README, "Data Format": target positions x_t y_t z_t
and their differences from the positions that were reached x_dif y_dif z_dif, mm; commanded joints joint_1 …, degrees;
step_order. Measured is target + difference: that sum has six decimals in every row, the difference of the two has not.

Landgraf et al. (2021), github.com/christianlandgraf/ipa-robot-accuracy, README and the headers of its tables: commanded
joints by their names in the URDF, rad; measurement_x y z, mm, and measurement_rx ry rz, degrees, of the T-Mac in the
tracker's frame; measurement_temperature of the air, °C; Timestamp as 20200714163904. That rx ry rz turn about the
moving axes x, y, z in this order is not written there: this convention agrees with the joints to 2 mrad, where each
other leaves more than 20. In some series the time stamps are rounded to 2,02011E+13: then the order of the rows
takes their place. The T-Mac sits about 93 mm before the flange, which is where its place is looked for first.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from thermal_robot.campaign.importers.mapped import Format, Source
from thermal_robot.campaign.importers.plan import Plan, planned
from thermal_robot.campaign.tabular import read_table

_STAMP = "Timestamp"


def _jacobi(files: Sequence[Path], plan: Plan) -> Source:
    table = read_table(files[0], plan.layout())
    joints = sorted((name for name in table.columns if re.fullmatch(r"joint_\d", name)), key=lambda name: name[-1])
    measured = {axis: {"sum": [f"{axis}_t", f"{axis}_dif"]} for axis in "xyz"}
    sections: dict[str, dict[str, Any]] = {
        "measurements": {"angle_unit": "deg", "length_unit": "mm"},
        "columns": {"joints": joints, **measured, "order": "step_order"},
    }
    return Source(table, planned(sections))


def _ipa_ur10(files: Sequence[Path], plan: Plan) -> Source:
    table = read_table(files[0], plan.layout())
    whole = _STAMP in table.columns and all(re.fullmatch(r"\d{14}", stamp) for stamp in table.text(_STAMP))
    clock: dict[str, Any] = {"time": {"column": _STAMP, "time": "%Y%m%d%H%M%S"}}
    measured = {axis: f"measurement_{axis}" for axis in "xyz"}
    turned = {"kind": "euler", "sequence": "XYZ", "unit": "deg", "columns": [f"measurement_r{axis}" for axis in "xyz"]}
    sections: dict[str, dict[str, Any]] = {
        "measurements": {"angle_unit": "rad", "length_unit": "mm"},
        "frames": {"target": [0.0, 0.0, 93.0]},
        "columns": {
            **measured,
            **(clock if whole else {"order": {"count": True}}),
            "temperature": "measurement_temperature",
        },
        "orientation": turned,
    }
    notes = () if whole else ("the time stamps are no instants: the order of the rows is taken",)
    return Source(table, planned(sections), notes)


JACOBI = Format(
    "the data sets of P. Jacobi: UR5 and WAM, laser tracker", "3D_UR5_uncalibrated_grid_cleaned.csv", _jacobi, most=1
)
IPA_UR10 = Format(
    "the data set of Landgraf et al.: UR10, laser tracker with T-Mac", "measurements_grid.csv", _ipa_ur10, most=1
)
