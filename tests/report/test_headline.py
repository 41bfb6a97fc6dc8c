"""The headline, the details below it and the advice: what is said of each kind of diagnosis, and never more."""

import re
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from report.cases import HARD, SCATTER, case, changed

from thermal_robot.diagnosis.values import AnotherModel, DataFault, Dependence, Location, Misfit, Unexplained, Wanted
from thermal_robot.effects import library
from thermal_robot.report import advice, headline, text
from thermal_robot.report.words import MOST_WORDS, details, length

HARM = replace(HARD, name="session", held_out="one after the other", rms_after=5e-4, shrinkage=-0.49)
LONG = "an effect of somebody's own whose title is a whole sentence, and then another one"
UNSTATED = {"noise_source": "remainder"}


def causes(count):
    """So many effects found, each with less than the one before it."""
    first = case("found").effects[0]
    found = tuple(replace(first, name=f"cause_{k}", shrinkage=0.4 / (k + 1)) for k in range(count))
    return {"effects": found, "verdict": tuple(f.name for f in found)}


def scattered(kind, **fields):
    return case(kind, effects=(SCATTER,), verdict=("scatter",), **fields)


def second(kind, **fields):
    """The diagnosis whose second effect is another."""
    base = case(kind)
    return replace(base, effects=(base.effects[0], replace(base.effects[1], **fields), *base.effects[2:]))


BOTH = {"effects": (case("found").effects[0], SCATTER), "verdict": ("thermal_elongation", "scatter")}
APART = {"unexplained": {"rms": 9.4e-4}}
AT_BASE = Unexplained(True, 1e-4, 1e-9, (), (Location("base", "base", 0.9),), (Dependence("time", 1e-9),))


@pytest.mark.parametrize(
    ("diagnosis", "said"),
    [
        (
            case("nothing"),
            "No gap beyond the noise: the 27.1 µm between model and robot is what noise alone leaves (26 µm).",
        ),
        (
            case("found"),
            "The gap of 412 µm comes from thermal elongation (98 % sure); correcting for it removes 99.5 % of its "
            "mean square on held-out data and leaves 30.5 µm, which is noise (26 µm).",
        ),
        (
            case("unexplained", verdict=()),
            "The gap of 412 µm is explained by no known effect; it enters most likely at elbow_joint and follows time.",
        ),
        (
            scattered("found"),
            "The gap of 412 µm is scatter: joints that scatter (98 % sure); no correction removes scatter.",
        ),
    ],
)
def test_a_headline_as_a_whole(diagnosis, said):
    assert headline(diagnosis) == said


@pytest.mark.parametrize(
    ("diagnosis", "part"),
    [
        (second("found", title="a"), "comes from thermal elongation ("),
        (case("found", effects=(replace(case("found").effects[0], title="warm links"),)), "comes from warm links ("),
        (case("found", probability=0.9999), "(more than 99 % sure"),
        (case("found", probability=0.994), "(99 % sure"),
        (case("found", probability=0.5), "(50 %"),
        (case("unexplained"), "and leaves 120 µm, of which 94 µm is not explained."),
        (case("unexplained", gap=UNSTATED), "and leaves 120 µm, which is more than noise."),
        (
            case("unexplained", **APART),
            "and leaves 120 µm, or 182 µm with the 2 rows set aside in it, which nothing explains.",
        ),
        (case("unexplained", **APART, gap={"held_out": {"rms_after_with_aside": None}}), "120 µm, which is more than"),
        (case("unexplained", **APART, outliers=(17,)), "or 182 µm with the row set aside in it"),
        (
            scattered("unexplained", **APART),
            "(98 % sure), or 452 µm with the 2 rows set aside in it, which nothing explains; no",
        ),
        (scattered("unexplained"), "(98 % sure), of which 94 µm is not explained; no correction removes scatter."),
        (case("found", gap=UNSTATED), "and leaves 30.5 µm, which may or may not be noise: the campaign states none."),
        (
            case("nothing", gap=UNSTATED),
            "No effect was found, and no pattern in the gap of 27.1 µm: whether it is noise cannot",
        ),
        (case("unexplained", verdict=(), left_out=("drift",)), "by none of the effects that were considered"),
        (case("found", unexplained=AT_BASE, verdict=()), "it enters most likely at the base and follows time."),
        (case("law"), "and a step at elbow_joint over time (98 % sure); correcting for them removes"),
        (second("confounded", shrinkage=0.004, confounded_with=()), "comes from geometric and a smaller one ("),
        (case("found", **causes(6)), "comes from cause 0, cause 1, cause 2 and 3 smaller ones ("),
        (case("confounded"), "comes from geometric and joint offset (or base frame) ("),
        (second("confounded", confounded_with=("base_frame", "tool_frame")), "joint offset (or others)"),
        (case("found", gap={"hardest": HARD}), "which is noise (26 µm); held out by temperature, 91.5 µm."),
        (case("found", gap={"hardest": HARM}), "; but it harms rows held out by session."),
        (case("found", **BOTH), "comes from thermal elongation (98 % sure)"),
        (case("found", **BOTH), "; there is also scatter."),
    ],
)
def test_a_headline_says(diagnosis, part):
    said = headline(diagnosis)
    assert said.endswith(part) if part.endswith(".") else part in said
    assert "100 %" not in said


