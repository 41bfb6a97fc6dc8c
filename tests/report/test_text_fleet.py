"""A fleet as text: a headline, and tables that end where a screen does."""

from report.fleets import EMPTY, SUMMARY

from thermal_robot.report import fleet_text


def test_every_part_is_told_and_long_ones_are_cut():
    text = fleet_text(SUMMARY)
    for said in ("30 campaigns of 29 robots", "12 of 28", "hall 2", "fore_arm", "arm_07", "hall_1/arm_05 (failed)"):
        assert said in text
    assert "arm_11" in text
    assert "arm_12 " not in text
    assert "… and 8 more" in text
    assert all(line == line.rstrip() for line in text.splitlines())


def test_columns_stand_under_their_heads():
    lines = fleet_text(SUMMARY).splitlines()
    at = lines.index("Robots that stand out")
    assert lines[at + 1].index("parameter") == lines[at + 2].index("lost motion")


def test_of_nothing_little_is_told():
    assert fleet_text({**EMPTY, "failures": []}) == "30 campaigns of 29 robots: 30 failed."
