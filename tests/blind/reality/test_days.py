"""Another day: other poses, another place of instrument and target; noise and what is recorded stay."""

import numpy as np
import pytest

pytest.importorskip("mujoco", reason='the blind trial needs "thermal-robot[blind]"')

from thermal_robot.blind.cases import Case
from thermal_robot.blind.plan import robots
from thermal_robot.blind.reality.campaign import draw_day, draw_habits, write_day
from thermal_robot.blind.reality.world import World
from thermal_robot.campaign import read_campaign


@pytest.fixture(scope="module")
def days():
    case = Case("s1", 0, "same", robots([("rv_m2", "builtin:rv_m2", "tool0")])[0], samples=(30, 60))
    rng = np.random.default_rng(8)
    habits = draw_habits(rng)
    world = World(case.robot.urdf, "tool0")
    return case, habits, [draw_day(case, world, habits, rng) for _ in range(4)]


def test_days_differ_in_all_but_the_habits(days):
    _, habits, drawn = days
    for day in drawn:
        assert (day.instrument.noise, day.instrument.stated) == (habits.noise, habits.stated)
        assert day.setting.sensor == habits.sensor
        assert day.setting.given.all()
        assert (day.instrument.base_known, day.instrument.tool_known, day.instrument.turning) == (False, False, None)
    assert len({day.setting.samples for day in drawn}) > 1
    targets = np.array([day.instrument.target for day in drawn])
    assert len(np.unique(targets[:, 0])) == 4
    assert len({tuple(day.instrument.pose[:3, 3]) for day in drawn}) == 4


def test_a_sound_robot_leaves_noise_alone(days, tmp_path):
    """Distances between poses are those of the sound robot, wherever instrument and target are."""
    case, habits, drawn = days
    _, measured = write_day(tmp_path, case, drawn[0], [], np.random.default_rng(1))
    campaign = read_campaign(tmp_path)
    assert campaign.samples == len(measured.position) == drawn[0].setting.samples
    assert not (tmp_path / "fresh.csv").exists()
    apart = np.linalg.norm(np.diff(campaign.position, axis=0), axis=1)
    true = np.linalg.norm(np.diff(drawn[0].gauge.sound, axis=0), axis=1)
    # a few rows may be spoilt; of the others a distance along one line has √2 times the noise
    assert np.median(np.abs(apart - true)) < 2.0 * habits.noise
    assert np.median(np.abs(apart - true)) > 0.3 * habits.noise
