"""The words that text and page share: lists, verdict, noise, needs, parameters, and what is left."""

from dataclasses import replace

import numpy as np
import pytest

from thermal_robot.diagnosis.data_checks import SAID
from thermal_robot.diagnosis.values import Dependence, Estimate, Finding, FoldScheme, Location
from thermal_robot.effects.law_words import Size
from thermal_robot.report.words import (
    NO_BREAK,
    STATUS,
    bound,
    by_status,
    campaign,
    hardest,
    in_joints,
    in_words,
    law,
    laws,
    left_out,
    needs,
    noise,
    noise_of,
    one_of,
    one_sigma,
    parameters,
    places,
    rivals,
    rows_in_words,
    rows_used,
    sentences,
    set_aside,
    told_as,
    turned,
    verdict,
    with_aside,
)

JOINTS = ("joint_1", "joint_2")
LAW = (
    "a law found in the data: an error at elbow_joint that follows time (step); step 0.1700 ± 0.0060 mrad; usually "
    "warming, or something that slips"
)


def finding(**known):
    return Finding(**{"name": "an_effect", "status": "found", **known})


def several(count, identified=True):
    """Parameters whose significance grows from the first to the last."""
    return tuple(Estimate(f"p{k}", 1e-5 * (k + 1), 1e-5, "m", identified) for k in range(count))


def test_every_status_has_words(case):
    shown = {told_as(f) for kind in ("found", "confounded", "contained") for f in case(kind).effects}
    assert {*shown, "in_question"} == set(STATUS)


def test_what_is_not_found_and_yet_probable_is_in_question():
    for probability, told in ((0.7, "in_question"), (0.3, "not_found"), (None, "not_found")):
        assert told_as(Finding("joint_gain", "not_found", probability)) == told
    assert told_as(Finding("joint_gain", "found", 0.95)) == "found"
    assert told_as(Finding("joint_gain", "confounded", 0.6)) == "confounded"


def test_what_is_in_question_is_shown_between_what_was_found_and_what_was_not(case):
    diagnosis = case("confounded")
    doubtful = Finding("joint_gain", "not_found", 0.7)
    shown = by_status(replace(diagnosis, effects=(*diagnosis.effects[::-1], doubtful)))
    assert sorted(f.name for f in shown) == sorted(f.name for f in (*diagnosis.effects, doubtful))
    ranks = [list(STATUS).index(told_as(f)) for f in shown]
    assert ranks == sorted(ranks)
    before, after = shown[: shown.index(doubtful)], shown[shown.index(doubtful) + 1 :]
    assert {f.status for f in before} == {"found", "confounded"}
    assert {f.status for f in after} == {"not_found", "not_testable"}


def test_what_is_part_of_a_larger_effect_says_of_which(case):
    whole = case("contained")
    inside = whole.finding("joint_offset")
    assert rivals(inside, whole) == "its part of geometric"
    assert rivals(replace(inside, status="confounded"), whole) == "these data cannot tell it from geometric"
    assert rivals(whole.finding("geometric"), whole) == ""


def test_what_is_not_seen_is_counted_and_named_once(case):
    shown = parameters(case("contained").finding("geometric"))
    assert shown.unseen.startswith("3 not seen apart from the others or the frames: shift d of shoulder_pan_joint; ")
    assert shown.undetermined == ""
    assert parameters(case("found").effects[0]).unseen == ""


def test_lists_are_cut_and_say_how_many_are_missing():
    assert in_words(["a", "b"]) == "a, b"
    assert in_words(["a", "b", "c", "d"], most=2, between="; ") == "a; b and 2 more"
    assert in_words([]) == ""
    assert rows_in_words((17,)) == "row 17"
    assert rows_in_words((17, 80)) == "rows 17, 80"
    assert rows_in_words(range(2, 14)) == "rows 2, 3, 4, 5, 6, 7, 8, 9, 10, 11 and 2 more"
    assert [one_of(x) for x in ([], ["a"], ["a", "b"], ["a", "b", "c"])] == ["", "a", "a or b", "a, b or c"]


