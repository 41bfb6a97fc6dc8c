"""The headline: what is said of each kind of diagnosis, and never more than that."""

import re
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from thermal_robot.diagnosis.values import (
    AnotherModel,
    DataFault,
    Dependence,
    Finding,
    FoldScheme,
    Location,
    Misfit,
    Unexplained,
)
from thermal_robot.effects import library
from thermal_robot.report.words import MOST_WORDS, advice, details, headline, length, listed


def said(diagnosis, **held):
    gap = replace(diagnosis.gap, held_out=replace(diagnosis.gap.held_out, **held))
    return headline(replace(diagnosis, gap=gap))


def test_what_holds_on_held_out_rows_leaves_noise(drifted):
    assert drifted.verdict == ("drift",)
    assert said(drifted) == drifted.summary
    assert "which is noise" in drifted.summary


def test_a_correction_that_harms_held_out_rows_is_said_to(drifted):
    text = said(drifted, rms_before=0.252e-3, rms_after=4.96e-3, shrinkage=-386.0)
    assert "does not carry over to held-out data: their gap is 4.96 mm with it and 252 µm without" in text
    assert "which is noise" not in text
    assert "removes" not in text


def test_far_more_on_held_out_rows_than_on_fitted_ones_is_not_called_noise(drifted):
    floor = drifted.gap.noise_floor
    assert "which is noise" in said(drifted, rms_after=1.4 * floor)
    assert "is left on the rows it was fitted to" in said(drifted, rms_after=1.8 * floor)


def told(base, **parts):
    """The headline of a diagnosis made by hand, with parts of its gap changed."""
    return headline(replace(base, gap=replace(base.gap, **parts)))


def test_nothing_but_noise_is_called_so(case):
    assert headline(case("nothing")) == (
        "No gap beyond the noise: the 27.1 µm between model and robot is what noise alone leaves (26 µm)."
    )


def test_one_effect_is_named_with_its_certainty_and_what_it_leaves(case):
    assert headline(case("found")) == (
        "The gap of 412 µm comes from thermal elongation (98 % sure); correcting for it removes 99.5 % of its mean "
        "square on held-out data and leaves 30.5 µm, which is noise (26 µm)."
    )


def test_titles_take_the_place_of_names(case):
    base = case("found")
    named = replace(base.effects[0], title="thermal elongation of the links")
    assert "comes from thermal elongation of the links (" in headline(replace(base, effects=(named,)))


@pytest.mark.parametrize(
    ("probability", "words"), [(0.9999, "more than 99 % sure"), (0.994, "99 % sure"), (0.5, "50 %")]
)
def test_certainty_is_never_claimed(case, probability, words):
    text = headline(replace(case("found"), probability=probability))
    assert f"({words}" in text
    assert "100 %" not in text


def test_a_remainder_is_told_with_its_size(case):
    assert headline(case("unexplained")).endswith("and leaves 120 µm, of which 94 µm is not explained.")


def test_a_remainder_of_unknown_size_is_called_more_than_noise(case):
    assert "and leaves 120 µm, which is more than noise." in told(case("unexplained"), noise_source="remainder")


def test_what_is_unexplained_of_rows_set_aside_is_no_part_of_what_the_others_leave(case):
    base = case("unexplained")
    apart = replace(base, unexplained=replace(base.unexplained, rms=9.4e-4))
    assert headline(apart).endswith(
        "and leaves 120 µm, or 182 µm with the 2 rows set aside in it, which nothing explains."
    )
    assert "or 182 µm with the row set aside in it" in headline(replace(apart, outliers=(17,)))
    unknown = replace(apart.gap, held_out=replace(apart.gap.held_out, rms_after_with_aside=None))
    assert headline(replace(apart, gap=unknown)).endswith("and leaves 120 µm, which is more than noise.")
    random = Finding("scatter", "found", 0.99, 0.0, title="joints that scatter", random=True)
    scattered = headline(replace(apart, effects=(random,), verdict=("scatter",)))
    assert "(98 % sure), or 452 µm with the 2 rows set aside in it, which nothing explains; no" in scattered


