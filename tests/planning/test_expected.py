"""What is expected of an effect is what happens: fits of campaigns simulated at the planned rows scatter so."""

import numpy as np
import pytest

from thermal_robot import observe
from thermal_robot.effects import library
from thermal_robot.effects.apply import displacement
from thermal_robot.kinematics import exp3
from thermal_robot.observations import Frames
from thermal_robot.planning import plan
from thermal_robot.planning.plan import FRAMES

TARGET = (0.05, 0.03, 0.1)
NOISE = 20e-6
DRAWS = 150


def moved(twist):
    """A small motion (6,), m and rad."""
    pose = np.eye(4)
    pose[:3, :3] = exp3(np.asarray(twist[3:])[None])[0]
    pose[:3, 3] = twist[:3]
    return pose


def places(commands, effect, values, base, tool):
    """(3 N,) where the exact displaced kinematics take the target, with frames that are a little off."""
    declared = Frames.declared(commands)
    shifted = declared.tool.copy()
    shifted[:3, 3] += tool
    frames = Frames(moved(base), shifted)
    chain, instrument = displacement(observe(commands, frames), [(effect, values)])
    place = observe(commands, frames, displacement=chain).predicted_position
    return (place if instrument is None else place + instrument).ravel()


def fitted_errors(commands, effect, sizes, rng):
    """(DRAWS, P) errors of least squares with the sizes as prior; base and tool are fitted, too, without one."""
    count = len(sizes)

    def at(x):
        return places(commands, effect, x[:count], x[count : count + 6], x[count + 6 :])

    steps = np.concatenate([0.1 * sizes, np.full(9, 1e-5)])
    none = at(np.zeros(count + 9))
    slope = np.stack(
        [(at(s * e) - at(-s * e)) / (2.0 * s) for s, e in zip(steps, np.eye(count + 9), strict=True)], axis=1
    )
    held = np.hstack([np.diag(1.0 / sizes), np.zeros((count, 9))])
    whole = np.vstack([slope / NOISE, held])
    errors = []
    for _ in range(DRAWS):
        truth = np.concatenate([sizes * rng.normal(size=count), 1e-4 * rng.normal(size=9)])
        measured = at(truth) + NOISE * rng.normal(size=none.shape)
        asked = np.concatenate([(measured - none) / NOISE, np.zeros(count)])
        errors.append(np.linalg.lstsq(whole, asked, rcond=None)[0][:count] - truth[:count])
    return np.array(errors)


@pytest.mark.parametrize("name", ["joint_offset", "joint_gain", "backlash", "thermal_elongation", "joint_compliance"])
def test_fits_scatter_as_expected(rv_m2, name):
    found = plan(rv_m2, 60, [name], target=TARGET, seed=3)
    parameters = found.effect(name).parameters
    effect = library()[name].variants(observe(found.commands))[0]
    sizes = np.array([p.size for p in parameters])
    errors = fitted_errors(found.commands, effect, sizes, np.random.default_rng(11))
    told = np.array([p.told for p in parameters])
    assert told.sum() >= 2
    expected = np.array([p.sigma for p in parameters])
    ratio = np.sqrt((errors**2).mean(axis=0)) / expected
    # 150 draws tell a deviation to 1 / √300 = 6 %: four of these, as five to ten parameters are asked at once
    assert np.all((ratio[told] > 0.75) & (ratio[told] < 1.25))
    assert np.all(ratio < 1.3)


def test_the_first_joints_offset_is_the_bases(rv_m2):
    unknown, known = (
        plan(rv_m2, 40, ["joint_offset"], target=TARGET, base_known=base).effect("joint_offset")
        for base in (False, True)
    )
    assert FRAMES in unknown.confounded
    first, second = unknown.parameters[:2]
    assert first.place == "joint_1"
    assert not first.told
    assert first.sigma > 0.99 * first.size
    assert second.told
    assert known.parameters[0].told


def test_the_last_joint_is_seen_off_its_axis_only(rv_m2):
    on, off = (
        plan(rv_m2, 40, ["joint_gain"], target=t).effect("joint_gain").parameters[-1] for t in ((0, 0, 0), TARGET)
    )
    assert not on.told
    assert off.told


def test_orientation_helps(rv_m2):
    plain, turned = (plan(rv_m2, 40, ["joint_gain"], target=TARGET, orientation=o) for o in (False, True))
    before, after = (each.effect("joint_gain").parameters for each in (plain, turned))
    assert sum(p.sigma for p in after) < 0.9 * sum(p.sigma for p in before)


def test_beside_others_nothing_is_known_better(planned):
    for expected in planned.effects:
        for p in expected.parameters:
            assert p.sigma <= p.beside * (1 + 1e-6)
            assert p.beside <= p.size * (1 + 1e-6)


def test_offsets_are_confounded_with_the_geometry_that_contains_them(planned):
    assert "geometric" in planned.effect("joint_offset").confounded
    assert "joint_offset" not in planned.effect("backlash").confounded
