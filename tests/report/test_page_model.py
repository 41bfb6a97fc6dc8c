"""The page's section on the model: frames in mm and degrees, correlations."""

import re
from html import unescape
from types import SimpleNamespace

import numpy as np
import pytest

import thermal_robot as tr
from thermal_robot.report.page import correlations_table, frames_table, model_section


@pytest.fixture(scope="module")
def diagnosis():
    return tr.diagnose(tr.demo_campaign())


def rows(table):
    """Rows of a table, as the plain texts of their cells."""
    found = [re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row) for row in table.split("<tr")[1:]]
    return [[unescape(re.sub(r"<[^>]+>", "", cell)) for cell in row] for row in found]


def test_frames_are_those_of_the_model(diagnosis):
    _, base, tool = rows(frames_table(diagnosis))
    told = [float(cell.replace("\N{MINUS SIGN}", "-")) for cell in base[1:]]
    np.testing.assert_allclose(told[:3], 1e3 * diagnosis.model.frames.base[:3, 3], atol=5e-4)
    roll, pitch, yaw = np.radians(told[3:])
    turn = [[[1, 0, 0], [0, np.cos(roll), -np.sin(roll)], [0, np.sin(roll), np.cos(roll)]]]
    turn += [[[np.cos(pitch), 0, np.sin(pitch)], [0, 1, 0], [-np.sin(pitch), 0, np.cos(pitch)]]]
    turn += [[[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]]]
    np.testing.assert_allclose(np.array(turn[2]) @ turn[1] @ turn[0], diagnosis.model.frames.base[:3, :3], atol=2e-6)
    assert tool[4:] == ["", "", ""], "positions say nothing of how the target is turned on the tool"


@pytest.mark.parametrize("value", [-1e-7, -0.0, 0.0])
def test_what_rounds_to_zero_has_no_sign(diagnosis, value):
    frames = diagnosis.frames.copy()
    frames.loc["base", ["x", "roll"]] = value
    told = rows(frames_table(SimpleNamespace(frames=frames)))[1]
    assert (told[1], told[4]) == ("0.000", "0.0000")


def test_correlations_are_the_strongest_and_the_others_are_counted(diagnosis):
    table = correlations_table(diagnosis)
    covariance = diagnosis.covariance.to_numpy()
    std = np.sqrt(covariance.diagonal())
    sizes = np.abs((covariance / np.outer(std, std))[np.triu_indices(len(std), 1)])
    strong = int((sizes > 0.5).sum())
    shown = rows(table)[1:]
    assert len(shown) == min(strong, 10)
    if shown:
        assert abs(float(shown[0][2].replace("\N{MINUS SIGN}", "-"))) == pytest.approx(sizes.max(), abs=0.005)
        assert f"{len(sizes) - strong} correlations within" in table
    else:
        assert "No two parameters" in table


def test_without_a_fit_there_is_no_section(case, diagnosis):
    assert "<h2>The model</h2>" in "".join(model_section(diagnosis))
    assert "".join(model_section(case("found"))) == ""