@pytest.mark.parametrize("said", ["412 µm", "96.0 %", "1.04 mrad", "p = 0.01", "p < 1e-12", "> 99.9 %", "2 mm", "3 m"])
def test_a_number_stays_with_its_unit(said):
    assert bound(f"it is {said}, so") == f"it is {said.replace(' ', NO_BREAK)}, so"
    assert bound("5 more of them") == "5 more of them"
    assert bound("3 mice") == "3 mice"


def test_few_parameters_are_shown_in_the_order_of_the_chain():
    shown = parameters(finding(parameters=several(7)))
    assert [name for name, _ in shown.shown] == [f"p{k}" for k in range(7)]
    assert (shown.heading, shown.more, shown.undetermined) == ("", 0, "")


def test_of_many_parameters_the_most_significant_come_first():
    shown = parameters(finding(parameters=several(20)))
    assert [name for name, _ in shown.shown] == ["p19", "p18", "p17", "p16", "p15", "p14"]
    assert shown.heading == "the 6 most significant of 20 parameters:"
    assert shown.more == 14


def test_parameters_that_are_not_determined_are_named_without_a_number():
    shown = parameters(finding(parameters=(*several(2), *several(6, identified=False))))
    assert len(shown.shown) == 2
    assert shown.undetermined == "p0; p1; p2; p3 and 2 more"


def test_a_law_with_a_size_has_nothing_undetermined():
    law = finding(parameters=several(2, identified=False), quantity="time", size=(Size("step", 1e-4, 1e-6, "rad"),))
    assert parameters(law).undetermined == ""


def test_what_an_effect_does_in_each_joint_is_told_before_its_waves():
    sizes = tuple(Size("peak to peak", k * 1e-4, 1e-5, "rad", f"j{k}") for k in (6, 5, 4, 3, 2))
    waves = finding(parameters=several(2, identified=False), size=sizes)
    told = [f"j{k} 0.{k}00 ± 0.010 mrad" for k in (6, 5, 4, 3)]
    assert in_joints(waves) == f"peak to peak: {', '.join(told)} and 1 more"
    assert parameters(waves).undetermined == ""
    assert law(waves) == ""
    assert in_joints(finding(parameters=several(2))) == ""
    assert in_joints(replace(waves, quantity="time")) == ""


def test_places_are_told_largest_first_and_small_ones_counted():
    where = tuple(Location("joint", f"j{k}", share) for k, share in enumerate((0.5, 0.2, 0.1, 0.05, 0.04, 0.001)))
    assert places(finding(locations=where)) == (
        "joint j0 50.0 %, joint j1 20.0 %, joint j2 10.0 %, joint j3 5.0 % and 2 more, at most 4.0 %"
    )
    assert places(finding(locations=where[5:])) == "joint j5 0.1 %"
    none = (*where[:4], Location("joint", "j6", 0.0))
    assert places(finding(locations=none)).endswith("joint j3 5.0 % and 1 more, less than 0.1 %")


def test_that_a_quantity_is_read_with_the_other_sign_comes_before_all_else(case):
    read = SAID["torque"]
    told = replace(case("found"), warnings=("column 'a' is empty", *SAID.values()))
    assert turned(told) == [f"Note: {said}." for said in SAID.values()]
    assert str(replace(told, warnings=(read,))).startswith(f"Note: {read}.\n{told.summary[:40]}")
    assert turned(case("found")) == []
    assert places(finding()) == ""


def test_the_verdict_tells_effects_probability_and_remainder(case):
    assert verdict(case("found")) == "thermal_elongation; probability of exactly this explanation 97.8 %"
    assert verdict(case("nothing")).startswith("no effect; ")
    assert verdict(case("unexplained")).endswith("; a remainder stays unexplained")


def test_the_campaign_is_told_by_name_robot_and_rows(case):
    assert campaign(case("found")) == "hall_3_morning: robot ur10, tool frame tool0, 120 rows, position measured"
    single = replace(case("confounded"), samples=1, campaign="")
    assert campaign(single) == "robot ur10, tool frame tool0, 1 row, position and orientation measured"


