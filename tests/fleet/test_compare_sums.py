"""What a campaign or its model says: against least squares over its rows, and what frames take up."""

from dataclasses import replace

import numpy as np
import pytest
from compared import NOISE, diagnosed
from coupled import joint, link, urdf

import thermal_robot as tr
from thermal_robot.effects import named
from thermal_robot.fleet.compare_sums import Known, candidates, sums, told
from thermal_robot.observations import observe
from thermal_robot.robot import load_robot


@pytest.fixture(scope="module")
def days():
    return [diagnosed(1), diagnosed(2, frame="there", noise=2 * NOISE)]


@pytest.fixture(scope="module")
def listed(days):
    return candidates(days, [d.fit for d in days], ["a", "b"])


@pytest.fixture(scope="module")
def said(days, listed):
    return [sums(d, d.fit, listed, k) for k, d in enumerate(days)]


def names(listed):
    return [p.name for item in listed for p in item.told]


def test_what_an_unknown_frame_takes_up_is_not_said(said, listed):
    for one in said:
        own = dict(zip(names(listed), np.diag(one.matrix), strict=True))
        assert own["zero offset, joint_1"] < 1e-6 * own["zero offset, joint_2"]
        assert own["zero offset, joint_5"] < 1e-6 * own["zero offset, joint_2"]
    kept = [names(listed)[k] for k in told(said)]
    assert [name for name in kept if name.startswith("zero offset")] == [f"zero offset, joint_{k}" for k in (2, 3, 4)]


def test_it_is_least_squares_with_free_frames(said, listed, days):
    """The parameters that a campaign says are those of a fit by finite differences of its own robot."""
    fit = days[0].fit
    robot, q, frames = fit.campaign.robot, fit.campaign.q, fit.corrected.frames
    kept = ~fit.explanation.outliers

    def predicted(state):
        moved = q + np.pad(state[:3] * 1e-3, (1, 1))
        pose = robot.forward(moved)
        target = frames.tool[:3, 3] + state[3:6] * 1e-3
        point = pose[:, :3, 3] + pose[:, :3, :3] @ target
        turn = np.cross(state[6:9] * 1e-3, point) + state[9:12] * 1e-3
        return ((point + turn) @ frames.base[:3, :3].T + frames.base[:3, 3])[kept]

    state = np.zeros(12)
    weight = np.sqrt(fit.explanation.whitening.weights[kept])[:, None]
    for _ in range(4):
        left = fit.campaign.position[kept] - predicted(state)
        slope = [(predicted(state + d) - predicted(state - d)) / 2e-3 for d in 1e-3 * np.eye(12)]
        columns = np.stack([(s * weight).ravel() for s in slope], axis=1)
        state = state + np.linalg.lstsq(columns, (left * weight).ravel())[0]
    where = [names(listed).index(f"zero offset, joint_{k}") for k in (2, 3, 4)]
    alone = said[0].some(where)
    values = np.linalg.solve(alone.matrix, alone.vector)
    spread = np.sqrt(np.linalg.inv(alone.matrix).diagonal())
    assert (np.abs(values - state[:3]) < 0.02 * spread).all()
    noise = fit.explanation.whitening.noise[0] * fit.explanation.best.noise
    other = np.linalg.inv(columns.T @ columns).diagonal()[:3] ** 0.5 * noise
    np.testing.assert_allclose(spread, other, rtol=0.01)


def test_every_effect_is_compared_in_all_places_zeros_first():
    days = [diagnosed(1), diagnosed(4, gains=2e-3)]
    listed = candidates(days, [d.fit for d in days], ["a", "b"])
    assert listed[0].effect.told_inside
    own = {item.name: item for item in listed}
    assert own["joint_gain"].named == ("joint_gain" in days[0].verdict, True)
    zeros = own["joint_offset"]
    assert [len(zeros.told), *map(len, zeros.parameters)] == [5, 5, 5]  # whichever places a diagnosis named
    np.testing.assert_array_equal(zeros.sizes, np.full(5, 1e-3))
    assert not any(p.responses for p in zeros.told)