def test_no_part_is_larger_than_the_whole(case, law_case):
    rng = np.random.default_rng(1)
    for diagnosis in invented(case, law_case):
        left = replace(diagnosis.unexplained, rms=float(10 ** rng.uniform(-5, -2.5)))
        text = headline(replace(diagnosis, unexplained=left if left.flagged else diagnosis.unexplained))
        assert len(text.split()) <= MOST_WORDS
        leaves = re.search(r"leaves ([\d.]+ [mµ]?m), of which ([\d.]+ [mµ]?m)", text)
        assert leaves is None or _metres(leaves[2]) <= _metres(leaves[1])


def _metres(text):
    value, unit = text.split()
    return float(value) * {"m": 1.0, "mm": 1e-3, "µm": 1e-6}[unit]


def test_noise_that_nobody_stated_is_claimed_by_no_headline(case, law_case):
    one = told(case("found"), noise_source="remainder")
    assert one.endswith("and leaves 30.5 µm, which may or may not be noise: the campaign states none.")
    none = told(case("nothing"), noise_source="remainder")
    assert none.startswith("No effect was found, and no pattern in the gap of 27.1 µm: whether it is noise cannot")
    for diagnosis in invented(case, law_case):
        text = told(diagnosis, noise_source="remainder")
        assert "which is noise" not in text
        assert "noise alone" not in text
        assert "(noise: " not in text.replace("(noise: not stated)", "")
        assert len(text.split()) <= MOST_WORDS


def test_what_no_effect_explains_is_said_to_be(case):
    base = replace(case("unexplained"), verdict=())
    assert headline(base) == (
        "The gap of 412 µm is explained by no known effect; it enters most likely at elbow_joint and follows time."
    )
    assert "by none of the effects that were considered" in headline(replace(base, left_out=("drift",)))


def test_a_base_or_a_tool_is_named_by_its_kind(case):
    left = Unexplained(True, 1e-4, 1e-9, (), (Location("base", "base", 0.9),), (Dependence("time", 1e-9),))
    base = replace(case("found"), unexplained=left, verdict=())
    assert "it enters most likely at the base and follows time." in headline(base)


def test_a_law_is_called_by_its_short_name(law_case):
    text = headline(law_case())
    assert "comes from thermal elongation and a step at elbow_joint over time (" in text
    assert "correcting for them removes" in text


def test_effects_that_bring_hardly_anything_are_counted(case):
    base = case("confounded")
    slight = replace(base.effects[1], shrinkage=0.004, confounded_with=())
    text = headline(replace(base, effects=(base.effects[0], slight, *base.effects[2:])))
    assert "comes from geometric and a smaller one (" in text


def test_three_causes_are_named_and_the_others_counted(case):
    base = case("found")
    causes = tuple(replace(base.effects[0], name=f"cause_{k}", shrinkage=0.4 / (k + 1)) for k in range(6))
    text = headline(replace(base, effects=causes, verdict=tuple(f.name for f in causes)))
    assert "comes from cause 0, cause 1, cause 2 and 3 smaller ones (" in text


def test_confounded_effects_are_doubted(case):
    base = case("confounded")
    assert "comes from geometric and joint offset (or base frame) (" in headline(base)
    several = replace(base.effects[1], confounded_with=("base_frame", "tool_frame"))
    assert "joint offset (or others)" in headline(replace(base, effects=(base.effects[0], several, *base.effects[2:])))


def test_the_hardest_hold_out_stands_beside_the_average(case):
    hard = FoldScheme("temperature", "the warmest fifth", 2, 40, 4.1e-4, 9.2e-5, 0.95, 1e-6)
    assert told(case("found"), hardest=hard).endswith("which is noise (26 µm); held out by temperature, 92 µm.")
    harmful = replace(hard, rms_after=5e-4, shrinkage=-0.5)
    assert told(case("found"), hardest=harmful).endswith("; but it harms rows held out by temperature.")


