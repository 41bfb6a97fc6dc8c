"""Tables for the reader: what stands where, and how wide."""

from dataclasses import replace

import pytest

from thermal_robot.iso9283 import Accuracy, AlongPath, Drift, PathCriteria, PoseCriteria, Repeatability, Variation
from thermal_robot.iso9283.performance import (
    MOST,
    Performance,
    drifts,
    lines,
    millimetres,
    path_turns,
    paths,
    poses,
    turns,
    variations,
    wrapped,
)

POSE = PoseCriteria("P1", 30, 1, Repeatability(1.1e-5, (9e-6, 1.4e-5)), Accuracy(7e-4, (2e-4, -3e-4, 6e-4)))
TURNED = replace(
    POSE,
    repeatability=Repeatability(1e-5, None, (1e-4, 2e-4, 3e-4)),
    accuracy=Accuracy(7e-4, (0.0, 0.0, 7e-4), (1e-3, -2e-3, 4e-3)),
    variation=Variation(2.5e-4, (1e-4, 2e-4, 3e-4)),
    variation_cycles=(30, 28, 30),
    drift=Drift(1e-4, 2e-5, 3e-4),
    drift_cycles=(10, 11),
)


def cells(line):
    return line.split()


def test_positions_stand_in_millimetres_under_their_names():
    heading, head, row = lines(poses([POSE]))
    assert "mm" in heading
    assert cells(head) == ["pose", "n", "dir", "AP_p", "AP_x", "AP_y", "AP_z", "RP_l", "low", "high"]
    assert cells(row) == ["P1", "30", "1", "0.700", "0.200", "−0.300", "0.600", "0.011", "0.009", "0.014"]
    assert len(head) == len(row)


def test_what_is_not_known_is_a_dash_and_a_correction_has_its_column():
    bare = PoseCriteria("far corner", 2, None, Repeatability(1.1e-5))
    corrected = replace(POSE, corrected=Accuracy(6e-5, (0.0, 0.0, 6e-5)))
    _, head, first, second = lines(poses([bare, corrected]))
    assert first.split()[-9:] == ["–", "–", "–", "–", "–", "–", "0.011", "–", "–"]
    assert cells(head)[4] == "corrected"
    assert cells(second)[3:5] == ["0.700", "0.060"]


def test_angles_variation_and_drift_have_tables_of_their_own():
    assert all(lines(t) == [] for t in (turns([POSE]), variations([POSE]), drifts([POSE]), paths([]), poses([])))
    assert cells(lines(turns([TURNED]))[2]) == ["P1", "1.000", "−2.000", "4.000", "0.100", "0.200", "0.300"]
    assert cells(lines(variations([POSE, TURNED]))[2]) == ["P1", "3", "28", "0.250", "0.100", "0.200", "0.300"]
    assert cells(lines(drifts([TURNED]))[2]) == ["P1", "2", "10", "0.100", "0.020", "0.300"]


def test_paths_are_told_by_their_worst_point():
    path = PathCriteria("seam", 20, 10, AlongPath(2e-4), AlongPath(1e-3), AlongPath(3e-4))
    assert cells(lines(paths([path]))[1]) == ["path", "points", "n", "AT_p", "corrected", "RT_p"]
    assert cells(lines(paths([path]))[2]) == ["seam", "20", "10", "1.000", "0.300", "0.200"]
    assert lines(path_turns([path])) == []
    turned = replace(path, accuracy=AlongPath(1e-3, (1e-3, 2e-3, 3e-3)), repeatability=AlongPath(2e-4, (4e-3,) * 3))
    assert cells(lines(path_turns([turned]))[2])[-6:] == ["1.000", "2.000", "3.000", "4.000", "4.000", "4.000"]


def test_small_figures_keep_two_digits():
    fine = replace(POSE, accuracy=None, repeatability=Repeatability(2.3e-8, (2e-8, 3e-8)))
    assert cells(lines(poses([fine]))[2])[-3:] == ["0.000023", "0.000020", "0.000030"]
    assert millimetres(7.01e-4) == "0.701 mm"
    assert millimetres(4.2e-6) == "0.0042 mm"


def test_zero_to_rounding_asks_for_no_decimals_and_a_long_name_is_cut():
    exact = replace(POSE, pose="x" * 50, accuracy=Accuracy(7e-4, (7e-4, 1e-17, -1e-17)))
    row = cells(lines(poses([exact]))[2])
    assert row[0] == "x" * 19 + "…"
    assert row[3:6] == ["0.700", "0.700", "0.000"]


def test_a_long_table_ends_with_how_many_are_left_out():
    printed = lines(poses([replace(POSE, pose=f"P{k}") for k in range(MOST + 7)]))
    assert len(printed) == MOST + 3
    assert printed[-1].strip().startswith("and 7 more")


@pytest.mark.parametrize(
    ("counts", "said"),
    [([30], "1 pose of 30 cycles"), ([30, 30], "2 poses of 30 "), ([5, 30, 12], "3 poses of 5 to 30 ")],
)
def test_cycles_are_told_beside_those_of_the_standard(counts, said):
    told = extent([replace(POSE, cycles=count) for count in counts])
    assert told.startswith(said)
    assert told.endswith("(the standard: 30)")
    assert extent([]) == ""
    assert extent([], [PathCriteria("seam", 20, 9, AlongPath(2e-4))]) == "1 path of 9 cycles (the standard: 10)"


def extent(at_rest, along=()):
    return Performance("", "", "", tuple(at_rest), tuple(along)).extent


def test_sentences_are_broken_at_the_width():
    assert all(len(line) <= 96 for line in wrapped("word " * 60, "  - ").splitlines())
