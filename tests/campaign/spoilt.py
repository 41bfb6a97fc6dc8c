"""A small campaign whose files are spoilt in one place, and how it is then refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from campaign.files import URDF

from thermal_robot.campaign import Campaign, read_campaign
from thermal_robot.errors import CampaignError

TOML = """[robot]
urdf = "robot.urdf"
tool_frame = "tool"

[measurements]
file = "measurements.csv"
angle_unit = "rad"
length_unit = "mm"

[frames]
base = "unknown"
tool = "known"
target = [0.0, 0.0, 80.0]

[noise]
position = 0.02

[priors]
joint_offset = 1e-3

[gears]
lift = 101
"""

ROWS = """turn,lift,slide,roll,x,y,z,time,note
0.1,0.2,30,0.4,1000,0,500,1,7
-0.1,0.3,60,3.5,900,100,510,2,8
0.5,-0.4,90,-0.4,800,200,520,3,9
"""


def read(folder: Path, *, table: str | bytes = ROWS, toml: str = TOML) -> Campaign:
    (folder / "robot.urdf").write_text(URDF)
    (folder / "campaign.toml").write_text(toml)
    (folder / "measurements.csv").write_bytes(table if isinstance(table, bytes) else table.encode())
    return read_campaign(folder)


def refusal(folder: Path, *, table: str | bytes = ROWS, toml: str = TOML) -> CampaignError:
    with pytest.raises(CampaignError) as caught:
        read(folder, table=table, toml=toml)
    error = caught.value
    assert "\n" not in str(error)
    return error


def renamed(**names: str) -> str:
    """The table with other column names."""
    header, rest = ROWS.split("\n", 1)
    return ",".join(names.get(name, name) for name in header.split(",")) + "\n" + rest


def with_column(name: str, *cells: str) -> str:
    """The table with one more column."""
    return "\n".join(f"{line},{cell}" for line, cell in zip(ROWS.split(), (name, *cells), strict=True)) + "\n"


def require(error: CampaignError, row: int | None, column: str | None, found: str | None, words: list[str]) -> None:
    """Assert that a refusal names the place, what stands there (where it is given), and says these words."""
    assert (error.row, error.column) == (row, column)
    if found is not None:
        assert error.found == found
    for word in words:
        assert word in str(error)


def table_is_refused(folder: Path, table: str | bytes, *said: Any) -> None:
    """Assert that this table is refused, and the file named; ``said`` is what :func:`require` asks of the words."""
    error = refusal(folder, table=table)
    assert error.file == str(folder / "measurements.csv")
    require(error, *said)


def toml_is_refused(
    folder: Path, old: str, new: str, row: int | None, column: str | None, found: str | None, words: list[str]
) -> None:
    """Assert that campaign.toml is refused once this text stands in it for that."""
    assert TOML.count(old) >= 1
    error = refusal(folder, toml=TOML.replace(old, new, 1))
    assert error.file == str(folder / "campaign.toml")
    assert error.found == found
    require(error, row, column, found, words)
