"""The effects of formats.md, as laws of what they do to the arm."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mujoco", reason='the blind trial needs "thermal-robot[blind]"')

from thermal_robot.blind.reality import FAULTS
from thermal_robot.blind.reality.sizes import place
from thermal_robot.blind.reality.world import from_vector, rpy_matrix
from thermal_robot.effects import library

TWIST = np.array([3e-4, -2e-4, 1e-4, 2e-4, 1e-4, -3e-4])


def settles(setting, body, constant):
    FAULTS["drift"].act(body, setting, np.append(TWIST, constant)[None])
    return body.base


def test_what_the_library_knows_the_reality_can_make():
    assert set(library()) <= set(FAULTS)
    assert all(name == fault.name for name, fault in FAULTS.items())


@pytest.mark.parametrize("constant", [600.0, 5e3, 7e4])
def test_drift_is_nothing_at_the_first_row_and_never_turns_back(setting, body, constant):
    base = settles(setting, body, constant)
    np.testing.assert_array_equal(base[0], np.eye(4))
    away = np.linalg.norm(base[:, :3, 3], axis=1)
    assert (np.diff(away) >= 0).all()
    assert (away <= np.linalg.norm(TWIST[:3]) * (1.0 + 1e-12)).all()


def test_it_slows_as_what_is_left_of_it_does(setting, body):
    """Newton's law: in equal times equal shares of the rest are made up, exp(−Δt/τ)."""
    constant = 2500.0
    rest = 1.0 - settles(setting, body, constant)[:, 0, 3] / TWIST[0]
    np.testing.assert_allclose(rest[1:] / rest[:-1], np.exp(-np.diff(setting.time) / constant), rtol=1e-6)


def test_a_floor_that_is_slow_drifts_steadily(setting, body):
    along = settles(setting, body, 1e3 * setting.time[-1])[:, 0, 3]
    np.testing.assert_allclose(along / along[-1], setting.time / setting.time[-1], atol=1e-3)


def test_stands_settle_in_minutes_to_a_day_and_no_two_alike(setting):
    rng = np.random.default_rng(8)
    drawn = np.array([FAULTS["drift"].draw(setting, rng)[0, 6] for _ in range(400)])
    assert 600.0 <= drawn.min() < 900.0
    assert 5e4 < drawn.max() <= 7.2e4
    assert len(np.unique(drawn)) == 400
    # no more of a campaign's length than of another time
    assert np.histogram(np.log(drawn), 8, np.log([600.0, 7.2e4]))[0].max() < 80


def test_links_grow_along_themselves(ur10, setting, gauge):
    """Tool displacement of growth equals the sum of segment vectors times their strain."""
    values = np.full((len(ur10.segments), 1), 12e-6)
    moved = place(setting, [(FAULTS["thermal_elongation"], values)], gauge.target)[0] - gauge.sound
    expected = np.zeros_like(moved)
    for s, k in enumerate(ur10.segments):
        chain = ur10.chain[: k + 1]
        start = np.tile(np.eye(4), (setting.samples, 1, 1))
        movable = 0
        for joint in chain[:-1]:
            step = from_vector(np.zeros((setting.samples, 6)))
            step[:, :3, :3], step[:, :3, 3] = rpy_matrix(joint.rpy), joint.xyz
            start = start @ step
            if joint.movable:
                turn = np.zeros((setting.samples, 6))
                turn[:, 3:] = joint.axis * setting.q[:, movable, None]
                start = start @ from_vector(turn)
                movable += 1
        strain = 12e-6 * (setting.links[:, s] - 20.0)
        expected += (start[:, :3, :3] @ chain[-1].xyz) * strain[:, None]
    np.testing.assert_allclose(moved, expected, atol=1e-10)
    assert np.abs(moved).max() > 50e-6


def test_a_soft_base_lets_its_load_sink_about_a_point_that_stays(setting, body):
    FAULTS["base_compliance"].act(body, setting, np.array([[1e-6, 2e-6, 0.7]]))
    below = np.array([0.0, 0.0, -0.7])
    np.testing.assert_allclose(body.base[:, :3, :3] @ below + body.base[:, :3, 3], np.tile(below, (90, 1)), atol=1e-6)
    # the centre of all that has weight goes down: gravity does work on each spring
    turned = (body.base[:, [2, 0], [1, 2]] - body.base[:, [1, 2], [2, 0]]) / 2.0
    assert (turned * setting.overturning[:, :2] >= -1e-15).all()
    np.testing.assert_allclose(turned, setting.overturning[:, :2] * [1e-6, 2e-6], rtol=1e-3, atol=1e-9)