@pytest.mark.parametrize(
    ("source", "words"),
    [
        ("stated", "as the campaign states it"),
        ("repeats", "differences between repeated commands"),
        ("scatter", "the instrument's noise and the scatter of the joints"),
        ("remainder", "an upper bound, from the remainder itself"),
    ],
)
def test_the_noise_says_where_it_is_known_from(case, source, words):
    base = case("found")
    known = replace(base, gap=replace(base.gap, noise_source=source))
    assert words in noise(known, "26 µm")
    assert noise_of(known) == noise(known, "26 µm")
    assert noise_of(known).endswith("the gap after correction is 1.09 times that")


def test_no_ratio_to_a_noise_that_is_not_known(case):
    base = case("found")
    assert "times" not in noise(replace(base, gap=replace(base.gap, noise_floor=0.0)), "0 µm")


@pytest.mark.parametrize(
    ("wanted", "words"),
    [
        (("time",), "time"),
        (("approach.joint_1", "approach.joint_2"), "approach.<joint>"),
        (("temperature.arm", "temperature.hand"), "temperature.<link>"),
        (("velocity.joint_2",), "velocity.joint_2"),
        (("torque.<joint>", "payload", "masses in the URDF"), "torque.<joint>, payload or masses in the URDF"),
    ],
)
def test_needs_name_a_column_once(wanted, words):
    assert needs(finding(needs=wanted), JOINTS) == words


def test_a_law_is_known_by_the_quantity_that_it_follows(law_case):
    diagnosis = law_case()
    assert [f.name for f in laws(diagnosis)] == ["discovered.1"]
    assert law(diagnosis.finding("discovered.1")) == LAW
    assert law(diagnosis.finding("thermal_elongation")) == ""
    assert laws(replace(diagnosis, verdict=("thermal_elongation",))) == []


def test_a_law_may_bear_any_name_and_an_effect_may_bear_its(law_case):
    base = law_case()
    renamed = replace(base.effects[1], name="step_in_time")
    alike = replace(base.effects[0], name="discovered.thermal")
    diagnosis = replace(base, effects=(alike, renamed), verdict=("discovered.thermal", "step_in_time"))
    assert [f.name for f in laws(diagnosis)] == ["step_in_time"]
    said = list(sentences(diagnosis))
    assert said[-1] == "step_in_time describes part of it: an error at elbow_joint that follows time (step)."


def test_nothing_left_is_said_with_its_chance(case):
    assert list(sentences(case("found"))) == [
        "Nothing: what remains is no larger and no more structured than the noise (p = 0.43)."
    ]


def test_what_is_left_is_not_compared_with_a_noise_that_nobody_knows(case):
    base = case("found")
    said = list(sentences(replace(base, gap=replace(base.gap, noise_source="remainder"))))
    assert said[0] == "No pattern was found in what remains (p = 0.43)."
    assert "cannot be told" in said[1]


def test_what_is_left_is_told_in_whole_sentences(case):
    said = list(sentences(case("unexplained")))
    assert len(said) == 5
    assert all(s.endswith(".") and s[0].isupper() and ".." not in s for s in said)
    assert said[-1] == "It follows time (p = 3e-9), elbow_joint (p = 0.004)."


def test_what_a_law_follows_is_not_said_twice(law_case):
    said = " ".join(sentences(law_case()))
    assert "It follows" not in said
    assert "discovered.1 describes part of it: an error at elbow_joint" in said


def test_without_a_known_noise_a_remainder_is_not_beyond_it(case):
    base = case("unexplained")
    own = replace(base, gap=replace(base.gap, noise_source="remainder"))
    assert next(iter(sentences(own))).startswith("The known effects leave 94.0 µm rms that chance")
    sizeless = replace(base, unexplained=replace(base.unexplained, rms=0.0))
    assert next(iter(sentences(sizeless))).startswith("The known effects leave a remainder that chance")


