"""The ledger: every row of the fact sheet, its computed values, and what they depend on."""

import contextlib
import dataclasses
import io
import json
from functools import cache
from pathlib import Path

import pytest

from thermal_robot import cli
from thermal_robot.paper import VERDICTS, PaperInputs, ledger, rows
from thermal_robot.paper.rows import ROWS

DOCS = Path(__file__).parents[2] / "docs" / "paper.md"


@cache
def default():
    return ledger()


# Rows of the fact sheet's table, and then its other slips: the entries of the ledger that answer them.
FACTS = {
    "Table 1, theoretical σ": ["Table 1, theoretical σ", "σ_q behind Table 1"],
    "Table 1, experimental σ": ["Table 1, experimental σ"],
    "Table 2 row 1, calculated": ["Table 2 row 1, calculated"],
    "Table 2 row 2, calculated": ["Table 2 row 2, calculated"],
    "U of Eq 13, row 1": ["U of Eq 13, row 1"],
    "U of Eq 13, row 2": ["U of Eq 13, row 2"],
    "Eq 12, five unknowns": ["Eq 12, five unknowns"],
    "strain Δl/(l·3 K)": ["strain Δl/(l·ΔT)"],
    "Fig 5a": ["Fig 5a, farthest point in y–z"],
    "Fig 5b": ["Fig 5b, farthest point in y–z"],
    "Eq 18, area under the density": ["Eq 18, area under the density"],
    "Eq 19": ["Eq 19, σ_t²"],
    "r = σ_t/σ_k": ["r = σ_t/σ_k"],
    "Eq 20, total variance": ["Eq 20, total variance"],
    "Shapiro–Wilk critical W": ["Shapiro–Wilk critical W, n = 100, α = 0.05"],
    "normal enough for r < 1": ['"normal enough for r < 1"', "normality at r = 0.5, n = 100 and 5000"],
    "C_p at L = 0.145 mm, row 1": ["C_p at L = 0.145 mm, row 1"],
    "C_p at L = 0.145 mm, row 2": ["C_p at L = 0.145 mm, row 2", "C_p of row 2 below that of row 1"],
    "C_p row 1 with ±3 °C": ["C_p row 1 with ±3 °C", "(1.33 − 1.1)/1.33"],
    "C_p row 2 with ±3 °C": ["C_p row 2 with ±3 °C", "(1.33 − 1.17)/1.33"],
    "q3 of row 1": ["q3 of row 1"],
    "N(1,0)": ["law of U"],
    "Eq 16 lacks its differential": ["Eq 16, convolution"],
    "Eq 12's index and counts": ["Eq 12, points and equations"],
    "σ_t written σ_r, σ_k σ_i": ["symbols of σ"],
    "ρ = 0.12 and 0.10": ["x–y correlation of the kinematic error"],
    "±1 of a thermal shift": ["x–y correlation of the thermal error"],
}


def test_every_row_of_the_fact_sheet_has_its_entry():
    names = [entry.quantity for entry in default()]
    assert len(set(names)) == len(names) == len(default()) == len(ROWS)
    assert [name for entries in FACTS.values() for name in entries if name not in names] == []
    # What the ledger has beyond it.
    assert set(names) - {name for entries in FACTS.values() for name in entries} == {
        "Table 1, minimum",
        "Table 1, maximum",
        "Table 1, skewness",
        "U of Eq 13 before stabilisation",
        "(1.33 − 1.00)/1.33",
    }


def test_rows_of_the_five_sections_are_all_there():
    sections = (rows.SCATTER, rows.WARMING, rows.RANDOMISED, rows.JOINING, rows.SLIPS)
    assert len(ROWS) == sum(map(len, sections)) == len(set(ROWS))
    assert set(ROWS) == {row for section in sections for row in section}


def test_verdicts():
    found = default()
    assert found.counts == {
        "agrees": 14,
        "agrees when truncated": 2,
        "agrees in part": 2,
        "erratum": 8,
        "not reproducible": 4,
        "only bounded": 1,
        "neglected": 2,
        "not printed": 4,
    }
    assert {entry.verdict for entry in found} <= set(VERDICTS)
    assert all(entry.why and entry.where and entry.printed and entry.computed for entry in found)
    verdicts = {entry.quantity: entry.verdict for entry in found}
    expected = {
        "Table 1, theoretical σ": "agrees",
        "Table 1, experimental σ": "not reproducible",
        "Table 2 row 1, calculated": "agrees when truncated",
        "Table 2 row 2, calculated": "agrees when truncated",
        "U of Eq 13 before stabilisation": "agrees in part",
        "Eq 18, area under the density": "erratum",
        "Eq 19, σ_t²": "erratum",
        "r = σ_t/σ_k": "agrees",
        "Shapiro–Wilk critical W, n = 100, α = 0.05": "erratum",
        '"normal enough for r < 1"': "agrees in part",
        "C_p at L = 0.145 mm, row 1": "agrees",
        "C_p at L = 0.145 mm, row 2": "agrees",
        "C_p row 1 with ±3 °C": "not reproducible",
        "C_p row 2 with ±3 °C": "not reproducible",
        "σ_q behind Table 1": "only bounded",
    }
    assert {quantity: verdicts[quantity] for quantity in expected} == expected


