"""From a campaign to criteria that were computed by hand: frames, predictions, directions, times, notes."""

from dataclasses import replace

import numpy as np
import pytest
from clouds import ELEVEN, TURNS, cell
from simulate import random_motion

from thermal_robot import campaign_from_table
from thermal_robot.campaign import Units, read_campaign, write_campaign
from thermal_robot.campaign.read import arrived
from thermal_robot.errors import CampaignError
from thermal_robot.iso9283 import performance
from thermal_robot.iso9283.groups import directions, repeats, times
from thermal_robot.observations import Frames, observe

OFF = 1e-3 * np.array([[1, 2, 2], [2, 3, 6], [0, 3, 4], [0, 0, 0], [8, 0, 0]])
"""Five poses 3, 7, 5, 0 and 8 mm away from their commands."""
NUMBER = np.tile(np.arange(5), 10)
CYCLE = np.repeat(np.arange(10), 5)


@pytest.fixture(scope="module")
def by_hand(rv_m2):
    """Five poses, ten cycles: AP as :data:`OFF`, RP_l 11, 22, 33, 44 and 55 mm, RP_c 6 mrad."""
    shift = OFF[NUMBER] + (1 + NUMBER)[:, None] * ELEVEN[CYCLE]
    return cell(rv_m2, NUMBER, shift, turn=np.outer(TURNS[CYCLE], [0, 0, 1.0]))


def test_accuracy_and_repeatability_of_every_pose(by_hand):
    found = performance(by_hand)
    assert [p.pose for p in found.poses] == ["P1", "P2", "P3", "P4", "P5"]
    assert [p.cycles for p in found.poses] == [10] * 5
    assert [p.accuracy.position for p in found.poses] == pytest.approx([3e-3, 7e-3, 5e-3, 0, 8e-3], abs=1e-12)
    assert found.poses[1].accuracy.axes == pytest.approx((2e-3, 3e-3, 6e-3))
    assert [p.repeatability.position for p in found.poses] == pytest.approx([11e-3, 22e-3, 33e-3, 44e-3, 55e-3])
    for pose in found.poses:
        assert pose.accuracy.angles == pytest.approx((0, 0, 0), abs=1e-8)
        assert pose.repeatability.angles == pytest.approx((0, 0, 6e-3), abs=1e-8)
        assert (pose.directions, pose.variation, pose.drift, pose.corrected) == (None, None, None, None)
    assert (found.accuracy, found.repeatability, found.corrected) == pytest.approx((8e-3, 55e-3, None))
    assert (found.registered, found.paths, found.instrument) == ((), (), None)


def test_the_place_of_the_instrument_changes_nothing(rv_m2):
    rng = np.random.default_rng(5)
    shift = (OFF[NUMBER] + ELEVEN[CYCLE]) * 0.1
    turn = np.outer(TURNS[CYCLE], [0.3, 0, 1.0])
    tables = []
    for base in (np.eye(4), random_motion(rng, 3.0), random_motion(rng, 3.0)):
        campaign = cell(rv_m2, NUMBER, shift, frames=Frames(base, np.eye(4)), turn=turn, known=False)
        tables.append(performance(campaign).to_frame())
    assert tables[0]["value"].abs().max() > 1e-3
    for table in tables[1:]:
        np.testing.assert_allclose(table["value"], tables[0]["value"], rtol=1e-5, atol=1e-9)
        np.testing.assert_allclose(table["ci95_high"], tables[0]["ci95_high"], rtol=1e-5)


def test_registration_changes_accuracy_and_not_repeatability(by_hand):
    known, fitted = performance(by_hand), performance(replace(by_hand, base_known=False, tool_known=False))
    assert fitted.registered == ("base", "tool")
    for one, other in zip(known.poses, fitted.poses, strict=True):
        assert other.repeatability.position == pytest.approx(one.repeatability.position)
    rms = [np.sqrt(np.mean([p.accuracy.position**2 for p in found.poses])) for found in (known, fitted)]
    assert rms[1] < 0.8 * rms[0]


