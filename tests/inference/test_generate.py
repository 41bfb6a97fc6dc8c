"""A cause that nobody listed is found: a law, an event, a wave; and none where there is none."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import NOISE, some, with_law
from simulate import simulate

import thermal_robot as tr
from thermal_robot.diagnosis.prune import forward_selection
from thermal_robot.effects import choose
from thermal_robot.effects.law import Discovered
from thermal_robot.inference import settings
from thermal_robot.inference.fit import fit
from thermal_robot.inference.generate import HeldOut, candidates, clustered_outliers, discovered, events, listed, where
from thermal_robot.inference.grouping import each
from thermal_robot.inference.screening import RowSample
from thermal_robot.kinematics import exp6

LISTED = ("joint_offset", "joint_gain", "backlash")
STEP = Discovered(place="joint_3", quantity="time", shape="step", marks=(3600.0,))
BEND = Discovered(place="joint_2", quantity="joint_2", shape="hinge", marks=(0.3, 1.0))


def known(campaign, effects=LISTED):
    return fit(campaign, choose(effects, (), ()))


def lawful(own, number=1):
    """The fit with a law among its effects, where one is worth its place; else the fit itself."""
    return forward_selection(own, number, lambda _: None) or own


@pytest.fixture(scope="module")
def stepped(rv_m2):
    """An elbow that jumps after an hour."""
    return known(with_law(rv_m2, STEP, [0.0, 5e-4], seed=3)[0])


@pytest.fixture(scope="module")
def offered(stepped):
    return candidates(stepped, 2, events(stepped))


@pytest.fixture(scope="module")
def found(stepped):
    return lawful(stepped)


def test_the_true_law_is_offered_first_and_pays_for_all_among_which_it_was_picked(offered, stepped):
    # the true law is the first that is offered
    assert 1 < len(offered) <= settings.COMPARED_LAWS
    assert len(set(offered)) == len(offered)
    assert {law.name for law in offered} == {"discovered.2"}
    assert (offered[0].kind, offered[0].place, offered[0].quantity) == ("joint", "joint_3", "time")
    assert offered[0].shape in ("step", "slide")
    # At each of five joints, base, tool: every quantity, and of each shapes; and segments besides.
    robot = stepped.campaign.robot
    for law in offered:
        # a mark in time has its share of the range, all others are counted
        assert law.shape == "step" or law.tried == round(law.tried)
        assert law.tried > (robot.n + 2) * 15
        assert law.share == pytest.approx(1.0 / law.tried)


def test_place_and_quantity_have_probabilities(found):
    (law,) = discovered(found)
    assert law.law.name == "discovered.1"
    assert (law.law.place, law.law.quantity) == ("joint_3", "time")
    assert law.probability > 0.9
    for pairs, first in ((law.places, ("joint", "joint_3")), (law.quantities, "time")):
        chances = [p for _, p in pairs]
        assert pairs[0][0] == first
        assert chances == sorted(chances, reverse=True)
        assert chances[0] >= law.probability - 1e-9
        assert sum(chances) <= 1.0 + 1e-9  # one law at a time


@pytest.mark.parametrize(
    ("law", "values"), [(STEP, [0.0, 6e-4]), (BEND, [0.0, 4e-3])], ids=["a step in time", "a bend of a joint"]
)
@pytest.mark.slow  # each is found once below
@pytest.mark.parametrize("seed", [1, 2, 5])
def test_an_injected_law_is_found_with_place_and_quantity(rv_m2, law, values, seed):
    own = lawful(known(with_law(rv_m2, law, values, seed=seed)[0]))
    (named,) = discovered(own)
    assert (named.law.place, named.law.quantity) == (law.place, law.quantity)
    assert [effect.name for effect, _ in own.effects] == ["discovered.1"]


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_no_gain_stands_beside_the_wrong_side_of_a_bend(rv_m2, side, seed):
    """A gain takes a bend's straight part first; what is left bends the other way, which the gain must not survive."""
    joint = rv_m2.joint_names.index("joint_2")
    q = with_law(rv_m2, BEND, [0.0, 0.0], seed=seed)[0].q[:, joint]
    bend = replace(BEND, place="joint_2", quantity="joint_2", marks=(float(np.median(q)), side), span=2.0)
    found = tr.diagnose(with_law(rv_m2, bend, [0.0, 3e-3], seed=seed)[0])
    names = [effect.name for effect, _ in found.fit.effects]
    assert "joint_gain" not in names
    assert "discovered.1" in names


