"""The robots of P. Jacobi, *serial_robots_datasets* (2025): UR5 and Barrett WAM before a laser tracker.

Source: github.com/pauljac7700/serial_robots_datasets, README, "Data Format": target positions x_t y_t z_t and their
differences from the positions that were reached x_dif y_dif z_dif, mm; commanded joints joint_1 …, degrees; step_order.
Measured is target + difference: that sum has six decimals in every row, the difference of the two has not.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from thermal_robot.campaign.importers.given import files_of
from thermal_robot.campaign.importers.mapped import Source
from thermal_robot.campaign.importers.plan import Plan, planned
from thermal_robot.campaign.tabular import read_table

DOES = "the data sets of P. Jacobi: UR5 and WAM, laser tracker"
FILES = "3D_UR5_uncalibrated_grid_cleaned.csv"


def read(files: Sequence[Path], plan: Plan) -> Source:
    """Read one of the tables.

    Raises
    ------
    CampaignError
        Another number of files, a table that cannot be read.
    """
    files_of(files, FILES, 1, 1)
    table = read_table(files[0], plan.layout())
    joints = sorted((name for name in table.columns if re.fullmatch(r"joint_\d", name)), key=lambda name: name[-1])
    measured = {axis: {"sum": [f"{axis}_t", f"{axis}_dif"]} for axis in "xyz"}
    return Source(
        table,
        planned(
            {
                "measurements": {"angle_unit": "deg", "length_unit": "mm"},
                "columns": {"joints": joints, **measured, "order": "step_order"},
            }
        ),
    )
