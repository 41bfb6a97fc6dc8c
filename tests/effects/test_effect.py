"""The contract: its guide runs, its defaults say little and nothing wrong."""

import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from helpers import SAMPLES, commanded

from thermal_robot.effects import Effect, JointOffset, Parameter, at_base, at_instrument, at_joint, at_segment, at_tool
from thermal_robot.effects import effect as module
from thermal_robot.effects.gate import checked
from thermal_robot.observations import observe


def test_the_guide_in_the_docstring_is_an_effect_that_keeps_the_contract(rv_m2):
    code = re.search(r"is a file like this one::\n\n(.*?)\n\nRegister", module.__doc__, re.DOTALL)[1]
    names = {}
    exec(re.sub(r"^ {4}", "", code, flags=re.MULTILINE), names)
    sag = names["JointSag"]()
    observations = observe(commanded(rv_m2, {"speed": np.linspace(0.1, 1.0, SAMPLES)}))
    assert [p.name for p in checked(sag, observations)] == [f"sag, {joint}" for joint in rv_m2.joint_names]
    assert sag.title == "joint sag"
    assert (sag.missing(observations), sag.reads(observations)) == ((), ("speed",))


def test_the_page_on_effects_of_ones_own_is_true(rv_m2):
    page = (Path(__file__).parents[2] / "docs" / "effects.md").read_text(encoding="utf-8")
    code = re.search(r"```python\n(.*?)\ndiagnosis = ", page, re.DOTALL)[1]
    names = {}
    exec(code, names)
    observations = observe(commanded(rv_m2, {"speed": np.linspace(0.1, 1.0, SAMPLES)}))
    assert len(checked(names["SpeedSag"](), observations)) == rv_m2.n
    table = page[page.index("| attribute |") :].split("\n\n")[0]
    stated = set(re.findall(r"`(\w+)(?:\([\w, ]*\))?`(?=[^|]*\|[^|]*\|[^|]*\|$)", table, re.MULTILINE))
    public = {n for n in vars(Effect) if not n.startswith("_")}
    assert stated == public - {"name", "parameters", "arguments", "random"}


@dataclass(frozen=True)
class Plain(Effect):
    """An effect that states nothing but its name."""

    name = "cable_drag"

    def parameters(self, observations):
        return ()


def test_defaults_say_that_nothing_is_known(rv_m2):
    observations = observe(commanded(rv_m2))
    plain = Plain()
    assert plain.title == "cable drag"
    assert (plain.needs, plain.random, plain.frame, plain.contained_in) == ((), False, "", ())
    assert plain.variants(observations) == plain.nearby(1.6) == (plain,)
    assert plain.at("joint_2") == replace(plain, places=("joint_2",)) != plain
    assert plain.driver(observations, (), np.zeros(SAMPLES)) is None
    assert plain.arguments() == {}


def test_a_title_is_not_inherited_by_an_effect_of_another_name():
    class Worn(JointOffset):
        name = "worn_coupling"

    class Stated(JointOffset):
        name = "other"
        title = "a worn coupling"

    class Same(JointOffset):
        pass

    assert (Worn.title, Stated.title, Same.title) == ("worn coupling", "a worn coupling", JointOffset.title)


def test_what_it_needs_is_missing_unless_it_varies(rv_m2):
    @dataclass(frozen=True)
    class Needy(Plain):
        needs = ("speed", "humidity")

    def asked(**columns):
        observations = observe(commanded(rv_m2, columns))
        return Needy().missing(observations), Needy().reads(observations)

    rises, stands = np.linspace(0.0, 1.0, SAMPLES), np.ones(SAMPLES)
    assert asked() == (("speed", "humidity"), ())
    assert asked(speed=rises) == (("humidity",), ("speed",))
    assert asked(speed=rises, humidity=stands) == (("humidity",), ("speed", "humidity"))
    assert asked(speed=rises, humidity=rises) == ((), ("speed", "humidity"))


def test_a_response_knows_its_channel_and_holds_floats():
    made = [
        at_joint(2, 1),
        at_segment(3, [1, 0, 0, 0, 0, 0]),
        at_base(np.eye(6)[0]),
        at_tool([0] * 6),
        at_instrument([[1, 2, 3]]),
    ]
    assert [(r.channel, r.index) for r in made] == [
        ("joint", 2),
        ("segment", 3),
        ("base", 0),
        ("tool", 0),
        ("instrument", 0),
    ]
    assert all(r.values.dtype == float for r in made)


def test_a_parameter_is_named_by_label_and_place():
    parameter = Parameter("strain per kelvin", "1/K", 1.5e-5, "link", "hand", ())
    assert parameter.name == "strain per kelvin, hand"
    assert replace(parameter, place="").name == "strain per kelvin"


def test_an_effect_is_frozen_and_has_to_give_parameters():
    with pytest.raises(AttributeError):
        JointOffset().title = "another"
    with pytest.raises(TypeError, match="abstract"):
        Effect()
