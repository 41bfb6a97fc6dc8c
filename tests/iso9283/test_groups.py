"""Which rows are repeats, directions and times."""

from dataclasses import replace

import numpy as np
import pytest
from clouds import cell

from thermal_robot.campaign.read import arrived
from thermal_robot.iso9283.groups import directions, repeats, times


def told(groups):
    return [(g.label, g.path, g.rows.tolist()) for g in groups]


def test_rows_of_one_label_or_else_of_one_command_are_one_pose_in_the_sequence_of_measurement(rv_m2):
    campaign = cell(rv_m2, [0, 1, 0, 2, 1, 0], covariates={"time": np.array([5.0, 4, 3, 2, 1, 0])})
    groups, alone = repeats(campaign)
    assert told(groups) == [("P1", "", [5, 2, 0]), ("P2", "", [4, 1])]
    assert alone == 1
    groups, alone = repeats(cell(rv_m2, [0, 1, 0, 2, 1]).drop_covariate("pose"))
    assert told(groups) == [("row 2", "", [0, 2]), ("row 3", "", [1, 4])]
    assert alone == 1
    without = cell(rv_m2, [0, 0, 0], labels={"pose": np.array(["", "", "x"])})
    assert repeats(without) == ([], 3)


def test_points_of_paths_and_poses_at_rest_never_mix(rv_m2):
    path = np.array(["a", "a", "b", "b", "", ""])
    for campaign in (cell(rv_m2, [0] * 6, labels={"path": path}), cell(rv_m2, [0] * 5 + [1], labels={"path": path})):
        for one in (campaign, campaign.drop_covariate("pose")):
            groups, _ = repeats(one)
            assert [(g.path, g.rows.tolist()) for g in groups[:2]] == [("a", [0, 1]), ("b", [2, 3])]
            assert {g.path for g in groups[2:]} <= {""}


def test_directions_are_the_same_sign_in_every_joint(rv_m2):
    rows = np.arange(6)
    signs = {"approach.joint_1": [1, 1, -1, -1, 0, 1], "approach.joint_2": [1, 1, 1, 1, 1, -1]}
    still = {f"approach.joint_{k}": [0] * 6 for k in (3, 4)}  # joints that never moved tell nothing
    covariates = {name: np.array(values, dtype=float) for name, values in (signs | still).items()}
    found = directions(cell(rv_m2, [0] * 6, covariates=covariates), rows)
    assert sorted(part.tolist() for part in found) == [[0, 1], [2, 3], [5]]
    assert directions(cell(rv_m2, [0] * 6), rows) is None
    nothing = {name: np.zeros(6) for name in signs}
    assert directions(cell(rv_m2, [0] * 6, covariates=nothing), rows) is None
    never = {"approach.joint_1": np.array([1.0, 0] * 3), "approach.joint_2": np.array([0, 1.0] * 3)}
    assert directions(cell(rv_m2, [0] * 6, covariates=never), rows) is None


def test_nobody_knows_from_where_a_pose_is_repeated_in_a_row(rv_m2):
    clock = {"covariates": {"time": np.arange(12.0)}}
    in_a_row = arrived(cell(rv_m2, np.repeat([0, 1], 6), **clock))
    assert in_a_row.derived
    assert directions(in_a_row, np.arange(6)) is directions(in_a_row, np.arange(6, 12)) is None
    # in turns, the order of the rows tells it; what was recorded is believed
    in_turns = arrived(cell(rv_m2, [0, 1] * 6, **clock))
    assert [len(part) for part in directions(in_turns, np.arange(1, 12, 2))] == [6]
    written = replace(in_a_row, derived=())
    assert directions(written, np.arange(6, 12)) is None
    recorded = {name: values for name, values in in_a_row.covariates.items()}
    recorded |= {name: np.where(values == 0.0, 1.0, values) for name, values in recorded.items() if name != "time"}
    assert [len(part) for part in directions(replace(written, covariates=recorded), np.arange(6, 12))] == [6]


@pytest.mark.parametrize(("cycles", "parts"), [(19, []), (20, [10, 10]), (30, [10, 10, 10]), (400, [50] * 8)])
def test_the_clock_is_divided_so_that_each_time_has_ten_cycles(rv_m2, cycles, parts):
    campaign = cell(rv_m2, [0] * cycles, covariates={"time": 60.0 * np.arange(cycles)})
    found = times(campaign, np.arange(cycles))
    assert [len(part) for part in found] == parts
    assert np.array_equal(np.concatenate([*found, []]), np.arange(sum(parts)))


def test_times_without_a_clock_or_with_one_that_stands_are_none(rv_m2):
    assert times(cell(rv_m2, [0] * 40), np.arange(40)) == []
    assert times(cell(rv_m2, [0] * 40, covariates={"time": np.ones(40)}), np.arange(40)) == []


def test_sessions_are_times_first_to_last(rv_m2):
    session = np.array(["late", "late", "early", "early", "alone", ""])
    campaign = cell(rv_m2, [0] * 6, labels={"session": session})
    assert [part.tolist() for part in times(campaign, np.array([2, 3, 0, 1, 4, 5]))] == [[2, 3], [0, 1]]
    assert times(campaign, np.array([0, 1, 4])) == []
