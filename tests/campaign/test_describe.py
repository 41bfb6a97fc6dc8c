"""What `check` prints: units of the file, ranges, gaps, repeats, warnings."""

from __future__ import annotations

import re
from pathlib import Path

from campaign.files import ROWS, add, full, put

from thermal_robot.campaign import describe, read_campaign, read_samples


def test_says_what_a_metrologist_asks(tmp_path: Path) -> None:
    text = _squeezed(describe(full(tmp_path / "hall_3")))
    for line in (
        "Campaign hall_3",
        "robot                  arm, chain from base to tool, 4 movable joints",
        "lengths hold at        22.5 °C",
        "measurements           3, position and orientation, in mm",
        "base frame unknown: measured in the instrument's own frame, place and direction are fitted",
        "target                 known: (1, 2, 80) mm on tool",
        "noise of position      0.02 mm per axis (one sigma)",
        "noise of orientation   3e-05 rad per axis (one sigma)",
        "slide   prismatic    30 .. 90     0 .. 500",
        "roll    continuous   -40 .. 400   none",
        "temperature        20.1 .. 21.3",
        "humidity           not defined by the format   40 .. 43",
        "sessions             2: a (2 rows), b (1 row)",
        "Warnings\n  none",
    ):
        assert _squeezed(line) in text, f"{line!r} is not in\n{text}"


def test_bare_campaign(tmp_path: Path) -> None:
    folder = put(tmp_path / "c", ROWS + ROWS.splitlines()[1] + "\n")
    file = folder / "campaign.toml"
    file.write_text(file.read_text().split("[noise]")[0].replace('tool = "known"', 'tool = "unknown"'))
    text = _squeezed(describe(read_campaign(folder)))
    assert "noise of position not given: estimated from the data" in text
    assert "target unknown: fitted, starting from (1, 2, 80) mm on tool" in text
    assert "Conditions recorded\n none\n not recorded: time, order, temperature, payload" in text
    assert "identical commands 1 pose repeated, 2 rows in all" in text
    assert "no label: taken as one run" in text


def test_gaps_and_warnings(tmp_path: Path) -> None:
    table = add(ROWS, payload="1 _ 1", temperature="290 291 292")
    text = _squeezed(describe(read_campaign(put(tmp_path / "c", table))))
    assert "payload 1, does not vary kg 1 filled" in text
    assert " - column 'payload' is empty in 1 of 3 rows: the previous row's value held" in text
    assert "are these kelvin?" in text


def test_samples(tmp_path: Path) -> None:
    campaign = full(tmp_path / "c")
    text = _squeezed(describe(read_samples(tmp_path / "c" / "measurements.csv", campaign)))
    assert "samples 3, to be predicted" in text


def test_columns_are_aligned(tmp_path: Path) -> None:
    lines = describe(full(tmp_path / "c")).split("Joints\n")[1].split("\n\n")[0].splitlines()
    assert len({line.index(cell) for line, cell in zip(lines[1:], ("rev", "rev", "pri", "con"), strict=True)}) == 1


def _squeezed(text: str) -> str:
    return re.sub(" +", " ", text)