def test_a_law_of_the_base_is_placed_there(rv_m2):
    """A tracker that is warmed: the base moves with the temperature."""
    shape = Discovered(kind="base", place="base", quantity="temperature", shape="step", marks=(22.0,))
    values = np.zeros(12)
    values[[1, 3]] = 1.5e-4
    own = lawful(known(with_law(rv_m2, shape, values, seed=2)[0]))
    (named,) = discovered(own)
    assert (named.law.kind, named.law.quantity) == ("base", "temperature")


@pytest.mark.slow
def test_noise_makes_no_law(rv_m2):
    """Of thirty campaigns of noise none has a law that is worth its place."""
    worth = []
    for seed in range(30):
        own = known(simulate(rv_m2, samples=80, seed=seed, noise=NOISE)[0], ("joint_offset",))
        wider = forward_selection(own, 1, lambda _: None)
        if wider is not None:
            worth.append((seed, [e.name for e, _ in wider.effects]))
    assert worth == []


@pytest.mark.parametrize("seeds", [range(1), pytest.param(range(1, 12), marks=pytest.mark.slow)], ids=len)
def test_repeats_of_few_poses_make_no_law_of_what_a_pose_brings(rv_m2, seeds):
    """Threefold visits to poses that each have an error of their own: rows of one pose count once."""
    worth = []
    for seed in seeds:
        plain = simulate(rv_m2, samples=40, seed=seed, noise=NOISE)[0].take(np.repeat(np.arange(40), 3))
        rng = np.random.default_rng(seed)
        shared = np.repeat(2.0 * NOISE * rng.normal(size=(40, 3)), 3, axis=0)
        single = plain.position + shared + NOISE * rng.normal(size=(120, 3))
        own = known(replace(plain, position=single, rows=np.arange(2, 122)), ("joint_offset",))
        wider = forward_selection(own, 1, lambda _: None)
        if wider is not None:
            worth.append((seed, [(e.name, getattr(e, "quantity", "")) for e, _ in wider.effects]))
    assert worth == []


def test_what_a_known_effect_and_a_zero_do_is_no_law(rv_m2):
    """Two levels by the direction of approach are lost motion and a zero; without one of the two they are a law."""
    campaign, _, _ = simulate(rv_m2, ["backlash"], seed=4, noise=NOISE)
    levels = Discovered(
        place="joint_3", quantity="approach.joint_3", shape="levels", marks=(-1.0, 1.0), origin=-1.0, span=2.0
    )
    sample = RowSample.of(known(campaign))
    assert listed(sample, levels)
    assert not listed(sample, replace(levels, place="joint_2"))
    assert not listed(sample, replace(STEP, span=3600.0))
    for fewer in (("joint_offset", "joint_gain"), ("joint_gain", "backlash")):
        assert not listed(RowSample.of(known(campaign, fewer)), levels)


@pytest.mark.parametrize("seed", some([1, 3, 4], 3))
def test_a_known_effect_that_is_at_work_in_one_joint_or_several_leaves_nothing_to_find(rv_m2, seed):
    campaign, truth, _ = simulate(rv_m2, ["backlash"], seed=seed, noise=NOISE)
    faulty = tuple(name.removeprefix("lost motion, ") for name in truth["parts"]["backlash"]["values"])
    assert (len(faulty) > 1) == (seed != 4)
    own = known(campaign)
    ((effect, _),) = own.effects
    assert effect.name == "backlash"
    assert effect.places == faulty or seed != 4
    assert forward_selection(own, 1, lambda _: None) is None


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 3])
def test_effects_that_had_taken_the_cause_upon_themselves_go_again(rv_m2, seed):
    """A joint that errs on one side of a place alone looks like a zero and a gain."""
    own = known(with_law(rv_m2, BEND, [0.0, 4e-3], seed=seed)[0])
    assert own.effects
    assert not any(isinstance(effect, Discovered) for effect, _ in own.effects)
    again = lawful(own)
    ((law, _),) = again.effects
    assert (law.place, law.quantity) == ("joint_2", "joint_2")