def test_what_is_said_of_held_out_rows_is_what_they_show(drifted):
    def said(**held):
        return headline(changed(drifted, gap={"held_out": held}))

    assert drifted.verdict == ("drift",)
    assert said() == drifted.summary
    assert "which is noise" in drifted.summary
    harm = said(rms_before=0.252e-3, rms_after=4.96e-3, shrinkage=-386.0)
    assert "does not carry over to held-out data: their gap is 4.96 mm with it and 252 µm without" in harm
    assert "which is noise" not in harm
    assert "removes" not in harm
    floor = drifted.gap.noise_floor
    assert "which is noise" in said(rms_after=1.4 * floor)
    assert "is left on the rows it was fitted to" in said(rms_after=1.8 * floor)


@pytest.mark.parametrize("name", ["session", "region"])
def test_a_headline_begins_with_the_harm_to_other_sessions_and_regions(name):
    harm = replace(HARM, name=name)
    said = headline(case("found", gap={"hardest": harm, "worse": harm}))
    assert said.startswith(f"Correcting harms rows held out by {name} (500 µm with it, 410 µm without): the gap of ")
    assert said.count("harms") == 1
    assert len(said.split()) <= MOST_WORDS


def invented():
    """Diagnoses of all kinds: causes many and long, in doubt or not, alone or beside scatter, held out in every way."""
    rng = np.random.default_rng(0)
    titles = [effect.title for effect in library().values()] + [LONG, "a wave at left_shoulder_joint over its position"]
    harmful = replace(HARD, rms_after=1e-3, shrinkage=-2.0)
    random, rivals = (
        replace(SCATTER, title="encoders that count in coarse steps"),
        [(), ("drift",), ("drift", "geometric")],
    )
    ways = product(
        range(1, 7), (None, HARD, harmful), (False, True), (False, True), ("stated", "remainder"), (0.9, -3.0)
    )
    for count, hardest, scatters, flagged, source, shrinkage in ways:
        base = case("unexplained" if flagged else "found")
        found = [
            replace(base.effects[0], name=f"c{k}", title=str(rng.choice(titles)), confounded_with=rivals[k % 3])
            for k in rng.permutation(count)
        ] + [random] * scatters
        held = {"shrinkage": shrinkage, "rms_after": 5e-5 if rng.random() < 0.5 else 3e-4}
        gap = {"held_out": held, "hardest": hardest, "noise_source": source}
        names, sure = tuple(f.name for f in found), float(rng.choice([0.4, 0.9999]))
        yield changed(base, gap=gap, effects=(*found, *base.effects[1:]), verdict=names, probability=sure)
    yield from (case(kind) for kind in ("found", "nothing", "unexplained", "confounded", "law"))
    yield from (case("unexplained", verdict=()), scattered("unexplained"), case("found", reach=1e-3))


