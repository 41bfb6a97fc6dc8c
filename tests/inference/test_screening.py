"""A law that is put in at a place comes first there, with its quantity and its shape."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from helpers import NOISE, erring, with_law
from simulate import simulate

from thermal_robot.campaign.turning import SLIPS
from thermal_robot.effects import choose
from thermal_robot.effects.apply import displacement
from thermal_robot.effects.effect import in_words
from thermal_robot.effects.law import Discovered
from thermal_robot.effects.quantities import quantities
from thermal_robot.inference import settings
from thermal_robot.inference.columns import block, frame_columns
from thermal_robot.inference.fit import fit
from thermal_robot.inference.grouping import consecutive_outliers
from thermal_robot.inference.registration import register
from thermal_robot.inference.screening import RowSample, Target, scan, shaped, shapes
from thermal_robot.kinematics import Displacement
from thermal_robot.observations import Frames, observe

TWIST = [3e-4, 0.0, 0.0, 0.0, 4e-4, 0.0]  # m, rad
PUT_IN = {
    "joint": (Discovered(place="joint_2", quantity="temperature", shape="ramp", origin=22.0, span=5.0), [0.0, 6e-4]),
    "step": (Discovered(place="joint_3", quantity="time", shape="step", marks=(3600.0,)), [0.0, 5e-4]),
    "bend": (Discovered(place="joint_2", quantity="joint_3", shape="hinge", marks=(-1.0, 1.0), span=2.0), [0.0, 4e-3]),
    "base": (Discovered(kind="base", place="base", quantity="speed", shape="ramp"), [0.0] * 6 + TWIST),
    "tool": (Discovered(kind="tool", place="tool", quantity="payload", shape="ramp", span=3.0), [0.0] * 6 + TWIST),
}


def seen(campaign):
    """Observations with the frames fitted, and what they leave to be explained."""
    here = observe(campaign, register(campaign))
    return here, Target.of(here.gap, frame_columns(here)[0])


@pytest.fixture(scope="module")
def scanned(rv_m2):
    found = {}
    for name, (law, values) in PUT_IN.items():
        here, target = seen(with_law(rv_m2, law, values, seed=3)[0])
        found[name] = law, here, target, scan(here, [target])[0][0]
    return found


@pytest.mark.parametrize("name", PUT_IN)
def test_place_and_quantity_come_first(scanned, name):
    law, _, _, found = scanned[name]
    first = found[0].law
    assert (first.kind, first.place, first.quantity) == (law.kind, law.place, law.quantity)
    assert found[0].gain > 20.0
    # but for six whose best shape is worth more than they are, each is worth less than the one before
    assert sum(after.net_gain > before.net_gain for before, after in pairwise(found)) <= 6


def test_every_candidate_is_counted_and_segments_are_tried_with_what_speaks_elsewhere(scanned):
    law, here, target, found = scanned["joint"]
    tried = scan(here, [target])[1]
    assert tried > len(found)
    # each kind of law has the same share of the prior, which its laws divide
    by_kind: dict[str, float] = {}
    for item in found:
        memory = item.law.quantity.startswith("since_turn.") or item.law.shape.startswith("relaxing")
        wave = "grid" if item.law.marks in ((1.0,), (2.0,), (3.0,)) else "free"
        kind = (item.law.of and "modulated") or (item.law.by and "product") or (memory and "memory")
        by_kind.setdefault(kind or (wave if item.law.shape == "harmonic" else "plain"), item.tried)
    assert len(by_kind) == 6
    assert sum(by_kind.values()) == pytest.approx(6 * tried, rel=0.01)
    assert all(item.net_gain == pytest.approx(item.gain - np.log(item.tried)) for item in found)
    links = {item.law.quantity for item in found if item.law.kind == "link"}
    assert "none" in links  # a constant of a segment: its geometry
    assert law.quantity in links
    assert len(links - {"none"}) == 6
    # a law of nothing has one shape
    constant = next(item for item in found if item.law.shape == "constant")
    again = shaped(here, target, constant.law)
    assert again.law == constant.law
    assert again.gain == pytest.approx(constant.gain, rel=1e-9)


def test_in_noise_no_law_gains_much(rv_m2):
    gains = []
    for seed in range(3):
        here, target = seen(simulate(rv_m2, seed=seed, noise=NOISE)[0])
        gains.append(max(item.net_gain for item in scan(here, [target])[0][0]))
    assert max(gains) < 3.0
    assert np.median(gains) < 0.0


@pytest.mark.parametrize("name", ["step", "bend"])
def test_the_shape_is_found_and_its_mark_to_within_the_rows_beside_it(scanned, name):
    law, here, target, found = scanned[name]
    best = shaped(here, target, found[0].law)
    assert best.gain > found[0].gain
    assert best.law.shape in {"step": ("step", "slide"), "bend": ("hinge",)}[name]
    values = np.sort(law.values(here))
    place = np.searchsorted(values, law.marks[0])
    assert values[place - 3] < best.law.marks[0] < values[place + 2]
    if name == "bend":
        assert best.law.marks[1] == law.marks[1]


@pytest.mark.parametrize("beyond", [6, 8])
def test_a_law_bends_where_rows_lie_on_both_sides(rv_m2, beyond):
    """A bend before the last few of 120 rows is placed before a sixteenth of them, or it would follow one or two."""
    speed = np.sort(with_law(rv_m2, *PUT_IN["base"], seed=3)[0].covariates["speed"])
    law = Discovered(place="joint_2", quantity="speed", shape="hinge", marks=(float(speed[-beyond]), 1.0))
    here, target = seen(with_law(rv_m2, law, [0.0, 0.01], seed=3)[0])
    found = shaped(here, target, replace(law, shape="ramp", marks=())).law
    assert found.shape == "hinge"
    assert (speed > found.marks[0]).sum() >= len(speed) // 16


def test_no_shape_gains_over_a_straight_line_where_the_law_is_straight(scanned):
    """By chance one of sixty may, by a few natural logarithms."""
    for name in ("joint", "base"):
        _, here, target, found = scanned[name]
        values = quantities(here)[found[0].law.quantity]
        straight = replace(found[0].law, shape="ramp", marks=())
        gains = {law.shape: target.score(block(here, law).columns).gain for law in shapes(found[0].law, values)}
        best = shaped(here, target, found[0].law)
        assert best.net_gain >= max(gains.values()) - np.log(best.tried) - 1e-6
        assert best.law.shape == "ramp"
        assert best.gain < target.score(block(here, straight).columns).gain + 3.0
        assert gains["ramp"] > gains["smooth"]
        # no step, no bump explains it as well
        assert max(gains["step"], gains["bump"]) < gains["ramp"] - 10.0


@pytest.mark.slow
def test_a_wheel_on_the_motor_is_found_with_its_order(rv_m2):
    law = Discovered(place="joint_2", quantity="joint_2", shape="harmonic", marks=(51.0,))
    campaign = replace(with_law(rv_m2, law, [0.0, 3e-4, 2e-4], seed=7)[0], gears={"joint_2": 51.0})
    here, target = seen(campaign)
    first = scan(here, [target])[0][0][0].law
    assert (first.place, first.shape, first.marks) == ("joint_2", "harmonic", (51.0,))
    assert shaped(here, target, first).law.marks == (51.0,)
    # who was not told the ratio finds it, too
    blind = observe(replace(campaign, gears={}), here.frames)
    again = scan(blind, [target])[0][0][0]
    assert (again.law.place, again.law.shape) == ("joint_2", "harmonic")
    assert again.law.marks[0] == pytest.approx(51.0, abs=0.06)
    assert again.net_gain < scan(here, [target])[0][0][0].net_gain
    # a smooth law of that joint is told its waves where their orders are known
    smooth = replace(first, shape="smooth", marks=(-1.0, -0.5, 0.0, 0.5, 1.0))
    assert shaped(here, target, smooth).law.marks == (51.0,)


def put_in(robot, law, values, seed, ratio):
    """A campaign of a robot with a law at work whose size is a ratio of the noise, once the frames are fitted."""
    data = replace(simulate(robot, samples=120, seed=seed, noise=NOISE)[0], priors={})
    frames = Frames.declared(data)
    nominal = observe(data, frames)
    item = block(nominal, law)
    moved = (item.columns @ values)[:, :3].ravel()
    fitted = frame_columns(nominal)[0][:, :3].reshape(len(moved), -1)
    left = moved - fitted @ np.linalg.lstsq(fitted, moved, rcond=1e-10)[0]
    values = values * ratio * NOISE / np.sqrt((left**2).mean())
    real = observe(data, frames, displacement=displacement(nominal, [(law, values)])[0])
    noise = NOISE * np.random.default_rng([seed, 7]).normal(size=data.position.shape)
    return seen(replace(data, position=real.predicted_position + noise))


def grammar(robot, name, rng):
    """A law of a kind at random in a robot, and its values."""
    joint = robot.joint_names[int(rng.integers(1, robot.n - 1))]
    k = int(rng.integers(14, 26))
    load = {"quantity": "payload", "span": 3.0}
    warm = {"quantity": "temperature", "span": 5.0, "origin": 22.0}
    product = {"quantity": "payload", "shape": "product"}
    # drawn in this order: a generator that is asked otherwise gives other laws
    tool, base, hour = rng.normal(size=3), rng.normal(size=6), float(rng.uniform(1800.0, 5400.0))
    own, values = {
        "lost motion x payload": ({**load, "shape": "ramp", "of": "backlash"}, [0.0, 1.0]),
        "compliance x temperature": (
            {**warm, "place": robot.joint_names[1], "shape": "ramp", "of": "joint_compliance"},
            [0.0, 1.0],
        ),
        "product in a joint": ({**load, "shape": "product", "by": robot.joint_names[0]}, [0.0, 1.0]),
        "product at the tool": (
            {**product, "kind": "tool", "place": "tool", "turns": False, "by": "gravity.x"},
            [0.0, 0.0, 0.0, *tool],
        ),
        "product at the base": (
            {**product, "kind": "base", "place": "base", "turns": False, "by": "reach.x"},
            [*np.zeros(6), *base],
        ),
        "memory": (
            {"quantity": f"since_turn.{joint}", "shape": "hysteresis", "marks": SLIPS[k : k + 2]},
            [0.0, 1.0, 1.0],
        ),
        "jump": ({"quantity": "time", "shape": "step", "marks": (hour,)}, [0.0, 1.0]),
    }[name]
    return Discovered(**{"place": joint, **own}), 1e-4 * np.asarray(values)


on_arms = pytest.mark.parametrize(
    ("arm", "seeds"),
    [("rv_m2", range(1)), *(pytest.param(arm, range(3), marks=pytest.mark.slow) for arm in ("rv_m2", "ur10", "panda"))],
    indirect=["arm"],
)
KINDS = (
    "lost motion x payload",
    "compliance x temperature",
    "product in a joint",
    "product at the tool",
    "product at the base",
    "memory",
    "jump",
)


@on_arms
@pytest.mark.parametrize("name", KINDS)
def test_each_kind_of_law_comes_first_where_it_is_at_work(arm, seeds, name):
    for seed in seeds:
        law, values = grammar(arm, name, np.random.default_rng([seed, 99]))
        here, target = put_in(arm, law, values, seed, 3.0)
        found = scan(here, [target])[0][0]
        first = found[0].law
        assert (first.kind, first.place, first.of) == (law.kind, law.place, law.of)
        assert {first.quantity, first.by} == {law.quantity, law.by}
        best = shaped(here, target, first)
        # the shape that was put in is at least as good as any other of its parameters, and it is one that is tried
        truth = target.score(block(here, law).columns).gain
        assert best.gain > truth - 10.0
        assert best.net_gain > 50.0
        if name == "jump":
            assert best.law.describe().startswith(f"the zero of {in_words('joint', law.place)} jumped at time")


def wound(path, slips):
    """How far elements hold a joint that passes positions (N,) in this order, each from −1 to 1, summed."""
    held = np.zeros((len(path), len(slips)))
    for row in range(1, len(path)):
        held[row] = np.maximum(-1.0, np.minimum(1.0, held[row - 1] + (path[row] - path[row - 1]) / slips))
    return held.sum(axis=1)


@on_arms
@pytest.mark.parametrize("ratio", [3.0, 12.0, 24.0])
def test_friction_on_springs_comes_first_and_leaves_the_noise(arm, seeds, ratio):
    """Four elements that slip anywhere between a twentieth and 0.6 of the joint's range (Jenkin)."""
    for seed in seeds:
        rng = np.random.default_rng([seed, 11])
        data = replace(simulate(arm, samples=120, seed=seed, noise=NOISE)[0], priors={})
        j = int(rng.integers(1, arm.n - 1))
        shift = np.zeros_like(data.q)
        shift[:, j] = wound(data.q[:, j], rng.uniform(0.05, 0.6, 4) * np.ptp(data.q[:, j]))
        frames = Frames.declared(data)
        small = observe(data, frames, displacement=Displacement(joint=1e-5 * shift))
        moved = (small.predicted_position - observe(data, frames).predicted_position).ravel()
        fitted = frame_columns(small)[0].reshape(len(moved), -1)
        left = moved - fitted @ np.linalg.lstsq(fitted, moved, rcond=1e-10)[0]
        shift *= 1e-5 * ratio * NOISE / np.sqrt((left**2).mean())
        here, target = seen(erring(data, [seed, 7], joint=shift))
        first = scan(here, [target])[0][0][0].law
        assert (first.place, first.quantity) == (arm.joint_names[j], f"since_turn.{arm.joint_names[j]}")
        best = shaped(here, target, first).law
        assert best.shape == "hysteresis"
        columns = np.concatenate([frame_columns(here)[0], block(here, best).columns], axis=2)
        columns = columns.reshape(here.gap.size, -1)
        left = here.gap.ravel() - columns @ np.linalg.lstsq(columns, here.gap.ravel(), rcond=1e-10)[0]
        assert np.sqrt((left**2).sum() / (left.size - columns.shape[1])) < 1.3 * NOISE


