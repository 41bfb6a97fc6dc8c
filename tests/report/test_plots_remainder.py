"""The remainder: every row at its place, the noise as a band, what was set aside as crosses."""

from dataclasses import replace

import numpy as np
import pytest
from report.looking import line, lines_of
from simulate import simulate

from thermal_robot import diagnose
from thermal_robot.diagnosis.values import Dependence
from thermal_robot.report import plot_remainder


def test_remainder_is_drawn_against_what_it_follows(case):
    figure = plot_remainder(case("unexplained"))
    assert len(figure.axes) == 6
    assert {axes.get_xlabel() for axes in figure.axes} == {"", "row in the file", "time (s)"}
    assert [axes.get_ylabel() for axes in figure.axes[::2]] == ["x (µm)", "y (µm)", "z (µm)"]
    points, median, crosses, _ = lines_of(figure.axes[2])
    assert len(points.get_xdata()) == 118
    assert list(crosses.get_xdata()) == [17, 80]
    assert np.all(np.abs(crosses.get_ydata()) < figure.axes[2].get_ylim()[1])
    steps = median.get_ydata()
    assert steps[0] == pytest.approx(40.0, abs=15.0)
    assert steps[-1] == pytest.approx(-90.0, abs=15.0)


@pytest.mark.parametrize("name", ["elbow_joint", "order"])
def test_remainder_finds_joints_and_the_order_of_rows(case, name):
    left = replace(case("unexplained").unexplained, depends_on=(Dependence(name, 1e-4),))
    figure = plot_remainder(replace(case("unexplained"), unexplained=left))
    assert len(figure.axes) == 6


def test_remainder_does_without_a_quantity_that_is_not_recorded(case):
    left = replace(case("unexplained").unexplained, depends_on=(Dependence("session", 1e-4),))
    assert len(plot_remainder(replace(case("unexplained"), unexplained=left)).axes) == 3


def test_remainder_leaves_out_rows_without_the_quantity(case):
    diagnosis = case("unexplained")
    time_ = np.where(np.arange(120) % 3 == 0, np.nan, diagnosis.rows.covariates["time"])
    diagnosis = replace(diagnosis, rows=replace(diagnosis.rows, covariates={"time": time_}))
    points = lines_of(plot_remainder(diagnosis).axes[1])[0]
    assert len(points.get_xdata()) == int((np.isfinite(time_) & ~diagnosis.rows.outliers).sum())


def test_points_are_the_remainder_of_the_rows_that_count(case):
    diagnosis = case("found")
    figure = plot_remainder(diagnosis)
    used = ~diagnosis.rows.outliers
    assert len(figure.axes) == 3
    for k, axes in enumerate(figure.axes):
        where, values = line(axes, "remainder")
        assert np.array_equal(where, diagnosis.rows.rows[used])
        assert np.allclose(values, 1e6 * diagnosis.rows.remainder[used, k])
        low, high = axes.get_ylim()
        assert low == -high
        assert np.all(np.abs(values) < high)


def test_the_band_holds_so_much_of_noise_as_two_sigma_must(case, make_rows):
    diagnosis = replace(case("nothing"), rows=make_rows(2000, before=1e-9, after=2.6e-5))
    for axes in plot_remainder(diagnosis).axes:
        (low, high) = axes.patches[0].get_y(), axes.patches[0].get_y() + axes.patches[0].get_height()
        _, values = line(axes, "remainder")
        assert high == -low
        assert np.mean(np.abs(values) < high) == pytest.approx(0.9545, abs=0.015)


def test_crosses_stay_whole_at_the_edge_and_true_inside(case):
    diagnosis = case("found")
    remainder = diagnosis.rows.remainder.copy()
    row = int(np.flatnonzero(diagnosis.rows.outliers)[0])
    remainder[row] = (1e-5, -1.0, 1.0)
    x, y, z = plot_remainder(replace(diagnosis, rows=replace(diagnosis.rows, remainder=remainder))).axes
    assert line(x, "set aside")[1, 0] == pytest.approx(10.0)
    for axes, side in ((y, -1.0), (z, 1.0)):
        at = line(axes, "set aside")[1, 0]
        assert 0.8 < side * at / axes.get_ylim()[1] < 0.92


