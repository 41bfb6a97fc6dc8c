"""The ledger: every row of the fact sheet, its computed values, and what they depend on."""

import contextlib
import dataclasses
import io
import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from thermal_robot import cli
from thermal_robot.paper import VERDICTS, PaperInputs, ledger
from thermal_robot.paper.ledger import WIDTH, markdown, text

DOCS = Path(__file__).parents[2] / "docs" / "paper.md"


@cache
def default():
    return ledger()


# Computed values, SI, to the digits that are shown.
EXACT = {
    "Table 1, theoretical σ": [15.5913e-6, 16.7486e-6, 16.6240e-6, 21.2479e-6, 16.2132e-6, 16.1824e-6],
    "σ_q behind Table 1": [
        *(32.0516e-6, 34.2979e-6, 54.7424e-6, 0.0),
        *(33.6733e-6, 40.4370e-6, 68.5696e-6, 76.9165e-6),
        *(33.1201e-6, 38.0559e-6, 62.0867e-6, 49.4433e-6),
    ],
    "Table 2 row 1, calculated": [8.42280e-6, 14.5920e-6, 9.39402e-6],
    "Table 2 row 2, calculated": [17.7548e-6, 3.12998e-6, 4.16864e-6],
    "U of Eq 13, row 1": [-0.714286, 1.11111, 1.17647, 1.95996, 0.915181],
    "U of Eq 13, row 2": [1.30435, 0.0, 1.11111, 1.95996, 0.915181],
    "U of Eq 13 before stabilisation": [
        *(-5.71429, -7.77778, -5.29412, -7.3913, -1.875, -2.22222),
        *(0.342994, 0.251995, 0.370215, 0.265172, 1.04531, 0.881984),
    ],
    "strain Δl/(l·ΔT)": [11.6667e-6, 13.8889e-6, 12.0e-6, 11.6667e-6, 17.7778e-6, 11.8575e-6],
    "Fig 5a, farthest point in y–z": [27.3472e-6, 29.3377e-6, 478.043e-12, 1912.17e-12, 10],
    "Fig 5b, farthest point in y–z": [22.8870e-6, 32.7149e-6, 419.765e-12, 1679.06e-12, 10],
    "Eq 18, area under the density": [*[1 / np.sqrt(np.pi)] * 3, 1, 1, 1],
    "Eq 19, σ_t²": [256e-12 / 3],
    "r = σ_t/σ_k": [16 / 18 / np.sqrt(3)],
    "Eq 20, total variance": [324e-12 + 256e-12 / 3, 20.2320e-6, 405e-12],
    "Shapiro–Wilk critical W, n = 100, α = 0.05": [0.974577, 0.965435, 0.00783403],
    "C_p at L = 0.145 mm, row 1": [1.30128, 1.26237, 1.34217],
    "C_p at L = 0.145 mm, row 2": [1.01289, 0.988360, 1.03834],
    "C_p of row 2 below that of row 1": [0.221621, 0.177471, 0.263608],
    "C_p row 1 with ±3 °C": [
        *(147.995e-6, 1.18367, 0.110020, 0.116585),
        *(1.09365, 0.177709, 0.175635, 1.20462, 0.0942697, 0.0945050),
    ],
    "C_p row 2 with ±3 °C": [
        *(187.430e-6, 1.19028, 0.105055, 0.113010),
        *(1.10758, 0.167236, 0.168531, 1.21071, 0.0896882, 0.0915224),
    ],
    "(1.33 − 1.1)/1.33": [0.172932, 0.135338, 0.210526],
    "(1.33 − 1.17)/1.33": [0.120301, 0.116541, 0.124060],
    "(1.33 − 1.00)/1.33": [0.248120, 0.244361, 0.251880],
    "q3 of row 1": [91.2439e-6, 2.98820e-9],
    "law of U": [1.95996, 4, -0.714286, 1.11111, 1.17647, 1.30435, 0.0, 1.11111],
    "Eq 16, convolution": [],
    "symbols of σ": [],
    "x–y correlation of the kinematic error": [0.124061, 0.0996120, -0.0110271, -0.00332527],
    "x–y correlation of the thermal error": [1, 1, -0.0105000, -0.000744590],
}
# Answers of simulations ten times as large with another seed, and at least four Monte Carlo standard errors. The best
# of a sample is an extreme, of which only the size is known. Extremes: test_rows.
SIMULATED = {
    "Table 1, skewness": (
        [*[-0.4686] * 6, *[0.4686] * 6, 0.7715, 0.2204, 0.7451, 0.3346, 0.0870, 0.8451],
        [*[0.014] * 12, *[0.013] * 6],
    ),
    "Eq 12, five unknowns": (
        [60.29, 3.7, 2.3e-6, 4.2e-6, 15.38e-6, 36.37e-6, 14e-6, 5e-6, 9e-6, 7e-6, 8e-6],
        [3.0, 0.7, 0.9e-6, 0.6e-6, 0.8e-6, 1.5e-6, *[1e-12] * 5],
    ),
    "Eq 12, points and equations": ([60.29, 5.991, 4], [3.0, 0.1, 0]),
    "normality at r = 0.5, n = 100 and 5000": ([0.0456, 0.0596, 0.513200], [0.020, 0.024, 1e-6]),
    '"normal enough for r < 1"': ([0.0460, 0.0569, 0.0496, 0.9901], [0.020, 0.024, 0.020, 0.010]),
    # Fitted standard deviations come from an optimiser. With the sampling error the scatter is compatible (≤ 1).
    "Table 1, experimental σ": (
        [15.2470e-6, 17.9124e-6, 17.4694e-6, 22.5748e-6, 14.9888e-6, 17.6788e-6, 1.24699e-6, 1.90288, 0.5],
        [*[2e-9] * 6, 2e-10, 2e-4, 0.5],
    ),
}
ELSEWHERE = {"Table 1, minimum", "Table 1, maximum"}


