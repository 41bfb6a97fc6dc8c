"""The score of a blind trial as a table in Markdown."""

from blind_records import trial

from thermal_robot.blind.report.text import markdown
from thermal_robot.blind.score import score


def test_there_is_a_row_for_each_kind_with_as_many_cells_as_heads():
    plain = score(trial()).to_dict()
    table, rest = markdown(plain).split("\n\n")
    lines = table.splitlines()
    assert len(lines) == 2 + len(plain["kinds"])
    assert {line.count("|") for line in lines} == {7}
    assert "| one effect | 4 | exactly what is at work, nothing else | 1 of 4 | 25.0 % | 4.6 to 69.9 % |" in lines
    assert rest.splitlines()[-1] == "- Diagnoses that failed, and count as wrong: 1"
    assert all(line.startswith("- ") for line in rest.splitlines())


def test_without_figures_there_is_the_table_only():
    assert markdown(score([]).to_dict()).count("\n") == 1
