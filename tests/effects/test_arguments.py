"""Arguments from a file: of the types and ranges that the class says, or told with their place."""

from dataclasses import dataclass

import pytest

from thermal_robot.effects import Effect, library
from thermal_robot.effects.arguments import NotNegative, Order, with_arguments
from thermal_robot.effects.gate import arguments
from thermal_robot.effects.law import Discovered
from thermal_robot.schema import MisfitError


@dataclass(frozen=True)
class Sag(Effect):
    """An effect with an argument of each type."""

    name = "sag"
    lag: NotNegative = 0.0
    orders: tuple[Order, ...] = ()
    share: float | tuple[float, ...] = 0.0
    turns: bool | None = None
    side: str = ""
    either: float | str = 0.0

    def parameters(self, observations):
        return ()


class Built(Effect):
    """No dataclass."""

    name = "built"

    def __init__(self, size):
        object.__setattr__(self, "size", size)

    def parameters(self, observations):
        return ()


@pytest.mark.parametrize("effect", [*library().values(), Discovered(place="joint_1", marks=(1.0, 2.0))])
def test_what_an_effect_writes_it_takes(effect):
    assert with_arguments(type(effect), arguments(effect), "") == effect


def test_lists_become_tuples_and_numbers_what_the_class_says():
    held = {"lag": 600, "orders": [1, 2], "share": [0.5, 1], "turns": True, "side": "left", "places": ["elbow"]}
    found = with_arguments(Sag, held, "a")
    assert found == Sag(600.0, (1, 2), (0.5, 1.0), True, "left", places=("elbow",))
    assert type(found.lag) is float
    assert with_arguments(Sag, {"share": 0.25, "turns": None, "either": "x"}, "a") == Sag(share=0.25, either="x")
    assert with_arguments(Built, {"size": [1, "x"]}, "a").size == (1, "x")


@pytest.mark.parametrize(
    ("effect", "held", "said"),
    [
        (Sag, {"lag": -1}, r"a\.lag: -1, expected a number that is not negative"),
        (Sag, {"lag": None}, r"a\.lag: null, expected"),
        (Sag, {"orders": [1, 0]}, r"a\.orders\[1\]: 0, expected a whole number from 1 on"),
        (Sag, {"orders": [1.5]}, r"a\.orders\[0\]: 1\.5, expected a whole number"),
        (Sag, {"orders": 1}, r"a\.orders: 1, expected a list"),
        (Sag, {"share": [0.5, "x"]}, r"a\.share\[1\]: 'x', expected a finite number"),
        (Sag, {"share": "x"}, r"a\.share: 'x', expected a finite number"),
        (Sag, {"turns": 1}, r"a\.turns: 1, expected true or false"),
        (Sag, {"side": 3}, r"a\.side: 3, expected text"),
        (Sag, {"either": [float("nan")]}, r"a\.either\[0\]: NaN, expected a finite number"),
        (Sag, {"places": "elbow"}, r"a\.places: 'elbow', expected a list"),
        (Sag, {"slack": 1}, r"a\.slack: is not known"),
        (Sag, [1], r"a: \[1\], expected an object with the keys places, excluded, lag"),
        (Built, {}, r"a: does not fit \(.*'size'\), expected the arguments of Built"),
        (Built, {"size": float("inf")}, r"a\.size: Infinity, expected a finite number"),
    ],
)
def test_what_an_effect_does_not_take_is_told_with_its_place(effect, held, said):
    with pytest.raises(MisfitError, match=f"^{said}"):
        with_arguments(effect, held, "a")