SMALL = PaperInputs(repetitions=150, pose_sets=400)
CHANGED = {
    "l5": 0.12,
    "sigma_q": (30e-6, 41e-6, 60e-6, 52e-6),
    "delta_l": (13e-6, 6e-6, 10e-6, 5e-6, 9e-6),
    "reference_temperature": 19.0,
    "temperature": 24.0,
    "poses": ((0.6, 0.9, -1.3, -1.0), (1.3, 0.4, -1.2, -0.7)),
    "pose_5a": (0.6, 0.7, -0.4, -1.0),
    "experimental_sigma": ((15e-6, 17e-6, 18e-6), (22e-6, 17e-6, 19e-6)),
    "static_displacements": ((7e-6, 15e-6, 10e-6), (18e-6, 2e-6, 5e-6)),
    "sample_means": ((8e-6, 15e-6, 12e-6), (19e-6, 4e-6, 5e-6)),
    "n": 80,
    "n_simulated": 1500,
    "alpha": 0.1,
    "delta_y": 15e-6,
    "clearance": 150e-6,
    "capability": 1.2,
    "reading_noise": 20e-6,
    "pose_sets": 500,
    "repetitions": 200,
    "seed": 1,
}


@cache
def small():
    return ledger(SMALL)


def test_every_input_is_changed_below():
    assert set(CHANGED) == {field.name for field in dataclasses.fields(PaperInputs)}
    assert {name for entry in default() for name in entry.depends} == set(CHANGED)


@pytest.mark.parametrize("name", CHANGED)
def test_rows_that_depend_on_an_input_move_and_the_others_stay(name):
    changed = ledger(dataclasses.replace(SMALL, **{name: CHANGED[name]}))
    moved = 0
    for before, after in zip(small(), changed, strict=True):
        assert before.depends == after.depends
        if name in before.depends:
            assert before.values != after.values, before.quantity
            moved += 1
        else:
            assert before == after
    assert moved


def test_the_rows_of_l5_and_sigma_q():
    rows = {name: {e.quantity for e in default() if name in e.depends} for name in ("l5", "sigma_q")}
    assert rows["sigma_q"] == {"Table 1, theoretical σ", "x–y correlation of the kinematic error"}
    assert rows["l5"] == rows["sigma_q"] | {
        "σ_q behind Table 1",
        "Table 1, experimental σ",
        "strain Δl/(l·ΔT)",
        "q3 of row 1",
    }


def test_verdicts_follow_the_inputs():
    other = ledger(
        dataclasses.replace(SMALL, l5=0.08, experimental_sigma=((16e-6, 20e-6, 17e-6), (25e-6, 16e-6, 18e-6)))
    )
    assert other["Table 1, theoretical σ"].verdict == "not reproducible"
    assert other["σ_q behind Table 1"].verdict == "agrees"
    assert other["C_p at L = 0.145 mm, row 1"].verdict == "not reproducible"
    assert ledger(dataclasses.replace(SMALL, l5=0.2))["σ_q behind Table 1"].verdict == "not reproducible"
    # Elongations within the printed ones' rounding, from which both rows of Table 2 come out rounded.
    rounded = ledger(dataclasses.replace(SMALL, delta_l=(13.5e-6, 4.5e-6, 8.52590445e-6, 6.5e-6, 7.5e-6)))
    assert [rounded[f"Table 2 row {row}, calculated"].verdict for row in (1, 2)] == ["agrees", "agrees"]


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


def test_the_documents_hold_the_ledger():
    text = DOCS.read_text(encoding="utf-8")
    start, end = "<!-- paper ledger -->", "<!-- /paper ledger -->"
    assert text.count(start) == text.count(end) == 1, "docs/paper.md lacks the markers of the ledger"
    assert text.split(start)[1].split(end)[0].strip("\n") == default().markdown()


def test_the_example_in_the_documents_prints_what_they_say():
    example, _, rest = DOCS.read_text(encoding="utf-8").split("```python\n")[1].partition("```")
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(example, DOCS.name, "exec"), {})
    said = rest.split("It prints, rounded, ")[1].split(":")[0].split(" and ")
    assert [float(number) for number in said] == pytest.approx([float(n) for n in printed.getvalue().split()], rel=1e-4)


def run(capsys, *arguments):
    status = cli.main(["paper", *arguments])
    return status, *capsys.readouterr()


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
