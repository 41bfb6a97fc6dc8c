"""The result as a dict, a data frame and tables: what stands where, and how wide."""

import json
from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest
from clouds import ELEVEN, cell

from thermal_robot.iso9283 import (
    Accuracy,
    AlongPath,
    Drift,
    PathCriteria,
    Performance,
    PoseCriteria,
    Repeatability,
    Variation,
    performance,
)
from thermal_robot.iso9283.performance import MOST
from thermal_robot.observations import observe

OFF = np.array([3e-4, 4e-4, 1e-4])
NUMBER, CYCLE = np.tile(np.arange(4), 20), np.repeat(np.arange(20), 4) % 10

POSE = PoseCriteria("P1", 30, 1, Repeatability(1.1e-5, (9e-6, 1.4e-5)), Accuracy(7e-4, (2e-4, -3e-4, 6e-4)))
CORRECTED = replace(POSE, corrected=Accuracy(6e-5, (0.0, 0.0, 6e-5)))
BARE = PoseCriteria("far corner", 2, None, Repeatability(1.1e-5))
TURNED = replace(
    POSE,
    repeatability=Repeatability(1e-5, None, (1e-4, 2e-4, 3e-4)),
    accuracy=Accuracy(7e-4, (0.0, 0.0, 7e-4), (1e-3, -2e-3, 4e-3)),
    variation=Variation(2.5e-4, (1e-4, 2e-4, 3e-4)),
    variation_cycles=(30, 28, 30),
    drift=Drift(1e-4, 2e-5, 3e-4),
    drift_cycles=(10, 11),
)
FINE = replace(POSE, accuracy=None, repeatability=Repeatability(2.3e-8, (2e-8, 3e-8)))
EXACT = replace(POSE, pose="x" * 50, accuracy=Accuracy(7e-4, (7e-4, 1e-17, -1e-17)))
PATH = PathCriteria("seam", 20, 10, AlongPath(2e-4), AlongPath(1e-3), AlongPath(3e-4))
TURNED_PATH = replace(PATH, accuracy=AlongPath(1e-3, (1e-3, 2e-3, 3e-3)), repeatability=AlongPath(2e-4, (4e-3,) * 3))


def of(poses, paths=()):
    return Performance("", "", "", tuple(poses), tuple(paths))


def shown(*poses, paths=()):
    """Words of the heading, head and rows of each table."""
    return [[line.split() for line in str(table).splitlines()] for table in of(poses, paths).tables]


def test_positions_stand_in_millimetres_under_their_names():
    ((heading, head, row),) = shown(POSE)
    assert "mm;" in heading
    assert head == ["pose", "n", "dir", "AP_p", "AP_x", "AP_y", "AP_z", "RP_l", "low", "high"]
    assert row == ["P1", "30", "1", "0.700", "0.200", "−0.300", "0.600", "0.011", "0.009", "0.014"]
    _, *lines = str(of([POSE, BARE]).tables[0]).splitlines()
    assert len({len(line) for line in lines}) == 1
    ((_, head, first, second),) = shown(BARE, CORRECTED)
    assert first[-9:] == ["–", "–", "–", "–", "–", "–", "0.011", "–", "–"]
    assert (head[4], second[3:5]) == ("corrected", ["0.700", "0.060"])


def test_angles_variation_drift_and_paths_have_tables_of_their_own():
    positions, turns, variations, drifts = shown(POSE, TURNED)
    assert len(positions) == 4
    assert turns[2] == ["P1", "1.000", "−2.000", "4.000", "0.100", "0.200", "0.300"]
    assert variations[2] == ["P1", "3", "28", "0.250", "0.100", "0.200", "0.300"]
    assert drifts[1:] == [
        ["pose", "times", "n", "dAP_p", "dRP_l", "shift"],
        ["P1", "2", "10", "0.100", "0.020", "0.300"],
    ]
    titles = [table.heading for table in of([replace(TURNED, variation=Variation(1e-4))]).tables]
    assert [title for title in titles if "vAP in mm;" in title]
    assert [table.heading for table in of([TURNED]).tables if "vAP in mm and mrad;" in table.heading]
    ((_, head, row),) = shown(paths=[PATH])
    assert head == ["path", "points", "n", "AT_p", "corrected", "RT_p"]
    assert row == ["seam", "20", "10", "1.000", "0.300", "0.200"]
    _, turns = shown(paths=[TURNED_PATH])
    assert turns[2][-6:] == ["1.000", "2.000", "3.000", "4.000", "4.000", "4.000"]


