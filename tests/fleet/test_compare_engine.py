"""The joint fit of several campaigns on normal equations whose truth is known."""

from dataclasses import replace

import numpy as np
import pytest
from compared import NOISE, diagnosed
from coupled import joint as hinge
from coupled import link, urdf
from helpers import some
from scipy.linalg import lstsq
from scipy.stats import chi2 as chi2_law

import thermal_robot as tr
from thermal_robot.effects import Parameter, library, named
from thermal_robot.fleet import settings
from thermal_robot.fleet.compare import _equal, _judged, _parameters
from thermal_robot.fleet.compare_joint import joint
from thermal_robot.fleet.compare_sums import Candidate, ModelAsFit, Sums, candidates, identifiable, sums
from thermal_robot.inference.algebra import solve
from thermal_robot.observations import observe
from thermal_robot.robot import load_robot

JOINTS = ("one", "two", "three", "four")
TRUTH = np.array([1.0, -0.5, 0.3, 0.8])
SURE = 1e4
"""Information of each campaign on each parameter: deviations of a hundredth of the expected size."""


def listed(campaigns, places=JOINTS, named=None, size=1.0):
    """One effect with a parameter in each of some joints."""
    own = tuple(Parameter("size", "rad", size, "joint", name, ()) for name in places)
    named = (True,) * campaigns if named is None else named
    at = tuple(range(len(own)))
    effect = library()["joint_offset"]
    return [Candidate("own", "own", effect, own, np.full(len(own), size), (own,) * campaigns, named, at)]


def statistics(truths, rng, rows=60):
    """What campaigns with these parameters say, noise one."""
    result = []
    for truth in truths:
        columns = rng.normal(size=(rows, 4)) * 4.0
        result.append(Sums(columns.T @ columns, columns.T @ (columns @ truth + rng.normal(size=rows))))
    return result


def fitted(truths, rng):
    return joint(listed(len(truths)), statistics(truths, rng))


def four(changes=()):
    """Four campaigns of one robot, with changes as (campaigns, joint, by how much)."""
    truths = np.tile(TRUTH, (4, 1))
    for where, k, by in changes:
        truths[list(where), k] += by
    return statistics(truths, np.random.default_rng(5))


def test_what_did_not_change_is_shared_as_least_squares_over_all_has_it():
    sums = statistics([TRUTH] * 3, np.random.default_rng(1))
    found = joint(listed(3), sums)
    assert found.changes == ()
    together = solve(sum(s.matrix for s in sums), sum(s.vector for s in sums))
    np.testing.assert_allclose(found.values, np.tile(together, (3, 1)), atol=2e-3)
    assert found.probability[0] > 0.999


def test_two_places_may_change_at_two_times():
    days = TRUTH + np.array([[0.0, 0.0, 0.0, 0.0], [0.4, 0.0, 0.0, 0.0], [0.4, 0.0, 0.0, -0.4]])
    found = fitted(days, np.random.default_rng(3))
    assert {change.part.place[1] for change in found.changes} == {"one", "four"}
    np.testing.assert_allclose(found.values, days, atol=0.12)


@pytest.mark.slow
def test_chance_makes_no_change_more_often_than_stated():
    rng = np.random.default_rng(0)
    truths = rng.normal(size=(150, 4))
    # 2 % of 150 are 3; more than 8 have a chance of 0.4 %
    assert sum(bool(fitted([truth, truth], rng).changes) for truth in truths) <= 8


@pytest.mark.slow
def test_a_change_of_five_deviations_is_found_and_nothing_else():
    rng, right = np.random.default_rng(0), 0
    for _ in range(60):
        truth, place = rng.normal(size=4), rng.integers(4)
        step = 5.0 * np.sqrt(2.0 / (60 * 16.0))
        changed = fitted([truth, truth + step * np.eye(4)[place]], rng).changes
        right += [c.part.place[1] for c in changed] == [JOINTS[place]]
    assert right >= 51


