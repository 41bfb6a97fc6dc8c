"""How large a change is: deviations are those of a fit to noise, whoever fits."""

import numpy as np
import pytest

pytest.importorskip("mujoco", reason='the blind trial needs "thermal-robot[blind]"')

from thermal_robot.blind.reality import FAULTS
from thermal_robot.blind.reality.sizes import GROWS_ONLY, Spot, Unseen, deviation, draw_spot

OFFSET, GAIN, PLAY = FAULTS["joint_offset"], FAULTS["joint_gain"], FAULTS["backlash"]
NOISE = 2e-5


def zeros(setting, fault):
    return np.zeros_like(fault.draw(setting, np.random.default_rng(0)))


def test_the_deviation_is_how_far_fits_to_noise_scatter(setting, gauge):
    """Displacements by the whole reality instead of slopes, least squares instead of projections, drawn noise."""
    gains = zeros(setting, GAIN)
    gains[2] = 1e-3
    sizes = np.diag(np.full(setting.world.n, 1e-5))
    columns = [gauge.moved(OFFSET, row[:, None]) / 1e-5 for row in sizes]
    columns.append(gauge.moved(GAIN, 1e-2 * gains) / 1e-5)
    design = np.column_stack([gauge.frames, *columns])
    chance = np.random.default_rng(5).normal(size=(len(design), 4000))
    # the first and the last zero are the frames': the shortest solution leaves the others as they are
    fitted = np.linalg.lstsq(design, NOISE * chance, rcond=1e-8)[0]
    number = gauge.frames.shape[1] + 3
    std, _ = deviation(gauge, Spot(OFFSET, 3), zeros(setting, OFFSET), [(GAIN, gains)], NOISE)
    assert np.std(fitted[number]) == pytest.approx(std, rel=0.05)


def test_what_else_is_at_work_makes_a_number_harder_to_tell_and_what_is_not_does_not(setting, gauge):
    gains = zeros(setting, GAIN)
    alone, _ = deviation(gauge, Spot(OFFSET, 3), zeros(setting, OFFSET), [], NOISE)
    assert deviation(gauge, Spot(OFFSET, 3), zeros(setting, OFFSET), [(GAIN, gains)], NOISE)[0] == pytest.approx(alone)
    gains[3] = 1e-3
    assert deviation(gauge, Spot(OFFSET, 3), zeros(setting, OFFSET), [(GAIN, gains)], NOISE)[0] > 1.001 * alone
    assert deviation(gauge, Spot(OFFSET, 3), zeros(setting, OFFSET), [], 2 * NOISE)[0] == pytest.approx(2 * alone)


def test_what_frames_take_up_is_not_asked_for(setting, gauge):
    with pytest.raises(Unseen, match="joint_offset"):
        deviation(gauge, Spot(OFFSET, 0), zeros(setting, OFFSET), [], NOISE)
    drawn = {draw_spot(OFFSET, zeros(setting, OFFSET), np.random.default_rng(k)).number for k in range(60)}
    assert drawn == set(range(1, setting.world.n - 1))


def test_a_place_is_one_where_the_fault_is_at_work(setting):
    values = zeros(setting, PLAY)
    values[[0, 4], 0] = 2e-4
    drawn = {draw_spot(PLAY, values, np.random.default_rng(k)).number for k in range(40)}
    assert drawn == {0, 4}


@pytest.mark.parametrize("name", ["joint_offset", "joint_gain", "backlash", "joint_compliance"])
def test_a_change_has_the_name_and_the_size_of_what_formats_md_says(name, setting, gauge):
    fault = FAULTS[name]
    values, spot = fault.draw(setting, np.random.default_rng(1)), Spot(fault, 2)
    by = 1e-4 * (1.0 if name in GROWS_ONLY else -1.0)
    parameter, amount = spot.told(setting, values, by)
    joint = setting.world.names[2]
    assert parameter.endswith(f", {joint}")
    assert spot.named(setting)["place"] == {"kind": "joint", "name": joint}
    # the displacement that the amount stands for, in the convention of formats.md
    body = setting.world.sound(setting.samples)
    fault.act(body, setting, spot.moved(values, by))
    before = setting.world.sound(setting.samples)
    fault.act(before, setting, values)
    moved = body.joints[:, 2] - before.joints[:, 2] - (body.springs - before.springs)[2] * setting.torque[:, 2]
    held = np.abs(setting.torque[:, 2]) < 0.2 * values[2, 1] if name == "backlash" else np.ones(setting.samples, bool)
    unit = {
        "joint_offset": np.ones(setting.samples),
        "joint_gain": setting.q[:, 2],
        "backlash": -0.5 * setting.approach[:, 2],
        "joint_compliance": -setting.torque[:, 2],
    }[name]
    np.testing.assert_allclose(moved[held], amount * unit[held], rtol=1e-6, atol=1e-12)
