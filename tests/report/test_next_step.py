"""What to measure next: one thing, named, and no word where nothing is needed."""

from dataclasses import replace

import pytest

from thermal_robot.diagnosis.values import AnotherModel, DataFault, Misfit, Wanted
from thermal_robot.report.plain_text import text
from thermal_robot.report.words import advice


def said(diagnosis, *wanted, **known):
    return advice(replace(diagnosis, wanted=Wanted(*wanted, **known)))


def test_nothing_is_said_where_nothing_is_needed(case):
    base = replace(case("found"), wanted=None, separates=())
    assert advice(base) == ""
    assert "NEXT" not in text(replace(base, advice=advice(base)))


def test_no_column_is_asked_for_where_robot_and_table_do_not_fit(case):
    told = said(replace(case("unexplained"), misfit=Misfit(away=0.3)), "column", "temperature")
    assert told == "Mend the table; then diagnose again."


@pytest.mark.parametrize(
    ("wanted", "words"),
    [
        (
            Wanted("frame", 'frames.base = "known"', apart=("joint_offset", "base_frame")),
            'A frame measured on its own, and declared known (frames.base = "known"), would tell joint offset from '
            "base frame.",
        ),
        (
            Wanted("range", apart=("geometric", "drift")),
            "More poses over the whole range of every joint would tell geometric from drift.",
        ),
        (
            Wanted("repeats"),
            "Repeat a few poses in another order and on another day: this shows how much of the remainder repeats.",
        ),
        (
            Wanted("repeats", "pose", apart=("encoder_resolution", "drift")),
            "Repeat some poses, and label them in a column pose: this would tell encoder resolution from drift.",
        ),
        (
            Wanted("column", "payload", apart=("geometric", "joint_compliance")),
            "Repeat some poses with another load, and record payload: this would tell geometric from joint compliance.",
        ),
        (
            Wanted("column", "temperature", whether="warmth", place="base", follows="time"),
            "Record temperature: a remainder enters at base and follows time, and this would show whether warmth "
            "causes it.",
        ),
        (
            Wanted("column", "approach.elbow_joint", whether="lost motion", place="elbow_joint", follows="elbow_joint"),
            "Record approach.elbow_joint: a remainder enters at elbow_joint and follows its position, and this would "
            "show whether lost motion causes it.",
        ),
        (
            Wanted("column", "humidity", untested=("drift", "backlash", "geometric")),
            "Record humidity: a remainder is unexplained, and drift, backlash and 1 more could not be tested.",
        ),
        (Wanted("column", "humidity"), "Record humidity: a remainder is unexplained, and this may be what it follows."),
    ],
)
def test_one_thing_is_asked_for(case, wanted, words):
    assert advice(replace(case("found"), wanted=wanted)) == words


def test_a_pose_is_told_joint_by_joint_in_the_units_of_a_reader(case):
    known = {"shoulder_pan_joint": -1.25, "elbow_joint": 0.5}
    text = said(case("found"), "pose", apart=("drift",), position=known, conditions={"temperature": 31.0})
    assert text == (
        "The pose that would best show whether to believe in drift: shoulder_pan_joint −1.25 rad, "
        "elbow_joint 0.50 rad, temperature 31.0 °C."
    )


def test_a_table_at_fault_is_to_be_mended_first(case):
    fault = DataFault(("reversed joint",), "elbow_joint is reversed", "change the sign of its column", 0.41, 6e-4)
    assert advice(replace(case("found"), misfit=Misfit(fault))) == (
        "Change the sign of its column; then diagnose again."
    )


def test_the_robot_that_was_measured_is_to_be_taken(case):
    known = AnotherModel(factor=1.7, fits="example-robot-data:ur5", remains=1e-3)
    assert "such as example-robot-data:ur5" in advice(replace(case("found"), misfit=Misfit(model=known)))
    assert advice(replace(case("found"), misfit=Misfit(model=AnotherModel(factor=1.7)))) == (
        "Take the URDF of the robot that was measured; then diagnose again."
    )
    unit = AnotherModel(factor=1e-3)
    assert advice(replace(case("found"), misfit=Misfit(model=unit))).startswith("Write the lengths of the URDF in m;")
