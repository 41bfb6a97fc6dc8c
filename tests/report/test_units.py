"""Numbers in the unit that a metrologist would choose."""

import math
import re
from itertools import pairwise

import numpy as np
import pytest

from thermal_robot.diagnosis.values import Estimate, Location
from thermal_robot.report import units

ROUND = {1.0: 1.0, 0.2: 0.2, 0.0005: 0.0005, 0.3: 0.2}


@pytest.mark.parametrize(
    ("value", "unit", "written"),
    [
        (4.12e-4, "m", "412 µm"), (2.83e-5, "m", "28.3 µm"), (9.999e-4, "m", "1.00 mm"), (2.41e-3, "m", "2.41 mm"),
        (0.5, "m", "500 mm"), (12.0, "m", "12.0 m"), (0.0, "m", "0 µm"), (1.04e-3, "rad", "1.04 mrad"),
        (4.2e-5, "rad", "42.0 µrad"), (-1.2e-3, "rad", "−1.20 mrad"), (1.2e-5, "1/K", "12.0 µm/(m·K)"),
        (5e-4, "1", "500 ppm"), (0.02, "1", "2.00 %"), (3e-3, "s", "3.00 ms"),
        (1.7e-5, "rad/(N·m)", "17.0 µrad/(N·m)"), (2e-7, "m/N", "0.200 µm/N"), (0.25, "kg", "0.250 kg"),
        (3.0, "slips/turn", "3.00 slips/turn"), (1e-9, "", "1.00e−09"), (None, "m", "–"), (math.nan, "m", "–"),
    ],
)  # fmt: skip
def test_a_quantity_is_written_in_its_best_unit(value, unit, written):
    assert units.quantity(value, unit) == written


def test_values_to_be_compared_share_unit_and_decimals():
    assert units.together((4.12e-4, 2.83e-5), "m") == ["412 µm", "28 µm"]
    assert units.together((2.41e-3, 2.83e-5, 0.0), "m") == ["2.410 mm", "0.028 mm", "0.000 mm"]
    assert units.together((1e-3, None), "rad") == ["1.00 mrad", "–"]
    assert units.together((0.0, 0.0), "m") == ["0 µm", "0 µm"]
    assert units.together((-1.97e-3, 2e-4), "rad") == ["−1.97 mrad", "0.20 mrad"]


@pytest.mark.parametrize(
    ("value", "std", "unit", "written"),
    [
        (1.234e-5, 4.1e-7, "1/K", "12.34 ± 0.41 µm/(m·K)"),
        (-1.2e-3, 2.2e-5, "rad", "−1.200 ± 0.022 mrad"),
        (6.685e-3, 2.74e-4, "1", "6685 ± 274 ppm"),
        (3.0, 0.0, "", "3.00"),
        (0.0, 2.2e-5, "rad", "0 ± 22 µrad"),
        (4.2e-4, 3e-5, "m", "420 ± 30 µm"),
        (1.7e-4, 6e-6, "rad", "0.1700 ± 0.0060 mrad"),
        (2e-3, 0.0, "m", "2.00 mm"),
        (3e-6, 2e-4, "rad", "0.00 ± 0.20 mrad"),
        (2e9, 1e7, "N", "2.00e+09 ± 1.0e+07 N"),
    ],
)
def test_a_value_carries_two_digits_of_its_standard_deviation(value, std, unit, written):
    assert units.measured(value, std, unit) == written
    assert units.estimate(Estimate("a", value, std, unit, True)) == written
    assert units.estimate(Estimate("a", value, std, unit, False)) == "not determined by these data"


def test_an_estimate_takes_the_unit_of_those_beside_it():
    small, large = Estimate("a", 0.0, 2.2e-5, "rad", True), Estimate("b", 1.2e-3, 2.2e-5, "rad", True)
    assert units.estimate(small, [large]) == "0.000 ± 0.022 mrad"
    assert units.estimate(small, [Estimate("b", 1.2e-3, 2.2e-5, "m", True)]) == "0 ± 22 µrad"
    for value in (None, math.nan):
        assert units.estimate(Estimate("a", value, value, "m", True)) == "not determined by these data"