def test_at_most_three_likely_places_and_quantities_are_named(case):
    base = case("unexplained")
    spots = tuple(Location("joint", f"j{k}", share) for k, share in enumerate((0.4, 0.3, 0.2, 0.09, 0.01)))
    follows = tuple(Dependence(f"q{k}", p) for k, p in enumerate(np.geomspace(1e-9, 1e-3, 5)))
    said = list(sentences(replace(base, unexplained=replace(base.unexplained, locations=spots, depends_on=follows))))
    assert "It enters most probably at joint j0 (40.0 %), joint j1 (30.0 %) or joint j2 (20.0 %)." in said
    assert "q2" in said[-1]
    assert "q3" not in said[-1]


def test_rows_set_aside_are_told_with_what_they_do_to_the_gap(case):
    found = case("found")
    assert with_aside(found) == "with the 2 rows set aside in it: 452 µm → 182 µm"
    assert with_aside(replace(found, outliers=(17,))).startswith("with the row set aside in it: ")


def test_without_rows_set_aside_there_is_one_gap(case):
    found = case("found")
    assert with_aside(replace(found, outliers=())) == ""
    held = replace(found.gap.held_out, rms_before_with_aside=None, rms_after_with_aside=None)
    assert with_aside(replace(found, gap=replace(found.gap, held_out=held))) == ""


def test_a_law_without_words_or_size_is_told_by_its_quantity():
    assert law(finding(quantity="time")) == "a law found in the data: it follows time"


def test_a_law_elsewhere_has_a_size_of_translation_and_one_of_rotation(law_case):
    (own,) = laws(law_case())
    size = (Size("difference", 4.2e-4, 3e-5, "m"), Size("difference", 3e-4, 5e-5, "rad"))
    assert "; difference 420 ± 30 µm and 0.300 ± 0.050 mrad; usually" in law(replace(own, size=size))


def test_rows_set_aside_are_counted_and_named(case):
    assert set_aside(case("found")) == "as outliers: rows 17, 80 of the file (its header is row 1)"
    assert rows_used(case("found")) == "118 of 120 rows, 2 set aside"
    assert (set_aside(case("nothing")), rows_used(case("nothing"))) == ("no row", "all 120 rows")


def test_the_hardest_way_of_holding_out_is_told_beside_the_average(case):
    base = case("found")
    assert hardest(base) == ""
    scheme = FoldScheme("temperature", "the warmest fifth", 2, 40, 4.1e-4, 9.15e-5, 0.95, 1e-6)
    said = hardest(replace(base, gap=replace(base.gap, hardest=scheme)))
    assert said == "410 µm → 92 µm, held out by temperature (the warmest fifth): 3.0 times the average"


def test_what_was_left_out_is_named_as_left_out(case):
    base = case("found")
    assert left_out(base) == ""
    assert left_out(replace(base, left_out=("drift", "geometric"))) == (
        "by request (--without drift geometric): drift, geometric"
    )
    few = replace(base, effects=base.effects[:1], left_out=("drift", "geometric"))
    assert left_out(few) == "by request all but thermal_elongation (--only thermal_elongation)"


def test_what_plus_minus_means_is_said_where_it_stands(case):
    assert one_sigma(case("found")) == "± is one standard deviation (1 sigma)."
    assert one_sigma(case("nothing")) == ""


def test_rivals_are_named_with_the_way_to_see_them(case):
    base = case("confounded")
    said = "these data cannot tell it from drift"
    found = replace(base.effects[1], confounded_with=("drift",))
    assert rivals(found, base) == f"{said}; --without joint_offset shows what would then stand in its place"
    assert rivals(replace(found, name="somebodys_own"), base) == said
    assert rivals(base.effects[0], base) == ""
    frame = Finding("base_frame", "not_testable", needs=('frames.base = "known"',))
    declared = replace(base, effects=(*base.effects[:2], frame))
    assert rivals(base.effects[1], declared) == "these data cannot tell it from base_frame"