def test_no_headline_is_long_or_claims_what_nobody_stated_whatever_there_is_to_say():
    rng = np.random.default_rng(1)
    for diagnosis in invented():
        said, hardest = headline(diagnosis), diagnosis.gap.hardest
        assert len(said.split()) <= MOST_WORDS == 45, said
        assert said.endswith(".")
        assert ".." not in said
        if hardest is not None and diagnosis.gap.held_out.shrinkage > 0.0 and "is scatter" not in said:
            assert ("harms rows held out" if hardest.shrinkage < 0.0 else "held out") + " by temperature" in said
        unstated = headline(changed(diagnosis, gap=UNSTATED)).replace("(noise: not stated)", "")
        assert not re.search(r"which is noise|noise alone|\(noise: ", unstated)
        assert len(unstated.split()) <= MOST_WORDS
        left = {"rms": float(10 ** rng.uniform(-5, -2.5))} if diagnosis.unexplained.flagged else {}
        said = headline(changed(diagnosis, unexplained=left))
        assert len(said.split()) <= MOST_WORDS
        parts = re.search(r"leaves ([\d.]+) ([mµ]?m), of which ([\d.]+) ([mµ]?m)", said)
        if parts:  # no part is larger than the whole
            scale = {"m": 1.0, "mm": 1e-3, "µm": 1e-6}
            assert float(parts[3]) * scale[parts[4]] <= float(parts[1]) * scale[parts[2]]


@pytest.mark.parametrize(
    ("metres", "written"),
    [
        (1e-3, "1 mm"), (9.99e-4, "999 µm"), (9.996e-4, "1 mm"), (2.41e-3, "2.41 mm"), (0.9999, "1 m"), (1.2, "1.2 m"),
        (2.6e-7, "0.26 µm"), (1.2e-9, "0.0012 µm"), (4e-10, "less than 1 nm"), (0.0, "less than 1 nm"),
    ],
)  # fmt: skip
def test_a_length_is_read_at_sight(metres, written):
    assert length(metres) == written


FAULT = DataFault(("reversed joint",), "elbow_joint is reversed", "change the sign of its column", 0.41, 6e-4)
INCH = DataFault(("inch",), "lengths are 2.54 times too large: inches?", "convert them", 0.41, 6e-4)
FIT = AnotherModel(1.7, fits="example-robot-data:ur5", remains=9e-4)


@pytest.mark.parametrize(
    ("misfit", "said", "to_do"),
    [
        (Misfit(away=0.3), "(300 mm of 1.2 m remain): check units", "Mend the table; then diagnose again."),
        (Misfit(turned=1.5), "(1.5 rad remain)", ""),
        (
            Misfit(model=AnotherModel(factor=1.7)),
            "the links are about 1.7 times as long as in the URDF. Is it another model of the family?",
            "Take the URDF of the robot that was measured; then diagnose again.",
        ),
        (
            Misfit(model=AnotherModel(joint="elbow_joint", off=0.205)),
            "elbow_joint would have to sit 205 mm from where the URDF has it.",
            "",
        ),
        (Misfit(model=FIT), "example-robot-data:ur5 fits: 900 µm remain.", "such as example-robot-data:ur5"),
        (Misfit(model=AnotherModel(fits="builtin:rv_m2", remains=9e-4)), "the URDF is of another robot.", ""),
        (
            Misfit(model=AnotherModel(factor=1e-3)),
            "the URDF stands in mm: its links are a thousand times too long.",
            "Write the lengths of the URDF in m;",
        ),
        (
            Misfit(FAULT),
            "The table is at fault, not the robot: elbow_joint is reversed. Mended, the gap falls from 410 mm to "
            "600 µm.",
            "Change the sign of its column; then diagnose again.",
        ),
        (Misfit(replace(FAULT, rows=(3, 7))), "The table is at fault in 2 rows, not the robot", ""),
        (Misfit(INCH), "inches? Mended", ""),
    ],
)
def test_robot_and_table_that_do_not_fit_are_not_explained(misfit, said, to_do):
    for kind in ("found", "law"):
        base = case(kind, reach=1.2, misfit=misfit, wanted=Wanted("column", "temperature"))
        assert said in headline(base)
        assert headline(base).startswith(
            "The table is at fault" if misfit.fault else "Robot and table do not describe the same motion"
        )
        assert to_do in advice(base)
        assert "thermal" not in headline(base)
        assert list(details(base)) == []


@pytest.mark.parametrize("more", [1, 3])
def test_faults_too_many_for_a_headline_are_counted_there_and_named_in_the_advice(more):
    ways = [f"{' '.join(f'joint_{j},' for j in range(20))} way {k}" for k in range(1 + more)]
    told = case("found", misfit=Misfit(replace(FAULT, what=", or ".join(ways))))
    assert len(headline(told).split()) <= MOST_WORDS
    assert f"{ways[0]}, or {'another fault' if more == 1 else '3 other faults'} alike." in headline(told)
    assert all(way in advice(told) for way in ways)