@pytest.mark.parametrize(
    "changes", [(), [((1, 3), 2, 0.6)], [((2, 3), 0, 0.5), ((0,), 1, -0.7)], [((1,), 3, 0.8), ((2,), 3, -0.8)]]
)
def test_of_many_parts_those_that_join_one_after_another_give_the_same(changes, monkeypatch):
    whole = joint(listed(4), four(changes))
    monkeypatch.setattr(settings, "AT_ONCE", 7)
    by_and_by = joint(listed(4), four(changes))
    assert by_and_by.looked_at == whole.looked_at
    assert {(c.part.where, c.part.parameters) for c in by_and_by.changes} == {
        (c.part.where, c.part.parameters) for c in whole.changes
    }
    np.testing.assert_allclose(by_and_by.values, whole.values, atol=1e-6)


def verdict(values, named=None, blind=()):
    """Status and reason of an effect in two joints with these values in each campaign."""
    values = np.asarray(values, dtype=float)
    named = tuple(bool(row.any()) for row in values) if named is None else named
    items = listed(len(values), JOINTS[:2], named)
    sums = [Sums(SURE * np.eye(2) * (k not in blind), SURE * row * (k not in blind)) for k, row in enumerate(values)]
    return _judged(0, items[0], joint(items, sums), sums, ["a", "b", "c", "d"][: len(values)])


@pytest.mark.parametrize(
    ("values", "more", "status", "reason"),
    [
        ([[1, -1], [1, -1]], {}, "shared", ""),
        ([[1, -1], [1.3, -1]], {}, "changed", ""),  # one joint of two
        ([[1, -1], [1.2, -1.2], [1.4, -1.4]], {}, "changed", ""),  # wear
        ([[0, 0], [1, 0]], {}, "changed", ""),  # a fault that began
        ([[0, 0], [1, 0], [1, 0]], {}, "changed", ""),
        ([[0.4, 0], [1, 0]], {}, "contradicts", "a and b each need another size, with none in common"),
        ([[0.4, 0], [1, 0], [2.5, 0]], {}, "contradicts", "a, b and c each need another size, with none in common"),
        ([[0, 0], [1, 0], [0, 0]], {}, "contradicts", "b alone needs it, and a and c exclude it"),
        ([[0.4, 0], [1, 0], [0, 0]], {}, "contradicts", "a and b need it in different sizes, and c excludes it"),
        ([[1, -1], [-1, 1]], {}, "contradicts", "a and b each need another size, with none in common"),
        ([[0, 0], [0, 0]], {"named": (True, False)}, "not_needed", "the campaigns together do not need it"),
        ([[0, 0], [0, 0]], {}, "absent", ""),
        ([[1, 1], [0, 0]], {"blind": (1,)}, "not_compared", "a alone can tell it"),
        ([[1, 1], [1, 1]], {"blind": (0, 1)}, "not_compared", "no campaign tells it beside the frames"),
    ],
)
def test_a_name_is_kept_where_two_agree(values, more, status, reason):
    assert verdict(values, **more) == (status, reason)


def rows(seed, campaigns=3, count=40, width=5, blind=()):
    """Columns and values of some campaigns; a blind one does not see the first two columns apart."""
    rng, found = np.random.default_rng(seed), []
    for c in range(campaigns):
        columns = rng.normal(size=(count, width)) * 10.0
        if c in blind:
            columns[:, 1] = columns[:, 0]
        found.append((columns, columns @ rng.normal(size=width) * 0.1 + rng.normal(size=count)))
    return found


def squares(columns, values):
    return float(((values - columns @ lstsq(columns, values)[0]) ** 2).sum())


@pytest.mark.parametrize(("seed", "blind"), [(0, ()), (1, ()), (2, (1,)), (3, (0, 2))])
def test_equal_is_what_is_lost_by_sharing(seed, blind):
    """Against least squares over all rows, some columns shared by all campaigns and the others of each alone."""
    data, own, others = rows(seed, blind=blind), [0, 2], [1, 3, 4]
    wide = []
    for c, (columns, _) in enumerate(data):
        block = np.zeros((len(columns), len(own) + len(others) * len(data)))
        block[:, : len(own)] = columns[:, own]
        start = len(own) + c * len(others)
        block[:, start : start + len(others)] = columns[:, others]
        wide.append(block)
    whole = np.vstack(wide)
    together = squares(whole, np.concatenate([values for _, values in data]))
    chi2, degrees, p_value = _equal([Sums(x.T @ x, x.T @ y) for x, y in data], own)
    assert chi2 == pytest.approx(together - sum(squares(x, y) for x, y in data), rel=1e-6)
    assert degrees == sum(np.linalg.matrix_rank(x) for x, _ in data) - np.linalg.matrix_rank(whole)
    assert p_value == pytest.approx(chi2_law.sf(chi2, degrees), rel=1e-9)


