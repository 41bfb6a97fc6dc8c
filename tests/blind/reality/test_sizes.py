"""How large a fault is, and what of it another could have done as well."""

import numpy as np
import pytest

pytest.importorskip("mujoco", reason='the blind trial needs "thermal-robot[blind]"')

from thermal_robot.blind.reality import FAULTS, UNLISTED, sizes
from thermal_robot.blind.reality.fault import Fault, joints
from thermal_robot.blind.reality.setting import draw_setting
from thermal_robot.blind.reality.sizes import Gauge, Unseen, place, shares, sized
from thermal_robot.blind.reality.world import from_vector


@pytest.mark.parametrize("name", [*FAULTS, *UNLISTED])
def test_every_fault_moves_the_target_as_far_as_it_is_told(name, ur10):
    fault: Fault = {**FAULTS, **UNLISTED}[name]
    rng = np.random.default_rng(7)
    day = draw_setting(
        ur10,
        80,
        rng,
        moving="moving" in fault.wants,
        visits=(4, 4) if "repeats" in fault.wants else (1, 1),
        sensor="links",
        sessions="sessions" in fault.wants,
    )
    day.extra.update(humidity=45.0 + np.arange(80) / 8, motor_temperature=25.0 + np.arange(80) / 3.0)
    unknown = not {"base_known", "tool_known"} & set(fault.wants)
    gauge = Gauge(day, np.arange(80), np.array([0.02, 0.0, 0.1]), unknown, unknown)
    values = sized(gauge, fault, fault.draw(day, rng), 1e-4)
    assert gauge.rms(gauge.left(gauge.moved(fault, values))) == pytest.approx(1e-4, rel=0.05)
    # twice the size, twice the displacement: faults are small (an encoder's steps are not: they are chance)
    if name != "encoder_resolution":
        one, two = gauge.moved(fault, values), gauge.moved(fault, fault.scaled(values, 2.0))
        np.testing.assert_allclose(two, 2.0 * one, atol=0.02 * np.abs(two).max())
    np.testing.assert_allclose(gauge.moved(fault, fault.scaled(values, 0.0)), 0.0, atol=1e-14)


def test_no_single_other_effect_does_what_is_measured_beyond_it(gauge):
    """A joint's offset is geometry: nothing of it is beyond; a gain leaves little beyond harmonics, drift a lot."""
    offset, drift = np.zeros((6, 1)), np.zeros((1, 7))
    offset[2], drift[0] = 1e-3, (1e-4, 0, 0, 1e-4, 0, 0, 2400.0)
    moved = gauge.moved(FAULTS["joint_offset"], offset)
    assert gauge.beyond(FAULTS["joint_offset"], moved, ["geometric"])["geometric"] < 2e-3 * gauge.rms(moved)
    moved = gauge.moved(FAULTS["drift"], drift)
    beyond = gauge.beyond(FAULTS["drift"], moved, ["geometric", "backlash"])
    assert min(beyond.values()) > 0.5 * gauge.rms(gauge.left(moved))


def test_two_others_together_leave_no_more_than_either(gauge):
    rng = np.random.default_rng(3)
    fault = FAULTS["joint_gain"]
    moved = gauge.moved(fault, fault.draw(gauge.setting, rng))
    names = ["drift", "backlash", "thermal_elongation"]
    alone = gauge.beyond(fault, moved, names)
    pairs = gauge.beyond(fault, moved, names, together=2)
    assert len(pairs) == 3
    for pair, left in pairs.items():
        assert left <= min(alone[name] for name in pair.split(" with ")) + 1e-15
    assert max(alone.values()) <= gauge.rms(gauge.left(moved)) + 1e-15


def test_a_kind_of_fault_can_do_whatever_of_it_was_drawn(gauge):
    """To first order: springs, joints and frames lie in what their kind spans."""
    rng = np.random.default_rng(4)
    for name in ("joint_offset", "joint_gain", "geometric", "thermal_elongation", "instrument_scale"):
        fault = FAULTS[name]
        basis = gauge.basis(fault)
        np.testing.assert_allclose(basis.T @ basis, np.eye(basis.shape[1]), atol=1e-10)
        left = gauge.left(gauge.moved(fault, fault.draw(gauge.setting, rng)))
        assert gauge.rms(left - basis @ (basis.T @ left)) < 0.01 * gauge.rms(left), name


