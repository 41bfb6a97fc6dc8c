"""The gate: every answer that breaks the contract is refused, with the effect, the parameter and what was found."""

import ast
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
from helpers import SAMPLES, commanded

import thermal_robot
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
from thermal_robot.effects.gate import checked, driver, independent
from thermal_robot.errors import OwnEffectError
from thermal_robot.inference.columns import block
from thermal_robot.observations import observe

GOOD = Parameter("sag", "rad", 1e-3, "joint", "joint_2", (at_joint(1, 1.0),))


@dataclass(frozen=True)
class Answers(Effect):
    """An effect of somebody's own that answers whatever it is given."""

    answer: Any = ()
    drives: Any = None
    name = "sagging"

    def parameters(self, observations):
        return self.answer

    def driver(self, observations, parameters, error):
        return self.drives


@pytest.fixture(scope="module")
def observations(rv_m2):
    return observe(replace(commanded(rv_m2), position=np.zeros((SAMPLES, 3))))


def with_response(channel, index, values):
    return (replace(GOOD, responses=(Response(channel, index, values),)),)


ROWS = np.ones(SAMPLES)
WRONG = {
    "nothing": (None, "answers NoneType"),
    "a parameter alone": (GOOD, "answers Parameter"),
    "a generator": ((p for p in (GOOD,)), "answers generator"),
    "a name": (("sag",), "parameter 1: found str, expected a Parameter"),
    "names twice": ((GOOD, replace(GOOD, size=2e-3)), "'sag, joint_2': the name is used twice"),
    "size 0": ((replace(GOOD, size=0.0),), "size is 0.0"),
    "size below 0": ((replace(GOOD, size=-1e-3),), "size is -0.001"),
    "size nan": ((replace(GOOD, size=float("nan")),), "size is nan"),
    "size inf": ((replace(GOOD, size=np.inf),), "size is inf"),
    "size of rows": ((replace(GOOD, size=ROWS),), "size is array"),
    "size in words": ((replace(GOOD, size="1 mm"),), "size is '1 mm'"),
    "kind unknown": ((replace(GOOD, kind="axis"),), "kind is 'axis', expected one of joint, link"),
    "unit not text": ((replace(GOOD, unit=None),), "unit is None, expected text"),
    "label not text": ((replace(GOOD, label=3),), "label is 3, expected text"),
    "place not text": ((replace(GOOD, place=1),), "place is 1, expected text"),
    "a joint of no robot": ((replace(GOOD, place="nowhere"),), "place is 'nowhere', expected a joint of the robot"),
    "a joint for a link": ((replace(GOOD, kind="link"),), "place is 'joint_2', expected a link of the robot"),
    "a tool elsewhere": ((replace(GOOD, kind="tool"),), "place is 'joint_2', expected 'tool' or a link of the robot"),
    "one response": ((replace(GOOD, responses=at_joint(1, 1.0)),), "responses are Response"),
    "numbers": ((replace(GOOD, responses=(1.0,)),), "a response is float"),
    "channel unknown": (with_response("wrist", 0, np.ones(6)), "channel is 'wrist', expected one of joint, segment"),
    "joint too far": ((replace(GOOD, responses=(at_joint(5, 1.0),)),), "joint index is 5, expected 0 to 4"),
    "joint from the end": ((replace(GOOD, responses=(at_joint(-1, 1.0),)),), "joint index is -1"),
    "joint by name": (with_response("joint", "joint_2", ROWS), "joint index is 'joint_2'"),
    "segment too far": ((replace(GOOD, responses=(at_segment(99, np.ones(6)),)),), "segment index is 99"),
    "a second base": (with_response("base", 1, np.ones(6)), "base index is 1, expected 0 to 0"),
    "a row too few": ((replace(GOOD, responses=(at_joint(1, ROWS[1:]),)),), r"joint are float64 \(9,\)"),
    "one column": ((replace(GOOD, responses=(at_joint(1, ROWS[:, None]),)),), r"joint are float64 \(10, 1\)"),
    "half a twist": ((replace(GOOD, responses=(at_segment(0, np.ones(3)),)),), r"expected float \(6,\) or \(10, 6\)"),
    "twists for other rows": ((replace(GOOD, responses=(at_tool(np.ones((9, 6))),)),), r"tool are float64 \(9, 6\)"),
    "a twist measured": (
        (replace(GOOD, responses=(at_instrument(np.ones((SAMPLES, 6))),)),),
        r"expected float \(10, 3",
    ),
    "a list": (with_response("joint", 1, [1.0] * SAMPLES), "values of channel joint are"),
    "whole numbers": (with_response("joint", 1, np.ones(SAMPLES, dtype=int)), "are int64"),
    "nan": ((replace(GOOD, responses=(at_joint(1, np.where(ROWS.cumsum() < 3, np.nan, 1.0)),)),), "not finite in 2"),
    "inf": ((replace(GOOD, responses=(at_base([0.0, 0.0, np.inf, 0.0, 0.0, 0.0]),)),), "not finite in 1"),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_answer_is_refused_by_name(observations, case):
    answer, words = WRONG[case]
    with pytest.raises(EffectError, match=f"effect 'sagging'.*{words}"):
        checked(Answers(answer), observations)


@pytest.mark.parametrize(
    "responses",
    [
        (),
        (at_joint(0, 1.0), at_joint(4, ROWS)),
        (at_segment(0, np.ones(6)), at_segment(1, np.ones((SAMPLES, 6)))),
        (at_base(np.ones(6)), at_tool(np.ones((SAMPLES, 6))), at_instrument(np.ones((SAMPLES, 3)))),
    ],
)
def test_a_right_answer_passes_as_it_is(observations, responses):
    given = (replace(GOOD, responses=responses), replace(GOOD, place="joint_3", size=np.float64(2.0)))
    assert checked(Answers(given), observations) == given
    assert checked(Answers(list(given)), observations) == given


def test_every_place_of_the_robot_may_be_named(observations):
    robot = observations.robot
    right = {
        "joint": ("", *robot.joint_names, *robot.urdf_joints),
        "link": ("", robot.root_frame, robot.tool_frame, *(s.parent_link for s in robot.segments)),
        "base": ("", "base", robot.root_frame),
        "tool": ("", "tool", robot.tool_frame),
        "instrument": ("", "instrument"),
    }
    for kind, places in right.items():
        for place in places:
            assert checked(Answers((replace(GOOD, kind=kind, place=place),)), observations)


def test_what_is_no_effect_is_refused(observations):
    with pytest.raises(EffectError, match="not an effect"):
        checked("joint_offset", observations)


@pytest.mark.parametrize("spread", ["wide", 0.0, -1.0, np.nan, np.inf, None])
def test_the_spread_of_a_size_is_a_number(observations, spread):
    class Vague(JointOffset):
        size_spread = spread

    with pytest.raises(EffectError, match=r"size_spread is .*, expected a number above 0"):
        checked(Vague(), observations)


def test_columns_come_through_the_gate(observations):
    with pytest.raises(EffectError, match=r"'sagging'.*not finite"):
        block(observations, Answers(WRONG["nan"][0]))


def test_a_diagnosis_stops_at_a_wrong_answer_with_its_name(rv_m2):
    from simulate import simulate

    with pytest.raises(EffectError, match=r"'sagging', parameter 'sag, joint_2': size is 0\.0"):
        diagnose(simulate(rv_m2, samples=40)[0], effects=[Answers(WRONG["size 0"][0])], only=["sagging"])


def test_a_driver_is_a_name_a_unit_and_rows(observations):
    error = np.zeros(SAMPLES)
    assert driver(Answers(), observations, (GOOD,), error) is None
    assert driver(Answers(drives=("load", "N", ROWS)), observations, (GOOD,), error)[:2] == ("load", "N")
    for wrong in (
        "load",
        ("load", "N"),
        ("load", 3, ROWS),
        (1, "N", ROWS),
        ("load", "N", ROWS[1:]),
        ("l", "N", ROWS * np.nan),
    ):
        with pytest.raises(EffectError, match="'sagging': driver answers"):
            driver(Answers(drives=wrong), observations, (GOOD,), error)


@dataclass(frozen=True)
class Mine(Effect):
    """An effect of somebody's own, right in all it says; each test spoils one answer."""

    share: Any = 0.5
    name = "mine"

    def parameters(self, observations):
        return (GOOD,)


def spoilt(member, answer):
    """An instance of a :class:`Mine` of which one member raises an exception, answers a value, or is a value."""

    def answers(self, *arguments):
        if isinstance(answer, Exception):
            raise answer
        return answer(self) if callable(answer) else answer

    return type("Spoilt", (Mine,), {member: answer if member == "needs" else answers})()


ASK = {
    "parameters": lambda effect, seen: checked(effect, seen),
    "missing": lambda effect, seen: gate.missing(effect, seen),
    "needs": lambda effect, seen: gate.missing(effect, seen),
    "reads": lambda effect, seen: gate.reads(effect, seen),
    "variants": lambda effect, seen: gate.variants(effect, seen),
    "nearby": lambda effect, seen: gate.nearby(effect, 1.6),
    "at": lambda effect, seen: gate.at(effect, "joint_2", seen),
    "delivered": lambda effect, seen: gate.delivered(effect, seen),
    "elsewhere": lambda effect, seen: gate.elsewhere(effect, seen),
    "driver": lambda effect, seen: driver(effect, seen, (GOOD,), np.zeros(SAMPLES)),
    "arguments": lambda effect, seen: gate.arguments(effect),
}


@pytest.mark.parametrize("member", [name for name in ASK if name != "needs"])
def test_whatever_an_effect_raises_names_it_and_what_was_asked(observations, member):
    cause = KeyError("payload")
    with pytest.raises(EffectError, match=rf"^effect 'mine': {member}\(\) raised KeyError\('payload'\)$") as caught:
        ASK[member](spoilt(member, cause), observations)
    assert caught.value.__cause__ is cause


@pytest.mark.parametrize(
    ("member", "answer", "found"),
    [
        ("needs", "speed", "needs is 'speed', expected a tuple of texts"),
        ("needs", (1,), r"needs is \(1,\)"),
        ("needs", None, "needs is None"),
        ("missing", None, "missing answers None, expected a tuple of texts"),
        ("missing", "speed", "missing answers 'speed'"),
        ("missing", (1,), r"missing answers \(1,\)"),
        ("missing", ("",), r"missing answers \('',\)"),
        ("missing", True, "missing answers True"),
        ("reads", None, "reads answers None"),
        ("reads", "speed", "reads answers 'speed'"),
        ("reads", (1,), r"reads answers \(1,\)"),
        ("reads", ("nowhere",), r"reads answers \('nowhere',\), expected columns of the campaign"),
        ("variants", (), r"variants answers \(\), expected a tuple of effects named 'mine', at least one"),
        ("variants", (1,), r"variants answers \(1,\)"),
        ("variants", None, "variants answers None"),
        ("variants", lambda own: own, "variants answers Spoilt"),
        ("variants", lambda own: (own, JointOffset()), "variants answers .*JointOffset"),
        ("variants", (Mine,), "variants answers .*Mine"),
        ("nearby", (), r"nearby answers \(\)"),
        ("nearby", ("mine",), "nearby answers"),
        ("nearby", lambda own: (replace(own, share=0.8),), r"nearby answers .*0\.8.*, expected it to hold itself"),
        ("at", "joint_2", "at answers 'joint_2', expected None or an effect named 'mine'"),
        ("at", JointOffset(), "at answers JointOffset"),
        ("at", (), r"at answers \(\)"),
        ("delivered", None, r"delivered answers \(None,\), expected a tuple of effects named 'mine'"),
        ("elsewhere", JointOffset(), "elsewhere answers .*JointOffset"),
        ("arguments", None, "arguments answers None, expected numbers, texts and tuples of them by name"),
        ("arguments", {"share": np.ones(2)}, "arguments answers {'share': array"),
        ("arguments", {1: 2.0}, "arguments answers {1: 2.0}"),
    ],
)
def test_junk_is_refused_with_what_was_asked(observations, member, answer, found):
    with pytest.raises(EffectError, match=f"^effect 'mine': {found}"):
        ASK[member](spoilt(member, answer), observations)


def test_right_answers_pass_as_they_are(rv_m2, observations):
    effect, other, speed = Mine(), Mine(0.8), {"speed": np.arange(float(SAMPLES))}
    recorded = observe(commanded(rv_m2, speed))
    assert gate.missing(spoilt("needs", ("speed",)), observations) == ("speed",)
    assert gate.missing(spoilt("needs", ("speed",)), recorded) == ()
    assert gate.missing(spoilt("missing", ["masses in the URDF"]), observations) == ("masses in the URDF",)
    assert gate.reads(spoilt("needs", ("speed",)), recorded) == ("speed",)
    assert gate.variants(effect, observations) == gate.nearby(effect, 1.6) == (effect,)
    assert gate.variants(spoilt("variants", [effect, other]), observations) == (effect, other)
    assert gate.nearby(spoilt("nearby", lambda own: (replace(own, share=0.8), own)), 1.6)[0].share == 0.8
    assert gate.at(effect, "joint_2", observations) == replace(effect, places=("joint_2",))
    assert gate.at(effect, "joint_3", observations) is None
    assert gate.at(spoilt("at", other), "joint_2", observations) is other
    assert gate.at(spoilt("at", None), "joint_2", observations) is None
    assert gate.arguments(JointOffset()) == {}
    assert gate.arguments(Mine(("a", 1.0))) == {"share": ("a", 1.0)}
    assert gate.arguments(JointOffset(places=("joint_2",))) == {"places": ("joint_2",)}


@pytest.mark.parametrize(
    ("member", "answer", "found"),
    [
        ("variants", (), r"variants answers \(\)"),
        ("variants", (1,), r"variants answers \(1,\)"),
        ("missing", None, "missing answers None"),
        ("needs", "speed", "needs is 'speed'"),
        ("parameters", KeyError("payload"), r"parameters\(\) raised KeyError\('payload'\)"),
        ("parameters", (replace(GOOD, place="nowhere"),), "place is 'nowhere'"),
        ("nearby", (), r"nearby answers \(\)"),
        ("reads", "speed", "reads answers 'speed'"),
    ],
)
def test_a_diagnosis_asks_through_the_gate(rv_m2, member, answer, found):
    from simulate import simulate

    data = simulate(rv_m2, samples=40)[0]
    # joint 2 is off by what the effect can do, so that it is chosen and then asked for all else
    off = replace(data, q=data.q - 3e-3 * (np.arange(rv_m2.n) == 1))
    assert diagnose(off, effects=[Mine()], only=["mine"]).verdict == ("mine",)
    with pytest.raises(EffectError, match=f"^effect 'mine'.*{found}"):
        diagnose(off, effects=[spoilt(member, answer)], only=["mine"])


def test_a_model_is_saved_through_the_gate(rv_m2, observations):
    campaign, effect = observations.campaign, Mine(np.ones(2))
    model = CorrectedModel(rv_m2, campaign.settings, observations.frames, ((effect, np.zeros(1)),), "position")
    with pytest.raises(EffectError, match="'mine': arguments answers"):
        model.to_dict()


def asked_directly(source):
    """Yield the calls of an effect's methods on anything but the gate; ``at`` of an effect takes one argument."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in ASK:
            call = ast.unparse(node)
            if not call.startswith("gate.") and (node.func.attr != "at" or len(node.args) == 1):
                yield call


def test_nobody_asks_an_effect_but_the_gate():
    source = "f(e.reads(seen)); gate.reads(e, seen); e.at(joint); np.add.at(a, b, c)"
    assert set(asked_directly(source)) == {"e.reads(seen)", "e.at(joint)"}
    root = Path(thermal_robot.__file__).parent
    others = [path for path in root.rglob("*.py") if path.parent.name != "effects"]
    assert len(others) > 100
    assert {path.name: found for path in others if (found := list(asked_directly(path.read_text("utf-8"))))} == {}


def rich(robot):
    """Commands in all conditions that the library's effects read."""
    from simulate import simulate

    return observe(simulate(robot, samples=12, seed=4, moving=True, links=True)[0])


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
def test_every_effect_of_joints_or_links_may_sit_in_one_of_them(rv_m2, name):
    seen, effect = rich(rv_m2), library()[name]
    whole = checked(effect, seen)
    single = gate.alone(effect, seen)
    assert [one.places for one in single] == [(place,) for place in PLACES.get(name, ())]
    for one in single:
        kept = [p.place in one.places for p in whole]
        assert [p.name for p in checked(one, seen)] == [p.name for p, keep in zip(whole, kept, strict=True) if keep]
        np.testing.assert_array_equal(block(seen, one).columns, block(seen, effect).columns[:, :, kept])
        # a place alone has none less, and its settings stay there
        assert gate.alone(one, seen) == ()
        assert {setting.places for setting in (*gate.variants(one, seen), *gate.nearby(one, 1.6))} == {one.places}
        assert gate.at(effect, one.places[0], seen) == one
    others = {*JOINTS, *LINKS} - set(PLACES.get(name, ()))
    assert {gate.at(effect, place, seen) for place in others} == {None}


@pytest.mark.parametrize("name", library())
def test_every_effect_of_joints_or_links_may_be_looked_for_in_all_but_one(rv_m2, name):
    seen, effect = rich(rv_m2), library()[name]
    whole = checked(effect, seen)
    for place in PLACES.get(name, ()):
        others = replace(effect, excluded=(place,))
        kept = [p.place != place for p in whole]
        assert [p.name for p in checked(others, seen)] == [p.name for p, keep in zip(whole, kept, strict=True) if keep]
        np.testing.assert_array_equal(block(seen, others).columns, block(seen, effect).columns[:, :, kept])
        assert gate.at(others, place, seen) is None
        assert checked(replace(others, places=(place,)), seen) == ()
        settings = (*gate.variants(others, seen), *gate.nearby(others, 1.6))
        assert {setting.excluded for setting in settings} == {(place,)}
        assert type(effect)(**gate.arguments(others)) == others


def test_joints_that_are_named_exist(observations):
    two = checked(JointOffset(places=("joint_4", "joint_2")), observations)
    assert [p.place for p in two] == ["joint_2", "joint_4"]
    with pytest.raises(EffectError, match="'joint_offset': places holds 'elbow', expected any of joint_1, joint_2"):
        checked(JointOffset(places=("joint_2", "elbow")), observations)
    with pytest.raises(EffectError, match="'joint_offset': places is 'joint_2', expected a tuple of texts"):
        checked(JointOffset(places="joint_2"), observations)
    with pytest.raises(EffectError, match="'joint_offset': excluded holds 'elbow', expected any of joint_1, joint_2"):
        checked(JointOffset(excluded=("elbow",)), observations)


@pytest.mark.parametrize("name", library())
def test_any_place_of_the_robot_may_be_excluded_from_where_an_effect_does_nothing(rv_m2, name):
    seen, effect = rich(rv_m2), library()[name]
    for place in {*rv_m2.urdf_joints, *rv_m2.urdf_links} - set(PLACES.get(name, ())):
        left = checked(replace(effect, excluded=(place,)), seen)
        assert [p.name for p in left] == [p.name for p in checked(effect, seen)]


def test_a_fault_of_the_programs_own_effect_is_told_as_its_own(observations, monkeypatch):
    def broken(*_):
        raise KeyError("time")

    monkeypatch.setattr(JointOffset, "reads", broken)
    with pytest.raises(OwnEffectError, match=r"'joint_offset': reads\(\) raised KeyError.* not of your campaign"):
        gate.reads(JointOffset(), observations)
    monkeypatch.setattr(Answers, "reads", broken, raising=False)
    with pytest.raises(EffectError, match=r"reads\(\) raised KeyError\('time'\)$") as told:
        gate.reads(Answers(), observations)
    assert not isinstance(told.value, OwnEffectError)


def test_a_model_keeps_its_joints_and_one_of_old_needs_none(rv_m2, tmp_path):
    seen = rich(rv_m2)
    held = tuple(
        (setting, 1e-3 * np.arange(1.0, 1.0 + len(checked(setting, seen))))
        for effect in (JointOffset(), TransmissionError())
        for setting in (effect, gate.at(effect, "joint_3", seen))
    )
    model = CorrectedModel(rv_m2, seen.campaign.settings, seen.frames, held, "position")
    model.save(tmp_path / "model.json")
    again = CorrectedModel.load(tmp_path / "model.json")
    assert [effect for effect, _ in again.effects] == [effect for effect, _ in held]
    assert [set(entry["arguments"]) for entry in model.to_dict()["effects"]] == [
        set(),
        {"places"},
        {"harmonics", "side"},
        {"harmonics", "places", "side"},
    ]


def test_an_effect_with_a_constructor_of_its_own_may_sit_in_one_joint(observations):
    class Built(Effect):
        """No dataclass: it sets what it holds itself."""

        name = "built"

        def __init__(self, size):
            object.__setattr__(self, "size", size)

        def parameters(self, observations):
            return tuple(replace(GOOD, size=self.size, place=joint) for joint in ("joint_2", "joint_3"))

    single = gate.alone(Built(0.5), observations)
    assert [(p.place, p.size) for one in single for p in checked(one, observations)] == [
        ("joint_2", 0.5),
        ("joint_3", 0.5),
    ]
    # it compares as equal with any other of its kind, and is not mistaken for it
    assert [p.size for p in checked(Built(0.7), observations)] == [0.7, 0.7]


def test_settings_in_single_places_share_what_the_effect_answers(observations):
    asked = []

    @dataclass(frozen=True)
    class Counted(Effect):
        """Writes down when it is asked."""

        size: float = 0.5
        name: ClassVar[str] = "counted"

        def parameters(self, observations):
            asked.append(self.size)
            return tuple(replace(GOOD, size=self.size, place=joint) for joint in ("joint_2", "joint_3"))

    here = replace(observations)
    singles = [checked(one, here) for one in gate.alone(Counted(), here)]
    assert [p.place for (p,) in singles] == ["joint_2", "joint_3"]
    assert asked == [0.5]
    assert [p.size for p in checked(Counted(0.7), here)] == [0.7, 0.7]
    checked(Counted(), replace(observations))  # what is seen from elsewhere is asked anew
    assert asked == [0.5, 0.7, 0.5]
    # only the last few are kept, so that the responses of hundreds of settings do not fill the memory
    for size in np.linspace(1.0, 2.0, 20):
        checked(Counted(float(size)), here)
    assert len(here.parameters) < 10
    assert asked[-1] == 2.0
    checked(Counted(0.7), here)
    assert asked[-1] == 0.7


def test_parameters_in_which_an_effect_is_told_keep_the_contract_too(rv_m2):
    class Muddled(Geometric):
        def independent(self, observations):
            own = self.parameters(observations)
            return (own[0], own[0])

    seen = observe(commanded(rv_m2))
    assert len(independent(Geometric(), seen)) > 0
    with pytest.raises(EffectError, match="the name is used twice"):
        independent(Muddled(), seen)


def test_parameters_are_declared_whatever_their_responses(observations):
    endless = Answers((replace(GOOD, responses=(Response("joint", 1, np.full(3, np.inf)),)),))
    assert gate.declared(endless, observations) == endless.answer
    with pytest.raises(EffectError):
        checked(endless, observations)
    assert gate.declared(replace(endless, excluded=("joint_2",)), observations) == ()
    for answer, found in ((None, "answers NoneType"), ((GOOD, 1), "answers tuple"), (GOOD, "answers Parameter")):
        with pytest.raises(EffectError, match=f"'sagging' {found}, expected a tuple of Parameter"):
            gate.declared(Answers(answer), observations)


@dataclass(frozen=True)
class Fixed(Effect):
    """Counts how often it is asked."""

    name: ClassVar[str] = "fixed"
    constant: ClassVar[bool] = True
    asked: ClassVar[list[int]] = []
    by_row: bool = False

    def parameters(self, observations):
        self.asked.append(1)
        values = np.ones(observations.campaign.samples) if self.by_row else 1.0
        return (replace(GOOD, responses=(at_joint(1, values),)),)


@dataclass(frozen=True)
class Derived(Fixed):
    """What derives from a constant effect is asked again."""


def test_a_constant_effect_is_asked_once_a_robot_and_what_derives_from_it_each_time(rv_m2):
    for kind, times in ((Fixed, 1), (Derived, 2)):
        Fixed.asked.clear()
        found = [checked(kind(), observe(commanded(rv_m2))) for _ in range(2)]
        assert len(Fixed.asked) == times
        assert [p.name for p in found[0]] == [p.name for p in found[1]]
    with pytest.raises(EffectError, match="constant is True, and a response has a value for each row"):
        checked(Fixed(by_row=True), observe(commanded(rv_m2)))