def test_a_law_of_a_segment_is_placed_at_the_link_that_carries_it(stepped):
    robot = stepped.campaign.robot
    assert where(stepped, STEP) == ("joint", "joint_3")
    assert where(stepped, Discovered(kind="base", place="base")) == ("base", "base")
    for segment in robot.segments[1:]:
        if segment.movable:
            assert where(stepped, Discovered(kind="link", place=segment.name)) == ("link", segment.parent_link)


ROWS, EVENT_NOISE = 90, 20e-6
TOOL = exp6(np.array([0.03, 0.02, 0.09, 0.0, 0.0, 0.0]))
BASE = exp6(np.array([0.4, -0.2, 0.1, 0.2, -0.5, 0.9]))


def measured(effects=None, base=BASE, tool=TOOL, robot="builtin:rv_m2"):
    frame = {"builtin:rv_m2": "tool0", "example-robot-data:ur5": "tool0"}[robot]
    return tr.simulate(robot, effects, base=base, tool=tool, tool_frame=frame, rows=ROWS, noise=EVENT_NOISE, seed=4)


def spliced(one, other, rows):
    """A campaign that is the other one in some rows."""
    position = one.position.copy()
    position[rows] = other.position[rows]
    return replace(one, position=position)


def shifted(kind, size, **options):
    """The same rows with something elsewhere, m or rad: what moved is simulated, not added to a linear model."""
    if kind == "base":
        moved = BASE @ exp6(size * np.array([0.6, -0.5, 0.62, 0.2, 0.3, -0.1]))
        return measured(base=moved, **options)
    if kind == "tool":
        return measured(tool=exp6(size * np.array([0.6, 0.5, -0.62, 0.0, 0.0, 0.0])) @ TOOL, **options)
    return measured({"joint_offset": {"joint_2": size}} if size else None, **options)


def with_events(campaign, *only):
    known = fit(campaign, choose(only or ("backlash", "joint_compliance"), (), ()))
    return known, events(known)


def assert_rows(event, known, span):
    """An event has the rows of a span and no other, and the simplest shape of these."""
    inside = event.at_rows(known.nominal)[0][:, 1] > 0.0
    true = np.zeros(ROWS, dtype=bool)
    true[slice(*span)] = True
    assert (inside == true).all() or (inside == ~true).all()
    assert event.shape == ("run" if span == (35, 55) else "step")


SPANS = {"base": (0, 30), "tool": (50, ROWS), "joint": (35, 55)}


@pytest.mark.parametrize(
    ("kind", "span"),
    [
        pytest.param(kind, span, marks=[pytest.mark.slow] * (own != kind))
        for kind in SPANS
        for own, span in SPANS.items()
    ],
)
def test_rows_that_go_together_are_one_event_at_its_place(kind, span):
    """1 mm or 1 mrad: before, after, and between two changes; each of its rows is in it and no other."""
    data = spliced(measured(), shifted(kind, 1e-3), slice(*span))
    known, (first, *_) = with_events(data)
    assert first.kind == kind
    assert first.place == ("joint_2" if kind == "joint" else kind)
    assert_rows(first, known, span)


@pytest.mark.slow
def test_what_is_named_of_an_event_has_all_of_its_rows():
    """A tool that sits elsewhere in the first thirty rows."""
    span = (0, 30)
    known, _ = with_events(spliced(measured(), shifted("tool", 1e-3), slice(*span)))
    ((named, _),) = lawful(known).effects
    assert named.kind == "tool"
    assert_rows(named, known, span)


def test_an_event_is_found_where_no_frame_is_fitted():
    """A joint alone, as base and target are known; nothing is then projected out."""
    known = {"base_known": True, "tool_known": True, "target": TOOL[:3, 3]}
    one, other = (replace(shifted("joint", size, base=np.eye(4)), **known) for size in (0.0, 1e-3))
    _, (first, *_) = with_events(spliced(one, other, slice(0, 30)))
    assert (first.kind, first.place, first.shape) == ("joint", "joint_2", "step")


