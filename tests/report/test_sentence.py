"""The headline and the advice: what is said of each kind of diagnosis, and never more than that."""

from dataclasses import replace

import pytest

from thermal_robot.diagnosis.parts import Dependence, Finding, Location, Unexplained
from thermal_robot.report.sentence import advice, headline, length


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


def test_a_remainder_is_told_with_its_size_place_and_quantity(case):
    text = headline(case("unexplained"))
    assert text.endswith("of which 94 µm is not explained; it enters most likely at elbow_joint and follows time.")


def test_a_remainder_of_unknown_size_is_called_more_than_noise(case):
    assert ", which is more than noise; it enters" in told(case("unexplained"), noise_source="remainder")


def test_what_no_effect_explains_is_said_to_be(case):
    base = replace(case("unexplained"), verdict=())
    assert headline(base) == (
        "The gap of 412 µm is explained by no known effect; it enters most likely at elbow_joint and follows time."
    )
    assert "by none of the effects that were considered" in headline(replace(base, narrowed=True))


def test_a_base_or_a_tool_is_named_by_its_kind(case):
    left = Unexplained(True, 1e-4, 1e-9, (), (Location("base", "base", 0.9),), (Dependence("time", 1e-9),))
    assert "it enters most likely at the base and follows time." in headline(replace(case("found"), unexplained=left))


def test_a_law_is_no_known_effect(law_case):
    text = headline(law_case())
    assert "thermal elongation and an error at elbow_joint that follows time (step)" in text
    assert "correcting for them removes" in text
    assert "no known effect has that shape" in text
    assert "that shape" not in headline(replace(law_case(), verdict=("thermal_elongation",)))


def test_effects_that_bring_hardly_anything_are_named_last(case):
    base = case("confounded")
    slight = replace(base.effects[1], shrinkage=0.004, confounded_with=())
    text = headline(replace(base, effects=(base.effects[0], slight, *base.effects[2:])))
    assert "comes from geometric, and, barely visible, joint offset (" in text


def test_confounded_effects_are_doubted(case):
    assert headline(case("confounded")).endswith("; but joint offset cannot be told apart from base frame.")


def test_scatter_is_no_cause_that_a_correction_removes(case):
    base = case("found")
    random = Finding("scatter", "found", 0.99, 0.0, title="joints that scatter", random=True)
    alone = headline(replace(base, effects=(random,), verdict=("scatter",)))
    assert alone == "The gap of 412 µm is scatter: joints that scatter (98 % sure); no correction removes scatter."
    both = headline(replace(base, effects=(base.effects[0], random), verdict=("thermal_elongation", "scatter")))
    assert "comes from thermal elongation (98 % sure)" in both
    assert both.endswith("; there is also scatter, which no correction removes: joints that scatter.")


def test_scatter_with_a_remainder_says_how_much_is_left(case):
    base = case("unexplained")
    random = Finding("scatter", "found", 0.99, 0.0, title="joints that scatter", random=True)
    text = headline(replace(base, effects=(random,), verdict=("scatter",)))
    assert "(98 % sure), of which 94 µm is not explained; no correction removes scatter." in text


def test_robot_and_table_that_do_not_fit_are_not_explained(case):
    base = replace(case("found"), reach=1.2)
    text = told(base, rms_after=0.3)
    assert text.startswith("Robot and table do not describe the same motion (300 mm of 1.2 m remain): check units")
    turned = told(base, orientation_after=1.5)
    assert "(1.5 rad remain)" in turned
    assert "thermal" not in text + turned


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
        (0.0, "0 µm"),
    ],
)
def test_a_length_is_read_at_sight(metres, written):
    assert length(metres) == written


def test_advice_separates_what_is_confounded_first(case):
    assert advice(case("found")) == (
        "More poses over the whole range of every joint would tell thermal elongation from drift."
    )
    frame = Finding("base_frame", "not_testable", needs=('frames.base = "known"',))
    base = case("confounded")
    declared = replace(base, effects=(*base.effects[:2], frame, *base.effects[3:]))
    assert (
        advice(declared) == "A frame measured on its own, and declared known, would tell joint offset from base frame."
    )


def test_advice_names_columns_that_can_be_recorded(case):
    text = advice(replace(case("unexplained"), separates=()))
    assert text == (
        "Record approach, payload and torque: backlash and joint compliance could not be tested, "
        "and a remainder is unexplained."
    )


def test_advice_asks_for_repeats_where_nothing_can_be_recorded(case):
    base = replace(case("unexplained"), separates=())
    for needs in ((), ("pose",), ("masses in the URDF",)):
        tried = Finding("an_effect", "not_testable", needs=needs)
        text = advice(replace(base, effects=(base.effects[0], tried) if needs else base.effects[:1]))
        assert text.startswith("Repeat a few poses in another order"), needs


def test_advice_asks_for_nothing_where_all_is_determined(case):
    assert advice(replace(case("found"), separates=())) == "Nothing: the data determine the explanation."
