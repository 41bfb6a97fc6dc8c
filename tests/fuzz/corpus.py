"""Sound campaigns to spoil: each a folder as a dict of its files."""

from __future__ import annotations

import io
import json
import tempfile
from functools import cache
from pathlib import Path

import numpy as np
from campaign.files import FULL, TOML, URDF
from conftest import AWKWARD
from coupled import COUPLED, PARALLELOGRAM
from simulate import conditions

from thermal_robot.campaign import Campaign, Units, campaign_from_table, read_campaign, write_campaign
from thermal_robot.correction import CorrectedModel
from thermal_robot.datasets import demo_directory
from thermal_robot.effects import library
from thermal_robot.kinematics import quaternion_to_rotation, rotation_to_quaternion, tool_poses
from thermal_robot.observations import Frames, observe
from thermal_robot.robot import load_robot

ROWS = 12
"""Of a campaign that is read; a diagnosis needs them, too, and takes under a second for them."""

Files = dict[str, bytes]

_BOMB = b'<?xml version="1.0"?><!DOCTYPE r [<!ENTITY a "%b">%b]><robot name="&k;"><link name="base"/></robot>'
BOMB = _BOMB % (b"a" * 32, b"".join(b'<!ENTITY %c "%b">' % (98 + n, b"&%c;" % (97 + n) * 30) for n in range(10)))
"""Entities of entities: 600 bytes that unfold to ten thousand billion."""


def files_of(campaign: Campaign) -> Files:
    """The files that ``write_campaign`` makes of a campaign."""
    with tempfile.TemporaryDirectory() as folder:
        write_campaign(campaign, folder)
        return {path.name: path.read_bytes() for path in Path(folder).iterdir()}


@cache
def campaigns() -> tuple[Files, ...]:
    """The demo's first rows, a table with every column, and arms with every kind of joint, with and without turns."""
    demo = read_campaign(demo_directory())
    sound = [
        demo.take(np.arange(ROWS)),
        *(made(*arm) for arm in ((AWKWARD, "tip"), (COUPLED, "tip"), (PARALLELOGRAM, "tool"))),
    ]
    return (*(files_of(campaign) for campaign in sound), every_column(), several_targets())


UNITS = Units("deg", "mm")
"""Not those of the program."""


def made(urdf: str, tool: str, *, units: Units = UNITS, seed: int = 7) -> Campaign:
    """A campaign of an arm, with turns, conditions and labels."""
    robot, rng = load_robot(urdf, tool), np.random.default_rng(seed)
    q = rng.uniform(np.maximum(robot.lower, -2.0), np.minimum(robot.upper, 2.0), (ROWS, robot.n))
    poses = tool_poses(robot, q)
    return Campaign(
        "made", robot, q, poses[:, :3, 3] + 1e-4 * rng.normal(size=(ROWS, 3)), rotation_to_quaternion(poses[:, :3, :3]),
        covariates=conditions(robot, q, rng, 3.0), labels={"session": np.repeat(["a", "b"], ROWS // 2)},
        noise_position=2e-5, noise_orientation=3e-5, payload_com=np.array([0.0, 0.0, 0.05]), units=units,
    )  # fmt: skip


def several_targets() -> Files:
    """Four targets of each pose, of which some rows lack one, and a noise for each row."""
    one, rng = made(AWKWARD, "tip"), np.random.default_rng(9)
    places = np.array([[0.1, 0.0, 0.0], [-0.05, 0.08, 0.0], [-0.05, -0.08, 0.02], [0.0, 0.0, 0.12]])
    table = one.to_frame().drop(columns=["x", "y", "z", "qw", "qx", "qy", "qz"])
    points = one.position[:, None] + places @ quaternion_to_rotation(one.orientation).transpose(0, 2, 1)
    points = points + 2e-5 * rng.normal(size=points.shape)
    points[3, 1] = points[8, 3] = np.nan
    for k in range(4):
        for a, axis in enumerate("xyz"):
            table[f"{axis}.{k + 1}"] = points[:, k, a] / one.units.length_scale
    table["noise"] = rng.choice([0.02, 0.05], len(table))
    return files_of(campaign_from_table(one.robot, table, angle_unit="deg", length_unit="mm"))


def every_column() -> Files:
    """The table of the tests of reading, in which every kind of column stands, with a gap."""
    table = FULL.replace(",41,", ",,")
    return {"robot.urdf": URDF.encode(), "campaign.toml": TOML.encode(), "measurements.csv": table.encode()}


@cache
def models() -> tuple[Files, ...]:
    """A saved model of each arm, with every effect that its campaign allows, and commands for it."""
    return tuple(model_of(files) for files in campaigns()[:4])


def model_of(files: Files) -> Files:
    """A saved model with every effect that a campaign allows, and the campaign's commands."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        put(files, folder)
        campaign = read_campaign(folder)
        nominal, rng = observe(campaign, Frames.declared(campaign)), np.random.default_rng(3)
        known = [effect for effect in library().values() if not effect.missing(nominal)]
        sizes = [np.array([p.size for p in effect.parameters(nominal)]) for effect in known]
        held = tuple((effect, size * rng.normal(size=len(size))) for effect, size in zip(known, sizes, strict=True))
        frames, needs = Frames.declared(campaign), tuple(campaign.covariates)
        model = CorrectedModel(campaign.robot, campaign.settings, frames, held, campaign.measures, needs)
        model.save(folder / "model.json")
        return {"model.json": (folder / "model.json").read_bytes(), "samples.csv": files["measurements.csv"]}


def put(files: Files, folder: Path) -> None:
    """Write the files of a trial."""
    for name, data in files.items():
        (folder / name).write_bytes(data)


def as_frame(files: Files):
    """The table as pandas reads it."""
    import pandas as pd

    return pd.read_csv(io.BytesIO(files["measurements.csv"]))


def as_parquet(frame) -> bytes:
    """A data frame as a Parquet file."""
    buffer = io.BytesIO()
    frame.to_parquet(buffer)
    return buffer.getvalue()


def rows_of(files: Files):
    """Where each row of a table stood before it was moved."""
    return json.loads(files["rows.json"]) if "rows.json" in files else slice(None)
