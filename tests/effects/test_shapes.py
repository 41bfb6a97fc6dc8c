"""Shapes of laws: what they do at their marks, and that one table serves all that ask."""

import numpy as np
import pytest

from thermal_robot.effects.law import Discovered
from thermal_robot.effects.shapes import SHAPES

X = np.linspace(-2.0, 4.0, 121)
MARKS = {
    "step": (0.7,),
    "run": (0.2, 1.9),
    "slide": (0.7, 0.3),
    "hinge": (0.7, 1.0),
    "bump": (0.7, 0.3),
    "harmonic": (2.0,),
    "hysteresis": (0.7, 3.0),
    "relaxing": (0.7,),
    "relaxing each": (0.7,),
    "apart": (float(X[60]),),
    "levels": (-2.0, 0.0, 1.0, 4.0),
    "smooth": (-1.5, 0.0, 0.4, 2.0, 3.5),
}


def values(name, x=X, marks=None, origin=-2.0, span=6.0):
    marks = MARKS.get(name, ()) if marks is None else marks
    if SHAPES[name].of == "strains":  # of elements that have slipped at −2 and are pulled
        x = np.column_stack([np.minimum((x + 2.0) / slip - 1.0, 1.0) for slip in marks])
    if SHAPES[name].of in ("run", "runs"):  # one began at −2, the other at 1
        begun = np.where(x < 1.0, x + 2.0, x - 1.0)[:, None]
        x = begun if SHAPES[name].of == "run" else np.where((x[:, None] < 1.0) == [True, False], begun, np.inf)
    return SHAPES[name].functions(x, marks, origin, span)


@pytest.mark.parametrize("name", SHAPES)
def test_a_shape_has_a_label_for_each_function_and_contains_a_constant(name):
    found = values(name)
    labels = (*SHAPES[name].labels, *(MARKS[name] if SHAPES[name].each else ()))
    labels += ("one", "other") if SHAPES[name].of == "runs" else ()
    assert found.shape == (len(X), len(labels))
    assert np.isfinite(found).all()
    # whatever the law, an offset of the place is part of it
    left = np.ones(len(X)) - found @ np.linalg.lstsq(found, np.ones(len(X)), rcond=None)[0]
    assert np.abs(left).max() < 1e-9
    assert np.linalg.matrix_rank(found) == len(labels)


