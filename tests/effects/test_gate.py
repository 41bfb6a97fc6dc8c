"""The contract of an effect, and its gate: a breach is refused with the effect, the parameter and what was found."""

import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers import SAMPLES, commanded
from simulate import simulate

from thermal_robot import EffectError, diagnose
from thermal_robot.correction import CorrectedModel
from thermal_robot.effects import (
    Effect,
    Geometric,
    JointOffset,
    Parameter,
    Response,
    TransmissionError,
    at_base,
    at_instrument,
    at_joint,
    at_segment,
    at_tool,
    gate,
    library,
)
from thermal_robot.effects import effect as contract
from thermal_robot.effects.arguments import NotNegative, Order, with_arguments
from thermal_robot.effects.gate import checked
from thermal_robot.effects.law import Discovered
from thermal_robot.errors import OwnEffectError
from thermal_robot.inference.columns import block
from thermal_robot.observations import observe
from thermal_robot.schema import MisfitError

GOOD = Parameter("sag", "rad", 1e-3, "joint", "joint_2", (at_joint(1, 1.0),))
ROWS = np.ones(SAMPLES)
RISES = {"speed": np.linspace(0.1, 1.0, SAMPLES)}


@dataclass(frozen=True)
class Mine(Effect):
    """An effect of somebody's own that answers what it is given, right by default; each test spoils one answer."""

    answer: Any = (GOOD,)
    size: Any = 0.5
    name = "mine"

    def parameters(self, observations):
        return self.answer


def spoilt(member, answer):
    """An instance of a :class:`Mine` of which one member raises an exception, answers a value, or is a value."""

    def answers(self, *arguments):
        if isinstance(answer, Exception):
            raise answer
        return answer(self) if callable(answer) else answer

    return type("Spoilt", (Mine,), {member: answer if member in ("needs", "size_spread") else answers})()


@pytest.fixture(scope="module")
def observations(rv_m2):
    return observe(replace(commanded(rv_m2), position=np.zeros((SAMPLES, 3))))


def test_the_guides_are_effects_that_keep_the_contract_and_name_all_that_may_stand_in_one(rv_m2):
    page = (Path(__file__).parents[2] / "docs" / "effects.md").read_text(encoding="utf-8")
    guide = re.search(r"is a file like this one::\n\n(.*?)\n\nRegister", contract.__doc__, re.DOTALL)[1]
    shown = re.search(r"```python\n(.*?)\ndiagnosis = ", page, re.DOTALL)[1]
    seen, made = observe(commanded(rv_m2, RISES)), {}
    exec(re.sub(r"^ {4}", "", guide, flags=re.MULTILINE), made)
    exec(shown, made)
    sag = made["JointSag"]()
    assert [p.name for p in checked(sag, seen)] == [f"sag, {joint}" for joint in rv_m2.joint_names]
    assert len(checked(made["SpeedSag"](), seen)) == rv_m2.n
    assert (sag.title, sag.missing(seen), sag.reads(seen)) == ("joint sag", (), ("speed",))
    table = page[page.index("| attribute |") :].split("\n\n")[0]
    stated = set(re.findall(r"`(\w+)(?:\([\w, ]*\))?`(?=[^|]*\|[^|]*\|[^|]*\|$)", table, re.MULTILINE))
    public = {n for n in vars(Effect) if not n.startswith("_")}
    assert stated == public - {"name", "parameters", "arguments", "random"}


def test_defaults_say_that_nothing_is_known(observations):
    class Plain(Mine):
        name = "cable_drag"

    plain = Plain()
    assert (plain.title, plain.singular) == ("cable drag", "cable drag")
    assert (plain.needs, plain.random, plain.contained_in, plain.share, plain.apart) == ((), False, (), None, 0)
    assert plain.variants(observations) == plain.nearby(1.6) == (plain,)
    assert plain.driver(observations, (), np.zeros(SAMPLES)) is None
    assert Plain(()).arguments() == {"answer": (), "size": 0.5}
    # a title is not inherited by an effect of another name
    worn = type("Worn", (JointOffset,), {"name": "worn_coupling"})
    stated = type("Stated", (JointOffset,), {"name": "other", "title": "a worn coupling"})
    same = type("Same", (JointOffset,), {})
    assert (worn.title, stated.title, same.title) == ("worn coupling", "a worn coupling", JointOffset.title)
    with pytest.raises(AttributeError):
        JointOffset().title = "another"
    with pytest.raises(TypeError, match="abstract"):
        Effect()