def test_small_figures_keep_two_digits_and_rounding_asks_for_none():
    assert shown(FINE)[0][2][-3:] == ["0.000023", "0.000020", "0.000030"]
    row = shown(EXACT)[0][2]
    assert (row[0], row[3:6]) == ("x" * 19 + "…", ["0.700", "0.700", "0.000"])
    assert "RP_l 0.0042 mm" in of([replace(POSE, repeatability=Repeatability(4.2e-6))]).summary


def test_a_long_table_ends_with_how_many_are_left_out():
    printed = str(of([replace(POSE, pose=f"P{k}") for k in range(MOST + 7)]).tables[0]).splitlines()
    assert len(printed) == MOST + 3
    assert printed[-1] == "  and 7 more, in the JSON and the CSV"


@pytest.mark.parametrize(
    ("counts", "paths", "said"),
    [
        ([30], [], "1 pose of 30 cycles (the standard: 30)"),
        ([30, 30], [], "2 poses of 30 cycles (the standard: 30)"),
        ([5, 30, 12], [], "3 poses of 5 to 30 cycles (the standard: 30)"),
        ([], [PATH], "1 path of 10 cycles (the standard: 10)"),
        ([], [], ""),
    ],
)
def test_cycles_are_told_beside_those_of_the_standard(counts, paths, said):
    assert of([replace(POSE, cycles=count) for count in counts], paths).extent == said


@pytest.fixture(scope="module")
def found(rv_m2):
    """Four poses and their corrections, three of them points of a path, from two directions, in two sessions."""
    labels = {"path": np.array(["", "seam", "seam", "seam"])[NUMBER], "session": np.repeat(["a", "b"], 40)}
    came = {"approach.joint_1": np.where(CYCLE % 2, 1.0, -1.0)}
    shift = [3e-4, 4e-4, 0] + 0.01 * ELEVEN[CYCLE]
    campaign = cell(rv_m2, NUMBER, shift, turn=np.zeros(3), covariates=came, labels=labels, noise_position=1e-5)
    return performance(campaign, predicted=(observe(campaign).predicted_position + OFF, None))


def test_the_frame_has_a_row_for_each_figure(found):
    frame = found.to_frame().set_index(["label", "criterion"])
    assert frame.index.is_unique
    value, unit, cycles = frame["value"], frame["unit"], frame["cycles"]
    expected = {("P1", "AP_p"): 5e-4, ("P1", "AP_y"): 4e-4, ("P1", "AP_p corrected"): 1e-4, ("P1", "dRP_l"): 0.0}
    expected |= {("seam", "AT_p"): 5e-4, ("seam", "AT_p corrected"): 1e-4}
    assert {at: value[at] for at in expected} == pytest.approx(expected, abs=1e-12)
    assert {"RP_l", "RP_a", "vAP_p", "vAP_c", "dAP_p", "dAP_b", "shift"} <= {c for p, c in frame.index if p == "P1"}
    assert {"AT_a", "RT_p", "RT_c"} <= {c for p, c in frame.index if p == "seam"}
    assert (unit["P1", "RP_l"], unit["P1", "shift"], unit["P1", "RP_b"], unit["seam", "AT_a"]) == (
        "m",
        "m",
        "rad",
        "rad",
    )
    assert (cycles["P1", "RP_l"], cycles["P1", "dRP_l"]) == (20, 10)
    told = frame["ci95_low"].notna()
    assert {criterion for _, criterion in frame.index[told]} == {"RP_l"}
    assert (frame["ci95_low"][told] < frame["ci95_high"][told]).all()


def test_json_holds_the_same_figures(found):
    with pytest.raises(FrozenInstanceError):
        found.poses[0].cycles = 31
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
        assert f"\n{part}" in text
    assert "AP_p 0.500 mm; corrected 0.100 mm; RP_l 0." in found.summary
    assert "AT_p 0.500 mm" in found.summary
