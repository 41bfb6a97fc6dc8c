"""What a fault is: how large it is drawn, what it does to the robot, and which answers about it are right."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thermal_robot.blind.reality.setting import Setting
from thermal_robot.blind.reality.world import Body

Array = NDArray[np.float64]
Place = tuple[str, str]


@dataclass(frozen=True)
class Fault:
    """One kind of fault.

    Attributes
    ----------
    name
        As in formats.md, or a name of its own.
    draw
        (setting, rng) → (P, D) how large it is in each of P places, D numbers each, in no particular scale: the trial
        makes it as large as it wants.
    act
        (body, setting, values) does it to the robot.
    places
        (setting) → the P places.
    few
        Whether it sits in few places, so that asking where makes sense.
    wants
        What the campaign must be like: ``moving``, ``repeats``, ``sessions``, ``sensor:links``, ``base_known`` ...
    quantities
        (setting) → names of columns, each a right answer to what it follows.
    random
        Whether it scatters anew at every visit.
    also
        Names of other effects that do part of it by definition, each with the columns of the values that do.
    known_as
        (setting, values) → true parameters by the names that the diagnosis has for them, in its units and with its
        signs, where formats.md leaves no doubt what is meant.
    fixed
        Columns of the values that are no size (a phase, a time constant), each with the settings that span it.
    """

    name: str
    draw: Callable[[Setting, np.random.Generator], Array]
    act: Callable[[Body, Setting, Array], None]
    places: Callable[[Setting], Sequence[Place]]
    few: bool = False
    wants: tuple[str, ...] = ()
    quantities: Callable[[Setting, Sequence[Place]], Sequence[str]] = lambda setting, places: ()
    random: bool = False
    known_as: Callable[[Setting, Array], Mapping[str, float]] = lambda setting, values: {}
    also: tuple[tuple[str, tuple[int, ...]], ...] = ()
    fixed: tuple[tuple[int, tuple[float, ...]], ...] = ()

    def scaled(self, values: Array, factor: float) -> Array:
        """Return values of another size."""
        result = values * factor
        for column, _ in self.fixed:
            result[:, column] = values[:, column]
        return result


def joints(setting: Setting) -> list[Place]:
    """Return every joint."""
    return [("joint", name) for name in setting.world.names]


def segments(setting: Setting) -> list[Place]:
    """Return the link of every segment."""
    return [("link", link) for link in setting.world.links]


def own_position(setting: Setting, places: Sequence[Place]) -> list[str]:
    """Return that joint's own position."""
    return [name for _, name in places]


def clock(setting: Setting, places: Sequence[Place]) -> list[str]:
    """Return time and the order of rows, which are one."""
    return ["time", "order"]


def each_joint(label: str, of: Callable[[Array], Array]) -> Callable[[Setting, Array], Mapping[str, float]]:
    """Return one parameter a joint, its value a function of the (n, D) values."""
    return lambda setting, values: {
        f"{label}, {name}": float(value) for name, value in zip(setting.world.names, of(values), strict=True)
    }


def twist(where: str) -> Callable[[Setting, Array], Mapping[str, float]]:
    """Return the components of a twist in the first row of the values: translation, then rotation."""
    names = [f"{kind} {axis}, {where}" for kind in ("translation", "rotation") for axis in "xyz"]
    return lambda setting, values: dict(zip(names, values[0].tolist(), strict=True))


def some(
    size: float,
    numbers: int = 1,
    *,
    first: bool = True,
    last: bool = True,
    positive: bool = False,
    turning: bool = False,
) -> Callable[[Setting, np.random.Generator], Array]:
    """Draw values for one to three joints; the first and last can be left out where frames would hide them.

    ``turning`` leaves out those that slide.
    """

    def draw(setting: Setting, rng: np.random.Generator) -> Array:
        n = setting.world.n
        allowed = np.arange(0 if first else 1, n if last else n - 1)
        if turning:
            allowed = allowed[~setting.world.slides[allowed]]
        if not len(allowed):
            return np.zeros((n, numbers))
        chosen = rng.choice(allowed, min(int(rng.integers(1, 4)), len(allowed)), replace=False)
        values = np.zeros((n, numbers))
        values[chosen] = size * rng.normal(size=(len(chosen), numbers))
        values[chosen[0]] += size * np.sign(values[chosen[0]])  # one of them is a real fault, not a draw near zero
        return np.abs(values) if positive else values

    return draw


Number = Callable[[Setting, int, np.random.Generator], float]
"""Draws a number for a joint, by its index."""


def one(*numbers: Number) -> Callable[[Setting, np.random.Generator], Array]:
    """Draw one joint, never the first or the last, and numbers for it; the first one is its size."""

    def draw(setting: Setting, rng: np.random.Generator) -> Array:
        values = np.zeros((setting.world.n, len(numbers)))
        j = int(rng.integers(1, setting.world.n - 1))
        values[j] = [number(setting, j, rng) for number in numbers]
        return values

    return draw


def milli(setting: Setting, j: int, rng: np.random.Generator) -> float:
    """Return a thousandth, of either sign."""
    return float(rng.choice([-1e-3, 1e-3]))


def part(low: float, high: float) -> Number:
    """Draw a number between two."""
    return lambda setting, j, rng: float(rng.uniform(low, high))


def within(low: float, high: float) -> Number:
    """Draw a position of the joint between two quantiles of where it goes."""
    return lambda setting, j, rng: float(np.quantile(setting.q[:, j], rng.uniform(low, high)))


def order(bounds: tuple[float, float]) -> Number:
    """Draw an order evenly over its logarithm."""
    return lambda setting, j, rng: float(np.exp(rng.uniform(*np.log(bounds))))