def test_values_are_least_squares_and_what_is_not_seen_is_no_number():
    data = rows(5, campaigns=2, blind=(1,))
    sums = [Sums(x.T @ x, x.T @ y) for x, y in data]
    (item,) = listed(2, [f"j{k}" for k in range(5)], size=1e-3)
    found = _parameters(item, sums, list(range(5)), ["a", "b"])
    np.testing.assert_allclose([p.values[0] for p in found], lstsq(*data[0])[0] * 1e-3, rtol=1e-8)
    spread = np.sqrt(np.diag(np.linalg.inv(data[0][0].T @ data[0][0]))) * 1e-3
    np.testing.assert_allclose([p.stds[0] for p in found], spread, rtol=1e-8)
    assert [p.values[1] is None for p in found] == [True, True, False, False, False]
    assert found[0].difference is None
    p = found[3]
    assert p.between == ("a", "b")
    assert p.difference == pytest.approx(p.values[1] - p.values[0])
    assert p.chi2 == pytest.approx((p.difference / p.std) ** 2)
    assert p.std == pytest.approx(np.hypot(*p.stds))


def test_a_parameter_that_repeats_another_is_told_once():
    columns = np.random.default_rng(0).normal(size=(30, 3))
    columns = np.column_stack([columns, columns[:, 0] + columns[:, 1], np.zeros(30)])
    assert identifiable([Sums(columns.T @ columns, np.zeros(5))] * 2) == [0, 1, 2]


# ---- what a campaign or its model says


def of_both(found, other):
    """What a campaign, and the model of its diagnosis, say beside another one, by the parameters' names."""
    fits, model = [found.fit, other.fit], ModelAsFit.of(found.model, "a")
    of_days = candidates([found, other], fits, ["a", "b"])
    of_model = {item.name: item for item in candidates([model, other], [model, other.fit], ["a", "b"])}
    assert {*of_model} <= {item.name for item in of_days}
    same = [replace(i, parameters=of_model[i.name].parameters if i.name in of_model else ((), ())) for i in of_days]
    keys = [f"{item.name}: {p.name}" for item in of_days for p in item.compared]
    return sums(found, found.fit, of_days, 0), sums(model, model, same, 0), keys, of_days


def test_it_is_least_squares_with_free_frames():
    """The parameters that a campaign says are those of a fit by finite differences of its own robot."""
    fit = diagnosed(1).fit
    told, _, keys, _ = of_both(diagnosed(1), diagnosed(2, frame="there", noise=2 * NOISE))
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
    alone = told.some([keys.index(f"joint_offset: zero offset, joint_{k}") for k in (2, 3, 4)])
    values = np.linalg.solve(alone.matrix, alone.vector)
    spread = np.sqrt(np.linalg.inv(alone.matrix).diagonal())
    assert (np.abs(values - state[:3]) < 0.02 * spread).all()
    noise = fit.explanation.whitening.noise[0] * fit.explanation.best.noise
    other = np.linalg.inv(columns.T @ columns).diagonal()[:3] ** 0.5 * noise
    np.testing.assert_allclose(spread, other, rtol=0.01)


def test_every_effect_is_compared_in_all_places_zeros_first():
    days = [diagnosed(1), diagnosed(4, gains=2e-3)]
    of_days = candidates(days, [d.fit for d in days], ["a", "b"])
    assert of_days[0].effect.told_inside
    own = {item.name: item for item in of_days}
    assert own["joint_gain"].named == ("joint_gain" in days[0].verdict, True)
    zeros = own["joint_offset"]
    assert [len(zeros.compared), *map(len, zeros.parameters)] == [5, 5, 5]  # whichever places a diagnosis named
    np.testing.assert_array_equal(zeros.sizes, np.full(5, 1e-3))
    assert not any(p.responses for p in zeros.compared)