@pytest.mark.parametrize(
    ("value", "written"),
    [(0.9996, "> 99.9 %"), (0.978, "97.8 %"), (1e-9, "< 0.1 %"), (0.5, "50.0 %"), (None, "–"), (math.nan, "–")],
)
def test_a_probability_is_never_certain(value, written):
    assert units.probability(value) == written


def test_shares_p_values_and_places():
    assert [units.percent(share) for share in (-0.031, -0.0003, None)] == ["−3.1 %", "0.0 %", "–"]
    assert units.interval((-36730.0, 0.99999)) == "< −1000 to 99.999"
    assert units.percent(12.3) == "> 1000 %"
    assert units.interval((-0.004, 0.006)) == "−0.4 to 0.6"
    assert units.interval(None) == ""
    told = ["p = 0.43", "p = 0.012", "p = 3e-9", "p < 1e-12"]
    assert [units.p_value(p) for p in (0.43, 0.012, 3.2e-9, 0.0)] == told
    for kind, name, words in (
        ("joint", "hand", "joint hand"),
        ("joint", "elbow_joint", "elbow_joint"),
        ("link", "elbow_joint", "link elbow_joint"),
        ("instrument", "", "instrument"),
        ("base", "base", "base"),
    ):
        assert Location(kind, name, 0.1).words == words


SI = {"µm": 1e-6, "mm": 1e-3, "m": 1.0, "µrad": 1e-6, "mrad": 1e-3, "rad": 1.0, "ms": 1e-3, "µs": 1e-6, "s": 1.0}


def read_back(written):
    """The SI value that a reader takes from ``412 µm``."""
    number, unit = written.replace("−", "-").split(" ")
    return float(number) * SI[unit]


@pytest.mark.parametrize("unit", ["m", "rad", "s"])
def test_what_is_written_is_what_was_meant(unit):
    rng = np.random.default_rng(4)
    for value in rng.choice([-1.0, 1.0], 400) * 10.0 ** rng.uniform(-9.0, 2.0, 400):
        written = units.quantity(value, unit)
        assert read_back(written) == pytest.approx(value, rel=6e-3), written
        digits = re.sub(r"e.*|[^\d]", "", written.split(" ")[0]).lstrip("0")
        assert len(digits) == (4 if unit == "m" and 1.0 <= abs(value) < 9.99 else 3), written  # 1186 mm


def test_values_that_are_compared_keep_their_order_as_they_are_read():
    rng = np.random.default_rng(5)
    for _ in range(100):
        values = np.sort(10.0 ** rng.uniform(-6.0, -2.0, 3))
        read = [read_back(w) for w in units.together(values, "m")]
        assert read == sorted(read)
        assert read[2] == pytest.approx(values[2], rel=6e-3)
        assert read[0] == pytest.approx(values[0], rel=0.06, abs=6e-8)


def test_a_standard_deviation_is_never_written_as_nothing():
    rng = np.random.default_rng(6)
    for value, std in zip(10.0 ** rng.uniform(-6.0, -2.0, 200), 10.0 ** rng.uniform(-7.0, -4.0, 200), strict=True):
        written = units.measured(value, std, "m")
        number, deviation = re.fullmatch(r"([\d.]+) ± ([\d.]+) (µm|mm|m)", written).groups()[:2]
        assert float(number) > 0.0
        assert (float(deviation) > 0.0) is bool(std > 5e-6 * value), written


def test_a_number_has_an_exponent_only_far_from_one_and_what_is_none_is_not_written_as_one():
    assert [units.number(*of) for of in ((0.0, 3), (1e7, 2), (-0.25, 2))] == ["0", "1.0e+07", "−0.25"]
    for value in (math.inf, -math.inf, math.nan):
        assert units.number(value) == units.percent(value) == units.MISSING
        assert units.p_value(value) == "p unknown"


def test_rounding_down_gives_the_next_round_number_below():
    values = np.geomspace(1e-7, 1e4, 300)
    rounded = [units.round_down(v) for v in values]
    for value, found in zip(values, rounded, strict=True):
        assert f"{found:.0e}"[0] in "125"
        assert found <= value < 2.5001 * found
    assert all(a <= b for a, b in pairwise(rounded))
    assert [units.round_down(v) for v in ROUND] == pytest.approx(list(ROUND.values()))