@pytest.mark.parametrize("name", ["session", "region"])
def test_a_headline_begins_with_the_harm_to_other_sessions_and_regions(case, name):
    harmful = FoldScheme(name, "one after the other", 4, 90, 4.1e-4, 5e-4, -0.49, 1e-6)
    base = case("found")
    text = headline(replace(base, gap=replace(base.gap, hardest=harmful, worse=harmful)))
    assert text.startswith(f"Correcting harms rows held out by {name} (500 µm with it, 410 µm without): the gap of ")
    assert text.count("harms") == 1
    assert len(text.split()) <= MOST_WORDS


LONG = "an effect of somebody's own whose title is a whole sentence, and then another one"


def invented(case, law_case):
    """Diagnoses of all kinds: causes many and long, in doubt or not, alone or beside scatter, held out in every way."""
    rng = np.random.default_rng(0)
    titles = [effect.title for effect in library().values()] + [LONG, "a wave at left_shoulder_joint over its position"]
    hard = FoldScheme("temperature", "the warmest fifth", 2, 40, 4.1e-4, 3.2e-4, 0.4, 1e-6)
    harmful = replace(hard, rms_after=1e-3, shrinkage=-2.0)
    scatter = Finding("scatter", "found", 0.99, 0.0, title="encoders that count in coarse steps", random=True)
    ways = product(
        range(1, 7), (None, hard, harmful), (False, True), (False, True), ("stated", "remainder"), (0.9, -3.0)
    )
    for count, hardest, random, flagged, source, shrinkage in ways:
        base = case("unexplained" if flagged else "found")
        rivals = [(), ("drift",), ("drift", "geometric")]
        causes = [
            replace(base.effects[0], name=f"c{k}", title=str(rng.choice(titles)), confounded_with=rivals[k % 3])
            for k in rng.permutation(count)
        ]
        held = replace(base.gap.held_out, shrinkage=shrinkage, rms_after=5e-5 if rng.random() < 0.5 else 3e-4)
        gap = replace(base.gap, held_out=held, hardest=hardest, noise_source=source)
        found = (*causes, *([scatter] if random else []))
        sure = float(rng.choice([0.4, 0.9999]))
        effects, verdict = (*found, *base.effects[1:]), tuple(f.name for f in found)
        yield replace(base, gap=gap, effects=effects, verdict=verdict, probability=sure)
    yield from (case(kind) for kind in ("found", "nothing", "unexplained", "confounded"))
    yield replace(case("unexplained"), verdict=())
    yield replace(case("unexplained"), effects=(scatter,), verdict=("scatter",))
    yield replace(case("found"), reach=1e-3)
    yield law_case()


def test_no_headline_is_long_whatever_there_is_to_say(case, law_case):
    for diagnosis in invented(case, law_case):
        text = headline(diagnosis)
        assert len(text.split()) <= MOST_WORDS == 45, text
        assert text.endswith(".")
        assert ".." not in text
        hardest = diagnosis.gap.hardest
        if hardest is not None and diagnosis.gap.held_out.shrinkage > 0.0 and "is scatter" not in text:
            assert ("harms rows held out" if hardest.shrinkage < 0.0 else "held out") + " by temperature" in text


def test_lists_end_in_and():
    assert [listed(names) for names in ([], ["a"], ["a", "b"], ["a", "b", "c"])] == ["", "a", "a and b", "a, b and c"]


def test_scatter_is_no_cause_that_a_correction_removes(case):
    base = case("found")
    random = Finding("scatter", "found", 0.99, 0.0, title="joints that scatter", random=True)
    alone = headline(replace(base, effects=(random,), verdict=("scatter",)))
    assert alone == "The gap of 412 µm is scatter: joints that scatter (98 % sure); no correction removes scatter."
    both = headline(replace(base, effects=(base.effects[0], random), verdict=("thermal_elongation", "scatter")))
    assert "comes from thermal elongation (98 % sure)" in both
    assert both.endswith("; there is also scatter.")


def test_scatter_with_a_remainder_says_how_much_is_left(case):
    base = case("unexplained")
    random = Finding("scatter", "found", 0.99, 0.0, title="joints that scatter", random=True)
    text = headline(replace(base, effects=(random,), verdict=("scatter",)))
    assert "(98 % sure), of which 94 µm is not explained; no correction removes scatter." in text


