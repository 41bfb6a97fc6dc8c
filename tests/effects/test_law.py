"""A law that nobody wrote down, as an effect: places, quantities, labels, words, and a file of its own."""

import importlib.util
from dataclasses import replace

import numpy as np
import pytest
from helpers import SAMPLES, commanded

from thermal_robot import CorrectedModel, EffectError
from thermal_robot.effects import Backlash, gate
from thermal_robot.effects.apply import displacement
from thermal_robot.effects.gate import checked
from thermal_robot.effects.law import PREFIX, Discovered
from thermal_robot.effects.shapes import SHAPES
from thermal_robot.observations import Frames, observe

TIME = np.array([0.0, 40.0, 100.0, 180.0, 300.0, 420.0, 500.0, 610.0, 700.0, 800.0])
STEP = Discovered(kind="joint", place="joint_3", quantity="time", shape="step", marks=(350.0,), span=800.0, unit="s")


@pytest.fixture(scope="module")
def observations(rv_m2):
    labels = {"session": np.array(list("aabbbccaca"))}
    return observe(replace(commanded(rv_m2, {"time": TIME}), labels=labels))


def test_a_step_displaces_its_joint_before_and_after(observations):
    moved, _ = displacement(observations, [(STEP, np.array([1e-4, 5e-4]))])
    np.testing.assert_array_equal(moved.joint[:, 2], np.where(TIME > 350.0, 5e-4, 1e-4))
    assert not np.any(np.delete(moved.joint, 2, axis=1))


@pytest.mark.parametrize(("kind", "place"), [("base", "base"), ("tool", "tool"), ("link", "joint_4")])
def test_elsewhere_than_in_a_joint_it_is_a_twist(observations, rv_m2, kind, place):
    law = replace(STEP, kind=kind, place=place)
    parameters = checked(law, observations)
    assert [p.unit for p in parameters] == (["m"] * 3 + ["rad"] * 3) * 2
    values = np.zeros(12)
    values[6 + 4] = 3e-4
    moved, _ = displacement(observations, [(law, values)])
    segment = next(s for s, segment in enumerate(rv_m2.segments) if segment.name == "joint_4")
    found = {"base": moved.base, "tool": moved.tool, "link": moved.segment[:, segment]}[kind]
    expected = np.zeros((SAMPLES, 6))
    expected[TIME > 350.0, 4] = 3e-4
    np.testing.assert_array_equal(found, expected)
    link = rv_m2.segments[segment].parent_link
    assert {(p.kind, p.place) for p in parameters} == {(kind, link if kind == "link" else kind)}


def test_without_orientation_a_turn_of_the_tool_is_no_parameter(observations):
    law = replace(STEP, kind="tool", place="tool", turns=False)
    assert [p.unit for p in checked(law, observations)] == ["m"] * 6
    # the base turns the target about itself: that shows
    assert len(checked(replace(law, kind="base", place="base"), observations)) == 12


def test_a_slide_that_errs_errs_by_a_length(awkward):
    slide = next(n for n, kind in zip(awkward.joint_names, awkward.joint_types, strict=True) if kind == "prismatic")
    law = Discovered(kind="joint", place=slide, quantity=slide, shape="ramp")
    assert {p.unit for p in checked(law, observe(commanded(awkward)))} == {"m"}


def test_a_session_has_a_value_each_and_an_unknown_one_the_mean(observations):
    law = Discovered(
        place="joint_1", quantity="session", shape="levels", marks=(0.0, 1.0, 2.0), span=2.0, labels=("a", "b", "c")
    )
    assert [p.label for p in checked(law, observations)] == ["at a", "at b", "at c"]
    values = np.array([1e-4, 2e-4, 3e-4])

    def shifts(labels):
        campaign = replace(observations.campaign, labels={"session": np.array(list(labels))})
        return displacement(observe(campaign), [(law, values)])[0].joint[:, 0]

    by_name = {"a": 1e-4, "b": 2e-4, "c": 3e-4}
    np.testing.assert_array_equal(shifts("aabbbccaca"), [by_name[s] for s in "aabbbccaca"])
    # a later campaign with other sessions, whose numbers in its own alphabet differ
    np.testing.assert_allclose(shifts("zzbbbzzzcc"), [by_name.get(s, 2e-4) for s in "zzbbbzzzcc"], rtol=1e-12)
    # rows to predict that do not say which session is theirs, and those of one session apart from the others
    unsaid = observe(replace(observations.campaign, labels={}, position=None))
    np.testing.assert_allclose(displacement(unsaid, [(law, values)])[0].joint[:, 0], 2e-4, rtol=1e-12)
    apart = replace(law, shape="apart", marks=(1.0,))
    np.testing.assert_allclose(apart.at_rows(unsaid)[0], np.tile([2.0 / 3.0, 1.0 / 3.0], (SAMPLES, 1)))