@on_arms
@pytest.mark.parametrize("reach", [(1.0, 60.0), (60.0, 200.0)])
def test_a_wave_of_any_order_comes_first_with_its_order(arm, seeds, reach):
    for seed in seeds:
        rng = np.random.default_rng([seed, 5])
        joint = arm.joint_names[int(rng.integers(1, arm.n - 1))]
        order = float(rng.uniform(*reach))
        law = Discovered(place=joint, quantity=joint, shape="harmonic", marks=(order,))
        here, target = put_in(arm, law, 1e-4 * np.array([0.0, *rng.normal(size=2)]), seed, 30.0)
        found = scan(here, [target])[0][0]
        first = found[0]
        assert (first.law.place, first.law.quantity, first.law.shape) == (joint, joint, "harmonic")
        assert abs(first.law.marks[0] - order) < 0.02
        # it stands on the peak: the true order gains no more
        assert first.gain >= target.score(block(here, law).columns).gain - 0.01
        assert first.gain > 100.0


def test_an_effect_that_does_not_change_is_no_law(rv_m2):
    """Steady lost motion is the effect's own; what it does not explain of itself no quantity adds."""
    steady = Discovered(place="joint_3", quantity="none", shape="constant", of="backlash")
    here, target = put_in(rv_m2, steady, np.array([1e-4]), 1, 5.0)
    changing = [i for i in scan(here, [target])[0][0] if i.law.of == "backlash" and i.law.place == "joint_3"]
    assert changing == []
    # told that nothing is known of it, nobody asks whether it changes
    assert {i.law.of for i in scan(here, [target], [])[0][0]} == {""}


