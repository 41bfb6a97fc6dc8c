"""The arm on the page: its values are those of the diagnosis, and no name gets out of them."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

import thermal_robot as tr
from thermal_robot.report import html
from thermal_robot.report.page import arm_figure, as_data, script


@pytest.fixture(scope="module")
def diagnosis():
    return tr.diagnose(tr.demo_campaign())


@pytest.fixture(scope="module")
def values(diagnosis):
    return json.loads(re.search(r'id="tr-arm-data">(.*?)</script>', arm_figure(diagnosis), flags=re.S)[1])


def test_arrows_start_at_the_target_and_are_the_gap(diagnosis, values):
    rows = diagnosis.rows
    shown = np.flatnonzero(~rows.outliers)
    assert len(values["rows"]) == len(shown) == 116
    for row, k in zip(values["rows"], shown, strict=True):
        assert row["told"].startswith(f"row {rows.rows[k]}: gap ")
        np.testing.assert_allclose(row["at"], rows.position[k], atol=5.1e-5)
        np.testing.assert_allclose(row["before"], rows.gap[k, :3], rtol=5.1e-3)
        np.testing.assert_allclose(row["after"], rows.remainder[k, :3], rtol=5.1e-3)


def test_the_last_link_stands_where_the_robot_puts_its_tool(diagnosis, values):
    shown = np.flatnonzero(~diagnosis.rows.outliers)
    expected = diagnosis.model.robot.forward(diagnosis.rows.q[shown])[:, :3]
    drawn = np.array([row["poses"] for row in values["rows"]]).reshape(len(shown), -1, 3, 4)[:, -1]
    np.testing.assert_allclose(drawn, expected, atol=5.1e-5)


def test_places_are_named_with_their_shares(diagnosis, values):
    named = {place["named"] for place in (*values["joints"], *values["links"]) if place["named"]}
    joint = max(diagnosis.where.joints, key=diagnosis.where.joints.get)
    assert f"{joint} {100 * diagnosis.where.joints[joint]:.1f} %" in named
    every = [p["share"] for p in (*values["joints"], *values["links"], values["base"], values["tool"])]
    assert sum(every) == pytest.approx(sum(diagnosis.where.places.values()), abs=1e-3)


def test_base_and_tool_are_places_of_the_drawing(diagnosis):
    where = replace(diagnosis.where, beyond={"base": 0.18, "tool": 0.6, "instrument": 0.031})
    drawn = arm_figure(replace(diagnosis, where=where))
    values = json.loads(re.search(r'id="tr-arm-data">(.*?)</script>', drawn, flags=re.S)[1])
    assert values["base"] == {"share": 0.18, "named": "base 18.0 %"}
    assert values["tool"] == {"share": 0.6, "named": "tool 60.0 %"}
    assert "60.0 % of the gap enters there" in drawn
    assert "At the instrument: 3.1 %, not drawn." in drawn
    assert "instrument" not in arm_figure(diagnosis)


def test_arrows_are_no_longer_than_fits_the_workspace(diagnosis, values):
    extent = np.ptp([row["at"] for row in values["rows"]], axis=0).max()
    typical = np.quantile([np.linalg.norm(row["before"]) for row in values["rows"]], 0.95)
    assert 0.02 * extent < values["factor"] * typical < 0.13 * extent


def test_no_name_ends_the_data():
    told = as_data({"name": "</script><script>alert(1)</script><!-- // &amp;"})
    assert not set("<>&/") & set(re.sub(r"\\/", "", told))
    assert json.loads(told)["name"] == "</script><script>alert(1)</script><!-- // &amp;"


def test_the_page_runs_this_script_alone(diagnosis):
    page = html(diagnosis)
    found = re.findall(r"<script([^>]*)>(.*?)</script>", page, flags=re.S)
    assert [kind for kind, _ in found] == [' type="application/json" id="tr-arm-data"', ""]
    assert found[1][1] == script()
    assert "'unsafe-inline'; img-src data:; script-src 'sha256-" in page
    assert "//" not in script()
    assert len(page) < 3_000_000


def test_nothing_is_drawn_where_no_place_is_known(case):
    assert arm_figure(case("found")) == ""
    assert "script-src 'none'" in html(case("nothing"))
