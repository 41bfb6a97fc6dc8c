"""What the data alone say of an effect: least squares, scattering about the truth whether it was found or not."""

import numpy as np
import pytest
from fleet.robots import ONLY

import thermal_robot as tr
from thermal_robot.fleet import settings
from thermal_robot.fleet.rows import _free


def diagnosed(robot, effects, seed, **options):
    frames = {"base_known": False, "tool_known": False}
    campaign = tr.simulate(robot, effects, rows=40, noise=20e-6, seed=seed, **frames)
    return tr.diagnose(campaign, **{"only": ONLY, **options})


@pytest.mark.parametrize("effects", [{}, {"backlash": {"joint_2": 4e-4}}], ids=["nothing found", "one found"])
def test_it_is_least_squares_beside_what_was_found(rv_m2, effects):
    """Against a dense solution with a row for each prior; the frames and the effect in question have none."""
    fit = diagnosed(rv_m2, effects, 3, only=["backlash", "joint_gain"]).fit
    e, name = fit.explanation, "joint_gain"
    own, others = fit.blocks_of(name)[0], [b for b in e.best.blocks if fit.families[b] != name]
    assert [fit.families[b] for b in others] == list(effects)
    assert fit.probability("backlash") < settings.MAY_BE or effects
    blocks = [e.linear.blocks[b] for b in (own, *others)]
    root = np.sqrt(e.whitening.weights)[:, None, None] / (e.whitening.sigma()[:, :, None] * e.best.noise)
    columns = np.concatenate([e.linear.frames, *(b.columns for b in blocks)], axis=2) * root
    columns = columns.reshape(-1, columns.shape[2])
    gap = (e.linear.gap[:, :, None] * root).ravel()
    flat, width = e.linear.frames.shape[2], len(blocks[0].sizes)
    prior = np.concatenate([np.full(flat + width, np.inf), *(e.held(b) for b in others)])
    whole = np.vstack([columns, np.diag(1.0 / prior)])
    size = np.concatenate([1e-3 * np.ones(flat), *(b.sizes for b in blocks)])
    inverse = np.linalg.pinv(
        whole * size, rcond=1e-5
    )  # the last joint turns about the target: next to nothing is seen of its gain
    answer = size * (inverse @ np.append(gap, np.zeros(len(prior))))
    spread = size * np.sqrt((inverse**2).sum(axis=1))
    names = [p.name for p in blocks[0].parameters]
    found = _free(fit)[name]
    assert found
    for parameter in found:
        k = flat + names.index(parameter.name)
        assert parameter.value == pytest.approx(answer[k], abs=1e-4 * spread[k])
        assert parameter.std == pytest.approx(spread[k], rel=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("size", [0.0, 6e-5], ids=["absent", "found in some"])
def test_it_scatters_about_the_truth_by_its_deviation(rv_m2, size):
    off, found = [], []
    for seed in range(24):
        diagnosis = diagnosed(rv_m2, {"backlash": {"joint_2": size}}, seed)
        found.append("backlash" in diagnosis.verdict)
        for parameter in _free(diagnosis.fit, ["backlash"])["backlash"]:
            true = size if parameter.name == "lost motion, joint_2" else 0.0
            off.append((parameter.value - true) / parameter.std)
    assert any(found) == (size > 0.0)
    assert not all(found)
    assert len(off) >= 48
    assert np.mean(off) == pytest.approx(0.0, abs=4.0 / np.sqrt(len(off)))
    assert np.sqrt(np.mean(np.square(off))) == pytest.approx(1.0, abs=0.2)


def test_what_the_data_do_not_see_has_no_value(rv_m2):
    """The zero of joint 1 is the direction of the base."""
    found = _free(diagnosed(rv_m2, {}, 0).fit)["joint_offset"]
    assert found
    assert "zero offset, joint_1" not in [parameter.name for parameter in found]


def test_an_effect_that_was_found_in_one_joint_is_told_in_all(rv_m2):
    """Else no robot could stand out by a fault of its own of the kind that all have."""
    found = diagnosed(rv_m2, {"backlash": {"joint_2": 6e-4}}, 4)
    assert {place.name for place in found.finding("backlash").locations if place.share > 0.0} == {"joint_2"}
    told = {p.name: p for p in _free(found.fit)["backlash"]}
    others = [p for name, p in told.items() if "joint_2" not in name]
    assert len(others) >= 3
    assert abs(told["lost motion, joint_2"].value - 6e-4) < 4.0 * told["lost motion, joint_2"].std
    assert all(abs(p.value) < 4.0 * p.std for p in others)
