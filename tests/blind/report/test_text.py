"""The score of a blind trial as text."""

import re

import pytest
from blind_records import record, said, trial, trial_of_several

from thermal_robot.blind.report.text import markdown, text
from thermal_robot.blind.score import score


@pytest.fixture(scope="module")
def plain():
    return score(trial()).to_dict()


def test_text_and_table_say_the_same(plain):
    said_ = text(plain)
    assert "exactly what is at work, nothing else" in said_
    assert re.search(r"one effect, 4 cases, 1 failed\n.*1 of 4 +25\.0 % +4\.6 to 69\.9 %", said_)
    assert "| one effect | 4 | exactly what is at work, nothing else | 1 of 4 | 25.0 % | 4.6 to 69.9 % |" in (
        markdown(plain)
    )
    assert re.search(r"1 backlash +· +· +· +· +1 +1", said_)
    assert re.search(r"a4 +single +ur3 +backlash → the diagnosis failed: late", said_)


def test_blocks_without_cases_are_left_out(plain):
    heads = [block.splitlines()[0] for block in text(plain).split("\n\n")]
    assert heads[0] == "Blind trial: 12 cases, 6 answered wrongly; 1 diagnoses failed and count as wrong."
    assert [h for h in heads if h.startswith("REAL")] == ["REAL CAMPAIGNS"]
    alone = score([record("null", said(), id="n1")]).to_dict()
    assert [re.split(r",|  |\n", b)[0] for b in text(alone).split("\n\n")] == [
        "Blind trial: 1 cases", "HOW OFTEN", "BY ROBOT", "NAMED FIRST: one effect", "FIGURES",
    ]  # fmt: skip
    assert text(score([]).to_dict()) == "Blind trial: 0 cases, 0 answered wrongly."


def test_columns_of_the_confusion_are_numbered_as_its_rows(plain):
    block = next(b for b in text(plain).split("\n\n") if b.startswith("NAMED FIRST: one effect, nothing"))
    heads, *rows, others = block.splitlines()[1:]
    assert heads.split() == ["1", "2", "3", "n", "u", "f"]
    assert [row.split()[:2] for row in rows[:2]] == [["1", "backlash"], ["2", "drift"]]
    assert others.strip() == "3 joint_gain; n nothing; u unexplained; f failed"
    counts = [[0 if c == "·" else int(c) for c in row.split()[-6:]] for row in rows]
    assert counts == [list(c) for c in plain["confusion"]["single"]["counts"]]


def test_a_long_answer_hangs_under_its_head(plain):
    real = {"id": "r1", "robot": "arm", "asked": "word " * 40, "answer": "answer " * 30, "right": False}
    block = next(b for b in text({**plain, "real": [real]}).split("\n\n") if b.startswith("REAL"))
    first, *rest = block.splitlines()[1:]
    assert first.startswith("  WRONG  r1  word word")
    assert all(line.startswith(" " * 11) and len(line) <= 100 for line in rest)
    assert sum(line.count("word") for line in (first, *rest)) == 40


def test_several_campaigns_are_told_by_what_changes(plain):
    told = text(score([*trial(), *trial_of_several()]).to_dict())
    assert re.search(
        r"two campaigns, one parameter changed, 1 cases\n  > what changed is told, and nothing else +1 of 1", told
    )
    assert re.search(r"backlash jumps +1/1 +100\.0 % +1/1 +100\.0 % +1/1 +100\.0 % +1/1 +100\.0 %", told)
    assert re.search(r"joint_offset changes +1/1 +100\.0 % +1/1 +100\.0 % +– +–", told)
    assert re.search(r"k5 +series +ur3 +backlash grows, j1 → backlash, j1: jump after campaign 5", told)
    assert "CAMPAIGNS OF ONE ROBOT" not in text(plain)