def test_every_row_has_its_value():
    found = {entry.quantity: entry for entry in default()}
    assert len(found) == len(default()) == 37
    assert found.keys() == {*EXACT, *SIMULATED, *ELSEWHERE}
    for quantity, values in EXACT.items():
        np.testing.assert_allclose(found[quantity].values, values, rtol=1e-5, atol=1e-15, err_msg=quantity)
    for quantity, (values, tolerance) in SIMULATED.items():
        off = np.abs(np.subtract(found[quantity].values, values))
        np.testing.assert_array_less(off, np.array(tolerance) + 1e-15, err_msg=quantity)
    assert found["Table 1, experimental σ"].values[-1] <= 1.0 < found["Table 1, experimental σ"].values[-2]


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


def test_text_fits_the_screen_and_leaves_nothing_out():
    told = str(default())
    assert max(map(len, told.splitlines())) <= WIDTH
    assert "\u00a0" not in told
    flat = "".join(told.split())
    for entry in default():
        assert "".join(entry.why.split()) in flat
        # Cells are wrapped side by side: their words are all there, and their first line stands at its column.
        assert all(word in told for cell in (entry.quantity, entry.printed, entry.computed) for word in cell.split())
    column = told.splitlines()[0].index("verdict")
    assert next(line for line in told.splitlines() if line.startswith("r = σ_t/σ_k"))[column:] == "agrees"
    wordy = dataclasses.replace(default().entries[0], why="word " * 21 + "12345 µm " + "word " * 30 + "99 °C")
    assert any("12345 µm" in line for line in text([wordy], {"agrees": 1}).splitlines()), (
        "a unit parted from its number"
    )


def test_markdown_is_one_table_whatever_stands_in_a_cell():
    lines = default().markdown().splitlines()
    cells = [line for line in lines if line.startswith("|")]
    assert len(cells) == len(default()) + 2
    odd = dataclasses.replace(default().entries[0], quantity="a | b", printed="2 * 3", why="x|y, *really*")
    row = markdown([odd], {"agrees": 1}).splitlines()[2]
    assert {line.replace("\\|", "").count("|") for line in [*cells, row]} == {6}
    assert row.replace("\\*", "").count("*") == 4  # the verdict's own
    assert all(cell in row for cell in ("a \\| b", "2 \\* 3", "x\\|y, \\*really\\*"))


def test_legend_explains_the_verdicts_that_occur_and_no_others():
    counts = {"agrees": 3, "erratum": 12}
    for told in (text([], counts), markdown([], counts)):
        flat = " ".join(told.split())
        assert [meaning in flat for meaning in VERDICTS.values()] == [verdict in counts for verdict in VERDICTS]
    assert all(f"**{verdict}** ({count})" in default().markdown() for verdict, count in default().counts.items())
