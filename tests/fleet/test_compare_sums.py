"""What a campaign says: against least squares over its rows, and what frames take up."""

import numpy as np
import pytest
from compared import NOISE, diagnosed
from coupled import joint, link, urdf

import thermal_robot as tr
from thermal_robot.effects import named
from thermal_robot.fleet.compare_sums import Sums, candidates, sums, told
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


def test_twice_the_noise_says_a_quarter(said, listed):
    own = names(listed).index("zero offset, joint_3")
    assert np.diag(said[0].matrix)[own] / np.diag(said[1].matrix)[own] == pytest.approx(4.0, rel=0.5)


def test_a_parameter_that_repeats_another_is_told_once():
    columns = np.random.default_rng(0).normal(size=(30, 3))
    columns = np.column_stack([columns, columns[:, 0] + columns[:, 1], np.zeros(30)])
    assert told([Sums(columns.T @ columns, np.zeros(5))] * 2) == [0, 1, 2]


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
