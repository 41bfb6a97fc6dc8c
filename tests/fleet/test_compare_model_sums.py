"""What a model file says is what its campaign said, in whatever setting and places the model has an effect."""

from dataclasses import replace

import numpy as np
import pytest
from compared import NOISE, diagnosed

import thermal_robot as tr
from thermal_robot.fleet.compare_sums import _parameters, candidates, known, sums, sums_of_model


def said(found, other):
    """What a campaign, and the model of its diagnosis, say beside another campaign, and the parameters' names."""
    fits = [found.fit, other.fit]
    listed = candidates([found, other], fits, ["a", "b"])
    model = known(found.model, "a")
    same = candidates([model, other], [model, other.fit], ["a", "b"])
    names = [f"{item.name}: {p.name}" for item in listed for p in item.told]
    assert set(names) >= {f"{item.name}: {p.name}" for item in same for p in item.told}
    return sums(found, found.fit, listed, 0), sums_of_model(model, listed_for(model, listed), 0), names


def listed_for(model, listed):
    """The same effects, with their responses at the poses of the model."""
    return [replace(item, parameters=(_parameters(item.effect, model), *item.parameters[1:])) for item in listed]


def seen(one, names, effect):
    own = [k for k, name in enumerate(names) if name.startswith(f"{effect}: ")]
    return one.matrix[np.ix_(own, own)], one.vector[own]


@pytest.mark.parametrize("times", [1.0, 5.0])
def test_it_is_what_the_rows_said_without_the_prior(times):
    """Where the noise is large, what was expected beforehand is a part of all that is known."""
    rows, model, names = said(diagnosed(1, noise=times * NOISE), diagnosed(2, frame="there", noise=2 * NOISE))
    matrix, vector = seen(model, names, "joint_offset")
    true, right = seen(rows, names, "joint_offset")
    np.testing.assert_allclose(matrix, true, atol=1e-4 * np.abs(true).max())
    np.testing.assert_allclose(vector, right, atol=1e-4 * np.abs(right).max())


def test_an_effect_in_one_joint_says_nothing_of_the_others():
    robot = tr.load_robot("builtin:rv_m2", "tool0")
    one = tr.diagnose(tr.simulate(robot, {"joint_gain": {"joint_3": 3e-3}}, rows=50, noise=NOISE, seed=1))
    ((effect, _),) = one.model.effects
    assert effect.places == ("joint_3",)
    _, model, names = said(one, diagnosed(2))
    told = dict(zip(names, np.diag(model.matrix), strict=True))
    gain = {name: value for name, value in told.items() if name.startswith("joint_gain")}
    assert gain.pop("joint_gain: gain error, joint_3") > 100.0
    assert max(gain.values()) < 1e-9 * told["joint_gain: gain error, joint_3"]
    # and its value is the model's own
    k = names.index("joint_gain: gain error, joint_3")
    size = next(i.sizes[[p.name for p in i.told].index("gain error, joint_3")] for i in _gains(one))
    assert model.vector[k] / model.matrix[k, k] * size == pytest.approx(3e-3, rel=0.05)


def _gains(found):
    listed = candidates([found, found], [found.fit, found.fit], ["a", "b"])
    return [item for item in listed if item.name == "joint_gain"]


@pytest.mark.slow
def test_geometry_is_told_in_the_parameters_of_a_diagnosis():
    robot = tr.load_robot("builtin:rv_m2", "tool0")
    names = [
        f"rotation {axis} of joint_{k}, {link}" for k, link in ((2, "shoulder"), (3, "upper_arm")) for axis in "xyz"
    ]
    bent = {"geometric": dict(zip(names, (4e-4, -6e-4, 5e-4, 3e-4, -5e-4, 6e-4), strict=True))}
    found = tr.diagnose(tr.simulate(robot, bent, rows=80, noise=NOISE, seed=4), only=["geometric"])
    assert found.verdict == ("geometric",)
    both = tr.compare(found.model, found, names=["file", "rows"])
    assert both.changes == ()
    for p in both.effect("geometric").parameters:
        if p.difference is not None:
            assert abs(p.difference) < 0.02 * p.std


def test_a_model_without_effects_says_nothing():
    sound = tr.diagnose(
        tr.simulate("builtin:rv_m2", tool_frame="tool0", rows=40, noise=NOISE, seed=2), only="joint_gain"
    )
    assert sound.model.effects == ()
    _, model, _ = said(sound, diagnosed(1))
    assert not model.matrix.any()
    assert not model.vector.any()
