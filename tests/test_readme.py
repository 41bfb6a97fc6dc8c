"""README is short, its campaign is a campaign, its lines of Python run, and the demo prints what it shows."""

import contextlib
import io
import re
from pathlib import Path

import numpy as np
import pytest
from pages import blocks, shown_lines_are_printed

import thermal_robot
from thermal_robot import demo_campaign, read_campaign

README = Path(__file__).parents[1] / "README.md"


@pytest.fixture(scope="module")
def text():
    return README.read_text(encoding="utf-8")


def block(language, number=0):
    return [body for kind, body in blocks(README) if kind == language][number]


def test_it_is_short(text):
    assert len(text.splitlines()) <= 150
    assert len(text.encode()) <= 10_000


def test_it_has_the_two_commands_that_ci_runs(text):
    lines = [line for line in text.splitlines() if line.startswith("python3 -m venv .venv && ")]
    assert [line.rsplit("&& ", 1)[1] for line in lines] == [".venv/bin/thermal-robot demo", ".venv/bin/pytest"]


def test_its_campaign_is_read(tmp_path):
    (tmp_path / "campaign.toml").write_text(block("toml"), encoding="utf-8")
    (tmp_path / "measurements.csv").write_text(block("csv"), encoding="utf-8")
    campaign = read_campaign(tmp_path)
    assert (campaign.samples, campaign.robot.name, campaign.warnings) == (5, "rv_m2", ())
    assert set(campaign.covariates) - set(campaign.derived) == {"time", "temperature"}
    assert campaign.noise_position == pytest.approx(12e-6)
    assert np.all(campaign.q > campaign.robot.lower)
    assert np.all(campaign.q < campaign.robot.upper)
    # a point on the hand, seen from anywhere: distances between points are those of an arm of 1.1 m, in metres
    assert np.linalg.norm(np.ptp(campaign.position, axis=0)) < 2.0


@pytest.fixture(scope="module")
def ran(tmp_path_factory, diagnosed_once):
    """Names, output and folder of README's lines of Python."""
    folder, names, out = tmp_path_factory.mktemp("api"), {}, io.StringIO()
    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(out):
        patch.setattr(thermal_robot, "diagnose", diagnosed_once)
        patch.chdir(folder)
        exec(compile(block("python"), "README.md", "exec"), names)
    return names, out.getvalue(), folder


def test_its_lines_of_python_run(ran):
    names, printed, folder = ran
    assert names["campaign"].samples == demo_campaign().samples
    assert {path.name for path in folder.iterdir()} == {"backlash.png", "model.json"}
    assert "backlash" in printed


def test_the_demo_prints_what_is_shown(ran):
    shown = block("text")
    assert len(shown.splitlines()) == 15
    shown_lines_are_printed(shown, str(ran[0]["diagnosis"]))


def test_its_table_has_every_effect(text, ran):
    listed = re.findall(r"^\| `(\w+)` \|", text, flags=re.M)
    assert sorted(listed) == sorted(finding.name for finding in ran[0]["diagnosis"].effects)