def test_known_frames_are_taken_as_they_stand_and_axes_are_those_of_the_base(rv_m2):
    frames, turn = Frames(random_motion(np.random.default_rng(1), 3.0), np.eye(4)), (2e-3, 0, 3e-3)
    campaign = cell(rv_m2, np.repeat(np.arange(5), 2), OFF[0], frames=frames, turn=turn)
    found = performance(campaign, frames=frames)
    assert found.registered == ()
    for pose in found.poses:
        assert pose.accuracy.axes == pytest.approx(tuple(OFF[0]))
        assert pose.accuracy.angles == pytest.approx(turn, abs=1e-8)


def test_unknown_frames_are_fitted_and_take_up_what_is_common(rv_m2):
    frames = Frames(random_motion(np.random.default_rng(2), 3.0), random_motion(np.random.default_rng(3), 0.1))
    twice = np.repeat(np.arange(8), 2)
    campaign = cell(rv_m2, twice, OFF[0], frames=frames, turn=np.zeros(3), known=False)
    found = performance(campaign)
    assert found.registered == ("base", "tool")
    assert "12 unknowns, 48 figures" in " ".join(found.notes)
    assert found.accuracy < 1e-7
    assert performance(replace(campaign, tool_known=True)).registered == ("base",)


@pytest.mark.parametrize(("poses", "told"), [(3, False), (4, True)])
def test_frames_that_take_up_all_figures_leave_no_accuracy(rv_m2, poses, told):
    """Nine unknowns: three positions, however often, are nine figures."""
    campaign = cell(rv_m2, np.repeat(np.arange(poses), 4), np.random.default_rng(0).normal(size=(4 * poses, 3)) * 1e-4)
    found = performance(replace(campaign, base_known=False, tool_known=False))
    assert (found.accuracy is not None) == told


def test_a_prediction_is_compared_where_it_is_finite(rv_m2):
    campaign = cell(rv_m2, [0, 0, 1, 1], OFF[0], turn=np.zeros(3))
    nominal = observe(campaign).predicted_position
    nominal[[1, 2, 3]] = np.nan
    first, second = performance(campaign, predicted=(nominal, campaign.orientation)).poses
    assert first.corrected.axes == pytest.approx(tuple(OFF[0]))
    assert first.corrected.angles == pytest.approx((0, 0, 0), abs=1e-9)
    assert second.corrected is None


@pytest.mark.parametrize("wrong", [np.zeros((2, 3)), (np.zeros((2, 3)), None), (np.zeros((3, 3)), np.zeros((2, 4)))])
def test_predictions_of_other_rows_are_refused(rv_m2, wrong):
    with pytest.raises(CampaignError, match="predict"):
        performance(cell(rv_m2, [0, 0, 1]), predicted=wrong)


def test_a_model_that_knows_half_leaves_half(by_hand):
    found = observe(by_hand)
    predicted = found.predicted_position + OFF[NUMBER] / 2
    after = performance(by_hand, predicted=(predicted, None))
    assert [p.corrected.position for p in after.poses] == pytest.approx([1.5e-3, 3.5e-3, 2.5e-3, 0, 4e-3], abs=1e-12)
    assert after.corrected == pytest.approx(4e-3)
    assert all(p.corrected.angles is None for p in after.poses)
    assert after.poses[0].accuracy == performance(by_hand).poses[0].accuracy


def test_directions_are_compared_where_each_was_taken_twice(rv_m2):
    """From one side 3 mm off, from the other 4 mm across: 5 mm apart. One row came from a third."""
    sides = np.array([0, 1] * 5 + [2])
    shift = np.array([[3e-3, 0, 0], [0, 4e-3, 0], [0.5, 0, 0]])[sides]
    signs = {"approach.joint_1": np.array([1.0, -1, -1])[sides], "approach.joint_2": np.array([1.0, 1, -1])[sides]}
    pose = performance(cell(rv_m2, [0] * 11, shift, covariates=signs)).poses[0]
    assert pose.directions == 3
    assert pose.variation.position == pytest.approx(5e-3)
    assert pose.variation_cycles == (5, 5)
    one_way = {name: np.ones(11) for name in signs}
    alone = performance(cell(rv_m2, [0] * 11, shift, covariates=one_way)).poses[0]
    assert (alone.directions, alone.variation, alone.variation_cycles) == (1, None, ())