def test_gains_in_a_scan_are_those_of_one_law_alone_whatever_else_is_scanned(rv_m2):
    here, target = seen(simulate(rv_m2, ["backlash"], samples=60, seed=4, noise=NOISE)[0])
    other = Target.of(here.gap[:, ::-1].copy(), frame_columns(here)[0])
    found, _ = scan(here, [target, other])
    assert {bool(i.law.of) for i in found[0]} == {True, False}
    for own, one in zip(found, (target, other), strict=True):
        for item in own[::7]:
            assert item.gain == pytest.approx(one.score(block(here, item.law).columns).gain, rel=1e-6, abs=1e-6)
    assert found[0][0].gain != found[1][0].gain


def in_sessions(robot, joint, zeros, seed=3):
    """A joint whose zero is another in each of three sessions, an hour between each and the next."""
    plain = replace(simulate(robot, samples=120, seed=seed, noise=NOISE)[0], priors={})
    part = np.digitize(plain.covariates["time"], [2400.0, 4800.0])
    covariates = {**plain.covariates, "time": plain.covariates["time"] + 3600.0 * part}
    data = replace(plain, covariates=covariates, labels={"session": np.array(["am", "noon", "pm"])[part]})
    shift = np.zeros_like(data.q)
    shift[:, robot.joint_names.index(joint)] = np.array(zeros)[part]
    return erring(data, [seed, 7], joint=shift)


