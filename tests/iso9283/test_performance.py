"""The result as a dict, a data frame and a text."""

import json

import numpy as np
import pytest
from clouds import ELEVEN, cell

from thermal_robot.iso9283 import performance
from thermal_robot.observations import observe

OFF = np.array([3e-4, 4e-4, 1e-4])
NUMBER, CYCLE = np.tile(np.arange(4), 20), np.repeat(np.arange(20), 4) % 10


@pytest.fixture(scope="module")
def found(rv_m2):
    """Four poses and their corrections, three of them points of a path, from two directions, in two sessions."""
    campaign = cell(
        rv_m2,
        NUMBER,
        [3e-4, 4e-4, 0] + 0.01 * ELEVEN[CYCLE],
        turn=np.zeros(3),
        covariates={"approach.joint_1": np.where(CYCLE % 2, 1.0, -1.0)},
        labels={
            "path": np.array(["", "seam", "seam", "seam"])[NUMBER],
            "session": np.repeat(["a", "b"], 40),
        },
        noise_position=1e-5,
    )
    return performance(campaign, predicted=(observe(campaign).predicted_position + OFF, None))


def test_the_frame_has_a_row_for_each_figure(found):
    frame = found.to_frame().set_index(["label", "criterion"])
    assert frame.index.is_unique
    value, unit = frame["value"], frame["unit"]
    assert value["P1", "AP_p"] == pytest.approx(5e-4)
    assert value["P1", "AP_y"] == pytest.approx(4e-4)
    assert value["P1", "AP_p corrected"] == pytest.approx(1e-4)
    assert value["seam", "AT_p"] == pytest.approx(5e-4)
    assert value["seam", "AT_p corrected"] == pytest.approx(1e-4)
    assert value["P1", "dRP_l"] == pytest.approx(0, abs=1e-12)
    assert {"RP_l", "RP_a", "vAP_p", "vAP_c", "dAP_p", "dAP_b", "shift"} <= {c for p, c in frame.index if p == "P1"}
    assert {"AT_a", "RT_p", "RT_c"} <= {c for p, c in frame.index if p == "seam"}
    assert unit["P1", "RP_l"] == "m"
    assert unit["P1", "RP_b"] == unit["seam", "AT_a"] == "rad"
    assert frame["cycles"]["P1", "RP_l"] == 20
    assert frame["cycles"]["P1", "dRP_l"] == 10
    told = frame["ci95_low"].notna()
    assert {criterion for _, criterion in frame.index[told]} == {"RP_l"}
    assert (frame["ci95_low"][told] < frame["ci95_high"][told]).all()


def test_json_holds_the_same_figures(found):
    plain = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert plain["schema"] == "thermal-robot/iso9283/1"
    (pose,) = plain["poses"]
    assert pose["accuracy"]["position"] == pytest.approx(5e-4)
    assert pose["corrected"]["axes"] == pytest.approx([0, 0, -1e-4], abs=1e-9)
    assert pose["repeatability"]["position"] == found.repeatability
    assert plain["paths"][0]["repeatability"]["position"] == found.paths[0].repeatability.position
    assert plain["instrument"] == pytest.approx(3.616e-5, rel=1e-3)


def test_the_text_tells_all_of_it_in_lines_that_fit(found):
    text = str(found)
    assert [line for line in text.splitlines() if len(line) > 96] == []
    assert text.startswith("Performance criteria of ISO 9283:1998: rv_m2, tool0; 1 pose of 20 cycles")
    for part in ("POSES: AP and RP", "POSES: angles", "DIRECTIONS", "DRIFT", "PATHS", "  - Fewer cycles"):
        assert f"\n\n{part}" in text or f"\n{part}" in text
    assert "AP_p 0.500 mm; corrected 0.100 mm; RP_l 0." in found.summary
    assert "AT_p 0.500 mm" in found.summary