def test_drift_over_sessions(rv_m2):
    """AP 3 mm and RP 11 mm in the morning, 8 mm and 22 mm at noon, 5 mm and 5.5 mm in the evening."""
    at = np.repeat([0, 1, 2], 10)
    shift = OFF[[0, 4, 2]][at] + np.array([1, 2, 0.5])[at][:, None] * ELEVEN[np.tile(np.arange(10), 3)]
    session = {"session": np.array(["morning", "noon", "evening"])[at]}
    pose = performance(cell(rv_m2, [0] * 30, shift, labels=session)).poses[0]
    assert pose.drift_cycles == (10, 10, 10)
    assert pose.drift.accuracy == pytest.approx(5e-3)
    assert pose.drift.repeatability == pytest.approx(11e-3)
    assert pose.drift.shift == pytest.approx(1e-3 * np.sqrt(57))


def test_a_path_is_as_bad_as_its_worst_point(rv_m2):
    path = {"path": np.array(["seam"] * 50)}
    shift = OFF[NUMBER] + (5 - NUMBER)[:, None] * ELEVEN[CYCLE]
    campaign = cell(rv_m2, NUMBER, shift, labels=path)
    found = performance(campaign, predicted=(observe(campaign).predicted_position + OFF[4], None))
    (seam,) = found.paths
    assert (seam.path, seam.points, seam.cycles, found.poses) == ("seam", 5, 10, ())
    assert seam.accuracy.position == pytest.approx(8e-3)
    assert seam.repeatability.position == pytest.approx(55e-3)
    assert seam.corrected.position == pytest.approx(1e-3 * np.sqrt(89))  # of the third
    assert (found.accuracy, found.repeatability) == (None, None)
    assert performance(campaign.take(np.arange(48))).paths[0].cycles == 9


def test_a_campaign_without_repeats_is_told_which_column_makes_them(rv_m2):
    with pytest.raises(CampaignError, match="column 'pose': no pose is repeated; found 5 rows") as error:
        performance(cell(rv_m2, np.arange(5)))
    assert "\n" not in str(error.value)
    bare = cell(rv_m2, [0, 0, 1])
    with pytest.raises(CampaignError, match="nothing was measured"):
        performance(replace(bare, position=None))
    with pytest.raises(CampaignError, match="a campaign"):
        performance("campaign.toml")


def test_scatter_of_a_known_size_is_found(rv_m2):
    """Normal scatter of 20 µm per axis: RP_l of endlessly many cycles is 72.3 µm, of 30 cycles 3 % less in the mean."""
    rng = np.random.default_rng(8)
    number = np.tile(np.arange(60), 30)
    campaign = cell(rv_m2, number, 2e-5 * rng.normal(size=(1800, 3)))
    found = [p.repeatability for p in performance(campaign).poses]
    assert np.mean([r.position for r in found]) == pytest.approx(0.97 * 72.3e-6, rel=0.02)
    held = [r.ci95[0] < 72.3e-6 < r.ci95[1] for r in found]
    assert sum(held) >= 53


