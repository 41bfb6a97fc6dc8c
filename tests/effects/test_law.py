"""A law that nobody wrote down: its shapes, its places and quantities, where it ends, and a file of its own."""

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

X = np.linspace(-2.0, 4.0, 121)
MARKS = {
    "step": (0.7,),
    "run": (0.2, 1.9),
    "slide": (0.7, 0.3),
    "hinge": (0.7, 1.0),
    "bump": (0.7, 0.3),
    "harmonic": (2.0,),
    "hysteresis": (0.7, 3.0),
    "relaxing": (0.7,),
    "relaxing each": (0.7,),
    "apart": (float(X[60]),),
    "levels": (-2.0, 0.0, 1.0, 4.0),
    "smooth": (-1.5, 0.0, 0.4, 2.0, 3.5),
}


def values(name, x=X, marks=None, origin=-2.0, span=6.0):
    marks = MARKS.get(name, ()) if marks is None else marks
    x = np.asarray(x)
    if SHAPES[name].of == "strains":  # of elements that have slipped at −2 and are pulled
        x = np.column_stack([np.minimum((x + 2.0) / slip - 1.0, 1.0) for slip in marks])
    if SHAPES[name].of in ("run", "runs"):  # one began at −2, the other at 1
        begun = np.where(x < 1.0, x + 2.0, x - 1.0)[:, None]
        x = begun if SHAPES[name].of == "run" else np.where((x[:, None] < 1.0) == [True, False], begun, np.inf)
    return SHAPES[name].functions(x, marks, origin, span)


