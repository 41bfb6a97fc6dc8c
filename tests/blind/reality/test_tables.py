"""The trial's files say what was commanded, in the units that they declare."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

pytest.importorskip("mujoco", reason='the blind trial needs "thermal-robot[blind]"')

from conftest import AWKWARD

from thermal_robot.blind.cases import Case
from thermal_robot.blind.plan import robots
from thermal_robot.blind.reality import World
from thermal_robot.blind.reality.instrument import Instrument, Measured, conditions, write_folder
from thermal_robot.blind.reality.setting import draw_setting
from thermal_robot.blind.reality.sizes import place
from thermal_robot.blind.reality.world import quaternion
from thermal_robot.campaign import read_campaign
from thermal_robot.kinematics import tool_poses

ROWS, OTHERS = np.arange(0, 12), np.arange(12, 20)
INSTRUMENT = Instrument(
    pose=np.eye(4),
    target=np.array([0.01, -0.02, 0.08]),
    declared=np.array([0.012, -0.021, 0.083]),
    base_known=False,
    tool_known=True,
    noise=2e-5,
    turning=3e-5,
    stated=True,
    tails=np.inf,
    spoilt=0.0,
)


@pytest.fixture(scope="module")
def rail():
    """An arm with three prismatic joints among its revolute ones."""
    return robots([("rail", AWKWARD, "tip")])[0]


@pytest.fixture(scope="module")
def day(rail):
    return draw_setting(
        World(rail.urdf, "tip"), 20, np.random.default_rng(2), moving=True, sensor="links", visits=(4, 4)
    )


@pytest.fixture(scope="module")
def measured():
    rng = np.random.default_rng(0)
    return Measured(rng.normal(size=(12, 3)), np.tile([0.5, 0.5, -0.5, 0.5], (12, 1)), [])


@pytest.fixture(scope="module")
def folder(rail, day, measured, tmp_path_factory):
    where = tmp_path_factory.mktemp("campaign")
    case = Case("c1", 1, "single", rail, hidden=("payload",))
    write_folder(where, case, day, measured, ROWS, OTHERS, INSTRUMENT, {"slide": 80.0})
    return where


@pytest.fixture(scope="module")
def campaign(folder):
    return read_campaign(folder)


def test_commands_of_revolute_and_prismatic_joints_come_back_as_they_were(campaign, day):
    np.testing.assert_allclose(campaign.q, day.q[ROWS], atol=1e-9)


@pytest.mark.parametrize("quantity", ["velocity", "acceleration"])
def test_so_do_their_rates(campaign, day, quantity):
    for j, name in enumerate(day.world.names):
        came = campaign.covariates[f"{quantity}.{name}"]
        np.testing.assert_allclose(came, getattr(day, quantity)[ROWS, j], atol=1e-6)


def test_so_do_what_was_measured_and_what_the_file_declares(campaign, measured):
    np.testing.assert_allclose(campaign.position, measured.position, atol=1e-9)
    np.testing.assert_allclose(campaign.target, INSTRUMENT.declared, atol=1e-9)
    np.testing.assert_allclose(campaign.noise_position, INSTRUMENT.noise, atol=1e-9)
    np.testing.assert_allclose(campaign.payload_com, [0.0, 0.0, 0.05])


def test_the_payload_hangs_where_the_world_has_it(campaign, rail):
    """The file's centre of mass and the world's are one."""
    q, load = np.full((1, 6), 0.25), np.array([3.0])
    there, here = World(rail.urdf, "tip", tuple(campaign.payload_com)), World(rail.urdf, "tip")
    np.testing.assert_allclose(
        here.poses(q, load, here.sound(1))[1], there.poses(q, load, there.sound(1))[1], atol=1e-12
    )


def test_a_sound_arm_on_rails_is_where_the_program_has_it(rail, day, tmp_path):
    seen, turned = place(day, [], INSTRUMENT.target, INSTRUMENT.pose)
    exact = Measured(seen[ROWS], quaternion(turned[ROWS]), [])
    write_folder(tmp_path, Case("c1", 1, "single", rail), day, exact, ROWS, OTHERS, INSTRUMENT)
    campaign = read_campaign(tmp_path)
    poses = tool_poses(campaign.robot, campaign.q)
    expected = poses[:, :3, :3] @ INSTRUMENT.target + poses[:, :3, 3]
    np.testing.assert_allclose(campaign.position, expected, atol=1e-8)
    assert np.ptp(campaign.position, axis=0).min() > 0.1


def test_the_rows_to_predict_have_the_same_columns_and_no_answer(folder):
    given, asked = (pd.read_csv(folder / f"{name}.csv") for name in ("measurements", "fresh"))
    assert set(given) - set(asked) == {"x", "y", "z", "qw", "qx", "qy", "qz"}
    assert not set(asked) - set(given)
    assert (len(given), len(asked)) == (12, 8)


def test_a_hidden_column_and_its_siblings_are_in_neither_file(rail, day, measured, tmp_path):
    case = Case("c1", 1, "hidden", rail, hidden=("temperature", "time"))
    write_folder(tmp_path, case, day, measured, ROWS, OTHERS, INSTRUMENT)
    for name in ("measurements", "fresh"):
        stems = {column.split(".")[0] for column in pd.read_csv(tmp_path / f"{name}.csv")}
        assert not stems & {"temperature", "time"}
        assert {"payload", "approach", "slide"} <= stems


def test_ratios_and_labels_are_declared(campaign, day):
    assert campaign.gears == {"slide": 80.0}
    same = campaign.labels["pose"][:, None] == campaign.labels["pose"]
    np.testing.assert_array_equal(same, day.pose[ROWS, None] == day.pose[ROWS])


@pytest.mark.parametrize("sensor", ["robot", "air", "links"])
def test_only_a_sensor_on_each_link_gives_a_column_a_link(rail, sensor):
    day = draw_setting(World(rail.urdf, "tip"), 8, np.random.default_rng(4), sensor=sensor)
    own = {name for name in conditions(day) if name.startswith("temperature.")}
    assert own == ({f"temperature.{link}" for link in day.world.links} if sensor == "links" else set())


def test_without_a_stated_noise_the_file_says_nothing_of_it(rail, day, measured, tmp_path):
    write_folder(
        tmp_path, Case("c1", 1, "single", rail), day, measured, ROWS, OTHERS, replace(INSTRUMENT, stated=False)
    )
    assert read_campaign(tmp_path).noise_position is None
