"""What is accepted but doubtful is said in one sentence, and nothing is said of an ordinary campaign."""

from __future__ import annotations

from pathlib import Path

import pytest
from campaign.spoilt import ROWS, TOML, read, with_column

DOUBTFUL = [
    (ROWS.replace("0.5,-0.4", "0.5,-2.1"), ["'lift'", "1 row", "row 4", "-2.1 rad", "limit -2 rad"]),
    (
        ROWS.replace(",60,", ",600,").replace(",90,", ",700,"),
        ["'slide'", "2 rows", "row 3", "600 mm", "limit 500 mm"],
    ),
    (ROWS.replace("0.1,0.2,", "45,0.2,"), ["'turn'", "45 rad", "row 2", "two turns", 'angle_unit = "deg"']),
    (ROWS.replace(",2,8", ",0.5,8"), ["'time' runs backwards 1 time", "row 3", "0.5 s after 1 s"]),
    (
        with_column("speed", "0.5", "50", "100"),
        ["'speed' is outside 0..1 in 2 rows", "row 3", "50", "fraction"],
    ),
    (with_column("temperature", "293", "294", "295"), ["'temperature'", "294 °C", "kelvin"]),
    (with_column("pose", "a", "b", "a"), ["same pose label", "different joint commands", "'a'"]),
    (
        ROWS.replace("1000,0", "90000000,0"),
        ["extend over", "m and the arm reaches 1.9 m", 'length_unit = "mm"'],
    ),
]


@pytest.mark.parametrize(("table", "words"), DOUBTFUL)
def test_doubtful(tmp_path: Path, table: str, words: list[str]) -> None:
    warnings = read(tmp_path, table=table).warnings
    fitting = [warning for warning in warnings if all(word in warning for word in words)]
    assert len(fitting) == 1, warnings
    assert not any("\n" in warning for warning in warnings)


def test_radians_called_degrees(tmp_path: Path) -> None:
    warnings = read(tmp_path, toml=TOML.replace('"rad"', '"deg"')).warnings
    assert any('no joint leaves ±3.5 degrees: is angle_unit = "rad" meant?' in warning for warning in warnings)


@pytest.mark.parametrize(("old", "new", "words"), [("80.0]", "80000.0]", "target lies 80 m"), ("0.02", "20", "noise")])
def test_lengths_in_another_unit(tmp_path: Path, old: str, new: str, words: str) -> None:
    (warning,) = read(tmp_path, toml=TOML.replace(old, new)).warnings
    assert words in warning
    assert 'is length_unit = "mm" right?' in warning


def test_the_last_digit_is_no_violation(tmp_path: Path) -> None:
    assert read(tmp_path, table=ROWS.replace("0.5,-0.4", "0.5,-2.0000005")).warnings == ()