def test_what_has_no_size_is_not_named_first():
    first = case("found").effects[0]
    unseen = tuple(replace(p, value=None, std=None, identified=False) for p in first.parameters)
    vague = replace(first, parameters=unseen, shrinkage=0.6)
    other = replace(first, name="drift", title="drift of the base", shrinkage=0.2)
    both = case("found", effects=(vague, other), verdict=(vague.name, "drift"))
    assert "comes from drift of the base and a smaller one" in headline(both)
    assert f"How large it is these data do not determine: {both.title(vague.name)}." in details(both)


@pytest.mark.parametrize(
    ("diagnosis", "said"),
    [
        (case("found"), []),
        (case("nothing"), []),
        (case("found", **causes(5)), ["The smaller ones are cause 3 and cause 4."]),
        (case("found", **causes(4)), ["The smaller one is cause 3."]),
        (case("confounded"), ["Joint offset cannot be told apart from base frame."]),
        (case("found", **BOTH), ["There is also scatter, which no correction removes: joints that scatter."]),
        (scattered("found"), []),
        (case("law"), ["No known effect has the shape of the law that was found."]),
        (
            case("law", left_out=("drift",)),
            ["None of the effects that were considered has the shape of the law that was found."],
        ),
        (case("law", verdict=("thermal_elongation",)), []),
        (case("found", gap={"schemes": (HARD,)}), []),
        (
            case("found", gap={"schemes": (HARM,)}),
            ["Held out by session (one after the other), the correction does harm: 410 µm → 500 µm."],
        ),
        (
            case("found", probability=0.9),
            [
                "That nothing else is at work is 90.0 % sure, less than each by itself: the rest is others, most "
                "probably joint offset (2.0 %)."
            ],
        ),
    ],
)
def test_what_the_headline_has_no_room_for_is_said_below_it(diagnosis, said):
    assert list(details(diagnosis)) == said


PAIR = ("joint_offset", "drift")
WARM = Wanted("column", "temperature", whether="warmth", place="base", follows="time")
BY_PLAY = Wanted("column", "approach.elbow_joint", whether="lost motion", place="elbow_joint", follows="elbow_joint")
POSE = {"shoulder_pan_joint": -1.25, "elbow_joint": 0.5}


@pytest.mark.parametrize(
    ("wanted", "words"),
    [
        (Wanted("frame", "frames.base", apart=PAIR), "A frame measured on its own, and declared known (frames.base),"),
        (Wanted("range", apart=PAIR), "More poses over the whole range of every joint"),
        (Wanted("repeats"), "Repeat a few poses in another order and on another day: this shows how much of the"),
        (Wanted("repeats", "pose", apart=PAIR), "Repeat some poses, and label them in a column pose: this"),
        (Wanted("column", "payload", apart=PAIR), "Repeat some poses with another load, and record payload: this"),
        (WARM, "Record temperature: a remainder enters at base and follows time, and this would show whether warmth"),
        (BY_PLAY, "Record approach.elbow_joint: a remainder enters at elbow_joint and follows its position, and"),
        (
            Wanted("column", "humidity", untested=("drift", "backlash", "geometric")),
            "Record humidity: a remainder is unexplained, and drift, backlash and 1 more could not be tested.",
        ),
        (Wanted("column", "humidity"), "Record humidity: a remainder is unexplained, and this may be what it follows."),
        (
            Wanted("pose", apart=("drift",), position=POSE, conditions={"temperature": 31.0}),
            "The pose that would best show whether to believe in drift: shoulder_pan_joint −1.25 rad, elbow_joint "
            "0.50 rad, temperature 31.0 °C.",
        ),
        (None, ""),
    ],
)
def test_one_thing_is_asked_for_and_none_where_nothing_is_needed(wanted, words):
    base = case("found", wanted=wanted, separates=())
    assert advice(base).startswith(words)
    assert bool(advice(base)) is bool(words)
    if wanted and wanted.apart == PAIR:
        assert advice(base) == f"{words} would tell joint offset from drift."
    assert ("NEXT" in text(replace(base, advice=advice(base)))) is bool(words)