def lifted():
    """An arm on two columns that lift it: what stands before its first turning joint is shifted as the base is."""
    parts = [
        link("base"), joint("lift_1", "prismatic", "base", "middle", "0.5 0 0.14", limits=(0.25, 1.25)),
        link("middle"), joint("lift_2", "prismatic", "middle", "top", limits=(0.25, 1.25)), link("top"),
    ]  # fmt: skip
    before, turned = "top", ("1.57 0 1.57", "0 -1.57 -1.57", "0 0 1.57", "1.57 0 0")
    for number, (origin, rpy) in enumerate(zip(("0.1 0 1", "0 0.03 0.1", "0.6 0 0", "0 -0.5 0"), turned, strict=True)):
        parts += [
            joint(f"turn_{number}", "revolute", before, f"link_{number}", origin, rpy, limits=(-2.2, 2.2)),
            link(f"link_{number}"),
        ]
        before = f"link_{number}"
    return load_robot(urdf(*parts, joint("end", "fixed", before, "tip", "0 0.1 0.1"), link("tip")), "tip")


def test_a_base_that_rocks_does_not_tell_where_it_stands():
    """A campaign's drift turns the base; a shift of the first link is then not exactly one of the base any more."""
    robot = lifted()
    plain = observe(tr.simulate(robot, rows=50, seed=1))
    rocks = named("drift").variants(plain)[0]
    links = named("geometric")
    errors = np.array([p.size for p in links.parameters(plain)])
    at_work = [(links, errors), (rocks, np.array([0, 0, 0, 3e-3, 3e-3, 0]))]
    campaign = tr.simulate(robot, at_work, rows=50, noise=5e-5, base=np.eye(4), tool=np.eye(4), seed=2)
    found = tr.diagnose(campaign, only=["geometric", "joint_offset", "drift"])
    assert "drift" in found.verdict
    listed = candidates([found], [found.fit], ["one"])
    told = np.linalg.eigvalsh(sums(found, found.fit, listed, 0).matrix)
    # nothing is told to no better than some expected sizes, which rounding apart is told to none
    assert not ((told > 1e-9) & (told < 0.01)).any()
    assert (told > 1.0).sum() > 10


def of_both(found, other):
    """What a campaign, and the model of its diagnosis, say beside another one, by the parameters' names."""
    fits, model = [found.fit, other.fit], Known.of(found.model, "a")
    listed = candidates([found, other], fits, ["a", "b"])
    of_model = {item.name: item for item in candidates([model, other], [model, other.fit], ["a", "b"])}
    assert {*of_model} <= {item.name for item in listed}
    same = [replace(i, parameters=of_model[i.name].parameters if i.name in of_model else ((), ())) for i in listed]
    keys = [f"{item.name}: {p.name}" for item in listed for p in item.told]
    return sums(found, found.fit, listed, 0), sums(model, model, same, 0), keys, listed


@pytest.mark.parametrize("times", [1.0, 5.0])
def test_a_model_says_what_the_rows_said_without_the_prior(times):
    """Where the noise is large, what was expected beforehand is a part of all that is known."""
    rows, model, keys, _ = of_both(diagnosed(1, noise=times * NOISE), diagnosed(2, frame="there", noise=2 * NOISE))
    own = [k for k, key in enumerate(keys) if key.startswith("joint_offset")]
    for name in ("matrix", "vector"):
        true = getattr(rows.some(own), name)
        np.testing.assert_allclose(getattr(model.some(own), name), true, atol=1e-4 * np.abs(true).max())


def test_a_model_with_an_effect_in_one_joint_says_nothing_of_the_others_and_one_without_effects_nothing():
    robot = load_robot("builtin:rv_m2", "tool0")
    one = tr.diagnose(tr.simulate(robot, {"joint_gain": {"joint_3": 3e-3}}, rows=50, noise=NOISE, seed=1))
    ((effect, _),) = one.model.effects
    assert effect.places == ("joint_3",)
    _, model, keys, listed = of_both(one, diagnosed(2))
    told = dict(zip(keys, np.diag(model.matrix), strict=True))
    own = told.pop("joint_gain: gain error, joint_3")
    assert own > 100.0
    assert max(value for key, value in told.items() if key.startswith("joint_gain")) < 1e-9 * own
    # and its value is the model's own
    k = keys.index("joint_gain: gain error, joint_3")
    size = np.concatenate([item.sizes for item in listed])[k]
    assert model.vector[k] / model.matrix[k, k] * size == pytest.approx(3e-3, rel=0.05)
    sound = tr.diagnose(tr.simulate(robot, rows=40, noise=NOISE, seed=2), only="joint_gain")
    assert sound.model.effects == ()
    _, model, *_ = of_both(sound, diagnosed(1))
    assert not model.matrix.any()
    assert not model.vector.any()


@pytest.mark.slow
def test_geometry_is_told_in_the_parameters_of_a_diagnosis():
    robot = load_robot("builtin:rv_m2", "tool0")
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