def test_alignment_takes_a_rigid_motion_and_a_shifted_target_away(setting, gauge):
    twist = 1e-5 * np.array([1.0, -2.0, 0.5, 1.0, 3.0, -1.0])
    motion = from_vector(twist[None])[0]
    target = gauge.target + 1e-5
    moved = (
        (setting.poses[:, :3, :3] @ target + setting.poses[:, :3, 3]) @ motion[:3, :3].T + motion[:3, 3] - gauge.sound
    )
    assert gauge.rms(moved.ravel()) > 1e-5
    assert gauge.rms(gauge.left(moved.ravel())) < 1e-8
    known = Gauge(setting, np.arange(setting.samples), gauge.target, False, False)
    np.testing.assert_array_equal(known.left(moved.ravel()), moved.ravel())


def test_what_frames_take_away_cannot_be_seen(gauge):
    nothing = Fault("nothing", lambda s, rng: np.ones((6, 1)), lambda *_: None, joints)
    with pytest.raises(Unseen, match="nothing cannot be seen"):
        sized(gauge, nothing, np.ones((6, 1)), 1e-4)


def test_places_come_with_what_each_does_alone_largest_first(gauge):
    values = np.zeros((6, 1))
    values[[1, 4], 0] = 1e-5, 1e-3
    found = shares(gauge, FAULTS["joint_gain"], values)
    assert [number for _, number, _ in found[:2]] == [4, 1]
    assert found[0][0] == ("joint", gauge.setting.world.names[4])
    sizes = [size for _, _, size in found]
    assert sizes == sorted(sizes, reverse=True)
    assert max(sizes[2:]) < 1e-12


@pytest.mark.parametrize(
    ("name", "day", "seen"),
    [
        ("tracking_lag", {}, False),
        ("tracking_lag", {"moving": True}, True),
        ("excess_repeatability", {}, False),
        ("excess_repeatability", {"visits": (4, 4)}, True),
        ("thermal_bending", {"sensor": "air"}, False),
        ("thermal_bending", {"sensor": "links"}, True),
        ("remounted_target", {}, False),
        ("remounted_target", {"sessions": True}, True),
        ("base_frame", {}, False),
        ("drift", {}, True),
    ],
)
def test_a_day_shows_what_it_has_the_conditions_for(name, day, seen, ur10):
    setting = draw_setting(ur10, 20, np.random.default_rng(1), **day)
    gauge = Gauge(setting, np.arange(20), np.zeros(3), True, True)
    assert sizes.testable({**FAULTS, **UNLISTED}[name], gauge) is seen


def test_faults_at_once_are_one_robot(setting, gauge):
    """Small as they are, two together move the target as far as one after the other; in any frame of the instrument."""
    rng = np.random.default_rng(9)
    pair = [(FAULTS[name], 0.1 * FAULTS[name].draw(setting, rng)) for name in ("joint_gain", "thermal_elongation")]
    alone = sum(gauge.moved(fault, values) for fault, values in pair)
    both = (place(setting, pair, gauge.target)[0] - gauge.sound).ravel()
    np.testing.assert_allclose(both, alone, atol=1e-3 * np.abs(both).max())
    pose = from_vector(np.array([[1.0, 2.0, 0.5, 0.2, -0.3, 1.0]]))[0]
    seen, turned = place(setting, pair, gauge.target, pose)
    np.testing.assert_allclose(seen, place(setting, pair, gauge.target)[0] @ pose[:3, :3].T + pose[:3, 3], atol=1e-12)
    np.testing.assert_allclose(turned.transpose(0, 2, 1) @ turned, np.tile(np.eye(3), (90, 1, 1)), atol=1e-12)
