"""Temperature to elongation: Eq 5, the strain of the paper, and names of segments and links."""

import numpy as np
import pytest

from thermal_robot.assembly.thermal import (
    columns_of,
    elongation,
    expansion_coefficient,
    expansion_coefficients,
    lengths,
    per_segment,
    segment_names,
)
from thermal_robot.errors import RobotError

PAPER = 1e-6 * np.array([14, 5, 9, 7, 8])  # m, Δl of the paper's section 3


def test_strain_behind_the_papers_elongations(rv_m2):
    np.testing.assert_allclose(
        1e6 * expansion_coefficients(rv_m2, PAPER, 3.0), [11.67, 13.89, 12.00, 11.67, 17.78], atol=0.005
    )
    first_four = segment_names(rv_m2)[:4]
    assert 1e6 * expansion_coefficient(rv_m2, PAPER, 3.0, segments=first_four) == pytest.approx(11.857, abs=1e-3)
    by_link = ["column", "shoulder", "upper_arm", "forearm"]
    assert expansion_coefficient(rv_m2, PAPER, 3.0, segments=by_link) == expansion_coefficient(
        rv_m2, PAPER, 3.0, segments=first_four
    )


def test_a_coefficient_comes_back_from_elongations_at_several_temperatures(arm):
    temperature = np.array([[18.0], [24.0], [31.0]]) * np.ones(len(segment_names(arm)))
    grown = elongation(arm, temperature, coefficients=2.3e-5)
    assert expansion_coefficient(arm, grown, temperature - 20.0) == pytest.approx(2.3e-5, rel=1e-12)
    np.testing.assert_allclose(expansion_coefficients(arm, grown, temperature - 20.0), 2.3e-5, rtol=1e-12)


def test_elongation_is_equation_5_in_every_form(rv_m2):
    links = {"column": 22.0, "shoulder": 23.0, "upper_arm": 24.0, "forearm": 25.0, "hand": 26.0}
    coefficients = dict(zip(segment_names(rv_m2), [1e-5, 2e-5, 3e-5, 4e-5, 5e-5], strict=True))
    expected = np.array([1e-5, 2e-5, 3e-5, 4e-5, 5e-5]) * [0.4, 0.12, 0.25, 0.2, 0.15] * np.array([2, 3, 4, 5, 6])
    np.testing.assert_allclose(elongation(rv_m2, links, coefficients=coefficients), expected, rtol=1e-13)
    np.testing.assert_allclose(
        elongation(rv_m2, [22, 23, 24, 25, 26], coefficients=[1e-5, 2e-5, 3e-5, 4e-5, 5e-5]), expected, rtol=1e-13
    )
    assert not np.any(elongation(rv_m2, 23.5, coefficients=1.2e-5, reference=23.5))
    # A segment's own value goes before its link's, in whatever order they are written.
    for mixed in ({**links, "joint_3": 30.0}, {"joint_3": 30.0, **links}):
        grown = elongation(rv_m2, mixed, coefficients=coefficients)
        np.testing.assert_allclose(grown[2], 3e-5 * 0.25 * 10.0, rtol=1e-13)
    over_time = elongation(rv_m2, {**links, "hand": np.array([20.0, 26.0, 32.0])}, coefficients=coefficients)
    assert over_time.shape == (3, 5)
    np.testing.assert_allclose(over_time[1], expected, rtol=1e-13)


def test_twice_the_rise_is_twice_the_elongation_and_no_rise_none(arm):
    coefficients = np.random.default_rng(3).uniform(1e-5, 3e-5, len(segment_names(arm)))
    grown = [elongation(arm, 20.0 + rise, coefficients=coefficients) for rise in (0.0, 1.0, 2.0, -2.0)]
    np.testing.assert_array_equal(grown[0], 0.0)
    np.testing.assert_allclose(grown[2], 2.0 * grown[1], rtol=1e-12)
    np.testing.assert_array_equal(grown[3], -grown[2])


def test_names_lengths_and_columns_belong_together(arm):
    names = segment_names(arm)
    assert len(set(names)) == len(names) == len(lengths(arm))
    assert np.all(lengths(arm) > 0.0)
    for column, name in enumerate(names):
        assert columns_of(arm, name) == (column,)
        only = per_segment(arm, dict.fromkeys(names, 0.0) | {name: 1.0}, "value")
        np.testing.assert_array_equal(only, np.eye(len(names))[column])
    by_length = {segment.name: segment.length for segment in arm.segments}
    np.testing.assert_array_equal(lengths(arm), [by_length[name] for name in names])


def test_least_squares_weigh_long_segments_more(rv_m2):
    # Two states that disagree: the common coefficient lies between them, nearer to the one with the larger rise.
    grown = np.stack([2e-5 * lengths(rv_m2), 1e-5 * lengths(rv_m2) * 3.0])
    found = expansion_coefficient(rv_m2, grown, np.array([[1.0], [3.0]]) * np.ones(5))
    assert found == pytest.approx((2e-5 * 1.0 + 1e-5 * 9.0) / 10.0, rel=1e-12)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda r: elongation(r, {"column": 20.0}, coefficients=1e-5), "no temperature is given for joint_2, joint_3"),
        (lambda r: elongation(r, 20.0, coefficients={"elbow": 1e-5}), "'elbow' is no segment .* column_top, column"),
        (lambda r: elongation(r, 20.0, coefficients=[1e-5] * 4), r"shape \(4,\) does not fit the 5 segments"),
        (lambda r: expansion_coefficient(r, PAPER, 3.0, segments=["wrist"]), "'wrist' is no segment with a length"),
        (lambda r: per_segment(r, {"column": 1.0, "hand": 2.0}, "mass"), "no mass is given for joint_2, joint_3"),
        (lambda r: columns_of(r, "joint_5"), "'joint_5' is no segment with a length"),
    ],
)
def test_what_does_not_fit_is_said(rv_m2, call, words):
    with pytest.raises(RobotError, match=words):
        call(rv_m2)
