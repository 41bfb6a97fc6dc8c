"""The instrument scatters as it says, spoils what it says, and its frames can be found again."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mujoco", reason='the blind trial needs "thermal-robot[blind]"')

from scipy.spatial.transform import Rotation
from scipy.stats import kurtosis

from thermal_robot.blind.reality.instrument import Instrument, Measured, measure, registered
from thermal_robot.blind.reality.sizes import place
from thermal_robot.blind.reality.world import anywhere, from_vector

NOISE = 2e-5


@pytest.fixture(scope="module")
def instrument():
    target = np.array([0.01, -0.02, 0.1])
    pose = anywhere(np.random.default_rng(1), 3.0)
    return Instrument(pose, target, target + 0.005, NOISE, turning=3e-5)


@pytest.fixture(scope="module")
def seen(setting, instrument):
    return place(setting, [], instrument.target, instrument.pose)


def errors(setting, seen, instrument, days=120):
    """(days, N, 3) over the noise."""
    rows, rng = np.arange(setting.samples), np.random.default_rng(2)
    return np.array([measure(*seen, rows, instrument, rng).position - seen[0] for _ in range(days)]) / NOISE


@pytest.mark.parametrize("tails", [np.inf, 7.0, 5.0])
def test_noise_is_as_large_as_it_says_whatever_its_tails(setting, seen, instrument, tails):
    scatter = errors(setting, seen, replace(instrument, tails=tails))
    assert scatter.mean() == pytest.approx(0.0, abs=4.5 / np.sqrt(scatter.size))
    assert scatter.std() == pytest.approx(1.0, rel=0.03)
    assert bool(kurtosis(scatter.ravel()) > 0.5) is bool(np.isfinite(tails))


def test_tails_are_heavier_with_fewer_degrees_of_freedom(setting, seen, instrument):
    beyond = [(np.abs(errors(setting, seen, replace(instrument, tails=t))) > 4.0).mean() for t in (3.0, 8.0, np.inf)]
    assert beyond[0] > 2.0 * beyond[1] > 4.0 * beyond[2]


def test_orientations_scatter_about_all_axes_alike(setting, seen, instrument):
    rows, rng = np.arange(setting.samples), np.random.default_rng(2)
    found = [measure(*seen, rows, instrument, rng).quaternion for _ in range(40)]
    turns = (
        Rotation.from_quat(np.roll(found, -1, axis=2).reshape(-1, 4))
        * Rotation.from_matrix(np.tile(seen[1], (40, 1, 1))).inv()
    )
    np.testing.assert_allclose(turns.as_rotvec().std(axis=0), 3e-5, rtol=0.06)
    bare = measure(*seen, rows, replace(instrument, turning=None), rng)
    assert bare.quaternion is None


def test_spoilt_rows_are_those_that_are_named_as_an_editor_counts_them(setting, seen, instrument):
    rows = np.arange(setting.samples)[::-1]
    given = measure(*seen, rows, replace(instrument, spoilt=0.3), np.random.default_rng(3))
    off = np.linalg.norm(given.position - seen[0][rows], axis=1) > 8.0 * NOISE
    named = np.array(given.spoilt) - 2
    assert set(np.flatnonzero(off)) <= set(named)
    assert off[named].mean() > 0.9
    assert 0.1 < len(named) / len(rows) < 0.5


def test_the_frames_of_a_sound_robot_are_found_from_exact_positions(setting, seen, instrument):
    rows = np.arange(0, setting.samples, 2)
    exact = Measured(seen[0][rows], None, [])
    np.testing.assert_allclose(registered(setting, exact, rows, instrument), seen[0], atol=1e-11)


def test_a_spoilt_row_does_not_move_them(setting, seen, instrument):
    rows = np.arange(setting.samples)
    wrong = seen[0].copy()
    wrong[[4, 40]] += 1e-2
    np.testing.assert_allclose(
        registered(setting, Measured(wrong, None, [6, 42]), rows, instrument), seen[0], atol=1e-11
    )
    assert np.abs(registered(setting, Measured(wrong, None, []), rows, instrument) - seen[0]).max() > 1e-5


def test_what_is_declared_known_is_left_as_it_is(setting, seen, instrument):
    rows = np.arange(setting.samples)
    known = replace(instrument, base_known=True, tool_known=True)
    shifted = Measured(seen[0] + 1e-3, None, [])
    poses = instrument.pose @ setting.poses
    declared = poses[:, :3, :3] @ instrument.declared + poses[:, :3, 3]
    np.testing.assert_allclose(registered(setting, shifted, rows, known), declared, atol=1e-12)
    freed = registered(setting, shifted, rows, replace(instrument, tool_known=True))
    assert np.linalg.norm(freed - declared, axis=1).mean() > 1e-4


def test_registration_leaves_least_squares(setting, seen, instrument):
    """No small motion of the frames makes the sum of squares smaller."""
    rows = np.arange(setting.samples)
    bent = seen[0] + 1e-4 * np.sin(np.arange(3.0 * len(rows)).reshape(-1, 3))
    at = registered(setting, Measured(bent, None, []), rows, instrument)
    best = np.sum((at - bent) ** 2)
    for twist in 1e-5 * np.vstack([np.eye(6), -np.eye(6)]):
        motion = from_vector(twist[None])[0]
        assert np.sum((at @ motion[:3, :3].T + motion[:3, 3] - bent) ** 2) > best
