"""What an effect explains: a place says its kind as a location does, and the values are frozen."""

from dataclasses import FrozenInstanceError

import numpy as np
import pytest

from thermal_robot.diagnosis.explained import Explained, Place
from thermal_robot.diagnosis.parts import Location

NONE = np.zeros(0)


def place(kind, name):
    return Place(kind, name, 1.0, "time", "s", NONE, False, "rad", NONE, NONE, NONE, np.zeros((2, 0)))


@pytest.mark.parametrize(("kind", "name"), [("joint", "shoulder"), ("joint", "joint_3"), ("base", "base")])
def test_a_place_says_its_kind_as_a_location_does(kind, name):
    assert place(kind, name).words == Location(kind, name, 0.5).words


def test_values_are_frozen():
    whole = Explained("drift", (place("base", "base"),), 0)
    with pytest.raises(FrozenInstanceError):
        whole.effect = "backlash"
    with pytest.raises(FrozenInstanceError):
        whole.places[0].share = 0.5