@pytest.mark.parametrize("zeros", [(0.0, 0.0, 4e-4), (0.0, -4e-4, -4e-4)])
def test_one_jump_between_sessions_is_a_jump_in_time(rv_m2, zeros):
    here, target = seen(in_sessions(rv_m2, "joint_3", zeros))
    found = scan(here, [target])[0][0]
    assert "session" not in {i.law.quantity for i in found if i.law.place == "joint_3" and not i.law.of}
    assert (found[0].law.place, found[0].law.quantity) == ("joint_3", "time")
    best = shaped(here, target, found[0].law)
    sessions = ("noon", "pm") if zeros[1] == 0.0 else ("am", "noon")
    assert (best.law.shape, best.law.runs) == ("step", sessions)
    assert best.law.describe().endswith(f", between session {sessions[0]} and {sessions[1]}")
    # an hour is a quarter of the time: of all steps it has nearly that share
    time = here.covariates["time"]
    late = time > best.law.marks[0]
    gap = time[late].min() - time[~late].max()
    assert gap > 3500.0
    # a step elsewhere has a smaller one, by the time between its rows
    inner = shaped(*seen(with_law(rv_m2, *PUT_IN["step"], seed=3)[0]), PUT_IN["step"][0])
    assert inner.law.shape == "step"
    assert inner.law.runs == ()
    assert inner.tried > 5.0 * best.tried
    assert best.law.shifted(1.0).runs == ()