def test_what_is_predicted_without_a_clock_comes_after_the_campaign(rv_m2):
    law = Discovered(place="joint_1", quantity="order", shape="ramp", origin=0.0, span=9.0)
    commands = commanded(rv_m2)
    measured = observe(replace(commands, position=np.zeros((SAMPLES, 3))))
    np.testing.assert_array_equal(law.values(measured), np.arange(10.0))
    np.testing.assert_array_equal(law.values(observe(commands)), 9.0)


def test_it_is_missing_and_reads_what_it_follows(observations, rv_m2):
    bare = observe(commanded(rv_m2))
    assert (STEP.missing(observations), STEP.missing(bare)) == ((), ("time",))
    assert (STEP.reads(observations), STEP.reads(bare)) == (("time",), ())
    assert STEP.parameters(bare) == ()
    own = replace(STEP, quantity="joint_2")
    assert (own.missing(bare), own.reads(bare)) == ((), ())
    constant = replace(STEP, shape="constant", quantity="none", marks=())
    assert (constant.missing(bare), constant.reads(bare)) == ((), ())


def test_marks_that_look_alike_in_three_digits_have_names_of_their_own(rv_m2):
    marks = (12340.0, 12341.0, 12342.5, 20000.0)
    clock = np.linspace(12340.0, 20000.0, SAMPLES)
    seen = observe(commanded(rv_m2, {"time": clock}))
    for shape in ("levels", "smooth"):
        law = Discovered(place="joint_1", quantity="time", shape=shape, marks=marks, origin=12340.0, span=7660.0)
        assert len({p.name for p in checked(law, seen)}) == 4


@pytest.mark.parametrize("shape", SHAPES)
def test_it_is_described_by_place_quantity_and_shape(shape):
    law = replace(STEP, shape=shape, marks=(-350.0, 20.0))
    words = law.describe()
    assert ("the zero of joint_3" if shape == "step" else "at joint_3") in words
    assert "joint joint_3" not in words
    assert ("time" in words) == (shape != "constant")
    assert ("−350 s" in words) == bool(SHAPES[shape].mark)
    assert "{" not in words


@pytest.mark.parametrize(
    ("law", "words"),
    [
        (STEP, "the zero of joint_3 jumped at time 350 s"),
        (
            replace(STEP, place="elbow", quantity="order", marks=(57.0,), unit=""),
            "the zero of joint elbow jumped at order 57",
        ),
        (replace(STEP, quantity="joint_2", unit="rad"), "an error at joint_3 that follows joint_2 (a step at 350 rad)"),
        (replace(STEP, kind="base"), "an error at the base that follows time (a step at 350 s)"),
        (replace(STEP, place="elbow", shape="constant"), "a constant error at joint elbow"),
        (replace(STEP, kind="base", shape="ramp"), "an error at the base that follows time (in proportion)"),
        (replace(STEP, kind="link", shape="constant"), "a constant error at the placement of joint_3"),
        (
            replace(STEP, quantity="joint_3", shape="harmonic", marks=(101.0,)),
            "an error at joint_3 that follows its position (harmonic of order 101)",
        ),
        (replace(STEP, shape="smooth"), "an error at joint_3 that follows time (smooth)"),
        (
            replace(STEP, place="elbow", shape="ramp", quantity="payload", of="backlash"),
            "lost motion in joint elbow that changes with payload (in proportion)",
        ),
        (
            replace(STEP, place="elbow", shape="ramp", of="transmission_error"),
            "a periodic transmission error in joint elbow that changes with time (in proportion)",
        ),
        (
            replace(STEP, kind="tool", shape="ramp", by="payload"),
            "an error at the tool that follows time times payload (in proportion)",
        ),
        (
            replace(STEP, quantity="since_turn.joint_3", shape="hysteresis", marks=(0.25,), unit="rad"),
            "an error at joint_3 that follows how far it has gone since it last turned round (springs that slip)",
        ),
    ],
)
def test_its_words(law, words):
    assert law.describe() == words