def test_half_the_rows_of_a_session_that_were_set_aside_are_an_event_of_the_session():
    """Sessions by turns: no run of rows holds one, and a quarter of all rows is set aside at most."""
    label = np.array(["a", "b", "c"])[np.arange(ROWS) // 6 % 3]
    data = spliced(measured(), shifted("tool", 0.9e-3), label == "b")
    _, (first, *_) = with_events(replace(data, labels={"session": label}))
    assert (first.kind, first.quantity, first.shape) == ("tool", "session", "apart")
    assert first.labels[int(first.marks[0])] == "b"


def test_noise_and_ordinary_effects_are_no_events():
    every = ("backlash", "joint_offset", "drift", "thermal_elongation")
    for effects in ({}, {"backlash": 3e-4}, {"joint_offset": 1e-3}, {"drift": {"translation x": 4e-4}}):
        known, events_found = with_events(measured(effects), *every)
        assert not [law for law in events_found if law.kind != "base"], effects
        assert {effect.name for effect, _ in known.effects} == set(effects)


@pytest.mark.slow
def test_gross_errors_side_by_side_are_no_event():
    """Three lost beams in a row, each its own way: rows that share in nothing."""
    for seed in range(2):
        data, rng = measured(), np.random.default_rng(seed)
        position = data.position.copy()
        position[40:43] += rng.normal(size=(3, 3)) * 3e-3
        position[[5, 70]] += 2e-3
        known, none = with_events(replace(data, position=position))
        assert none == ()
        assert known.explanation.outliers[40:43].all()


def test_an_event_pays_for_the_rows_places_and_sessions_among_which_it_was_picked():
    data = spliced(measured(), shifted("base", 1e-3), slice(50, ROWS))
    _, (step, *_) = with_events(data)
    _, (run, *_) = with_events(spliced(measured(), shifted("base", 1e-3), slice(35, 55)))
    assert step.tried > 7 * (ROWS - 20)  # five joints, base and tool, and nearly every row
    assert run.tried > 50 * step.tried


def test_rows_set_aside_near_each_other_are_told_from_single_ones():
    data = measured()
    known = fit(data, choose(("backlash",), (), ()))
    aside = np.zeros(ROWS, dtype=bool)
    aside[[3, 30, 33, 34, 36, 80]] = True
    assert np.flatnonzero(clustered_outliers(known, aside)).tolist() == [30, 33, 34, 36]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "says"),
    [("tool", "the target sits 1 mm elsewhere"), ("joint", "zero 1 mrad off")],
)
def test_an_event_is_told_by_its_rows_and_leaves_the_other_effect_its_size(kind, says):
    """Lost motion beside an event: the same as without it, within what noise allows."""
    lost = {"backlash": 3e-4}
    whole = measured(lost)
    other = shifted(kind, 1e-3) if kind == "tool" else measured({"joint_offset": {"joint_2": 1e-3}, **lost})
    other = measured(lost, tool=exp6(1e-3 * np.array([0.6, 0.5, -0.62, 0, 0, 0])) @ TOOL) if kind == "tool" else other
    only = ["backlash", "joint_offset", "drift"]
    told = tr.diagnose(spliced(whole, other, slice(0, 30)), only=only)
    sound = tr.diagnose(whole, only=only)
    (event,) = [f for f in told.effects if f.quantity]
    assert "rows 2 to 31" in event.describes
    assert says in event.describes
    assert "rows 2–31" in told.summary
    assert not told.outliers
    for one, same in zip(told.finding("backlash").parameters, sound.finding("backlash").parameters, strict=True):
        assert one.value == pytest.approx(same.value, abs=3.0 * np.hypot(one.std, same.std))


def test_what_is_left_of_rows_held_out_is_what_separate_fits_leave():
    """A column that a tight prior holds at nothing is as none; a further one counts as if it had been there."""
    rng = np.random.default_rng(0)
    columns = rng.normal(size=(60, 3, 4))
    values = columns @ [1.0, -2.0, 0.5, 3.0] + rng.normal(size=(60, 3))
    labels, expected, none = np.arange(60) % 5, 0.0, np.zeros(0)
    for label in range(5):
        held = labels == label
        fitted = np.linalg.lstsq(columns[~held].reshape(-1, 4), values[~held].ravel(), rcond=None)[0]
        expected += ((values[held] - columns[held] @ fitted) ** 2).sum()
    whole, first = (HeldOut.of(own, values, each(labels)) for own in (columns, columns[:, :, :3]))
    np.testing.assert_allclose(whole.left(4, none), expected, rtol=1e-8)
    np.testing.assert_allclose(whole.left(3, np.array([1e12])), first.left(3, none), rtol=1e-6)
    prior = np.array([0.3])
    np.testing.assert_allclose(first.left(3, prior, columns[:, :, 3:]), whole.left(3, prior), rtol=1e-12)
