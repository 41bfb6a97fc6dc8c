"""The ledger as text, Markdown and JSON; the command; and the README, which holds what is computed."""

import json
from functools import cache
from pathlib import Path

import pytest

from thermal_robot import cli
from thermal_robot.paper import ledger
from thermal_robot.paper.tables import WIDTH

README = Path(__file__).parents[2] / "README.md"


@cache
def default():
    return ledger()


def run(capsys, *arguments):
    status = cli.main(["paper", *arguments])
    return status, *capsys.readouterr()


def test_text_fits_the_screen_and_leaves_nothing_out():
    text = str(default())
    assert text == default().text()
    assert max(map(len, text.splitlines())) <= WIDTH
    assert "\u00a0" not in text
    flat = "".join(text.split())
    for entry in default():
        assert "".join(entry.why.split()) in flat
        # Cells are wrapped side by side: their words are all there, and their first line stands at its column.
        assert all(word in text for cell in (entry.quantity, entry.printed, entry.computed) for word in cell.split())
    columns = [line.index("verdict") for line in text.splitlines() if line.startswith("quantity")]
    starts = [line for line in text.splitlines() if line.startswith("r = σ_t/σ_k")]
    assert starts[0][columns[0] :] == "agrees"


def test_markdown_is_one_table():
    lines = default().markdown().splitlines()
    rows = [line for line in lines if line.startswith("|")]
    assert len(rows) == len(default()) + 2
    assert {line.replace("\\|", "").count("|") for line in rows} == {6}
    assert f"{len(default())} rows." in lines[-1]
    for verdict, count in default().counts.items():
        assert f"**{verdict}** ({count})" in lines[-1]


def test_readme_holds_the_ledger():
    text = README.read_text(encoding="utf-8")
    start, end = "<!-- paper ledger -->", "<!-- /paper ledger -->"
    assert text.count(start) == text.count(end) == 1, "README.md lacks the markers of the ledger"
    assert text.split(start)[1].split(end)[0].strip("\n") == default().markdown()


def test_to_dict_is_plain_data():
    told = json.loads(json.dumps(default().to_dict(), allow_nan=False))
    assert told["inputs"]["l5"] == 0.15
    assert told["counts"] == default().counts
    assert [entry["quantity"] for entry in told["entries"]] == [entry.quantity for entry in default()]
    first = default().entries[0]
    assert told["entries"][0]["values"] == list(first.values)
    assert told["entries"][0]["depends"] == ["l5", "sigma_q", "poses"]
    assert set(told["entries"][0]) == {
        "quantity", "where", "printed", "computed", "values", "verdict", "why", "depends",
    }  # fmt: skip


def test_a_quantity_that_is_not_there():
    assert default()["Eq 19, σ_t²"].values[0] == pytest.approx(8.53e-11, rel=1e-3)
    with pytest.raises(KeyError):
        default()["Eq 99"]


def test_command_prints_the_ledger(capsys, tmp_path):
    status, out, err = run(capsys, "--json", str(tmp_path / "ledger.json"))
    assert (status, out, err) == (0, default().text() + "\n", "")
    assert json.loads((tmp_path / "ledger.json").read_text(encoding="utf-8")) == default().to_dict()
    assert run(capsys, "--markdown")[1] == default().markdown() + "\n"


def test_command_takes_another_hand(capsys):
    status, out, _ = run(capsys, "--l5", "0.25", "--json", "-")
    told = json.loads(out)
    assert status == 0
    assert told["inputs"]["l5"] == 0.25
    # No σ_q fits this hand: its ranges are not numbers.
    assert told["entries"][1]["values"][:8] == [None] * 8
    status, out, err = run(capsys, "--l5", "-0.1")
    assert (status, out) == (2, "")
    assert err == "thermal-robot: l5 must be a positive number of metres, got -0.1\n"
