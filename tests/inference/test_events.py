"""Events: rows in which base, target or a joint stands elsewhere are found together, and sound rows have none."""

from dataclasses import replace

import numpy as np
import pytest

import thermal_robot as tr
from thermal_robot.effects import choose
from thermal_robot.inference.fit import fit
from thermal_robot.inference.generate import events, gathered
from thermal_robot.kinematics import exp6

ROWS, NOISE = 90, 20e-6
TOOL = exp6(np.array([0.03, 0.02, 0.09, 0.0, 0.0, 0.0]))
BASE = exp6(np.array([0.4, -0.2, 0.1, 0.2, -0.5, 0.9]))


def measured(effects=None, base=BASE, tool=TOOL, robot="builtin:rv_m2"):
    frame = {"builtin:rv_m2": "tool0", "example-robot-data:ur5": "tool0"}[robot]
    return tr.simulate(robot, effects, base=base, tool=tool, tool_frame=frame, rows=ROWS, noise=NOISE, seed=4)


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


def found(campaign, *only):
    known = fit(campaign, choose(only or ("backlash", "joint_compliance"), (), ()))
    return known, events(known)


@pytest.mark.parametrize("kind", ["base", "tool", "joint"])
@pytest.mark.parametrize("span", [(0, 30), (50, ROWS), (35, 55)])
def test_rows_that_go_together_are_one_event_at_its_place(kind, span):
    """1 mm or 1 mrad: before, after, and between two changes; each of its rows is in it and no other."""
    data = spliced(measured(), shifted(kind, 1e-3), slice(*span))
    known, (first, *_) = found(data)
    assert first.kind == kind
    assert first.place == ("joint_2" if kind == "joint" else kind)
    inside = first.at_rows(known.nominal)[0][:, 1] > 0.0
    true = np.zeros(ROWS, dtype=bool)
    true[slice(*span)] = True
    assert (inside == true).all() or (inside == ~true).all()
    assert first.shape == ("run" if span == (35, 55) else "step")


def test_an_event_is_found_where_no_frame_is_fitted():
    """A joint alone, as base and target are known; nothing is then projected out."""
    known = {"base_known": True, "tool_known": True, "target": TOOL[:3, 3]}
    one, other = (replace(shifted("joint", size, base=np.eye(4)), **known) for size in (0.0, 1e-3))
    _, (first, *_) = found(spliced(one, other, slice(0, 30)))
    assert (first.kind, first.place, first.shape) == ("joint", "joint_2", "step")


def test_half_the_rows_of_a_session_that_were_set_aside_are_an_event_of_the_session():
    """Sessions by turns: no run of rows holds one, and a quarter of all rows is set aside at most."""
    label = np.array(["a", "b", "c"])[np.arange(ROWS) // 6 % 3]
    data = spliced(measured(), shifted("tool", 0.9e-3), label == "b")
    _, (first, *_) = found(replace(data, labels={"session": label}))
    assert (first.kind, first.quantity, first.shape) == ("tool", "session", "apart")
    assert first.labels[int(first.marks[0])] == "b"


def test_noise_and_ordinary_effects_are_no_events():
    every = ("backlash", "joint_offset", "drift", "thermal_elongation")
    for effects in ({}, {"backlash": 3e-4}, {"joint_offset": 1e-3}, {"drift": {"translation x": 4e-4}}):
        known, events_found = found(measured(effects), *every)
        assert not [law for law in events_found if law.kind != "base"], effects
        assert {effect.name for effect, _ in known.effects} == set(effects)


def test_gross_errors_side_by_side_are_no_event():
    """Three lost beams in a row, each its own way: rows that share in nothing."""
    for seed in range(8):
        data, rng = measured(), np.random.default_rng(seed)
        position = data.position.copy()
        position[40:43] += rng.normal(size=(3, 3)) * 3e-3
        position[[5, 70]] += 2e-3
        known, none = found(replace(data, position=position))
        assert none == ()
        assert known.explanation.outliers[40:43].all()


def test_an_event_pays_for_the_rows_places_and_sessions_among_which_it_was_picked():
    data = spliced(measured(), shifted("base", 1e-3), slice(50, ROWS))
    _, (step, *_) = found(data)
    _, (run, *_) = found(spliced(measured(), shifted("base", 1e-3), slice(35, 55)))
    assert step.tried > 7 * (ROWS - 20)  # five joints, base and tool, and nearly every row
    assert run.tried > 50 * step.tried


def test_rows_set_aside_near_each_other_are_told_from_single_ones():
    data = measured()
    known = fit(data, choose(("backlash",), (), ()))
    aside = np.zeros(ROWS, dtype=bool)
    aside[[3, 30, 33, 34, 36, 80]] = True
    assert np.flatnonzero(gathered(known, aside)).tolist() == [30, 33, 34, 36]


@pytest.mark.parametrize(("kind", "says"), [("tool", "the target sits 1 mm elsewhere"), ("joint", "zero 1 mrad off")])
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
