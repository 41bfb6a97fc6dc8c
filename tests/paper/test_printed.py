"""What is printed: the numbers beside the text are the text's own."""

import re

import numpy as np
import pytest

from thermal_robot.paper import PaperInputs
from thermal_robot.paper import rows as printed
from thermal_robot.paper.entry import Printed

UNITS = {"µm": 1e-6, "mm": 1e-3, "%": 1e-2, "": 1.0}


def found():
    """Every printed figure of the module, also those in tuples."""

    def walk(value):
        if isinstance(value, Printed):
            yield value
        elif isinstance(value, tuple):
            for item in value:
                yield from walk(item)

    return [figure for name in vars(printed) if name.isupper() for figure in walk(getattr(printed, name))]


def read(text):
    """Numbers of a text in SI units, and one unit of the last digit of each."""
    numbers, digits = [], []
    for part in text.replace("−", "-").split(";"):
        unit = next((unit for unit in UNITS if unit and part.endswith(unit)), "")
        for number in re.findall(r"[-+]?\d*\.?\d+(?:e-?\d+)?", part):
            mantissa, _, exponent = number.partition("e")
            decimals = len(mantissa.partition(".")[2])
            # Eq 19 gives a variance: its unit should be the square of what is printed.
            factor = UNITS[unit] ** (2 if exponent else 1)
            numbers.append(float(number) * factor)
            digits.append(10.0 ** (int(exponent or 0) - decimals) * factor)
    return numbers, digits


def test_there_are_figures():
    assert len(found()) > 20


@pytest.mark.parametrize("figure", [f for f in found() if "density" not in f.text], ids=lambda figure: figure.text)
def test_numbers_are_those_of_the_text(figure):
    numbers, digits = read(figure.text)
    np.testing.assert_allclose(figure.values, numbers, rtol=1e-12)
    np.testing.assert_allclose(np.broadcast_to(figure.digits, len(numbers)), digits, rtol=1e-12)


def test_figures_that_are_printed_twice_are_the_same():
    inputs = PaperInputs()
    assert printed.TABLE_1_EXPERIMENTAL.values == tuple(np.ravel(inputs.experimental_sigma))
    assert tuple(figure.values for figure in printed.TABLE_2) == inputs.static_displacements
    assert printed.CAPABILITY[0].values[0] == inputs.capability
    # Table 1 gives row 1 its first q3.
    assert printed.Q3_OF_ROW_1[0] == inputs.poses[0][2]
    assert printed.DELTA_L.split(" µm")[0].split() == [f"{1e6 * grown:.0f}" for grown in inputs.delta_l]
