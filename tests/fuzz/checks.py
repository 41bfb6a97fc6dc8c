"""What a sound answer is: numbers that are finite, survive a round trip, and agree with those of the same campaign."""

from __future__ import annotations

import contextlib
import io
import json
import os
import pickle
import sys
import tempfile
from functools import cache
from pathlib import Path

import numpy as np
from fuzz import corpus

from thermal_robot import cli, diagnose
from thermal_robot.campaign import Campaign, campaign_from_table, describe, read_campaign, write_campaign
from thermal_robot.campaign.document import tomllib
from thermal_robot.correction import CorrectedModel
from thermal_robot.robot import load_robot

CLOSE = 1e-9
"""Relative and in SI: what converting units there and back may round, with room for angles of thousands of turns."""
PARTS = ("q", "position", "orientation", "simulated_position", "simulated_orientation", "target", "payload_com")


def finite(campaign: Campaign) -> None:
    """No number that is none where something was measured or commanded."""
    for part in PARTS:
        value = getattr(campaign, part)
        assert value is None or np.isfinite(value).all(), f"{part} is not finite"
    for name, values in campaign.covariates.items():
        assert np.isfinite(values).all(), f"column {name} is not finite"


def alike(one: Campaign, other: Campaign, rows: object = slice(None), further: tuple[str, ...] = ()) -> None:
    """The same observations; ``further`` are columns that only the first has."""
    for part in PARTS:
        a, b = getattr(one, part), getattr(other, part)
        assert (a is None) == (b is None), f"{part} is there once only"
        if a is not None:
            b = b if part in ("target", "payload_com") else b[rows]
            np.testing.assert_allclose(a, b, rtol=CLOSE, atol=CLOSE * max(1e-9, np.abs(b).max(initial=0)), err_msg=part)
    assert set(one.covariates) - set(further) == set(other.covariates)
    for name, values in other.covariates.items():
        np.testing.assert_allclose(one.covariates[name], values[rows], rtol=CLOSE, atol=1e-12, err_msg=name)
    for name, labels in other.labels.items():
        assert (one.labels[name] == labels[rows]).all(), name
    for part in ("noise_position", "noise_orientation"):
        np.testing.assert_allclose(getattr(one, part) or 0.0, getattr(other, part) or 0.0, rtol=CLOSE, err_msg=part)


def accepted(campaign: Campaign) -> None:
    """What is read is described, finite, and the same after a round trip."""
    describe(campaign)
    finite(campaign)
    with tempfile.TemporaryDirectory() as folder:
        alike(read_campaign(write_campaign(campaign, folder)), campaign)


def reading(folder: Path) -> None:
    """A campaign is read."""
    accepted(read_campaign(folder))


def frame(folder: Path) -> None:
    """A data frame is read."""
    table, given = pickle.loads((folder / "table.pickle").read_bytes())
    tool = tomllib.loads((folder / "campaign.toml").read_text(encoding="utf-8"))["robot"]["tool_frame"]
    accepted(campaign_from_table(load_robot(folder / "robot.urdf", tool), table, **given))


def model(folder: Path) -> None:
    """A model is loaded, predicts numbers, and predicts the same once it is saved and loaded."""
    first = CorrectedModel.load(folder / "model.json")
    samples = first.samples(folder / "samples.csv")
    predicted = first.prediction(samples)[:2]
    assert all(np.isfinite(part).all() for part in predicted if part is not None), "a prediction is not finite"
    first.save(folder / "again.json")
    repeated = CorrectedModel.load(folder / "again.json").prediction(samples)[:2]
    for part, again in zip(predicted, repeated, strict=True):
        assert part is None or np.array_equal(part, again), "saved and loaded it predicts otherwise"


def arguments(folder: Path) -> None:
    """A command ends with 0, or with 2 and one line; files that were asked for appear whole."""
    words = json.loads((folder / "arguments.json").read_bytes())
    out, err = io.TextIOWrapper(io.BytesIO(), encoding="utf-8"), io.TextIOWrapper(io.BytesIO(), encoding="utf-8")
    os.chdir(folder)
    before, sys.stdin = sys.stdin, io.TextIOWrapper(io.BytesIO())  # the worker's own brings it its trials
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            status = cli.main(words)
    except SystemExit as end:
        status = end.code
    finally:
        os.chdir("/")
        sys.stdin = before
    err.seek(0)
    said = err.read()
    assert status in (0, 2), f"exit status {status}: {said}"
    assert status == 0 or not words or said.count("\n") == 1, f"more than one line: {said!r}"  # no words: the usage
    assert not list(folder.glob(".thermal-robot-*")), "a half written file stayed"


@cache
def expected(which: int) -> tuple[Campaign, CorrectedModel | None, np.ndarray | None]:
    """A sound campaign, its model, and what that predicts."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        corpus.put(corpus.campaigns()[which], folder)
        campaign = read_campaign(folder)
        if which >= len(corpus.models()):
            return campaign, None, None
        (folder / "model.json").write_bytes(corpus.models()[which]["model.json"])
        held = CorrectedModel.load(folder / "model.json")
        return campaign, held, held.prediction(campaign)[0]


def same(folder: Path) -> None:
    """A campaign written in another way is the same campaign; its model predicts the same. A refusal is wrong, too."""
    campaign, held, predicted = expected(json.loads((folder / "like.json").read_bytes()))
    rows = (
        json.loads((folder / "rows.json").read_bytes())
        if (folder / "rows.json").exists()
        else np.arange(campaign.samples)
    )
    found = read_campaign(folder)
    alike(found, campaign, rows, ("air_pressure",))
    if held is not None:
        np.testing.assert_allclose(held.prediction(found)[0], predicted[rows], rtol=CLOSE, atol=1e-12)


def diagnosis(folder: Path) -> None:
    """A diagnosis is finite throughout, is told, and its model predicts; ``only.json`` may name what is asked for."""
    asked = folder / "only.json"
    found = diagnose(folder, only=json.loads(asked.read_bytes()) if asked.is_file() else None)
    json.dumps(found.to_dict(), allow_nan=False)
    assert str(found)
    if found.usable:
        predicted = found.model.prediction(read_campaign(folder))[0]
        assert np.isfinite(predicted).all(), "a prediction is not finite"


def itself(folder: Path) -> None:
    """Do what ``code.py`` says."""
    exec((folder / "code.py").read_text(encoding="utf-8"))
