"""A law as a file: the text is Python, and what it defines is the law under another name."""

import numpy as np

from thermal_robot.effects.law import Discovered, source


def test_the_file_holds_the_law_its_values_and_what_it_is():
    law = Discovered(place="joint_3", quantity="joint_3", shape="harmonic", marks=(37.62,), origin=-0.5, span=1.25)
    text = source(law.arguments(), law.describe(), np.array([1e-4, -2.5e-4, 3e-5]), "worn_belt")
    assert law.describe()[1:] in text
    assert "0.0001, -0.00025, 3e-05" in text
    made = {}
    exec(text, made)
    own = made["WornBelt"]()
    assert own.name == "worn_belt"
    assert {k: v for k, v in own.arguments().items() if k != "name"} == {
        k: v for k, v in law.arguments().items() if k != "name"
    }
