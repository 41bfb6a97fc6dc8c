"""Gaps of covariates: filled once, by the rule of their quantity, and said."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from campaign.files import ROWS, add, put

from thermal_robot.campaign import read_campaign
from thermal_robot.campaign.read import fill


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


@pytest.mark.parametrize("column", ["approach.lift", "velocity.lift", "payload", "speed", "time", "humidity"])
def test_what_is_there_stays_and_nothing_is_made_up(column: str) -> None:
    rng = np.random.default_rng(3)
    values = rng.uniform(1, 2, 40)
    values[rng.permutation(40)[:15]] = np.nan
    there = ~np.isnan(values)
    filled, _ = fill(column, values)
    np.testing.assert_array_equal(filled[there], values[there])
    assert np.isfinite(filled).all()
    inside = filled[~there]
    assert np.all((inside == 0) | ((inside >= values[there].min()) & (inside <= values[there].max())))
    again, _ = fill(column, filled)
    np.testing.assert_array_equal(again, filled)


def test_a_payload_is_held_until_it_is_changed_and_a_line_is_a_line() -> None:
    values = np.array([np.nan, 1.0, np.nan, np.nan, 4.0, np.nan])
    held, _ = fill("payload", values)
    assert held.tolist() == [1, 1, 1, 1, 4, 4]
    line, _ = fill("temperature", values)
    assert line.tolist() == [1, 1, 2, 3, 4, 4]
    still, _ = fill("velocity.lift", values)
    assert still.tolist() == [0, 1, 0, 0, 4, 0]


@pytest.mark.parametrize("column", ["temperature", "payload", "torque.lift", "speed"])
def test_gaps_are_filled_in_the_sequence_of_measurement_wherever_the_rows_stand(column: str) -> None:
    rng = np.random.default_rng(5)
    clock, values = np.sort(rng.uniform(0, 100, 30)), rng.uniform(1, 2, 30)
    values[[0, 3, 4, 5, 17, 29]] = np.nan
    shuffled = rng.permutation(30)
    np.testing.assert_array_equal(
        fill(column, values[shuffled], clock[shuffled])[0], fill(column, values, clock)[0][shuffled]
    )
    assert "row" not in fill(column, values, clock)[1]


def test_a_temperature_between_two_readings_is_that_of_its_time() -> None:
    filled, _ = fill("temperature", np.array([20.0, np.nan, 30.0]), np.array([0.0, 9.0, 10.0]))
    assert filled[1] == pytest.approx(29.0)
