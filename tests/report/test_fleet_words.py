"""A fleet in words: each line says what the summary holds, in units that are read at sight."""

from report.fleets import EMPTY, SUMMARY

from thermal_robot.report.text_campaigns import (
    SECTIONS,
    apart,
    cases,
    differs,
    failures,
    fleet_headline,
    found,
    gathered,
    shared,
)


def test_the_headline_counts():
    assert fleet_headline(SUMMARY) == "30 campaigns of 29 robots: 28 diagnosed, 1 failed, 1 unusable."
    assert fleet_headline({**SUMMARY, "campaigns": 1, "robots": 1}).startswith("1 campaign of 1 robot:")


def test_what_was_never_found_is_left_out():
    places = "joint_0 2, joint_1 2, joint_2 2, joint_3 2, …"
    assert list(found(SUMMARY)) == [("joint offset", "12 of 28, in 2 or another", places)]


def test_what_gathers_says_where_and_how_probable_that_is_by_chance():
    assert list(gathered(SUMMARY)) == [("joint offset", "hall 2", "9 of 10", "3 of 18", "p = 2e-5")]


def test_a_parameter_is_shared_or_differs():
    ((effect, parameter, mean, spread, robots, chance),) = shared(SUMMARY)
    assert (effect, parameter, robots) == ("thermal elongation", "strain of fore_arm", "28")
    assert (mean, spread, chance) == ("12.00 ± 0.40 µm/(m·K)", "1.10 ± 0.30 µm/(m·K)", "p < 1e-12")
    first, second = differs(SUMMARY)
    assert first == ("joint offset", "zero offset, joint_2", "hall 2", "0.4100 ± 0.0050 mrad", "10", "p = 1e-8")
    assert second == ("", "", "hall 1", "−2.0 ± 4.0 µrad", "18", "")


def test_who_stands_out_has_a_probability_and_what_is_usual():
    assert list(apart(SUMMARY)) == [
        ("arm_07", "backlash", "lost motion, joint_4", "0.500 ± 0.010 mrad", "1.00 µrad", "> 99.9 %")
    ]


def test_cases_and_failures():
    first, second, *_ = cases(SUMMARY)
    assert first == ("arm_00", "hall/arm_00", "joint offset", "joint_2", "97.0 %", "200 µm", "30.0 µm")
    assert second[2] == "joint offset (or base frame)"
    nothing = {**SUMMARY["found"][0], "effect": "", "place": "", "probability": None}
    assert next(cases({**SUMMARY, "found": [nothing]}))[2:5] == ("no effect explains it", "", "–")
    assert list(failures(SUMMARY)) == ["hall_1/arm_05 (failed): measurements.csv, row 3: <nonsense>"]


def test_each_line_has_a_cell_for_each_head():
    for _, heads, told in SECTIONS:
        assert {len(line) for line in told(SUMMARY)} == {len(heads)}
        assert list(told(EMPTY)) == []
