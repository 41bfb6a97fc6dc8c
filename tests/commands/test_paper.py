"""`thermal-robot paper`: the ledger as text, as a table of Markdown, and as JSON."""

import json

import pytest


def test_the_ledger_is_printed_and_written(run, tmp_path):
    status, text, err = run("paper")
    assert (status, err) == (0, "")
    status, out, err = run("paper", "--json", "-")
    assert (status, err) == (0, "")
    entries = json.loads(out)
    assert entries
    assert run("paper", "--json", tmp_path / "ledger.json") == (0, text, "")
    assert json.loads((tmp_path / "ledger.json").read_text(encoding="utf-8")) == entries


def test_markdown_takes_the_place_of_the_text(run):
    text, table = run("paper")[1], run("paper", "--markdown")[1]
    assert "|" in table
    assert table != text


@pytest.mark.parametrize("length", ["-1", "nan"])
def test_a_length_that_is_none_is_bad_input(run, length):
    status, out, err = run("paper", "--l5", length)
    assert (status, out) == (2, "")
    assert err.count("\n") == 1