@pytest.mark.parametrize("poses", [1, 2])
@pytest.mark.parametrize("unit", ["m", "mm", "inch"])
def test_few_poses_tell_repeatability_without_frames(rv_m2, tmp_path, poses, unit):
    """A robot's acceptance test: 30 cycles in a row, the tracker anywhere, the target's place unknown."""
    frames = Frames(random_motion(np.random.default_rng(1), 3.0), random_motion(np.random.default_rng(2), 0.1))
    scatter = np.random.default_rng(3).normal(0.0, 3e-5, (30 * poses, 3))
    clock = {"time": 10.0 * np.arange(30 * poses)}
    known = cell(rv_m2, np.repeat(np.arange(poses), 30), scatter, frames=frames, covariates=clock)
    unknown = replace(known, base_known=False, tool_known=False, units=Units("deg", unit))
    found = performance(read_campaign(write_campaign(unknown, tmp_path)))
    for pose, expected in zip(found.poses, performance(known, frames=frames).poses, strict=True):
        assert (pose.cycles, pose.accuracy, pose.directions) == (30, None, None)
        assert pose.repeatability.position == pytest.approx(expected.repeatability.position, rel=1e-6)
    assert any("AP and AT cannot be told" in note for note in found.notes)
    assert all(row[2] == "–" for row in found.tables[0].rows)


def test_several_targets_tell_repeatability_of_two_poses(rv_m2, tmp_path):
    scatter = np.random.default_rng(3).normal(0.0, 3e-5, (60, 3))
    one = cell(rv_m2, np.repeat([0, 1], 30), scatter)
    frame, pose = one.to_frame().drop(columns=["x", "y", "z"]), rv_m2.forward(one.q)
    for k, place in enumerate(np.vstack([np.eye(3), -np.eye(3)]) * 0.1, start=1):
        frame[[f"x.{k}", f"y.{k}", f"z.{k}"]] = one.position + pose[:, :3, :3] @ place
    several = campaign_from_table(rv_m2, frame, tool="known")
    assert any('tool = "known" counts as "unknown"' in warning for warning in several.warnings)
    found, expected = performance(several), performance(one)
    for pose, same in zip(found.poses, expected.poses, strict=True):
        assert pose.repeatability.position == pytest.approx(same.repeatability.position, rel=1e-6)
        assert max(pose.repeatability.angles) < 1e-9


SCATTER = 1e-5 * np.random.default_rng(0).normal(size=(200, 3))


def in_turns(robot, poses, rows, **fields):
    """Poses in turn, so many rows in all, as the standard has them."""
    return cell(robot, np.arange(rows) % poses, SCATTER[:rows], **fields)


def test_what_a_reader_must_know_is_noted(rv_m2):
    plain = in_turns(rv_m2, 5, 150)
    assert performance(plain).notes == ()  # it is as the standard has it
    unknown = replace(plain, base_known=False)
    three = replace(in_turns(rv_m2, 3, 90), base_known=False, tool_known=False)
    lone = cell(rv_m2, [*np.arange(90) % 3, 3, 3, 4], SCATTER[:93])
    apart = in_turns(rv_m2, 2, 60)
    apart = replace(apart, q=apart.q + 0.01 * (np.arange(60) == 1)[:, None])
    sides = {"approach.joint_1": np.where(np.arange(60) % 4, 1.0, -1.0)}
    for campaign, *told in (
        (unknown, "the base frame is fitted", "6 unknowns, 15 figures"),
        (replace(unknown, tool_known=False), "base and tool frames are fitted"),
        (three, "AP and AT cannot be told: the unknown base and tool frames have 9 unknowns, and 9"),
        (lone, "Fewer cycles than the standard's 30: 1 of 4 poses.", "1 of 93 rows repeat nothing"),
        (in_turns(rv_m2, 2, 12, labels={"path": np.array(["seam"] * 12)}), "standard's 10: 1 of 1 paths"),
        (in_turns(rv_m2, 2, 60, covariates=sides), "larger than the standard's, which comes from one: 'P1'."),
        (apart, "different joint commands, which counts as scatter: 'P2'"),
        (in_turns(rv_m2, 2, 60, noise_position=1e-5), "alone would show 0.0362 mm"),
    ):
        notes = " ".join(performance(campaign).notes)
        assert all(part in notes for part in told), notes


# ---- which rows are repeats, directions and times


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
