"""A small fleet, diagnosed once."""

import pytest
from fleet.robots import ONLY, write_fleet

from thermal_robot import diagnose_many


@pytest.fixture(scope="session")
def fleet_folder(rv_m2, tmp_path_factory):
    """Six campaigns in two halls, one of them with a table that cannot be read."""
    root = write_fleet(rv_m2, tmp_path_factory.mktemp("campaigns"), 6)
    table = root / "hall_1" / "arm_05" / "measurements.csv"
    table.write_text(table.read_text().replace("\n", "\nnonsense,", 2))
    return root


@pytest.fixture(scope="session")
def fleet(fleet_folder, tmp_path_factory):
    return diagnose_many(fleet_folder, tmp_path_factory.mktemp("out"), labels=["hall", "robot"], only=ONLY, workers=2)