def test_what_it_needs_is_missing_unless_it_varies(rv_m2):
    needy, stands = spoilt("needs", ("speed", "humidity")), np.ones(SAMPLES)

    def asked(**columns):
        seen = observe(commanded(rv_m2, columns))
        return gate.missing(needy, seen), gate.reads(needy, seen)

    assert asked() == (("speed", "humidity"), ())
    assert asked(**RISES, humidity=stands) == (("humidity",), ("speed", "humidity"))
    assert asked(**RISES, humidity=RISES["speed"]) == ((), ("speed", "humidity"))


def with_response(channel, index, values):
    return (replace(GOOD, responses=(Response(channel, index, values),)),)


def responding(*responses):
    return (replace(GOOD, responses=responses),)


WRONG = {
    "nothing": (None, "answers NoneType"),
    "a parameter alone": (GOOD, "answers Parameter"),
    "a generator": ((p for p in (GOOD,)), "answers generator"),
    "a name": (("sag",), "parameter 1: found str, expected a Parameter"),
    "names twice": ((GOOD, replace(GOOD, size=2e-3)), "'sag, joint_2': the name is used twice"),
    **{f"size {x}": ((replace(GOOD, size=x),), f"size is {x}") for x in (0.0, -1e-3, np.nan, np.inf)},
    "size of rows": ((replace(GOOD, size=ROWS),), "size is array"),
    "size in words": ((replace(GOOD, size="1 mm"),), "size is '1 mm'"),
    "kind unknown": ((replace(GOOD, kind="axis"),), "kind is 'axis', expected one of joint, link"),
    "unit not text": ((replace(GOOD, unit=None),), "unit is None, expected text"),
    "label not text": ((replace(GOOD, label=3),), "label is 3, expected text"),
    "label a list": ((replace(GOOD, label=["sag"], place=""),), r"label is \['sag'\], expected text"),
    "place not text": ((replace(GOOD, place=1),), "place is 1, expected text"),
    "positive in words": ((replace(GOOD, positive="yes"),), "positive is 'yes', expected True or False"),
    "a joint of no robot": ((replace(GOOD, place="nowhere"),), "place is 'nowhere', expected a joint of the robot"),
    "a joint for a link": ((replace(GOOD, kind="link"),), "place is 'joint_2', expected a link of the robot"),
    "a tool elsewhere": ((replace(GOOD, kind="tool"),), "place is 'joint_2', expected 'tool' or a link of the robot"),
    "one response": ((replace(GOOD, responses=at_joint(1, 1.0)),), "responses are Response"),
    "numbers": (responding(1.0), "a response is float"),
    "channel unknown": (with_response("wrist", 0, np.ones(6)), "channel is 'wrist', expected one of joint, segment"),
    "joint too far": (responding(at_joint(5, 1.0)), "joint index is 5, expected 0 to 4"),
    "joint from the end": (responding(at_joint(-1, 1.0)), "joint index is -1"),
    "joint by name": (with_response("joint", "joint_2", ROWS), "joint index is 'joint_2'"),
    "segment too far": (responding(at_segment(99, np.ones(6))), "segment index is 99"),
    "a second base": (with_response("base", 1, np.ones(6)), "base index is 1, expected 0 to 0"),
    "a row too few": (responding(at_joint(1, ROWS[1:])), r"joint are float64 \(9,\)"),
    "one column": (responding(at_joint(1, ROWS[:, None])), r"joint are float64 \(10, 1\)"),
    "half a twist": (responding(at_segment(0, np.ones(3))), r"expected float \(6,\) or \(10, 6\)"),
    "twists for other rows": (responding(at_tool(np.ones((9, 6)))), r"tool are float64 \(9, 6\)"),
    "a twist measured": (responding(at_instrument(np.ones((SAMPLES, 6)))), r"expected float \(10, 3"),
    "a list": (with_response("joint", 1, [1.0] * SAMPLES), "values of channel joint are"),
    "whole numbers": (with_response("joint", 1, np.ones(SAMPLES, dtype=int)), "are int64"),
    "nan": (responding(at_joint(1, np.where(ROWS.cumsum() < 3, np.nan, 1.0))), "not finite in 2"),
    "inf": (responding(at_base([0.0, 0.0, np.inf, 0.0, 0.0, 0.0])), "not finite in 1"),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_answer_is_refused_by_name(observations, case):
    answer, words = WRONG[case]
    with pytest.raises(EffectError, match=f"effect 'mine'.*{words}"):
        checked(Mine(answer), observations)
    if case == "nan":  # columns come through the gate
        with pytest.raises(EffectError, match=r"'mine'.*not finite"):
            block(observations, Mine(answer))


@pytest.mark.parametrize(
    "responses",
    [
        (),
        (at_joint(0, 1), at_joint(4, ROWS)),
        (at_segment(0, [1] * 6), at_segment(1, np.ones((SAMPLES, 6)))),
        (at_base([1] * 6), at_tool(np.ones((SAMPLES, 6))), at_instrument([[1, 2, 3]] * SAMPLES)),
    ],
)
def test_a_right_answer_passes_as_it_is(observations, responses):
    given = (replace(GOOD, responses=responses), replace(GOOD, place="", size=np.float64(2.0)))
    assert checked(Mine(given), observations) == checked(Mine(list(given)), observations) == given
    assert [p.name for p in given] == ["sag, joint_2", "sag"]


def test_every_place_of_the_robot_may_be_named(observations):
    robot = observations.robot
    links = ("", robot.root_frame, robot.tool_frame, *(s.parent_link for s in robot.segments))
    right = {"joint": ("", *robot.joint_names, *robot.urdf_joints), "link": links}
    right |= {kind: (kind, *links) for kind in ("base", "tool", "instrument")}
    for kind, places in right.items():
        for place in places:
            assert checked(Mine((replace(GOOD, kind=kind, place=place),)), observations)


ASK = {
    "parameters": checked,
    "missing": gate.missing,
    "needs": gate.missing,
    "size_spread": checked,
    "reads": gate.reads,
    "variants": gate.variants,
    "nearby": lambda effect, seen: gate.nearby(effect, 1.6),
    "independent": gate.independent,
    "delivered": gate.delivered,
    "elsewhere": gate.elsewhere,
    "driver": lambda effect, seen: gate.driver(effect, seen, (GOOD,), np.zeros(SAMPLES)),
    "arguments": lambda effect, seen: gate.arguments(effect),
}


@pytest.mark.parametrize("member", [name for name in ASK if name not in ("needs", "size_spread")])
def test_whatever_an_effect_raises_names_it_and_what_was_asked(observations, member):
    cause = KeyError("payload")
    with pytest.raises(EffectError, match=rf"^effect 'mine': {member}\(\) raised KeyError\('payload'\)$") as caught:
        ASK[member](spoilt(member, cause), observations)
    assert caught.value.__cause__ is cause


@pytest.mark.parametrize(
    ("member", "answers", "found"),
    [
        ("needs", ["speed", (1,), None], "needs is .*, expected a tuple of texts"),
        ("missing", [None, "speed", (1,), ("",), True], "missing answers .*, expected a tuple of texts"),
        ("reads", [None, "speed", (1,)], "reads answers .*, expected a tuple of texts"),
        ("reads", [("nowhere",)], r"reads answers \('nowhere',\), expected columns of the campaign"),
        (
            "variants",
            [(), (1,), None, lambda own: own, lambda own: (own, JointOffset()), (Mine,)],
            "variants answers .*, expected a tuple of effects named 'mine', at least one",
        ),
        ("nearby", [(), ("mine",)], "nearby answers .*, expected a tuple of effects"),
        ("nearby", [lambda own: (replace(own, size=0.8),)], r"nearby answers .*0\.8.*, expected it to hold itself"),
        ("delivered", [None], r"delivered answers \(None,\), expected a tuple of effects named 'mine'"),
        ("elsewhere", [JointOffset()], "elsewhere answers .*JointOffset"),
        (
            "arguments",
            [None, {"size": np.ones(2)}, {1: 2.0}],
            "arguments answers .*, expected numbers, texts and tuples of them by name",
        ),
        ("independent", [None], " answers NoneType"),
        ("size_spread", ["wide", 0.0, -1.0, np.nan, np.inf, None], "size_spread is .*, expected a number above 0"),
        (
            "driver",
            ["load", ("l", "N"), ("l", 3, ROWS), (1, "N", ROWS), ("l", "N", ROWS[1:]), ("l", "N", ROWS * np.nan)],
            "driver answers .*, expected name, unit and 10 finite values",
        ),
    ],
)
def test_junk_is_refused_with_what_was_asked(observations, member, answers, found):
    for answer in answers:
        with pytest.raises(EffectError, match=rf"^effect 'mine':?\s*{found.strip()}"):
            ASK[member](spoilt(member, answer), observations)


def test_right_answers_pass_as_they_are(rv_m2, observations):
    effect, other = Mine(), Mine(size=0.8)
    assert gate.missing(spoilt("missing", ["masses in the URDF"]), observations) == ("masses in the URDF",)
    assert gate.variants(effect, observations) == gate.nearby(effect, 1.6) == (effect,)
    assert gate.variants(spoilt("variants", [effect, other]), observations) == (effect, other)
    assert gate.nearby(spoilt("nearby", lambda own: (replace(own, size=0.8), own)), 1.6)[0].size == 0.8
    assert gate.at(effect, "joint_2", observations) == replace(effect, places=("joint_2",))
    assert gate.at(effect, "joint_3", observations) is None
    assert gate.arguments(JointOffset()) == {}
    assert gate.arguments(JointOffset(places=("joint_2",))) == {"places": ("joint_2",)}
    driver = spoilt("driver", ("load", "N", ROWS))
    assert gate.driver(driver, observations, (GOOD,), np.zeros(SAMPLES))[:2] == ("load", "N")
    assert gate.unfaded(effect) is effect
    assert len(gate.independent(Geometric(), observations)) > 0
    with pytest.raises(EffectError, match="not an effect"):
        checked("joint_offset", observations)


@pytest.mark.parametrize(
    ("member", "answer", "found"),
    [
        ("variants", (), r"variants answers \(\)"),
        ("missing", None, "missing answers None"),
        ("needs", "speed", "needs is 'speed'"),
        ("parameters", KeyError("payload"), r"parameters\(\) raised KeyError\('payload'\)"),
        ("parameters", (replace(GOOD, size=0.0),), r"parameter 'sag, joint_2': size is 0\.0"),
        ("nearby", (), r"nearby answers \(\)"),
        ("reads", "speed", "reads answers 'speed'"),
    ],
)
def test_a_diagnosis_asks_through_the_gate(rv_m2, member, answer, found):
    data = simulate(rv_m2, samples=40)[0]
    # joint 2 is off by what the effect can do, so that it is chosen and then asked for all else
    off = replace(data, q=data.q - 3e-3 * (np.arange(rv_m2.n) == 1))
    sound = type("Sound", (Mine,), {"arguments": lambda self: {}})
    if member == "reads":
        assert diagnose(off, effects=[sound()], only=["mine"]).verdict == ("mine",)
    with pytest.raises(EffectError, match=f"^effect 'mine'.*{found}"):
        diagnose(off, effects=[spoilt(member, answer)], only=["mine"])


@pytest.fixture(scope="module")
def rich(rv_m2):
    """Commands in all conditions that the library's effects read."""
    return observe(simulate(rv_m2, samples=12, seed=4, moving=True, links=True)[0])


JOINTS = ("joint_1", "joint_2", "joint_3", "joint_4", "joint_5")
LINKS = ("column", "shoulder", "upper_arm", "forearm", "hand")
PLACES = {
    **dict.fromkeys(("joint_offset", "joint_gain", "transmission_error", "backlash", "tracking_lag"), JOINTS),
    "joint_compliance": JOINTS,
    **dict.fromkeys(("link_compliance", "thermal_elongation", "thermal_bending"), LINKS),
    "geometric": ("base_link", "shoulder", "upper_arm", "forearm", "wrist", "hand"),
}
"""Where each effect may sit alone; those of frames and instruments are not listed."""


@pytest.mark.parametrize("name", library())
def test_every_effect_may_sit_in_one_of_its_places_or_in_all_but_one(rv_m2, rich, name):
    effect, places = library()[name], PLACES.get(name, ())
    whole, columns, single = checked(effect, rich), block(rich, effect).columns, gate.alone(effect, rich)
    assert [one.places for one in single] == [(place,) for place in places]

    def holds(own, kept):
        assert [p.name for p in checked(own, rich)] == [p.name for p, keep in zip(whole, kept, strict=True) if keep]
        np.testing.assert_array_equal(block(rich, own).columns, columns[:, :, kept])
        settings = (*gate.variants(own, rich), *gate.nearby(own, 1.6))
        assert {(setting.places, setting.excluded) for setting in settings} == {(own.places, own.excluded)}

    for one in single:
        holds(one, [p.place in one.places for p in whole])
        assert gate.alone(one, rich) == ()
        assert gate.at(effect, one.places[0], rich) == one
        others = replace(effect, excluded=one.places)
        holds(others, [p.place not in one.places for p in whole])
        assert gate.at(others, one.places[0], rich) is None
        assert checked(replace(others, places=one.places), rich) == ()
        assert type(effect)(**gate.arguments(others)) == others
    # any place of the robot may be excluded from where an effect does nothing
    for place in {*rv_m2.urdf_joints, *rv_m2.urdf_links} - {*places}:
        assert gate.at(effect, place, rich) is None
        assert [p.name for p in checked(replace(effect, excluded=(place,)), rich)] == [p.name for p in whole]


def test_joints_that_are_named_exist(observations):
    two = checked(JointOffset(places=("joint_4", "joint_2")), observations)
    assert [p.place for p in two] == ["joint_2", "joint_4"]
    for given, found in (
        ({"places": ("joint_2", "elbow")}, "places holds 'elbow', expected any of joint_1, joint_2"),
        ({"places": "joint_2"}, "places is 'joint_2', expected a tuple of texts"),
        ({"excluded": ("elbow",)}, "excluded holds 'elbow', expected any of joint_1, joint_2"),
    ):
        with pytest.raises(EffectError, match=f"'joint_offset': {found}"):
            checked(JointOffset(**given), observations)


def test_a_fault_of_the_programs_own_effect_is_told_as_its_own(observations, monkeypatch):
    def broken(*_):
        raise KeyError("time")

    monkeypatch.setattr(JointOffset, "reads", broken)
    with pytest.raises(OwnEffectError, match=r"'joint_offset': reads\(\) raised KeyError.* not of your campaign"):
        gate.reads(JointOffset(), observations)
    with pytest.raises(EffectError, match=r"reads\(\) raised KeyError\('time'\)$") as told:
        gate.reads(spoilt("reads", KeyError("time")), observations)
    assert not isinstance(told.value, OwnEffectError)


def test_a_model_keeps_places_and_is_saved_through_the_gate(rv_m2, rich, tmp_path):
    settings = [s for e in (JointOffset(), TransmissionError()) for s in (e, gate.at(e, "joint_3", rich))]
    held = tuple((setting, 1e-3 * np.arange(1.0, 1.0 + len(checked(setting, rich)))) for setting in settings)
    model = CorrectedModel(rv_m2, rich.campaign.settings, rich.frames, held, "position")
    model.save(tmp_path / "model.json")
    assert [effect for effect, _ in CorrectedModel.load(tmp_path / "model.json").effects] == settings
    saved = [sorted(entry["arguments"]) for entry in model.to_dict()["effects"]]
    assert saved == [[], ["places"], ["harmonics", "side"], ["harmonics", "places", "side"]]
    with pytest.raises(EffectError, match="'mine': arguments answers"):
        replace(model, effects=((Mine(size=np.ones(2)), np.zeros(1)),)).to_dict()


class Built(Effect):
    """No dataclass: it sets what it holds itself."""

    name = "built"

    def __init__(self, size):
        object.__setattr__(self, "size", size)

    def parameters(self, observations):
        return tuple(replace(GOOD, size=self.size, place=joint) for joint in ("joint_2", "joint_3"))


def test_an_effect_with_a_constructor_of_its_own_may_sit_in_one_joint(observations):
    single = [checked(one, observations) for one in gate.alone(Built(0.5), observations)]
    assert [(p.place, p.size) for (p,) in single] == [("joint_2", 0.5), ("joint_3", 0.5)]
    # it compares as equal with any other of its kind, and is not mistaken for it
    assert [p.size for p in checked(Built(0.7), observations)] == [0.7, 0.7]


def test_parameters_are_declared_whatever_their_responses(observations):
    endless = Mine(with_response("joint", 1, np.full(3, np.inf)))
    assert gate.declared(endless, observations) == endless.answer
    assert gate.declared(replace(endless, excluded=("joint_2",)), observations) == ()
    for answer, found in ((None, "NoneType"), ((GOOD, 1), "tuple"), (GOOD, "Parameter")):
        with pytest.raises(EffectError, match=f"'mine' answers {found}, expected a tuple of Parameter"):
            gate.declared(Mine(answer), observations)


@dataclass(frozen=True)
class Sag(Mine):
    """An effect with an argument of each type."""

    name = "sag"
    lag: NotNegative = 0.0
    orders: tuple[Order, ...] = ()
    share_of: float | tuple[float, ...] = 0.0
    turns: bool | None = None
    side: str = ""
    either: float | str = 0.0


@pytest.mark.parametrize("effect", [*library().values(), Discovered(place="joint_1", marks=(1.0, 2.0))])
def test_what_an_effect_writes_it_takes(effect):
    assert with_arguments(type(effect), gate.arguments(effect), "") == effect


def test_lists_become_tuples_and_numbers_what_the_class_says():
    held = {"lag": 600, "orders": [1, 2], "share_of": [0.5, 1], "turns": True, "side": "left", "places": ["elbow"]}
    found = with_arguments(Sag, held, "a")
    assert found == Sag(lag=600.0, orders=(1, 2), share_of=(0.5, 1.0), turns=True, side="left", places=("elbow",))
    assert type(found.lag) is float
    plain = with_arguments(Sag, {"share_of": 0.25, "turns": None, "either": "x"}, "a")
    assert plain == Sag(share_of=0.25, either="x")
    assert with_arguments(Built, {"size": [1, "x"]}, "a").size == (1, "x")


@pytest.mark.parametrize(
    ("effect", "held", "said"),
    [
        (Sag, {"lag": -1}, r"a\.lag: -1, expected a number that is not negative"),
        (Sag, {"lag": None}, r"a\.lag: null, expected"),
        (Sag, {"orders": [1, 0]}, r"a\.orders\[1\]: 0, expected a whole number from 1 on"),
        (Sag, {"orders": [1.5]}, r"a\.orders\[0\]: 1\.5, expected a whole number"),
        (Sag, {"orders": 1}, r"a\.orders: 1, expected a list"),
        (Sag, {"share_of": [0.5, "x"]}, r"a\.share_of\[1\]: 'x', expected a finite number"),
        (Sag, {"share_of": "x"}, r"a\.share_of: 'x', expected a finite number"),
        (Sag, {"turns": 1}, r"a\.turns: 1, expected true or false"),
        (Sag, {"side": 3}, r"a\.side: 3, expected text"),
        (Sag, {"either": [float("nan")]}, r"a\.either\[0\]: NaN, expected a finite number"),
        (Sag, {"places": "elbow"}, r"a\.places: 'elbow', expected a list"),
        (Sag, {"slack": 1}, r"a\.slack: is not known"),
        (Sag, [1], r"a: \[1\], expected an object with the keys places, excluded, answer"),
        (Built, {}, r"a: does not fit \(.*'size'\), expected the arguments of Built"),
        (Built, {"size": float("inf")}, r"a\.size: Infinity, expected a finite number"),
    ],
)
def test_what_an_effect_does_not_take_is_told_with_its_place(effect, held, said):
    with pytest.raises(MisfitError, match=f"^{said}"):
        with_arguments(effect, held, "a")
