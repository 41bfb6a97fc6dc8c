"""A UR10 before a laser tracker with a T-Mac: the data set of Landgraf et al. (2021), *ipa-robot-accuracy*.

Source: github.com/christianlandgraf/ipa-robot-accuracy, README and the headers of its tables: commanded joints by their
names in the URDF, rad; measurement_x y z, mm, and measurement_rx ry rz, degrees, of the T-Mac in the tracker's frame;
measurement_temperature of the air, °C; Timestamp as 20200714163904. Semicolons and decimal commas.

That rx ry rz turn about the moving axes x, y, z in this order is not written there: it is the convention that agrees
with the joints to 2 mrad, where each other leaves more than 20. In some series the time stamps are rounded to
2,02011E+13: then the order of the rows takes their place. The T-Mac sits about 93 mm before the flange, which is where
its place is looked for first.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from thermal_robot.campaign.importers.given import files_of
from thermal_robot.campaign.importers.mapped import Source
from thermal_robot.campaign.importers.plan import Plan, planned
from thermal_robot.campaign.tabular import read_table

DOES = "the data set of Landgraf et al.: UR10, laser tracker with T-Mac"
FILES = "measurements_grid.csv"
_STAMP = "Timestamp"


def read(files: Sequence[Path], plan: Plan) -> Source:
    """Read one of the series.

    Raises
    ------
    CampaignError
        Another number of files, a table that cannot be read.
    """
    files_of(files, FILES, 1, 1)
    table = read_table(files[0], plan.layout())
    whole = all(re.fullmatch(r"\d{14}", stamp) for stamp in table.text(_STAMP)) if _STAMP in table.columns else False
    clock: dict[str, Any] = (
        {"time": {"column": _STAMP, "time": "%Y%m%d%H%M%S"}} if whole else {"order": {"count": True}}
    )
    measured = {axis: f"measurement_{axis}" for axis in "xyz"}
    sections: dict[str, dict[str, Any]] = {
        "measurements": {"angle_unit": "rad", "length_unit": "mm"},
        "frames": {"target": [0.0, 0.0, 93.0]},
        "columns": {**measured, **clock, "temperature": "measurement_temperature"},
        "orientation": {
            "kind": "euler",
            "sequence": "XYZ",
            "unit": "deg",
            "columns": [f"measurement_r{axis}" for axis in "xyz"],
        },
    }
    notes = () if whole else ("the time stamps are no instants: the order of the rows is taken",)
    return Source(table, planned(sections), notes)
