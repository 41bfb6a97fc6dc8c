"""The page and the JSON of a diagnosis of motion: whole, valid, and nothing cut off on a desk or a telephone."""

import json
import re
from dataclasses import replace
from html import unescape

import jsonschema
import numpy as np
import pytest
from matplotlib.image import imread
from motion.found import COUNT, JOINTS, found, nothing

from thermal_robot.report import motion_html, motion_schema, schema
from thermal_robot.report.plots import plot_gap_against, plot_hysteresis, slowest, velocity


@pytest.fixture(scope="module")
def page():
    return motion_html(found(flagged=True, rivals=(("lag", ("delay",)),)), "now", {"motion.toml": "0" * 64})


def test_the_page_needs_nothing_beside_itself(page):
    assert page.lstrip().lower().startswith("<!doctype html>")
    assert not re.search(r"(src|href)=\"(?!#|data:image/png)", page)
    assert "script-src 'none'" in page
    for heading in ("How far", "Which", "What these data cannot tell", "What the gap follows", "Unexplained", "Next"):
        assert f"<h2>{heading}</h2>" in page
    assert "motion.toml" in page


def test_the_page_says_what_the_text_says(page):
    d = found(flagged=True, rivals=(("lag", ("delay",)),))
    words = unescape(re.sub(r"<[^>]+>", " ", page))
    words = re.sub(r"\s+", " ", words)
    for said in (d.summary, d.advice, "time constant, joint_2", "60.0 ± 3.0 ms", "first-order filter"):
        assert said in words


@pytest.mark.slow
def test_equal_diagnoses_give_equal_pages():
    assert motion_html(found()) == motion_html(found())


@pytest.mark.parametrize("make", [found, nothing, lambda: replace(found(), joints={}, verdict=(), effects=())])
def test_a_piece_for_a_notebook_is_one_division(make):
    piece = make()._repr_html_().strip()
    assert piece.startswith("<div")
    assert piece.endswith("</div>")
    assert piece.count("<div") == piece.count("</div>")


@pytest.mark.parametrize("make", [found, nothing, lambda: found(stated=True), lambda: found(flagged=True)])
def test_the_json_is_valid(make, tmp_path):
    make().to_json(tmp_path / "d.json")
    plain = json.loads((tmp_path / "d.json").read_text(encoding="utf-8"))
    validator = jsonschema.Draft202012Validator(motion_schema())
    validator.check_schema(motion_schema())
    validator.validate(plain)
    assert plain["campaign"]["measures"] == "motion"
    assert not jsonschema.Draft202012Validator(schema()).is_valid(plain)
    for breakage in ({"measures": "pose"}, {"motions": 0}, {"outliers": [3]}):
        assert not validator.is_valid({**plain, "campaign": {**plain["campaign"], **breakage}})


def test_velocity_is_the_slope_of_the_command_in_each_motion():
    curves = found().curves["joint_2"]
    speed = velocity(curves)
    for motion in curves["motion"].unique():
        own = (curves["motion"] == motion).to_numpy()
        turned = np.trapezoid(speed[own], curves["time"][own])
        command = curves["command"].to_numpy()[own]
        assert turned == pytest.approx(command[-1] - command[0], abs=0.02 * np.ptp(command))


def test_the_loop_is_drawn_of_the_slowest_motion():
    d = found()
    for joint in JOINTS:
        one = d.curves[joint].assign(speed=velocity(d.curves[joint]) ** 2).groupby("motion")
        assert slowest(d.curves[joint]) == one["speed"].mean().idxmin()


def test_the_gap_of_a_lag_falls_with_velocity_and_goes():
    figure = plot_gap_against(found())
    speed, before = (figure.axes[3].lines[1].get_data()[k] for k in range(2))  # joint_3, against velocity: medians
    after = figure.axes[3].lines[3].get_ydata()
    slope = np.polyfit(speed, before, 1)[0]
    assert slope == pytest.approx(-80.0, abs=11.0)  # mrad per rad/s: ms, within half a step of the held command
    assert np.abs(after).max() < 4e3 * COUNT


def test_a_loop_is_as_high_as_the_friction_is_wide():
    axes = plot_hysteresis(found()).axes[0]
    assert np.ptp(axes.lines[0].get_ydata()) > 2.0 * 12.0  # mrad: twice the half width


def test_figures_are_drawn(tmp_path):
    figure = plot_hysteresis(found())
    figure.savefig(tmp_path / "loop.png")
    assert np.ptp(imread(tmp_path / "loop.png")) > 0.5
