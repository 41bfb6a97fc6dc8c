"""What goes into the ledger: a hand of some length, and nothing else about the robot."""

import numpy as np
import pytest

from thermal_robot import cli
from thermal_robot.errors import RobotError
from thermal_robot.kinematics import tool_poses
from thermal_robot.paper import PaperInputs, rows, rv_m2_with_hand
from thermal_robot.paper.entry import Printed, Words, judge, numbers
from thermal_robot.paper.inputs import joints


def test_the_hand_is_the_only_change_of_the_robot():
    nominal, other = rv_m2_with_hand(PaperInputs().l5), rv_m2_with_hand(0.123)
    assert nominal.segments[-1].length == rv_m2_with_hand().segments[-1].length
    assert [s.name for s in other.segments] == [s.name for s in nominal.segments]
    assert [s.length for s in other.segments[:-1]] == [s.length for s in nominal.segments[:-1]]
    assert (nominal.segments[-1].length, other.segments[-1].length) == (0.15, 0.123)


@pytest.mark.parametrize("l5", ["0", "-0.1", "nan", "inf", "5e-324", "1e-9", "1001", "1e154", "1e308"])
def test_a_hand_that_arithmetic_does_not_bear_is_refused_in_one_line(capsys, l5):
    words = (
        "l5 must be from 0.001 to 1000 m long" if 0.0 < float(l5) < np.inf else "l5 must be a positive number of metres"
    )
    with pytest.raises(RobotError, match=words):
        PaperInputs(l5=float(l5))
    assert cli.main(["paper", f"--l5={l5}"]) == 2
    out, err = capsys.readouterr()
    assert (out, err) == ("", f"thermal-robot: {words}, got {float(l5)}\n")


def test_a_word_for_a_length_is_refused_in_one_line(capsys):
    with pytest.raises(SystemExit, match="2"):
        cli.main(["paper", "--l5", "long"])
    assert capsys.readouterr().err.count("\n") == 1


def test_joints_are_those_of_the_robot_and_the_fifth_moves_nothing():
    q = joints(*PaperInputs().poses)
    assert q.shape == (2, 5)
    turned = q + np.array([0.0, 0.0, 0.0, 0.0, 1.3])
    places = [tool_poses(rv_m2_with_hand(), angles)[:, :3, 3] for angles in (q, turned)]
    np.testing.assert_allclose(places[1], places[0], atol=1e-15)


def test_poses_lie_within_the_limits_of_the_robot():
    robot, inputs = rv_m2_with_hand(), PaperInputs()
    q = joints(*inputs.poses, inputs.pose_5a)
    assert np.all((q >= robot.lower) & (q <= robot.upper))


# ---- what is printed and what is computed


@pytest.mark.parametrize(
    ("text", "values", "digit"),
    [
        ("16 17 / −21 µm", (16e-6, 17e-6, -21e-6), 1e-6),
        (".008 .014 mm", (8e-6, 14e-6), 1e-6),
        ("0.067 −0.406", (0.067, -0.406), 0.001),
        ("24.81 %", (0.2481,), 1e-4),
        # Eq 19 gives a variance: its unit should be the square of what is printed.
        ("8.1e-5 mm", (8.1e-11,), 1e-12),
        ("1.1; 17.8 %; +17.21 %", (1.1, 0.178, 0.1721), (0.1, 0.001, 0.0001)),
        ("outside the critical set", (), ()),
    ],
)
def test_numbers_are_those_of_the_text(text, values, digit):
    found = Printed.of(text)
    assert found.text == text
    assert found.values == values
    np.testing.assert_allclose(found.digits, np.broadcast_to(digit, len(values)), rtol=1e-14)


def test_figures_that_are_printed_twice_are_the_same():
    inputs = PaperInputs()
    assert rows.printed("Table 1, experimental σ").values == tuple(np.ravel(inputs.experimental_sigma))
    assert tuple(rows.printed(f"Table 2 row {n}, calculated").values for n in (1, 2)) == inputs.static_displacements
    assert rows.printed("C_p at L = 0.145 mm, row 1").values == (inputs.capability,)
    assert rows.printed("q3 of row 1").values[0] == inputs.poses[0][2]  # Table 1 gives row 1 its first q3
    assert rows.printed("Eq 12, five unknowns").values[:5] == inputs.delta_l


@pytest.mark.parametrize(
    ("figure", "computed", "rounded", "cut"),
    [
        ("1.33", 1.33, True, True),
        ("1.33", 1.3349, True, True),
        ("1.33", 1.3351, False, True),
        ("1.33", 1.3399, False, True),
        ("1.33", 1.3401, False, False),
        ("1.33", 1.3251, True, False),
        ("1.33", 1.3249, False, False),
        ("1.33", -1.33, False, False),
        ("−0.4", -0.44, True, True),
        ("−0.4", -0.49, False, True),
        ("−0.4", -0.36, True, False),
        ("−0.4", 0.4, False, False),
        # Half of a last digit counts on either side: 0.145 and 1.005 have no exact binary fraction.
        ("0.14", 0.145, True, True),
        ("0.15", 0.145, True, False),
        ("1.00", 1.005, True, True),
        ("1.01", 1.005, True, False),
        # All figures count together.
        ("8 14 µm", [8.4e-6, 14.3e-6], True, True),
        ("8 14 µm", [8.4e-6, 14.7e-6], False, True),
        ("8 14 µm", [7.6e-6, 14.7e-6], False, False),
    ],
)
def test_rounding_and_truncation(figure, computed, rounded, cut):
    expected = "agrees" if rounded else "agrees when truncated" if cut else "erratum"
    assert judge(Printed.of(figure), computed, otherwise="erratum") == expected


def test_the_rounding_of_the_inputs_leaves_a_range():
    for low, high, verdict in ((1.26, 1.34, "agrees"), (1.28, 1.32, "erratum")):
        assert judge(Printed.of("1.33"), 1.30, low=low, high=high, otherwise="erratum") == verdict
    mixed, computed = Printed.of("1.1; 17.8 %"), [1.3, 0.1]
    for most, verdict in ((0.19, "agrees"), (0.17, "erratum")):
        assert judge(mixed, computed, low=[1.07, 0.16], high=[1.11, most], otherwise="erratum") == verdict


def test_numbers_are_written_with_a_true_minus():
    assert numbers([[1e-6, -2e-6], [0.0, 3e-6]], 1, factor=1e6) == "1.0 −2.0 / 0.0 3.0"
    told = Words().format("{a:2u} {a:0c} {b:gm} {b:g} {c}", a=[-1e-6, 2.5e-6], b=0.15, c="x")
    assert told == "−1.00 2.50 −0 0 150 0.15 x"