def test_zeros_that_are_found_anew_in_each_session_follow_the_session(rv_m2):
    here, target = seen(in_sessions(rv_m2, "joint_3", (0.0, 6e-4, -4e-4)))
    found = scan(here, [target])[0][0]
    assert (found[0].law.place, found[0].law.quantity) == ("joint_3", "session")
    # no law of the clock stands beside it: the session says enough
    own = [i.law for i in found if (i.law.kind, i.law.place) == ("joint", "joint_3") and not i.law.of + i.law.by]
    plain = {law.quantity for law in own if law.shape in ("smooth", "ramp", "levels")}
    assert "session" in plain
    assert "time" not in plain
    # where nobody says when, the session is all that there is
    two = in_sessions(rv_m2, "joint_3", (0.0, 0.0, 4e-4))
    blind = replace(two, covariates={k: v for k, v in two.covariates.items() if k != "time"})
    here, target = seen(blind)
    assert scan(here, [target])[0][0][0].law.quantity in ("session", "order")


def test_a_tool_that_stands_elsewhere_in_one_session_is_no_curve_over_weeks(rv_m2):
    data = in_sessions(rv_m2, "joint_3", (0.0, 0.0, 0.0))
    noon = data.labels["session"] == "noon"
    weeks = {
        **data.covariates,
        "time": data.covariates["time"] + 1.8e6 * np.digitize(data.covariates["time"], [5e3, 1e4]),
    }
    data = replace(data, covariates=weeks)
    here, target = seen(erring(data, [7, 7], tool=np.outer(noon, [4.2e-4, 0.0, 0.0, 0.0, 0.0, 0.0])))
    found = scan(here, [target])[0][0]
    at_tool = [i.law for i in found if i.law.kind == "tool" and not i.law.by]
    assert (found[0].law.kind, found[0].law.quantity) == ("tool", "session")
    assert "time" not in {law.quantity for law in at_tool}
    best = shaped(here, target, found[0].law).law
    assert best.describe() == "the tool stands elsewhere in session noon"


@pytest.mark.parametrize("sizes", [(1.0, 1.0, 1.0), (1.0, -0.6, 0.4)])
def test_a_joint_that_relaxes_after_each_start_comes_first(rv_m2, sizes):
    data = in_sessions(rv_m2, "joint_3", (0.0, 0.0, 0.0))
    time, session = data.covariates["time"], data.labels["session"]
    runs, which = np.unique(session, return_inverse=True)
    since = time - np.array([time[session == run].min() for run in runs])[which]
    shift = np.zeros_like(data.q)
    shift[:, 2] = 8e-4 * np.array(sizes)[which] * np.exp(-since / 500.0)
    here, target = seen(erring(data, [7, 7], joint=shift))
    first = scan(here, [target])[0][0][0].law
    assert (first.place, first.quantity) == ("joint_3", "time")
    best = shaped(here, target, first).law
    assert best.shape == ("relaxing" if sizes[1] == 1.0 else "relaxing each")
    assert best.marks[0] == pytest.approx(500.0, rel=0.25)
    assert best.follows == "time"


