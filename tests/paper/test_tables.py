"""The ledger as text and as Markdown: nothing is lost, nothing is too wide."""

from dataclasses import replace
from functools import cache

from thermal_robot.paper import PaperInputs, ledger
from thermal_robot.paper.entry import VERDICTS
from thermal_robot.paper.ledger import WIDTH, markdown, text


@cache
def default():
    """All rows, from fewer draws than usual: only their words matter here."""
    return ledger(PaperInputs(repetitions=150, pose_sets=400))


def test_text_fits_the_screen_and_leaves_nothing_out():
    told = str(default())
    assert told == default().text()
    assert max(map(len, told.splitlines())) <= WIDTH
    assert "\u00a0" not in told
    flat = "".join(told.split())
    for entry in default():
        assert "".join(entry.why.split()) in flat
        # Cells are wrapped side by side: their words are all there, and their first line stands at its column.
        assert all(word in told for cell in (entry.quantity, entry.printed, entry.computed) for word in cell.split())
    columns = [line.index("verdict") for line in told.splitlines() if line.startswith("quantity")]
    starts = [line for line in told.splitlines() if line.startswith("r = σ_t/σ_k")]
    assert starts[0][columns[0] :] == "agrees"


def test_markdown_is_one_table():
    lines = default().markdown().splitlines()
    rows = [line for line in lines if line.startswith("|")]
    assert len(rows) == len(default()) + 2
    assert {line.replace("\\|", "").count("|") for line in rows} == {6}
    assert f"{len(default())} rows." in lines[-1]
    for verdict, count in default().counts.items():
        assert f"**{verdict}** ({count})" in lines[-1]


def test_strokes_and_stars_in_a_cell_do_not_break_the_table():
    odd = replace(default().entries[0], quantity="a | b", printed="2 * 3", why="x|y, *really*")
    row = markdown([odd], {"agrees": 1}).splitlines()[2]
    assert row.replace("\\|", "").count("|") == 6
    assert row.replace("\\*", "").count("*") == 4  # the verdict's own
    for cell in ("a \\| b", "2 \\* 3", "x\\|y, \\*really\\*"):
        assert cell in row


def test_a_number_is_not_parted_from_its_unit():
    wordy = replace(default().entries[0], why="word " * 21 + "12345 µm " + "word " * 30 + "99 °C")
    lines = text([wordy], {"agrees": 1}).splitlines()
    assert any("12345 µm" in line for line in lines)
    assert not any(line.strip().startswith("µm") for line in lines)


def test_legend_explains_the_verdicts_that_occur_and_no_others():
    counts = {"agrees": 3, "erratum": 12}
    for told in (text([], counts), markdown([], counts)):
        flat = " ".join(told.split())
        assert [meaning in flat for meaning in VERDICTS.values()] == [verdict in counts for verdict in VERDICTS]
