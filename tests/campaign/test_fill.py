"""Gaps of covariates: filled once, by the rule of their quantity, and said."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from campaign.files import ROWS, add, put

from thermal_robot.campaign import read_campaign


@pytest.mark.parametrize(
    ("name", "cells", "filled", "words"),
    [
        ("approach__lift", "1 _ -1 _", [1, 0, -1, 0], "taken as 0"),
        ("velocity__slide", "_ 1000 1000 1000", [0, 1, 1, 1], "taken as 0"),
        ("acceleration__slide", "2000 _ 1000 1000", [2, 0, 1, 1], "taken as 0"),
        ("payload", "_ 5 _ 3", [5, 5, 5, 3], "previous row's value held"),
        ("speed", "0.5 _ _ 1", [0.5, 0.5, 0.5, 1], "previous row's value held"),
        ("time", "0 _ _ 30", [0, 10, 20, 30], "interpolated between rows"),
        ("order", "_ 1 2 3", [1, 1, 2, 3], "interpolated between rows"),
        ("temperature", "20 _ 22 _", [20, 21, 22, 22], "interpolated between rows"),
        ("temperature__beam", "20 nan 22 NA", [20, 21, 22, 22], "interpolated between rows"),
        ("torque__lift", "_ 4 _ 8", [4, 4, 6, 8], "interpolated between rows"),
        ("encoder__slide", "1000 _ 3000 null", [1, 2, 3, 3], "interpolated between rows"),
        ("humidity", "40 _ 44 44", [40, 42, 44, 44], "interpolated between rows"),
    ],
)
def test_filled_once_and_said(tmp_path: Path, name: str, cells: str, filled: list[float], words: str) -> None:
    campaign = read_campaign(put(tmp_path / "c", add(ROWS + "20,20,30,40,990,0,500\n", **{name: cells})))
    column = name.replace("__", ".")
    np.testing.assert_allclose(campaign.covariates[column], filled)
    count = sum(cell in ("_", "nan", "NA", "null") for cell in cells.split())
    assert campaign.missing[column].sum() == count
    assert campaign.warnings == (f"column {column!r} is empty in {count} of 4 rows: " + _how(words),)


def _how(words: str) -> str:
    return f"the {words}" if words.startswith("previous") else words