def test_a_wave_of_a_screw_is_found_with_its_lead(awkward):
    law = Discovered(place="slide", quantity="slide", shape="harmonic", marks=(2.0 * np.pi / 0.01,))
    here, target = put_in(awkward, law, np.array([0.0, 1e-4, 1e-4]), 1, 10.0)
    first = scan(here, [target])[0][0][0].law
    assert (first.place, first.shape) == ("slide", "harmonic")
    assert 2.0 * np.pi / first.marks[0] == pytest.approx(0.01, rel=1e-3)
    assert first.describe().endswith("(a wave of 0.01 m)")


@pytest.fixture(scope="module")
def known(rv_m2):
    """A fit with an effect at work, gross errors, and a spell of rows that were knocked."""
    campaign = simulate(rv_m2, ["joint_offset"], samples=150, seed=3, outliers=0.05)[0]
    position = campaign.position.copy()
    position[np.argsort(campaign.covariates["time"])[60:64]] += 5e-3
    return fit(replace(campaign, position=position), choose(("joint_offset",), (), ()))


@pytest.mark.parametrize("enough", [90, 1000])
def test_above_a_limit_rows_are_drawn_once_in_order_and_stand_for_all(known, monkeypatch, enough):
    e, clock = known.explanation, known.campaign.covariates["time"]
    sound = RowSample.of(known).target(e.best.blocks).white
    monkeypatch.setattr(settings, "ENOUGH_ROWS", enough)
    sample = RowSample.of(known)
    assert sample.observations.campaign.samples == min(enough, 150)
    rows = [int(np.flatnonzero((known.campaign.q == q).all(axis=1))[0]) for q in sample.observations.q]
    assert rows == sorted(set(rows))
    np.testing.assert_array_equal(sample.linear.gap, e.linear.gap[rows])
    np.testing.assert_array_equal(sample.linear.frames, e.linear.frames[rows])
    for own, whole in zip(sample.linear.blocks, e.linear.blocks, strict=True):
        np.testing.assert_array_equal(own.columns, whole.columns[rows])
    # the knocked rows follow each other, scattered gross errors do not
    aside = consecutive_outliers(known.campaign, e.outliers)
    np.testing.assert_array_equal(sample.changed, aside[rows])
    assert aside[np.argsort(clock)[60:64]].all()
    assert aside.sum() < e.outliers.sum()
    # the corrected model is the same: its gap at these rows is the one it had among all
    np.testing.assert_allclose(sample.observations.gap, known.corrected.gap[rows], rtol=0, atol=1e-12)
    # the same campaign always gets the same rows
    np.testing.assert_array_equal(RowSample.of(known).observations.q, sample.observations.q)
    assert np.mean(clock[rows] < np.median(clock)) == pytest.approx(0.5, abs=4.0 * 0.5 / np.sqrt(90))
    # four of its standard deviations: that of a normal law's median of |x|, 1.17/√n of it
    own = sample.target(e.best.blocks).white
    assert np.median(np.abs(own)) == pytest.approx(np.median(np.abs(sound)), rel=4.0 * 1.17 / np.sqrt(own.size))


def test_targets_hold_what_is_left_beside_some_blocks(known):
    sample = RowSample.of(known)
    blocks = known.explanation.best.blocks
    assert blocks
    calm = replace(sample, changed=np.zeros(150, dtype=bool))
    before, after = calm.target(()), sample.target(blocks)
    frames = sample.linear.frames.shape[2]
    assert before.basis.shape[1] == frames
    assert after.basis.shape[1] > frames
    columns = sample.linear.blocks[blocks[0]].columns
    assert before.score(columns).gain > 50.0
    # rows that changed weigh fully, however far they are
    assert (after.root[sample.changed].min(axis=0) >= after.root.max(axis=0) * (1.0 - 1e-9)).all()
    spoilt = known.explanation.outliers & ~sample.changed
    assert after.root[spoilt].max() < 0.2 * after.root.max()