def test_it_is_drawn_against_what_it_follows(observations):
    name, unit, values = STEP.driver(observations, checked(STEP, observations), np.zeros(SAMPLES))
    assert (name, unit) == ("time", "s")
    np.testing.assert_array_equal(values, TIME)
    constant = replace(STEP, shape="constant", quantity="none")
    assert constant.driver(observations, checked(constant, observations), np.zeros(SAMPLES)) is None


@pytest.mark.parametrize("shape", ["step", "smooth", "levels", "hinge"])
def test_as_a_file_it_does_the_same_under_its_own_name(observations, tmp_path, shape):
    marks = {"step": (350.0,), "hinge": (350.0, -1.0)}.get(shape, (0.0, 200.0, 400.0, 800.0))
    law = replace(STEP, shape=shape, marks=marks)
    values = 1e-4 * (1.0 + np.arange(len(checked(law, observations))))
    (tmp_path / "slipping_belt.py").write_text(law.to_source(values, "slipping_belt"), encoding="utf-8")
    spec = importlib.util.spec_from_file_location("slipping_belt", tmp_path / "slipping_belt.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    named = module.SlippingBelt()
    assert (named.name, named.title) == ("slipping_belt", "slipping belt")
    own, again = (displacement(observations, [(e, values)])[0].joint for e in (law, named))
    np.testing.assert_array_equal(own, again)
    assert all(f"{v:.4g}" in module.SlippingBelt.__doc__ for v in values)


def test_a_model_keeps_it_whole(observations, tmp_path, rv_m2):
    law = replace(STEP, name=PREFIX + "3", labels=("a", "b"))
    campaign = observations.campaign
    model = CorrectedModel(
        rv_m2, campaign.settings, Frames.declared(campaign), ((law, np.array([1e-4, 5e-4])),), "position", ("time",)
    )
    model.save(tmp_path / "model.json")
    again = CorrectedModel.load(tmp_path / "model.json")
    assert again.effects[0][0] == law
    np.testing.assert_array_equal(again.predict(campaign)[0], model.predict(campaign)[0])


COLUMNS = {
    "time": TIME,
    "payload": np.tile([0.0, 2.0], 5),
    "approach.joint_3": np.tile([1.0, 1.0, -1.0, -1.0, 1.0], 2),
    "velocity.joint_3": np.linspace(-0.4, 0.5, SAMPLES),
    "temperature": np.linspace(20.0, 30.0, SAMPLES),
}
CHANGING = Discovered(place="joint_3", quantity="payload", shape="ramp", span=2.0, of="backlash")
RICHER = {
    "an effect that changes": CHANGING,
    "an effect with arguments": replace(CHANGING, of="transmission_error", of_arguments='{"harmonics": [1, 3]}'),
    "two quantities": Discovered(
        kind="tool", place="tool", quantity="payload", shape="ramp", span=2.0, by="time", by_origin=50.0, by_span=800.0
    ),
    "their product": Discovered(place="joint_2", quantity="payload", shape="product", by="joint_1", span=3.0),
    "memory": Discovered(place="joint_3", quantity="since_turn.joint_3", shape="hysteresis", marks=(0.25, 1.0)),
    "a start": Discovered(
        place="joint_3",
        quantity="time",
        shape="relaxing each",
        marks=(90.0,),
        span=800.0,
        runs=("am", "pm"),
        starts=(float(TIME[0]), float(TIME[5])),
    ),
    "a wave": Discovered(place="joint_3", quantity="joint_3", shape="harmonic", marks=(37.62,)),
}


@pytest.fixture(scope="module")
def rich(rv_m2):
    return observe(commanded(rv_m2, COLUMNS))


def test_an_effect_that_changes_is_the_effect_times_the_law(rich):
    law, twice = (displacement(rich, [(CHANGING, np.array(v))])[0].joint for v in ([5e-4, 0.0], [0.0, 5e-4]))
    steady = displacement(rich, [(Backlash(places=("joint_3",)), np.array([5e-4]))])[0].joint
    np.testing.assert_allclose(law, steady, atol=1e-18)
    # as straight as the payload, which is 0 or 2 kg
    np.testing.assert_allclose(twice, steady * (COLUMNS["payload"] / 2.0)[:, None], atol=1e-18)
    first = checked(CHANGING, rich)[0]
    assert (first.kind, first.place, first.unit, first.size) == ("joint", "joint_3", "rad", 5e-4)
    assert first.label.startswith("lost motion, ")
    assert (CHANGING.missing(rich), set(CHANGING.reads(rich))) == ((), {"payload", "approach.joint_3"})


def test_an_effect_of_two_amplitudes_an_order_keeps_them_all(rich):
    law = RICHER["an effect with arguments"]
    labels = [p.label for p in checked(law, rich)]
    assert len(labels) == 2 * 4
    assert sum("order 3" in label for label in labels) == 4


@pytest.mark.parametrize(("of", "words"), [("worn_belt", "no effect is named"), ("backlash", "does not take")])
def test_an_effect_in_a_law_is_one_that_is_installed_and_takes_its_arguments(rich, of, words):
    with pytest.raises(EffectError, match=f"{words}.*{of}|{of}.*{words}"):
        checked(replace(CHANGING, of=of, of_arguments='{"slack": 1}'), rich)


def test_a_straight_law_of_two_quantities_holds_each_and_their_product(rich):
    functions, labels = RICHER["two quantities"].at_rows(rich)
    u, v = COLUMNS["payload"] / 2.0, (TIME - 50.0) / 800.0
    for column in (np.ones(SAMPLES), u, v, u * v):
        left = column - functions @ np.linalg.lstsq(functions, column, rcond=None)[0]
        assert np.abs(left).max() < 1e-12
    assert len(set(labels)) == functions.shape[1] == 4
    assert RICHER["two quantities"].follows == "payload * time"
    assert CHANGING.follows == "payload"


def test_a_product_alone_is_nothing_where_either_is(rich):
    functions, _ = RICHER["their product"].at_rows(rich)
    none = COLUMNS["payload"] == 0.0
    assert not functions[none, 1].any()
    np.testing.assert_allclose(functions[~none, 1], 2.0 * rich.q[~none, 0] / 3.0, rtol=1e-12)


def test_memory_follows_the_distance_since_the_turn_and_needs_an_order(rich, rv_m2):
    law = RICHER["memory"]
    since = rich.campaign.since_turn["joint_3"]
    np.testing.assert_array_equal(law.values(rich), since)
    assert law.reads(rich) == ("time",)
    assert law.missing(observe(commanded(rv_m2))) == ("since_turn.joint_3",)
    functions, labels = law.at_rows(rich)
    assert labels == ("constant", "at 0.25", "at 1")
    np.testing.assert_array_equal(functions[:, 0], 1.0)
    for slip, strain in zip(law.marks, functions[:, 1:].T, strict=True):
        # twice its slip from the turn an element slips, whatever it was strained by before, as lost motion does
        far = np.abs(since) >= 2.0 * slip
        np.testing.assert_allclose(strain[far], np.sign(since[far]), atol=1e-12)
        assert (np.abs(strain) <= 1.0).all()
    assert checked(law, rich)[0].unit == "rad"


@pytest.mark.parametrize("name", RICHER)
def test_a_richer_law_is_the_same_on_rows_taken_away(rich, name):
    law, rows = RICHER[name], np.array([8, 1, 5])
    values = 1e-4 * (1.0 + np.arange(len(checked(law, rich))))
    whole = displacement(rich, [(law, values)])[0]
    part = displacement(observe(rich.campaign.take(rows)), [(law, values)])[0]
    np.testing.assert_allclose(part.joint, whole.joint[rows], atol=1e-18)
    np.testing.assert_allclose(part.tool, whole.tool[rows], atol=1e-18)
    assert np.abs(whole.joint).max() + np.abs(whole.tool).max() > 5e-5


@pytest.mark.parametrize("name", RICHER)
def test_a_richer_law_is_kept_whole_by_a_model_and_by_a_file(rich, rv_m2, tmp_path, name):
    law = RICHER[name]
    values = 1e-4 * (1.0 + np.arange(len(checked(law, rich))))
    campaign = rich.campaign
    needs = law.reads(rich)
    model = CorrectedModel(rv_m2, campaign.settings, Frames.declared(campaign), ((law, values),), "position", needs)
    model.save(tmp_path / "model.json")
    again = CorrectedModel.load(tmp_path / "model.json")
    assert again.effects[0][0] == law
    np.testing.assert_array_equal(again.predict(campaign)[0], model.predict(campaign)[0])
    named = {}
    exec(law.to_source(values, "slipping_belt"), named)
    own, other = (displacement(rich, [(e, values)])[0] for e in (law, named["SlippingBelt"]()))
    np.testing.assert_array_equal(own.joint, other.joint)
    np.testing.assert_array_equal(own.tool, other.tool)


def test_what_relaxes_knows_its_sessions_and_takes_a_new_one_for_their_mean(rv_m2):
    law = RICHER["a start"]
    session = np.array(["pm"] * 3 + ["am"] * 3 + ["night"] * 4)  # rows may be told of any session, in any order
    here = observe(commanded(rv_m2, COLUMNS, labels={"session": session}))
    functions, labels = law.at_rows(here)
    assert labels == ("constant", "at the start of am", "at the start of pm")
    am, pm, new = session == "am", session == "pm", session == "night"
    np.testing.assert_allclose(functions[am, 1], np.exp(-np.maximum(TIME[am] - TIME[0], 0.0) / 90.0))
    np.testing.assert_allclose(functions[pm, 2], np.exp(-np.maximum(TIME[pm] - TIME[5], 0.0) / 90.0))
    for k in (1, 2):
        np.testing.assert_allclose(functions[new, k], 0.5 * np.exp(-(TIME[new] - TIME[new].min()) / 90.0))
    assert not functions[am, 2].any()
    assert not functions[pm, 1].any()
    assert law.shifted(-200.0).marks == (110.0,)
    assert (law.follows, law.describe()) == (
        "time",
        "an error at joint_3 that follows time (it settles within 90 of each start)",
    )


RAMP = Discovered(place="joint_3", quantity="wind", shape="ramp", origin=0.5, span=1.0)
FADING = {
    "ramp": (),
    "quadratic": (),
    "step": (0.9,),
    "slide": (0.9, 0.2),
    "hinge": (0.7, 1.0),
    "bump": (1.4, 0.3),
    "drag": (),
    "harmonic": (3.0,),
    "levels": (0.5, 1.0, 1.5),
    "smooth": (0.5, 0.8, 1.1, 1.5),
}


def carrying(rich, wind, q=1.0):
    """The rows with other winds, and all joints at one position or at one each."""
    covariates = {**rich.campaign.covariates, "wind": wind * np.ones(SAMPLES)}
    return observe(replace(rich.campaign, covariates=covariates, q=np.zeros_like(rich.q) + q), rich.frames)


def sizes(rich, law, values, winds, q=1.0):
    """What a law in joint 3 does at some winds, rad."""
    return np.array([displacement(carrying(rich, p, q), [(law, values)])[0].joint[0, 2] for p in winds])


@pytest.mark.parametrize("shape", FADING)
def test_a_law_falls_back_to_its_mean_beyond_what_was_measured(rich, shape):
    law = replace(RAMP, shape=shape, marks=FADING[shape])
    measured = carrying(rich, np.linspace(0.5, 1.5, SAMPLES))
    values = 1e-4 * np.array([3.0, -7.0, 5.0, 2.0])[: len(checked(law, measured))]
    inside = displacement(measured, [(law, values)])[0].joint[:, 2]
    law, mean, most = gate.delivered(law, measured), inside.mean(), np.abs(inside - inside.mean()).max()
    np.testing.assert_allclose(displacement(measured, [(law, values)])[0].joint[:, 2], inside, rtol=0, atol=1e-18)
    for edge, way in ((0.5, -1.0), (1.5, 1.0)):
        beyond = edge + way * np.array([0.0, 1e-9, 0.1, 0.2, 0.4, 0.7, 1.0, 30.0])
        off = np.abs(sizes(rich, law, values, beyond) - mean)
        assert off[1] == pytest.approx(off[0], abs=1e-6 * most)  # no jump at the edge
        assert (np.diff(off) <= 1e-18).all()  # ever less of it, and never more than inside
        assert off[0] <= most * (1.0 + 1e-12)
        assert off[-2] < 1e-3 * most
        assert off[-1] == pytest.approx(0.0, abs=1e-15)
        kept = sizes(rich, gate.unfaded(law), values, beyond)
        assert np.ptp(kept) <= 1e-18  # what was given up is what the edge has beside the mean


@pytest.mark.parametrize("shape", ["ramp", "product"])
def test_a_law_of_two_quantities_ends_where_they_no_longer_go_together(rich, shape):
    q = np.linspace(-0.4, 0.6, SAMPLES)[:, None]
    law = replace(RAMP, shape=shape, by="joint_1", by_origin=-0.4, by_span=1.0)
    measured = carrying(rich, 1.0 + q[:, 0], q)  # the wind and the joint, each over its range, only together
    values = 1e-3 * np.array([0.0, 1.0, -1.0, 0.2])[: len(checked(law, measured))]
    law = gate.delivered(law, measured)
    inside = displacement(measured, [(law, values)])[0].joint[:, 2]
    mean, most = inside.mean(), np.abs(inside - inside.mean()).max()
    far = [sizes(rich, law, values, [wind], joint)[0] for wind, joint in ((9.0, 9.0), (-9.0, 9.0), (1.0, 30.0))]
    np.testing.assert_allclose(far, mean, rtol=0, atol=1e-12)
    # each inside its range, and both where no row was
    corner = sizes(rich, law, values, [1.6, 1.55, 1.5], -0.4)
    assert np.abs(corner - mean).max() < 1.5 * most


def test_what_has_changed_by_the_end_of_the_campaign_stays(rich):
    law = replace(RAMP, quantity="time", origin=0.0, span=500.0)
    rows = np.flatnonzero(TIME <= 500.0)
    law = gate.delivered(law, observe(rich.campaign.take(rows)))
    functions, _ = law.at_rows(rich)
    late = TIME > 500.0
    assert np.ptp(functions[late], axis=0).max() == 0.0
    np.testing.assert_array_equal(functions[late][0], functions[TIME == 500.0][0])


@pytest.mark.parametrize("name", RICHER)
def test_a_law_is_delivered_with_the_range_of_its_rows_and_does_the_same_there(rich, name):
    law = RICHER[name]
    delivered = gate.delivered(law, rich)
    assert len(delivered.found) == {"two quantities": 8, "their product": 6, "memory": 0, "a start": 0}.get(name, 2)
    np.testing.assert_allclose(delivered.at_rows(rich)[0], law.at_rows(rich)[0], rtol=0, atol=1e-15)
    values = 1e-4 * (1.0 + np.arange(len(checked(law, rich))))
    own, again = (displacement(rich, [(e, values)])[0] for e in (law, delivered))
    np.testing.assert_allclose(again.joint, own.joint, rtol=0, atol=1e-18)
    np.testing.assert_allclose(again.tool, own.tool, rtol=0, atol=1e-18)


def test_an_effect_in_a_law_ends_with_its_own_range(rich):
    law = replace(CHANGING, of="transmission_error", of_arguments='{"harmonics": [1]}')
    values = 1e-3 * np.array([5.0, -4.0, 2.0, 1.0])
    inside = np.abs(displacement(rich, [(law, values)])[0].joint[:, 2]).max()
    delivered = gate.delivered(law, rich)
    far = carrying(rich, 1.0, rich.q[:, 2].max() + 2.0 * np.ptp(rich.q[:, 2]))
    assert np.abs(displacement(far, [(delivered, values)])[0].joint[:, 2]).max() < inside


@pytest.mark.parametrize(
    ("quantity", "unit", "told"),
    [
        ("time", "s", ("at the start", "rise over the campaign")),
        ("payload", "kg", ("at payload 0.5 kg", "rise over 1.5 kg of payload")),
        ("joint_2", "rad", ("at joint_2 0.5 rad", "rise over 1.5 rad of joint_2")),
    ],
)
def test_a_slope_is_told_by_what_it_is_over(quantity, unit, told):
    law = Discovered(place="joint_3", quantity=quantity, shape="ramp", origin=0.5, span=1.5, unit=unit)
    assert law.functions(np.linspace(0.5, 2.0, 5))[1] == told