def test_some_bases_turn_at_the_flange_and_some_below(setting):
    fault = FAULTS["base_compliance"]
    rng = np.random.default_rng(6)
    drawn = [fault.draw(setting, rng) for _ in range(40)]
    depths = np.array([values[0, 2] for values in drawn])
    assert (depths == 0.0).any()
    assert ((depths >= 0.0) & (depths <= 1.0)).all()
    assert {len(fault.known_as(setting, values)) for values in drawn} == {2, 4}


def test_a_link_as_warm_as_its_hall_does_not_bow(setting, gauge, body):
    values = np.full((len(setting.world.segments), 2), 1e-4)
    level = replace(setting, links=np.repeat(setting.air[:, None], setting.links.shape[1], axis=1))
    FAULTS["thermal_bending"].act(body, level, values)
    assert not body.bow.any()
    FAULTS["thermal_bending"].act(body, setting, values)
    warmer = (setting.links - setting.air[:, None])[:, :, None]
    np.testing.assert_array_equal(np.sign(body.bow), np.sign(warmer) * np.ones(2))


@pytest.mark.parametrize("name", ["joint_offset", "geometric", "base_frame", "tool_frame", "instrument_scale"])
def test_what_is_always_there_does_not_know_the_row(name, setting, gauge):
    """The same command measured later and carrying more is as far off."""
    rng = np.random.default_rng(2)
    fault = FAULTS[name]
    values = fault.draw(setting, rng)
    later = replace(setting, time=setting.time + 1e4, payload=setting.payload + 1.0, links=setting.links + 5.0)
    np.testing.assert_array_equal(
        place(setting, [(fault, values)], gauge.target)[0], place(later, [(fault, values)], gauge.target)[0]
    )


@pytest.mark.parametrize("name", ["joint_compliance", "link_compliance"])
def test_what_yields_yields_more_under_a_payload(name, setting, gauge):
    fault = FAULTS[name]
    values = np.full((len(fault.places(setting)), 2 if name == "link_compliance" else 1), 1e-6)
    bare, loaded = (replace(setting, payload=np.full(setting.samples, mass)) for mass in (0.0, 8.0))
    sinks = [
        np.linalg.norm(place(day, [(fault, values)], gauge.target)[0] - gauge.sound, axis=1) for day in (bare, loaded)
    ]
    assert (sinks[1] > sinks[0]).mean() > 0.95
    assert np.median(sinks[1]) > 1.1 * np.median(sinks[0])


def test_a_scale_is_about_the_instruments_origin(setting):
    pose = from_vector(np.array([[1.0, 2.0, 0.5, 0.2, -0.3, 1.0]]))[0]
    scaled = place(setting, [(FAULTS["instrument_scale"], np.array([[1e-3]]))], np.zeros(3), pose)[0]
    np.testing.assert_allclose(scaled, 1.001 * place(setting, [], np.zeros(3), pose)[0], rtol=1e-12)


def test_misplaced_frames_move_their_own_end(setting, gauge):
    base, tool = (place(setting, [(FAULTS[f"{end}_frame"], TWIST[None])], gauge.target)[0] for end in ("base", "tool"))
    motion = from_vector(TWIST[None])[0]
    np.testing.assert_allclose(base, gauge.sound @ motion[:3, :3].T + motion[:3, 3], atol=1e-12)
    shifted = motion[:3, :3] @ gauge.target + motion[:3, 3]
    turned = setting.poses[:, :3, :3]
    np.testing.assert_allclose(tool, turned @ shifted + setting.poses[:, :3, 3], atol=1e-12)


def test_one_time_in_three_it_is_one_bent_link(setting):
    rng = np.random.default_rng(5)
    draws = np.abs([FAULTS["geometric"].draw(setting, rng) for _ in range(300)]).max(axis=2)
    second, first = np.sort(draws, axis=1)[:, -2:].T
    assert 0.2 < (first > 3.0 * second).mean() < 0.45