def test_the_median_of_few_levels_stands_at_each(case):
    base = case("unexplained")
    payload = np.repeat([0.0, 2.5, 5.0], 40)
    remainder = np.repeat([1e-5, -2e-5, 3e-5], 40)[:, None] * np.ones(3)
    diagnosis = replace(
        base,
        rows=replace(base.rows, remainder=remainder, covariates={"payload": payload}),
        unexplained=replace(base.unexplained, depends_on=(Dependence("payload", 1e-6),)),
    )
    axes = plot_remainder(diagnosis).axes[1]
    np.testing.assert_allclose(line(axes, "median at each value"), [[0.0, 2.5, 5.0], [10.0, -20.0, 30.0]])


def test_joint_positions_are_those_commanded(case):
    base = case("unexplained")
    left = replace(base.unexplained, depends_on=(Dependence("elbow_joint", 1e-4),))
    diagnosis = replace(base, unexplained=left)
    where, _ = line(plot_remainder(diagnosis).axes[1], "remainder")
    assert np.array_equal(where, diagnosis.rows.q[~diagnosis.rows.outliers, 2])


def label_of(case, name, values=None):
    """What the axis of a quantity bears that the remainder follows; a joint's own position without values."""
    base = case("unexplained")
    joints = {"slide": "m", "hand": "rad"}
    known = {"velocity.slide": "m/s", "velocity.hand": "rad/s", "temperature.hand": "°C", "torque.slide": "N", **joints}
    covariates = {} if values is None else {name: values}
    diagnosis = replace(
        base,
        joint_names=tuple(joints),
        rows=replace(base.rows, q=base.rows.q[:, :2], covariates=covariates, units=known),
        unexplained=replace(base.unexplained, depends_on=(Dependence(name, 1e-6),)),
    )
    return plot_remainder(diagnosis).axes[5].get_xlabel()


@pytest.mark.parametrize(
    ("name", "label"),
    [
        ("velocity.slide", "velocity.slide (m/s)"),
        ("velocity.hand", "velocity.hand (rad/s)"),
        ("torque.slide", "torque.slide (N)"),
        ("temperature.hand", "temperature.hand (°C)"),
        ("approach.slide", "approach.slide (−1, 0, 1)"),
        ("speed", "speed (share of the maximum)"),
        ("order", "order (number)"),
        ("humidity", "humidity"),
    ],
)
def test_an_axis_bears_the_unit_of_what_was_recorded(case, name, label):
    assert label_of(case, name, np.linspace(0.0, 1.0, 120)) == label


def test_a_joint_that_slides_is_drawn_in_metres_and_one_that_turns_in_radians(case):
    assert [label_of(case, joint) for joint in ("slide", "hand")] == ["slide (m)", "hand (rad)"]


def test_a_diagnosis_knows_the_unit_of_a_joint_that_slides(awkward):
    found = diagnose(simulate(awkward, ["drift"], seed=3, moving=True)[0], only=["drift"])
    for joint, kind in zip(awkward.joint_names, awkward.joint_types, strict=True):
        length = "m" if kind == "prismatic" else "rad"
        left = replace(found.unexplained, depends_on=(Dependence(f"velocity.{joint}", 1e-6),))
        assert plot_remainder(replace(found, unexplained=left)).axes[5].get_xlabel() == f"velocity.{joint} ({length}/s)"
        assert found.rows.units[joint] == length
    assert {*found.rows.covariates, *found.joint_names} == set(found.rows.units)


def test_directions_of_approach_are_not_joined_by_a_line(case):
    diagnosis = case("unexplained")
    side = np.where(np.arange(120) % 2 == 0, -1.0, 1.0)
    left = replace(diagnosis.unexplained, depends_on=(Dependence("approach.joint_1", 1e-4),))
    rows = replace(diagnosis.rows, covariates={"approach.joint_1": side})
    figure = plot_remainder(replace(diagnosis, unexplained=left, rows=rows))
    used = ~diagnosis.rows.outliers
    for k, axes in enumerate(figure.axes[1::2]):
        (medians,) = [drawn for drawn in axes.lines if drawn.get_label() == "median at each value"]
        assert medians.get_linestyle() == "None"
        for level, middle in zip(*medians.get_data(), strict=True):
            of = 1e6 * rows.remainder[used & (side == level), k]
            assert (of < middle).sum() <= len(of) / 2 >= (of > middle).sum()
