"""The instrument scatters as it says, its frames can be found again, and its files say what was commanded."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

pytest.importorskip("mujoco", reason='the blind trial needs "thermal-robot[blind]"')

from conftest import AWKWARD
from scipy.spatial.transform import Rotation
from scipy.stats import kurtosis

from thermal_robot.blind.cases import Case
from thermal_robot.blind.plan import robots
from thermal_robot.blind.reality import World
from thermal_robot.blind.reality.instrument import Day, Instrument, conditions, measure, registered, write_folder
from thermal_robot.blind.reality.setting import draw_setting
from thermal_robot.blind.reality.sizes import place
from thermal_robot.blind.reality.world import anywhere, from_vector
from thermal_robot.campaign import read_campaign
from thermal_robot.kinematics import tool_poses

NOISE = 2e-5
TARGET = np.array([0.01, -0.02, 0.1])
XYZ, TURNED = ["x", "y", "z"], ["qx", "qy", "qz", "qw"]


@pytest.fixture(scope="module")
def day(setting):
    return Day(
        setting, Instrument(anywhere(np.random.default_rng(1), 3.0), TARGET, TARGET + 0.005, NOISE, turning=3e-5)
    )


@pytest.fixture(scope="module")
def seen(day):
    return place(day.setting, [], TARGET, day.instrument.pose)


def other(day, **changed):
    return Day(day.setting, replace(day.instrument, **changed))


def errors(day, seen, days=120):
    """(days, N, 3) over the noise."""
    rng = np.random.default_rng(2)
    return np.array([measure(day, [], rng)[1][XYZ] - seen[0] for _ in range(days)]) / NOISE


@pytest.mark.parametrize("tails", [np.inf, 7.0, 5.0])
def test_noise_is_as_large_as_it_says_whatever_its_tails(day, seen, tails):
    scatter = errors(other(day, tails=tails), seen)
    assert scatter.mean() == pytest.approx(0.0, abs=4.5 / np.sqrt(scatter.size))
    assert scatter.std() == pytest.approx(1.0, rel=0.03)
    assert bool(kurtosis(scatter.ravel()) > 0.5) is bool(np.isfinite(tails))


@pytest.mark.slow
def test_tails_are_heavier_with_fewer_degrees_of_freedom(day, seen):
    beyond = [(np.abs(errors(other(day, tails=t), seen)) > 4.0).mean() for t in (3.0, 8.0, np.inf)]
    assert beyond[0] > 2.0 * beyond[1] > 4.0 * beyond[2]


def test_orientations_scatter_about_all_axes_alike(day, seen):
    rng = np.random.default_rng(2)
    found = np.concatenate([measure(day, [], rng)[1][TURNED] for _ in range(40)])
    turns = Rotation.from_quat(found) * Rotation.from_matrix(np.tile(seen[1], (40, 1, 1))).inv()
    np.testing.assert_allclose(turns.as_rotvec().std(axis=0), 3e-5, rtol=0.06)
    assert list(measure(other(day, turning=None), [], rng)[1]) == XYZ


def test_spoilt_rows_are_those_that_are_named_as_an_editor_counts_them(day, seen):
    true, measured, spoilt = measure(other(day, spoilt=0.3), [], np.random.default_rng(3))
    np.testing.assert_array_equal(true, seen[0])
    off = np.linalg.norm(measured[XYZ] - seen[0], axis=1) > 8.0 * NOISE
    named = np.array(spoilt) - 2
    assert set(np.flatnonzero(off)) <= set(named)
    assert off[named].mean() > 0.9
    assert 0.1 < len(named) / len(off) < 0.5


def test_the_frames_of_a_sound_robot_are_found_from_half_the_rows_and_spoilt_ones_do_not_move_them(day, seen):
    given = np.arange(day.setting.samples) % 2 == 0
    half = Day(replace(day.setting, given=given), day.instrument)
    np.testing.assert_allclose(registered(half, seen[0][given], []), seen[0], atol=1e-11)
    wrong = seen[0].copy()
    wrong[[4, 40]] += 1e-2
    np.testing.assert_allclose(registered(day, wrong, [6, 42]), seen[0], atol=1e-11)
    assert np.abs(registered(day, wrong, []) - seen[0]).max() > 1e-5


def test_what_is_declared_known_is_left_as_it_is(day, seen):
    poses = day.instrument.pose @ day.setting.poses
    declared = poses[:, :3, :3] @ day.instrument.declared + poses[:, :3, 3]
    known = registered(other(day, base_known=True, tool_known=True), seen[0] + 1e-3, [])
    np.testing.assert_allclose(known, declared, atol=1e-12)
    freed = registered(other(day, tool_known=True), seen[0] + 1e-3, [])
    assert np.linalg.norm(freed - declared, axis=1).mean() > 1e-4


def test_registration_leaves_least_squares(day, seen):
    """No small motion of the frames makes the sum of squares smaller."""
    bent = seen[0] + 1e-4 * np.sin(np.arange(float(seen[0].size)).reshape(-1, 3))
    at = registered(day, bent, [])
    best = np.sum((at - bent) ** 2)
    for twist in 1e-5 * np.vstack([np.eye(6), -np.eye(6)]):
        motion = from_vector(twist[None])[0]
        assert np.sum((at @ motion[:3, :3].T + motion[:3, 3] - bent) ** 2) > best


# ---- files, of an arm with three prismatic joints among its revolute ones


@pytest.fixture(scope="module")
def rail():
    return robots([("rail", AWKWARD, "tip")])[0]


@pytest.fixture(scope="module")
def rails(rail):
    setting = draw_setting(
        World(rail.urdf, "tip"), 12, np.random.default_rng(2), fresh=8, moving=True, sensor="links", visits=(4, 4)
    )
    declared = np.array([0.012, -0.021, 0.083])
    return Day(setting, Instrument(np.eye(4), TARGET, declared, NOISE, tool_known=True, turning=3e-5))


@pytest.fixture(scope="module")
def measured(rails):
    exact, turned = place(rails.setting, [], TARGET)
    rows = rails.rows
    quaternions = Rotation.from_matrix(turned[rows]).as_quat()
    return pd.DataFrame(np.hstack([exact[rows], quaternions]), columns=[*XYZ, *TURNED])


@pytest.fixture(scope="module")
def folder(rail, rails, measured, tmp_path_factory):
    where = tmp_path_factory.mktemp("campaign")
    write_folder(where, Case("c1", 1, "single", rail, hidden=("payload",)), rails, measured, {"slide": 80.0})
    return where


@pytest.fixture(scope="module")
def campaign(folder):
    return read_campaign(folder)


def test_what_was_commanded_and_measured_comes_back_as_it_was(campaign, rails, measured):
    setting, rows = rails.setting, rails.rows
    np.testing.assert_allclose(campaign.q, setting.q[rows], atol=1e-9)
    for quantity in ("velocity", "acceleration"):
        came = np.column_stack([campaign.covariates[f"{quantity}.{name}"] for name in setting.world.names])
        np.testing.assert_allclose(came, getattr(setting, quantity)[rows], atol=1e-6)
    np.testing.assert_allclose(campaign.position, measured[XYZ], atol=1e-9)
    np.testing.assert_allclose(campaign.target, rails.instrument.declared, atol=1e-9)
    assert campaign.noise_position == pytest.approx(NOISE, abs=1e-9)
    np.testing.assert_allclose(campaign.payload_com, [0.0, 0.0, 0.05])
    assert campaign.gears == {"slide": 80.0}
    same = campaign.labels["pose"][:, None] == campaign.labels["pose"]
    np.testing.assert_array_equal(same, setting.pose[rows, None] == setting.pose[rows])


def test_a_sound_arm_on_rails_is_where_the_program_has_it(campaign):
    poses = tool_poses(campaign.robot, campaign.q)
    np.testing.assert_allclose(campaign.position, poses[:, :3, :3] @ TARGET + poses[:, :3, 3], atol=1e-8)
    turned = Rotation.from_quat(np.roll(campaign.orientation, -1, axis=1)).as_matrix()
    np.testing.assert_allclose(turned, poses[:, :3, :3], atol=1e-8)
    assert np.ptp(campaign.position, axis=0).min() > 0.1


def test_the_payload_hangs_where_the_world_has_it(campaign, rail):
    q, load = np.full((1, 6), 0.25), np.array([3.0])
    there, here = World(rail.urdf, "tip", tuple(campaign.payload_com)), World(rail.urdf, "tip")
    torques = [world.poses(q, load, world.sound(1))[1] for world in (there, here)]
    np.testing.assert_allclose(*torques, atol=1e-12)


def test_the_rows_to_predict_have_the_same_columns_and_no_answer(folder):
    given, asked = (pd.read_csv(folder / f"{name}.csv") for name in ("measurements", "fresh"))
    assert set(given) - set(asked) == {"x", "y", "z", "qw", "qx", "qy", "qz"}
    assert not set(asked) - set(given)
    assert (len(given), len(asked)) == (12, 8)
    assert "payload" not in given


@pytest.mark.parametrize("sensor", ["robot", "air", "links"])
def test_only_a_sensor_on_each_link_gives_a_column_a_link(rails, sensor):
    setting = replace(rails.setting, sensor=sensor)
    own = {name for name in conditions(setting) if name.startswith("temperature.")}
    assert own == ({f"temperature.{link}" for link in setting.world.links} if sensor == "links" else set())


def test_without_a_stated_noise_the_file_says_nothing_of_it(rail, rails, measured, tmp_path):
    quiet = Day(rails.setting, replace(rails.instrument, stated=False))
    write_folder(tmp_path, Case("c1", 1, "single", rail), quiet, measured)
    assert read_campaign(tmp_path).noise_position is None
