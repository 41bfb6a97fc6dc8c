"""Laws that were printed, and whether those that were sure are right."""

from blind_records import J1, J2, L2, crash, effect, record, said

from thermal_robot.blind.score import laws, sure_laws

TRUE = {"unlisted": "cable", "places": [J1], "near": [J1, L2], "quantities": ["time", "order"]}


def law(number, p, place=J1, quantity="time"):
    return effect(f"discovered.{number}", p, places=[place], quantity=quantity)


def test_a_sure_law_is_right_at_its_place_or_beside_it_and_with_its_quantity():
    records = [
        record("unlisted", said(law(1, 0.9), law(2, 0.99, J2), flagged=True), **TRUE),
        record("both", said(effect("drift"), law(1, 0.95, L2, "order"), flagged=True), ["drift"], **TRUE),
        record("mixed", said(law(1, 0.99, J1, "payload"), flagged=True), **TRUE),
        record("unlisted", said(law(1, 0.89), flagged=True), **TRUE),
        crash("unlisted", **TRUE),
    ]
    found = sure_laws(records)
    assert (found.successes, found.trials) == (2, 4)


def test_where_everything_is_in_the_library_no_law_is_right():
    found = sure_laws([record("single", said(effect("drift"), law(1, 0.99), flagged=True), ["drift"])])
    assert (found.successes, found.trials) == (0, 1)


def test_of_real_campaigns_nobody_knows():
    real = record("real", said(law(1, 0.99), flagged=True), right=True, asked="", answer="")
    assert sure_laws([real]).trials == 0


def test_a_law_without_a_probability_was_not_printed():
    assert [e["name"] for e in laws(record("unlisted", said(law(1, None), law(2, 0.1), effect("drift"))))] == [
        "discovered.2"
    ]
