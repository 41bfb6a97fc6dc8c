"""What was named, counted."""

from blind_records import effect, record, said, trial

from thermal_robot.blind.score import confusion


def test_confusion_counts_every_case_once():
    table = confusion(trial(), ("single", "null", "unlisted"))
    assert table.rows == ("backlash", "drift", "nothing", "unlisted")
    assert table.columns == ("backlash", "drift", "joint_gain", "nothing", "unexplained", "failed")
    assert table.counts == ((0, 0, 0, 0, 1, 1), (1, 1, 0, 0, 0, 0), (0, 0, 1, 1, 0, 0), (0, 0, 0, 0, 1, 0))
    assert sum(map(sum, table.counts)) == sum(r["kind"] in ("single", "null", "unlisted") for r in trial())
    assert confusion(trial(), ("removed",)).counts == ((0, 1),)  # a column of its own, though nobody can name it


def test_the_first_effect_at_work_is_the_row_and_a_law_names_no_cause():
    law = effect("discovered.1", quantity="time", shape="step")
    cases = [
        record("pair", said(effect("backlash"), effect("drift")), ["drift", "backlash"]),
        record("pair", said(law), ["drift", "backlash"]),
        record("pair", said(flagged=True), ["drift", "backlash"], unlisted="cable"),
    ]
    table = confusion(cases, ("pair",))
    assert table.rows == ("drift", "unlisted")
    assert table.columns == ("drift", "backlash", "unexplained")
    assert table.counts == ((0, 1, 1), (0, 0, 1))
    assert confusion(cases, ("single",)).rows == ()