def lifted():
    """An arm on two columns that lift it: what stands before its first turning joint is shifted as the base is."""
    parts = [
        link("base"), hinge("lift_1", "prismatic", "base", "middle", "0.5 0 0.14", limits=(0.25, 1.25)),
        link("middle"), hinge("lift_2", "prismatic", "middle", "top", limits=(0.25, 1.25)), link("top"),
    ]  # fmt: skip
    before, turned = "top", ("1.57 0 1.57", "0 -1.57 -1.57", "0 0 1.57", "1.57 0 0")
    for number, (origin, rpy) in enumerate(zip(("0.1 0 1", "0 0.03 0.1", "0.6 0 0", "0 -0.5 0"), turned, strict=True)):
        parts += [
            hinge(f"turn_{number}", "revolute", before, f"link_{number}", origin, rpy, limits=(-2.2, 2.2)),
            link(f"link_{number}"),
        ]
        before = f"link_{number}"
    return load_robot(urdf(*parts, hinge("end", "fixed", before, "tip", "0 0.1 0.1"), link("tip")), "tip")


@pytest.mark.slow
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
    of_days = candidates([found], [found.fit], ["one"])
    compared = np.linalg.eigvalsh(sums(found, found.fit, of_days, 0).matrix)
    # nothing is told to no better than some expected sizes, which rounding apart is told to none
    assert not ((compared > 1e-9) & (compared < 0.01)).any()
    assert (compared > 1.0).sum() > 10


@pytest.mark.parametrize("times", some([5.0, 1.0], 2))
def test_a_model_says_what_the_rows_said_without_the_prior(times):
    """Where the noise is large, what was expected beforehand is a part of all that is known."""
    rows, model, keys, _ = of_both(diagnosed(1, noise=times * NOISE), diagnosed(2, frame="there", noise=2 * NOISE))
    own = [k for k, key in enumerate(keys) if key.startswith("joint_offset")]
    for name in ("matrix", "vector"):
        true = getattr(rows.some(own), name)
        np.testing.assert_allclose(getattr(model.some(own), name), true, atol=1e-4 * np.abs(true).max())


@pytest.mark.slow
def test_a_model_with_an_effect_in_one_joint_says_nothing_of_the_others_and_one_without_effects_nothing(rv_m2):
    one = tr.diagnose(tr.simulate(rv_m2, {"joint_gain": {"joint_3": 3e-3}}, rows=50, noise=NOISE, seed=1))
    ((effect, _),) = one.model.effects
    assert effect.places == ("joint_3",)
    _, model, keys, of_days = of_both(one, diagnosed(2))
    compared = dict(zip(keys, np.diag(model.matrix), strict=True))
    own = compared.pop("joint_gain: gain error, joint_3")
    assert own > 100.0
    assert max(value for key, value in compared.items() if key.startswith("joint_gain")) < 1e-9 * own
    # and its value is the model's own
    k = keys.index("joint_gain: gain error, joint_3")
    size = np.concatenate([item.sizes for item in of_days])[k]
    assert model.vector[k] / model.matrix[k, k] * size == pytest.approx(3e-3, rel=0.05)
    sound = tr.diagnose(tr.simulate(rv_m2, rows=40, noise=NOISE, seed=2), only="joint_gain")
    assert sound.model.effects == ()
    _, model, *_ = of_both(sound, diagnosed(1))
    assert not model.matrix.any()
    assert not model.vector.any()


@pytest.mark.slow
def test_geometry_is_told_in_the_parameters_of_a_diagnosis(rv_m2):
    names = [
        f"rotation {axis} of joint_{k}, {link}" for k, link in ((2, "shoulder"), (3, "upper_arm")) for axis in "xyz"
    ]
    bent = {"geometric": dict(zip(names, (4e-4, -6e-4, 5e-4, 3e-4, -5e-4, 6e-4), strict=True))}
    found = tr.diagnose(tr.simulate(rv_m2, bent, rows=80, noise=NOISE, seed=4), only=["geometric"])
    assert found.verdict == ("geometric",)
    both = tr.compare(found.model, found, names=["file", "rows"])
    assert both.changes == ()
    for p in both.effect("geometric").parameters:
        if p.difference is not None:
            assert abs(p.difference) < 0.02 * p.std