@pytest.mark.parametrize("name", SHAPES)
def test_a_row_knows_nothing_of_the_rows_beside_it(name):
    shuffled = np.random.default_rng(0).permutation(len(X))
    np.testing.assert_allclose(values(name, X[shuffled]), values(name)[shuffled], rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(values(name, X[7:8]), values(name)[7:8], rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize("name", SHAPES)
def test_a_mark_is_sudden_or_gradual_as_stated(name):
    """What moves a little with a gradual mark moves nothing, or jumps, with a sudden one."""
    shape, marks = SHAPES[name], MARKS.get(name, ())
    if not shape.mark:
        assert Discovered(shape=name, marks=marks).nearby(1.6) == (Discovered(shape=name, marks=marks),)
        return
    # the mark lies on no row
    shift = np.abs(
        values(name, marks=(marks[0] + 1e-3 + 1e-6, *marks[1:])) - values(name, marks=(marks[0] + 1e-3, *marks[1:]))
    )
    far = np.abs(values(name, marks=(marks[0] + 0.2, *marks[1:])) - values(name))
    assert far.max() > 1e-2
    assert (0.0 < shift.max() < 1e-4) if shape.mark == "gradual" else (shift.max() == 0.0 and far.max() == 1.0)


@pytest.mark.parametrize("name", [n for n, s in SHAPES.items() if s.mark])
def test_what_may_be_refined_is_the_mark_and_the_width(name):
    law = Discovered(shape=name, marks=MARKS[name], span=6.0)
    near = [other.marks for other in law.nearby(1.5)]
    assert MARKS[name] in near
    moved = {m[0] for m in near}
    assert len(moved) == 3
    assert max(moved) - 0.7 == pytest.approx(0.7 - min(moved)) == pytest.approx(0.02 * 6.0)
    widths = {m[1] for m in near if len(m) > 1}
    assert widths == ({0.3, 0.3 * 1.5, 0.3 / 1.5} if SHAPES[name].width else set(MARKS[name][1:]))


def test_a_step_is_one_before_and_another_after():
    found = values("step")
    np.testing.assert_array_equal(found[:, 0], X <= 0.7)
    np.testing.assert_array_equal(found.sum(axis=1), 1.0)


def test_a_narrow_slide_is_a_step_and_a_wide_one_passes_its_middle_at_half():
    off = np.abs(X - 0.7) > 0.02
    np.testing.assert_allclose(values("slide", marks=(0.7, 1e-3))[off], values("step")[off], atol=1e-12)
    np.testing.assert_allclose(values("slide", np.array([0.7])), [[0.5, 0.5]])


def test_a_hinge_bends_on_its_side_only():
    beyond, before = (values("hinge", marks=(0.7, side))[:, 1] for side in (1.0, -1.0))
    assert not beyond[X < 0.7].any()
    assert not before[X > 0.7].any()
    # together they are the distance from the mark, in spans
    np.testing.assert_allclose(beyond + before, np.abs(X - 0.7) / 6.0, atol=1e-15)


def test_a_bump_is_one_at_its_mark_and_gone_far_from_it():
    np.testing.assert_allclose(values("bump", np.array([0.7, 0.7 - 3.0]))[:, 1], [1.0, 0.0], atol=1e-12)
    height = values("bump")[:, 1]
    assert abs(X[height.argmax()] - 0.7) < 0.05
    area = height.sum() * (X[1] - X[0])
    assert area == pytest.approx(0.3 * np.sqrt(2.0 * np.pi), rel=1e-3)


def test_a_drag_keeps_its_sign_through_zero():
    low, zero, high = values("drag", np.array([-1e-9, 0.0, 1e-9]))[:, 2]
    assert (low, zero, high) == (-1.0, 0.0, 1.0)


def test_a_harmonic_repeats_after_a_turn_of_its_order():
    np.testing.assert_allclose(values("harmonic", X + np.pi), values("harmonic"), atol=1e-12)
    assert np.abs(values("harmonic", X + np.pi / 2.0) - values("harmonic")).max() > 1.0


def test_what_relaxes_is_whole_at_its_start_and_a_third_after_its_time_constant():
    found = values("relaxing", np.array([-2.0, -1.3, 1.0, 1.7]))
    np.testing.assert_allclose(found[:, 1], [1.0, np.exp(-1.0), 1.0, np.exp(-1.0)], rtol=1e-12)
    each = values("relaxing each")
    np.testing.assert_allclose(each[:, 1] + each[:, 2], values("relaxing")[:, 1], rtol=1e-12)
    assert not (each[:, 1] * each[:, 2]).any()


def test_levels_are_told_by_the_nearest():
    found = values("levels", np.array([-5.0, -0.9, 0.6, 2.4, 2.6, 9.0]))
    assert found.argmax(axis=1).tolist() == [0, 1, 2, 2, 3, 3]
    np.testing.assert_array_equal(found.sum(axis=1), 1.0)


def test_a_spline_takes_a_value_at_each_knot_bends_smoothly_and_runs_straight_beyond():
    knots = np.array(MARKS["smooth"])
    np.testing.assert_allclose(values("smooth", knots), np.eye(5), atol=1e-12)
    heights = np.array([1.0, -2.0, 0.5, 3.0, 0.0])

    def curve(x):
        return values("smooth", np.asarray(x)) @ heights

    for knot in knots:
        h = 1e-4
        slope = (curve([knot + h]) - curve([knot])) / h, (curve([knot]) - curve([knot - h])) / h
        assert slope[0] == pytest.approx(slope[1], abs=0.02)
    beyond = curve([3.5, 4.5, 5.5, 6.5])
    np.testing.assert_allclose(np.diff(beyond, 2), 0.0, atol=1e-9)
    np.testing.assert_allclose(np.diff(curve([-1.5, -2.5, -3.5]), 2), 0.0, atol=1e-9)
    # a natural spline through a straight line is that line, everywhere
    line = values("smooth") @ (2.0 * knots + 1.0)
    np.testing.assert_allclose(line, 2.0 * X + 1.0, atol=1e-9)