@pytest.mark.parametrize("name", SHAPES)
def test_a_shape_has_a_label_for_each_function_contains_a_constant_and_is_told_row_by_row(name):
    shape, found = SHAPES[name], values(name)
    count = len(shape.labels) + len(MARKS[name] if shape.each else ()) + 2 * (shape.of == "runs")
    assert found.shape == (len(X), count)
    assert np.isfinite(found).all()
    # whatever the law, an offset of the place is part of it
    left = np.ones(len(X)) - found @ np.linalg.lstsq(found, np.ones(len(X)), rcond=None)[0]
    assert np.abs(left).max() < 1e-9
    assert np.linalg.matrix_rank(found) == count
    shuffled = np.random.default_rng(0).permutation(len(X))
    np.testing.assert_allclose(values(name, X[shuffled]), found[shuffled], rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(values(name, X[7:8]), found[7:8], rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize("name", SHAPES)
def test_a_mark_is_sudden_or_gradual_as_stated_and_may_then_be_refined(name):
    """What moves a little with a gradual mark moves nothing, or jumps, with a sudden one."""
    shape, marks = SHAPES[name], MARKS.get(name, ())
    law = Discovered(shape=name, marks=marks, span=6.0)
    near = [other.marks for other in law.nearby(1.5)]
    assert near[0] == marks
    if not shape.mark:
        assert law.nearby(1.5) == (law,)
        return
    one, other = (values(name, marks=(marks[0] + 1e-3 + h, *marks[1:])) for h in (0.0, 1e-6))  # on no row
    shift = np.abs(one - other).max()
    far = np.abs(values(name, marks=(marks[0] + 0.2, *marks[1:])) - values(name)).max()
    assert far > 1e-2
    assert (0.0 < shift < 1e-4) if shape.mark == "gradual" else (shift == 0.0 and far == 1.0)
    moved = sorted({m[0] for m in near})
    assert moved == pytest.approx([0.7 - 0.02 * 6.0, 0.7, 0.7 + 0.02 * 6.0])
    widths = {m[1] for m in near if len(m) > 1}
    assert widths == ({0.3, 0.3 * 1.5, 0.3 / 1.5} if shape.width else set(marks[1:]))


def test_shapes_do_at_their_marks_what_their_table_says():
    step = values("step")
    np.testing.assert_array_equal(step, np.column_stack([X <= 0.7, X > 0.7]))
    off = np.abs(X - 0.7) > 0.02
    np.testing.assert_allclose(values("slide", marks=(0.7, 1e-3))[off], step[off], atol=1e-12)
    np.testing.assert_allclose(values("slide", [0.7]), [[0.5, 0.5]])
    beyond, before = (values("hinge", marks=(0.7, side))[:, 1] for side in (1.0, -1.0))
    assert not beyond[X < 0.7].any()
    assert not before[X > 0.7].any()
    np.testing.assert_allclose(beyond + before, np.abs(X - 0.7) / 6.0, atol=1e-15)  # the distance, in spans
    np.testing.assert_allclose(values("bump", [0.7, 0.7 - 3.0])[:, 1], [1.0, 0.0], atol=1e-12)
    height = values("bump")[:, 1]
    assert abs(X[height.argmax()] - 0.7) < 0.05
    assert height.sum() * (X[1] - X[0]) == pytest.approx(0.3 * np.sqrt(2.0 * np.pi), rel=1e-3)
    assert values("drag", [-1e-9, 0.0, 1e-9])[:, 2].tolist() == [-1.0, 0.0, 1.0]
    np.testing.assert_allclose(values("harmonic", X + np.pi), values("harmonic"), atol=1e-12)
    assert np.abs(values("harmonic", X + np.pi / 2.0) - values("harmonic")).max() > 1.0
    relaxing, each = values("relaxing", [-2.0, -1.3, 1.0, 1.7])[:, 1], values("relaxing each")
    np.testing.assert_allclose(relaxing, [1.0, np.exp(-1.0)] * 2, rtol=1e-12)
    np.testing.assert_allclose(each[:, 1] + each[:, 2], values("relaxing")[:, 1], rtol=1e-12)
    assert not (each[:, 1] * each[:, 2]).any()
    nearest = values("levels", [-5.0, -0.9, 0.6, 2.4, 2.6, 9.0])
    np.testing.assert_array_equal(nearest, np.eye(4)[[0, 1, 2, 2, 3, 3]])


def test_a_spline_takes_a_value_at_each_knot_bends_smoothly_and_runs_straight_beyond():
    knots, heights = np.array(MARKS["smooth"]), np.array([1.0, -2.0, 0.5, 3.0, 0.0])
    np.testing.assert_allclose(values("smooth", knots), np.eye(5), atol=1e-12)
    right, at, left = (values("smooth", knots + h) @ heights for h in (1e-4, 0.0, -1e-4))
    np.testing.assert_allclose((right - at) / 1e-4, (at - left) / 1e-4, rtol=0, atol=0.02)  # of slopes up to 10
    for beyond in ([3.5, 4.5, 5.5, 6.5], [-1.5, -2.5, -3.5]):
        np.testing.assert_allclose(np.diff(values("smooth", beyond) @ heights, 2), 0.0, atol=1e-9)
    # a natural spline through a straight line is that line, everywhere
    np.testing.assert_allclose(values("smooth") @ (2.0 * knots + 1.0), 2.0 * X + 1.0, atol=1e-9)


TIME = np.array([0.0, 40.0, 100.0, 180.0, 300.0, 420.0, 500.0, 610.0, 700.0, 800.0])
STEP = Discovered(kind="joint", place="joint_3", quantity="time", shape="step", marks=(350.0,), span=800.0, unit="s")
COLUMNS = {
    "time": TIME,
    "payload": np.tile([0.0, 2.0], 5),
    "approach.joint_3": np.tile([1.0, 1.0, -1.0, -1.0, 1.0], 2),
    "velocity.joint_3": np.linspace(-0.4, 0.5, SAMPLES),
    "temperature": np.linspace(20.0, 30.0, SAMPLES),
}
CHANGING = Discovered(place="joint_3", quantity="payload", shape="ramp", span=2.0, of="backlash")
RICHER = {
    "a step": STEP,
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
    "a spline": replace(STEP, shape="smooth", marks=(0.0, 200.0, 400.0, 800.0), name=PREFIX + "3"),
    "a bend": replace(STEP, shape="hinge", marks=(350.0, -1.0)),
    "a session": replace(STEP, quantity="session", shape="levels", marks=(0.0, 1.0), labels=("a", "b")),
}


@pytest.fixture(scope="module")
def rich(rv_m2):
    return observe(commanded(rv_m2, COLUMNS, labels={"session": np.array(list("aabbbccaca"))}))


def moved(seen, law, values):
    """(N, n + 12) what a law does: joints, base, tool."""
    found = displacement(seen, [(law, np.asarray(values))])[0]
    return np.hstack([found.joint, found.base, found.tool])


@pytest.mark.parametrize("kind", ["joint", "base", "tool", "link"])
def test_a_step_displaces_its_place_before_and_after(rich, rv_m2, kind):
    place = {"joint": "joint_3", "link": "joint_4"}.get(kind, kind)
    law = replace(STEP, kind=kind, place=place)
    parameters, late = checked(law, rich), TIME > 350.0
    own = 1 if kind == "joint" else 6
    assert [p.unit for p in parameters] == (["rad"] if own == 1 else ["m"] * 3 + ["rad"] * 3) * 2
    values = np.arange(1.0, 2 * own + 1.0) * 1e-4
    found, _ = displacement(rich, [(law, values)])
    segment = next(s for s, segment in enumerate(rv_m2.segments) if segment.name == "joint_4")
    where = {"joint": found.joint[:, 2:3], "base": found.base, "tool": found.tool, "link": found.segment[:, segment]}
    np.testing.assert_array_equal(where[kind], np.where(late[:, None], values[own:], values[:own]))
    assert sum(np.any(part) for part in (found.joint, found.base, found.tool, found.segment)) == 1
    link = rv_m2.segments[segment].parent_link if kind == "link" else place
    assert {(p.kind, p.place) for p in parameters} == {(kind, link)}
    if kind in ("base", "tool"):  # without orientation a turn of the tool shows nothing, one of the base does
        assert len(checked(replace(law, turns=False), rich)) == {"tool": 6, "base": 12}[kind]


def test_a_slide_that_errs_errs_by_a_length(awkward):
    slide = awkward.joint_names[awkward.joint_types.index("prismatic")]
    law = Discovered(kind="joint", place=slide, quantity=slide, shape="ramp")
    assert {p.unit for p in checked(law, observe(commanded(awkward)))} == {"m"}


def test_a_session_has_a_value_each_and_an_unknown_one_the_mean(rich):
    law = replace(RICHER["a session"], marks=(0.0, 1.0, 2.0), labels=("a", "b", "c"))
    assert [p.label for p in checked(law, rich)] == ["at a", "at b", "at c"]
    heights, by_name = np.array([1e-4, 2e-4, 3e-4]), {"a": 1e-4, "b": 2e-4, "c": 3e-4}
    # and a later campaign with other sessions, whose numbers in its own alphabet differ
    for sessions in ("aabbbccaca", "zzbbbzzzcc"):
        there = observe(replace(rich.campaign, labels={"session": np.array(list(sessions))}))
        expected = [by_name.get(s, 2e-4) for s in sessions]
        np.testing.assert_allclose(moved(there, law, heights)[:, 2], expected, rtol=1e-12)
    # rows to predict that do not say which session is theirs, and those of one session apart from the others
    unsaid = observe(replace(rich.campaign, labels={}, position=None))
    np.testing.assert_allclose(moved(unsaid, law, heights)[:, 2], 2e-4, rtol=1e-12)
    apart = replace(law, shape="apart", marks=(1.0,))
    np.testing.assert_allclose(apart.at_rows(unsaid)[0], np.tile([2.0 / 3.0, 1.0 / 3.0], (SAMPLES, 1)))


def test_what_is_predicted_without_a_clock_comes_after_the_campaign(rv_m2):
    law, commands = Discovered(place="joint_1", quantity="order", shape="ramp", origin=0.0, span=9.0), commanded(rv_m2)
    np.testing.assert_array_equal(law.values(observe(replace(commands, position=np.zeros((10, 3))))), np.arange(10.0))
    np.testing.assert_array_equal(law.values(observe(commands)), 9.0)


@pytest.mark.parametrize("shape", ["ramp", "product"])
def test_a_second_quantity_that_is_the_order_of_rows_ends_with_the_campaign(rv_m2, shape):
    """What is predicted does not depend on where a sample stands in its file."""
    law = Discovered(place="joint_2", quantity="joint_1", shape=shape, by="order", by_span=9.0, span=3.0)
    commands = commanded(rv_m2)
    heights = np.full(len(checked(law, observe(commands))), 1e-4)
    forward, backward = (commands.take(rows) for rows in (np.arange(SAMPLES), np.arange(SAMPLES)[::-1]))
    backward = replace(backward, rows=commands.rows)
    there, again = (moved(observe(own), law, heights) for own in (forward, backward))
    np.testing.assert_array_equal(there, again[::-1])
    last = moved(observe(replace(commands, position=np.zeros((SAMPLES, 3)))), law, heights)
    np.testing.assert_array_equal(there[-1], last[-1])  # as in the campaign's last row
    assert np.abs(there[0] - last[0]).max() > 1e-5


def test_it_is_missing_reads_and_is_drawn_against_what_it_follows(rich, rv_m2):
    bare = observe(commanded(rv_m2))
    constant = replace(STEP, shape="constant", quantity="none", marks=())
    told = [(e.missing(bare), e.reads(bare)) for e in (STEP, replace(STEP, quantity="joint_2"), constant)]
    assert told == [(("time",), ()), ((), ()), ((), ())]
    assert STEP.parameters(bare) == ()
    assert (STEP.missing(rich), STEP.reads(rich)) == ((), ("time",))
    assert replace(RICHER["their product"], by="humidity").missing(rich) == ("payload", "humidity")
    assert replace(RICHER["two quantities"], by="humidity").missing(rich) == ("humidity",)
    assert replace(RICHER["two quantities"], by="humidity").parameters(rich) == ()
    assert RICHER["memory"].missing(bare) == ("since_turn.joint_3",)
    assert (CHANGING.missing(rich), set(CHANGING.reads(rich))) == ((), {"payload", "approach.joint_3"})
    name, unit, drawn = STEP.driver(rich, checked(STEP, rich), np.zeros(SAMPLES))
    assert (name, unit) == ("time", "s")
    np.testing.assert_array_equal(drawn, TIME)
    assert constant.driver(rich, checked(constant, rich), np.zeros(SAMPLES)) is None


def test_marks_that_look_alike_in_three_digits_have_names_of_their_own(rv_m2):
    marks = (12340.0, 12341.0, 12342.5, 20000.0)
    seen = observe(commanded(rv_m2, {"time": np.linspace(12340.0, 20000.0, SAMPLES)}))
    for shape in ("levels", "smooth"):
        law = Discovered(place="joint_1", quantity="time", shape=shape, marks=marks, origin=12340.0, span=7660.0)
        assert len({p.name for p in checked(law, seen)}) == 4


@pytest.mark.parametrize(
    ("quantity", "unit", "told"),
    [
        ("time", "s", ("at the start", "rise over the campaign")),
        ("payload", "kg", ("at payload 0.5 kg", "rise over 1.5 kg of payload")),
    ],
)
def test_a_slope_is_told_by_what_it_is_over(quantity, unit, told):
    law = Discovered(place="joint_3", quantity=quantity, shape="ramp", origin=0.5, span=1.5, unit=unit)
    assert law.functions(np.linspace(0.5, 2.0, 5))[1] == told


def test_an_effect_that_changes_is_the_effect_times_the_law(rich):
    steady = moved(rich, Backlash(places=("joint_3",)), [5e-4])
    np.testing.assert_allclose(moved(rich, CHANGING, [5e-4, 0.0]), steady, atol=1e-18)
    # as straight as the payload, which is 0 or 2 kg
    twice = moved(rich, CHANGING, [0.0, 5e-4])
    np.testing.assert_allclose(twice, steady * (COLUMNS["payload"] / 2.0)[:, None], atol=1e-18)
    first = checked(CHANGING, rich)[0]
    assert (first.kind, first.place, first.unit, first.size, first.positive) == ("joint", "joint_3", "rad", 5e-4, False)
    assert first.label.startswith("lost motion, ")
    labels = [p.label for p in checked(RICHER["an effect with arguments"], rich)]
    assert (len(labels), sum("order 3" in label for label in labels)) == (8, 4)
    for of, words in (("worn_belt", "no effect is named"), ("backlash", "does not take")):
        with pytest.raises(EffectError, match=f"{words}.*{of}|{of}.*{words}"):
            checked(replace(CHANGING, of=of, of_arguments='{"slack": 1}'), rich)


def test_a_law_of_two_quantities_holds_each_and_their_product(rich):
    functions, labels = RICHER["two quantities"].at_rows(rich)
    u, v = COLUMNS["payload"] / 2.0, (TIME - 50.0) / 800.0
    for column in (np.ones(SAMPLES), u, v, u * v):
        left = column - functions @ np.linalg.lstsq(functions, column, rcond=None)[0]
        assert np.abs(left).max() < 1e-12
    assert len(set(labels)) == functions.shape[1] == 4
    assert (RICHER["two quantities"].follows, CHANGING.follows) == ("payload * time", "payload")
    product = RICHER["their product"].at_rows(rich)[0][:, 1]  # nothing where either is
    np.testing.assert_allclose(product, COLUMNS["payload"] * rich.q[:, 0] / 3.0, rtol=1e-12)


def test_memory_follows_the_distance_since_the_turn_and_needs_an_order(rich):
    law, since = RICHER["memory"], rich.campaign.since_turn["joint_3"]
    np.testing.assert_array_equal(law.values(rich), since)
    assert law.reads(rich) == ("time",)
    functions, labels = law.at_rows(rich)
    assert labels == ("constant", "at 0.25", "at 1")
    np.testing.assert_array_equal(functions[:, 0], 1.0)
    for slip, strain in zip(law.marks, functions[:, 1:].T, strict=True):
        # twice its slip from the turn an element slips, whatever it was strained by before, as lost motion does
        far = np.abs(since) >= 2.0 * slip
        np.testing.assert_allclose(strain[far], np.sign(since[far]), atol=1e-12)
        assert (np.abs(strain) <= 1.0).all()


def test_what_relaxes_knows_its_sessions_and_takes_a_new_one_for_their_mean(rv_m2):
    law = RICHER["a start"]
    session = np.array(["pm"] * 3 + ["am"] * 3 + ["night"] * 4)  # rows may be told of any session, in any order
    functions, labels = law.at_rows(observe(commanded(rv_m2, COLUMNS, labels={"session": session})))
    assert labels == ("constant", "at the start of am", "at the start of pm")
    am, pm, new = session == "am", session == "pm", session == "night"
    gone = {"am": TIME[am] - TIME[0], "pm": TIME[pm] - TIME[5], "night": TIME[new] - TIME[new].min()}
    left = {name: np.exp(-np.maximum(t, 0.0) / 90.0) for name, t in gone.items()}
    np.testing.assert_allclose(functions[am, 1:], np.column_stack([left["am"], 0.0 * left["am"]]))
    np.testing.assert_allclose(functions[pm, 1:], np.column_stack([0.0 * left["pm"], left["pm"]]))
    np.testing.assert_allclose(functions[new, 1:], 0.5 * np.column_stack([left["night"]] * 2))
    assert law.shifted(-200.0).marks == (110.0,)


@pytest.mark.parametrize("name", RICHER)
def test_a_law_is_kept_whole_by_a_model_a_file_rows_taken_away_and_its_own_range(rich, rv_m2, tmp_path, name):
    law, rows, campaign = RICHER[name], np.array([8, 1, 5]), rich.campaign
    if name == "a start":  # of other sessions it is the mean, whose start other rows may tell
        campaign = replace(campaign, labels={})
        rich = observe(campaign)
    values = 1e-4 * (1.0 + np.arange(len(checked(law, rich))))
    whole = moved(rich, law, values)
    assert np.abs(whole).max() > 5e-5
    np.testing.assert_allclose(moved(observe(campaign.take(rows)), law, values), whole[rows], atol=1e-18)
    held = ((law, values),)
    model = CorrectedModel(rv_m2, campaign.settings, Frames.declared(campaign), held, "position", law.reads(rich))
    model.save(tmp_path / "model.json")
    again = CorrectedModel.load(tmp_path / "model.json")
    assert again.effects[0][0] == law
    np.testing.assert_array_equal(again.prediction(campaign)[0], model.prediction(campaign)[0])
    made = {}
    exec(text := law.to_source(values, "slipping_belt"), made)
    named = made["SlippingBelt"]()
    assert (named.name, named.title) == ("slipping_belt", "slipping belt")
    assert law.describe()[1:] in text
    assert all(f"{v:.4g}" in named.__doc__ for v in values)
    assert {**named.arguments(), "name": law.name} == law.arguments()
    np.testing.assert_array_equal(moved(rich, named, values), whole)
    delivered = gate.delivered(law, rich)
    lengths = {"two quantities": 8, "their product": 6, "memory": 0, "a start": 0, "a session": 0}
    assert len(delivered.found) == lengths.get(name, 2)
    np.testing.assert_allclose(moved(rich, delivered, values), whole, rtol=0, atol=1e-18)


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


def does(rich, law, values, winds, q=1.0):
    """What a law in joint 3 does at some winds, rad."""
    return np.array([moved(carrying(rich, p, q), law, values)[0, 2] for p in winds])


@pytest.mark.parametrize("shape", FADING)
def test_a_law_falls_back_to_its_mean_beyond_what_was_measured(rich, shape):
    law = replace(RAMP, shape=shape, marks=FADING[shape])
    measured = carrying(rich, np.linspace(0.5, 1.5, SAMPLES))
    values = 1e-4 * np.array([3.0, -7.0, 5.0, 2.0])[: len(checked(law, measured))]
    inside = moved(measured, law, values)[:, 2]
    law, mean, most = gate.delivered(law, measured), inside.mean(), np.abs(inside - inside.mean()).max()
    for edge, way in ((0.5, -1.0), (1.5, 1.0)):
        beyond = edge + way * np.array([0.0, 1e-9, 0.1, 0.2, 0.4, 0.7, 1.0, 30.0])
        off = np.abs(does(rich, law, values, beyond) - mean)
        assert off[1] == pytest.approx(off[0], abs=1e-6 * most)  # no jump at the edge
        assert (np.diff(off) <= 1e-18).all()  # ever less of it, and never more than inside
        assert off[0] <= most * (1.0 + 1e-12)
        assert off[-2] < 1e-3 * most
        assert off[-1] == pytest.approx(0.0, abs=1e-15)
        # what was given up is what the edge has beside the mean
        assert np.ptp(does(rich, gate.unfaded(law), values, beyond)) <= 1e-18


@pytest.mark.parametrize("shape", ["ramp", "product"])
def test_a_law_of_two_quantities_ends_where_they_no_longer_go_together(rich, shape):
    q = np.linspace(-0.4, 0.6, SAMPLES)[:, None]
    law = replace(RAMP, shape=shape, by="joint_1", by_origin=-0.4, by_span=1.0)
    measured = carrying(rich, 1.0 + q[:, 0], q)  # the wind and the joint, each over its range, only together
    values = 1e-3 * np.array([0.0, 1.0, -1.0, 0.2])[: len(checked(law, measured))]
    inside, law = moved(measured, law, values)[:, 2], gate.delivered(law, measured)
    mean, most = inside.mean(), np.abs(inside - inside.mean()).max()
    far = [does(rich, law, values, [wind], joint)[0] for wind, joint in ((9.0, 9.0), (-9.0, 9.0), (1.0, 30.0))]
    np.testing.assert_allclose(far, mean, rtol=0, atol=1e-12)
    # each inside its range, and both where no row was
    corner = does(rich, law, values, [1.6, 1.55, 1.5], -0.4)
    assert np.abs(corner - mean).max() < 1.5 * most


def test_what_changed_stays_and_an_effect_in_a_law_ends_with_its_own_range(rich):
    # what has changed by the end of the campaign stays
    law = replace(RAMP, quantity="time", origin=0.0, span=500.0)
    law = gate.delivered(law, observe(rich.campaign.take(np.flatnonzero(TIME <= 500.0))))
    functions, _ = law.at_rows(rich)
    late = functions[TIME >= 500.0]
    np.testing.assert_array_equal(late, np.tile(late[:1], (len(late), 1)))
    # an effect in a law ends with its own range
    law = replace(CHANGING, of="transmission_error", of_arguments='{"harmonics": [1]}')
    values = 1e-3 * np.array([5.0, -4.0, 2.0, 1.0])
    far = carrying(rich, 1.0, rich.q[:, 2].max() + 2.0 * np.ptp(rich.q[:, 2]))
    beyond = np.abs(moved(far, gate.delivered(law, rich), values)[:, 2]).max()
    assert beyond < np.abs(moved(rich, law, values)[:, 2]).max()