def test_robot_and_table_that_do_not_fit_are_not_explained(case):
    base = replace(case("found"), reach=1.2)
    text = headline(replace(base, misfit=Misfit(away=0.3)))
    assert text.startswith("Robot and table do not describe the same motion (300 mm of 1.2 m remain): check units")
    turned = headline(replace(base, misfit=Misfit(turned=1.5)))
    assert "(1.5 rad remain)" in turned
    assert "thermal" not in text + turned


@pytest.mark.parametrize(
    ("model", "said"),
    [
        (
            AnotherModel(factor=1.7),
            "the links are about 1.7 times as long as in the URDF. Is it another model of the family?",
        ),
        (
            AnotherModel(joint="elbow_joint", off=0.205),
            "elbow_joint would have to sit 205 mm from where the URDF has it.",
        ),
        (AnotherModel(1.7, fits="example-robot-data:ur5", remains=9e-4), "example-robot-data:ur5 fits: 900 µm remain."),
        (AnotherModel(fits="builtin:rv_m2", remains=9e-4), "the URDF is of another robot."),
        (AnotherModel(factor=1e-3), "the URDF stands in mm: its links are a thousand times too long."),
    ],
)
def test_another_robot_is_said_with_what_tells_it(case, model, said):
    text = headline(replace(case("found"), misfit=Misfit(away=1e-3, model=model)))
    assert text.startswith("Robot and table do not describe the same motion: the ") or model.joint
    assert said in text


def test_a_fault_of_the_table_is_said_with_what_it_explains_and_its_remedy(case):
    fault = DataFault(("reversed joint",), "elbow_joint is reversed", "change the sign of its column", 0.41, 6e-4)
    told = replace(case("found"), misfit=Misfit(fault))
    assert headline(told) == (
        "The table is at fault, not the robot: elbow_joint is reversed. Mended, the gap falls from 410 mm to 600 µm."
    )
    part = headline(replace(told, misfit=Misfit(replace(fault, rows=(3, 7)))))
    assert part.startswith("The table is at fault in 2 rows, not the robot")


@pytest.mark.parametrize("more", [1, 3])
def test_faults_too_many_for_a_headline_are_counted_there_and_named_in_the_advice(case, more):
    ways = [f"{' '.join(f'joint_{j},' for j in range(20))} way {k}" for k in range(1 + more)]
    told = replace(case("found"), misfit=Misfit(DataFault(("reversed joint",), ", or ".join(ways), "turn", 0.41, 6e-4)))
    text = headline(told)
    assert len(text.split()) <= MOST_WORDS
    assert f"{ways[0]}, or {'another fault' if more == 1 else '3 other faults'} alike." in text
    assert all(way in advice(told) for way in ways)


def test_a_question_ends_with_its_own_mark(case):
    fault = DataFault(("inch",), "lengths are 2.54 times too large: inches?", "convert them", 0.41, 6e-4)
    assert "inches? Mended" in headline(replace(case("found"), misfit=Misfit(fault)))


@pytest.mark.parametrize(
    ("metres", "written"),
    [
        (1e-3, "1 mm"),
        (9.99e-4, "999 µm"),
        (9.996e-4, "1 mm"),
        (2.41e-3, "2.41 mm"),
        (0.9999, "1 m"),
        (1.2, "1.2 m"),
        (2.6e-7, "0.26 µm"),
        (1.2e-9, "0.0012 µm"),
        (4e-10, "less than 1 nm"),
        (0.0, "less than 1 nm"),
    ],
)
def test_a_length_is_read_at_sight(metres, written):
    assert length(metres) == written


def test_what_has_no_size_is_not_named_first(case):
    base = case("found")
    unseen = tuple(replace(p, value=None, std=None, identified=False) for p in base.effects[0].parameters)
    vague = replace(base.effects[0], parameters=unseen, shrinkage=0.6)
    other = replace(base.effects[0], name="drift", title="drift of the base", shrinkage=0.2)
    both = replace(base, effects=(vague, other), verdict=(vague.name, "drift"))
    assert "comes from drift of the base and a smaller one" in headline(both)
    assert f"How large it is these data do not determine: {both.title(vague.name)}." in details(both)
