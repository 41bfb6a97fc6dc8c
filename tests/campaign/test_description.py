"""What `check` prints: units of the file, ranges, gaps, repeats, warnings."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

from campaign.files import ROWS, add, full, put

from thermal_robot.campaign import Units, describe, read_campaign


def test_says_what_a_metrologist_asks() -> None:
    text = _squeezed(describe(full()))
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


def test_samples_are_to_be_predicted_and_columns_are_aligned() -> None:
    samples = dataclasses.replace(full(), position=None, orientation=None)
    assert "samples 3, to be predicted" in _squeezed(describe(samples))
    lines = describe(full()).split("Joints\n")[1].split("\n\n")[0].splitlines()
    assert len({line.index(cell) for line, cell in zip(lines[1:], ("rev", "rev", "pri", "con"), strict=True)}) == 1


def _squeezed(text: str) -> str:
    return re.sub(" +", " ", text)


def test_every_condition_has_its_unit() -> None:
    block = describe(full()).split("Conditions recorded\n")[1].split("\n\n")[0]
    units = {tuple(line.split()[:2]): line for line in block.splitlines()}
    for words, unit in (
        (("velocity", "lift"), "deg/s"),
        (("velocity", "slide"), "mm/s"),
        (("acceleration", "roll"), "deg/s²"),
        (("encoder", "slide"), "mm"),
        (("torque", "lift"), "N·m"),
    ):
        assert f" {unit} " in units[words]
    for name, unit in (("time", "s"), ("payload", "kg"), ("speed", "0..1"), ("temperature.beam", "°C")):
        (line,) = (line for line in block.splitlines() if line.split()[0] == name)
        assert f" {unit} " in line
    assert "as given" in next(line for line in block.splitlines() if "humidity" in line)


def test_ranges_are_those_of_the_file_in_any_unit() -> None:
    text = _squeezed(describe(dataclasses.replace(full(), units=Units("rad", "um"))))
    assert "slide prismatic 30000 .. 90000 0 .. 500000 um 12 %" in text
    assert "lift revolute -0.785398 .. 0.349066 -2 .. 2 rad 28 %" in text


def test_many_sessions_and_the_noise_of_each_row_are_told(tmp_path: Path) -> None:
    rows = "".join(f"{i},20,30,40,{1000 + i},0,500,day {i:02d}\n" for i in range(12))
    text = describe(read_campaign(put(tmp_path / "c", ROWS.split("\n")[0] + ",session\n" + rows)))
    assert "12: day 00 (1 row)" in text
    assert "day 07 (1 row) and 4 more" in text
    text = _squeezed(describe(read_campaign(put(tmp_path / "c", add(ROWS, noise="0.02 0.5 0.03")))))
    assert "noise of position 0.02 .. 0.5 mm per axis (one sigma), of each row" in text
