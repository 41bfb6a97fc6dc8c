"""Campaigns as files: one that has every kind of column, and a plain one that is spoilt in a place."""

from __future__ import annotations

from functools import cache, reduce
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from thermal_robot.campaign import Campaign, read_campaign
from thermal_robot.errors import CampaignError

URDF = """<robot name="arm">
  <link name="base"/><link name="column"/><link name="beam"/><link name="carriage"/><link name="hand"/>
  <link name="tool"/><link name="finger"/>
  <joint name="turn" type="revolute"><parent link="base"/><child link="column"/><origin xyz="0 0 0.4"/>
    <axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
  <joint name="lift" type="revolute"><parent link="column"/><child link="beam"/><origin xyz="0.1 0 0"/>
    <axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
  <joint name="slide" type="prismatic"><parent link="beam"/><child link="carriage"/><origin xyz="0.5 0 0"/>
    <axis xyz="1 0 0"/><limit lower="0" upper="0.5" effort="1" velocity="1"/></joint>
  <joint name="roll" type="continuous"><parent link="carriage"/><child link="hand"/><origin xyz="0.3 0 0"/>
    <axis xyz="1 0 0"/></joint>
  <joint name="mount" type="fixed"><parent link="hand"/><child link="tool"/><origin xyz="0.1 0 0"/></joint>
  <joint name="grip" type="revolute"><parent link="hand"/><child link="finger"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="1" effort="1" velocity="1"/></joint>
</robot>"""

PLAIN_TOML = """[robot]
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
MORE = {
    '"rad"': '"deg"',
    '"tool"\n': '"tool"\nreference_temperature = 22.5\n',
    "[0.0, 0.0, 80.0]": "[1.0, 2, 80.0]",
    "0.02\n": "0.02\norientation = 3e-5\n[payload]\ncom = [0.0, 0.0, 50.0]\n",
}
TOML = reduce(lambda text, pair: text.replace(*pair), MORE.items(), PLAIN_TOML)
"""The same in degrees, with every kind of declaration."""

ROWS = """turn,lift,slide,roll,x,y,z
10,20,30,40,1000,0,500
-10,15,60,400,900,100,510
50,-45,90,-40,800,200,520
"""


def put(folder: Path, table: str | bytes = ROWS, toml: str = TOML) -> Path:
    folder.mkdir(exist_ok=True)
    (folder / "robot.urdf").write_text(URDF)
    (folder / "campaign.toml").write_text(toml)
    (folder / "measurements.csv").write_bytes(table if isinstance(table, bytes) else table.encode())
    return folder


def add(table: str, **columns: str) -> str:
    """Append columns, their cells separated by blanks, '_' for an empty one and '.' in a name for '__'."""
    lines = table.strip().splitlines()
    for name, cells in columns.items():
        parts = [name.replace("__", "."), *("" if cell == "_" else cell for cell in cells.split())]
        lines = [f"{line},{part}" for line, part in zip(lines, parts, strict=True)]
    return "\n".join(lines) + "\n"


FULL = add(
    ROWS, qw="1 0 0.6", qx="0 -1 0", qy="0 0 0.8", qz="0 0 0", time="0 1.5 3", temperature="20.1 20.7 21.3",
    temperature__beam="20 21 22", payload="0 5 5", approach__lift="1 -1 0", approach__slide="1 1 -1",
    velocity__lift="10 20 30", velocity__slide="10 20 30", acceleration__roll="1 2 3", torque__lift="1.5 2.5 3.5",
    encoder__lift="20.1 15.1 -44.9", encoder__slide="30.1 60.1 90.1", speed="0.1 0.5 1", order="3 1 2",
    humidity="40 41 43", session="a a b", pose="1 2 3", sim__x="1000 900 800", sim__y="0 100 200",
    sim__z="500 510 520", sim__qw="1 1 1", sim__qx="0 0 0", sim__qy="0 0 0", sim__qz="0 0 0",
)  # fmt: skip
"""A table that has every kind of column."""


@cache
def full() -> Campaign:
    """The campaign of that table."""
    with TemporaryDirectory() as folder:
        return read_campaign(put(Path(folder) / "hall_3", FULL))


PLAIN = """turn,lift,slide,roll,x,y,z,time,note
0.1,0.2,30,0.4,1000,0,500,1,7
-0.1,0.3,60,3.5,900,100,510,2,8
0.5,-0.4,90,-0.4,800,200,520,3,9
"""


def read(folder: Path, table: str | bytes = PLAIN, toml: str = PLAIN_TOML) -> Campaign:
    """The plain campaign, or what it is with another table or campaign.toml."""
    return read_campaign(put(folder, table, toml))


def refusal(folder: Path, table: str | bytes = PLAIN, toml: str = PLAIN_TOML) -> CampaignError:
    """How it is refused: in one line, of a thousand letters at most."""
    with pytest.raises(CampaignError) as caught:
        read(folder, table, toml)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) <= 1000
    return caught.value


def says(text: object, told: str) -> bool:
    """Whether a text has these parts, between which there is a … each."""
    return all(part.strip() in str(text) for part in told.split("…"))


def renamed(**names: str) -> str:
    """The plain table with other column names."""
    header, rest = PLAIN.split("\n", 1)
    return ",".join(names.get(name, name) for name in header.split(",")) + "\n" + rest


def with_column(name: str, *cells: str) -> str:
    """The plain table with one more column, or several."""
    return "\n".join(f"{line},{cell}" for line, cell in zip(PLAIN.split(), (name, *cells), strict=True)) + "\n"
