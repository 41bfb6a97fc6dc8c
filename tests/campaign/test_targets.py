"""Several targets of one pose: their places, the pose that they tell, and how sure it is."""

import numpy as np
import pytest

from thermal_robot.campaign.targets import posed, telling
from thermal_robot.kinematics import exp3, log3, quaternion_to_rotation

PLACES = np.array([[0.1, 0.0, 0.0], [-0.05, 0.08, 0.0], [-0.05, -0.08, 0.02], [0.0, 0.0, 0.12], [0.03, 0.1, -0.1]])
NUMBERS = (1, 2, 3, 4, 7)


def seen(rng, rows=40, targets=5, noise=0.0):
    """Points of targets in rows, and how they were moved."""
    turn, shift = exp3(rng.normal(size=(rows, 3))), rng.normal(size=(rows, 3))
    points = shift[:, None] + PLACES[:targets] @ turn.transpose(0, 2, 1)
    return points + noise * rng.normal(size=points.shape), turn, shift


def without(points, rng, share=0.25):
    """The points of which some were not seen, three at least in each row."""
    points = points.copy()
    for row in points:
        lost = rng.permutation(len(row))[: int(rng.integers(0, len(row) - 2))]
        row[lost[rng.uniform(size=len(lost)) < 4 * share]] = np.nan
    return points


@pytest.mark.parametrize("gaps", [False, True], ids=["all", "some"])
def test_exact_points_tell_places_and_poses(gaps):
    """Up to the one motion that nobody knows: of the common frame on the tool."""
    rng = np.random.default_rng(0)
    points, turn, shift = seen(rng)
    if gaps:
        points = without(points, rng)
    found = posed(NUMBERS, points)
    own = quaternion_to_rotation(found.orientation)
    on_tool = turn.transpose(0, 2, 1) @ own
    np.testing.assert_allclose(on_tool, np.broadcast_to(on_tool[0], on_tool.shape), atol=1e-9)
    at = np.einsum("nba,nb->na", turn, found.position - shift)
    np.testing.assert_allclose(at, np.broadcast_to(PLACES.mean(axis=0), at.shape), atol=1e-10)
    np.testing.assert_allclose(PLACES.mean(axis=0) + found.targets.places @ on_tool[0].T, PLACES, atol=1e-10)
    assert found.deviation.max() < 1e-10


def test_the_common_frame_has_the_principal_axes_and_is_right_handed():
    found = posed(NUMBERS, seen(np.random.default_rng(1))[0])
    places = found.targets.places
    np.testing.assert_allclose(places.mean(axis=0), 0.0, atol=1e-12)
    moments = places.T @ places
    np.testing.assert_allclose(moments - np.diag(np.diag(moments)), 0.0, atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(quaternion_to_rotation(found.orientation)), 1.0)


@pytest.mark.parametrize(
    ("targets", "missing"), [(3, ()), (5, ()), (5, (0, 3))], ids=["three", "five", "three of five"]
)
def test_a_pose_is_off_by_what_is_said_of_it(targets, missing):
    """Each figure, the turn about the frame's own axes."""
    rng, noise, rows = np.random.default_rng(2), 1e-5, 4000
    points, turn, shift = seen(rng, rows, targets, noise)
    points[rows // 2 :, list(missing)] = np.nan
    found = posed(NUMBERS[:targets], points)
    exact = posed(NUMBERS[:targets], shift[:, None] + PLACES[:targets] @ turn.transpose(0, 2, 1))
    turns = [quaternion_to_rotation(each.orientation) for each in (exact, found)]
    # the axes of nearly the same places may be reversed, which is a turn on the tool in common
    common = turns[1][0].T @ turns[0][0]
    common = np.sign(np.round(common))
    off = np.hstack([found.position - exact.position, log3((turns[0] @ common.T).transpose(0, 2, 1) @ turns[1])])
    half = np.s_[rows // 2 :]
    off = off[half] - off.mean(axis=0)
    said = noise * found.targets.spread[half]
    np.testing.assert_allclose(np.sqrt((off[:, :3] ** 2).mean()), said[0, 0], rtol=0.03)
    np.testing.assert_allclose(np.sqrt((off[:, 3:] ** 2).mean(axis=0)), said[0, 3:], rtol=0.06)
    assert found.targets.sigma == pytest.approx(noise, rel=0.05)


def test_the_common_frame_does_not_depend_on_the_order_of_the_rows():
    rng = np.random.default_rng(8)
    points = without(seen(rng, noise=1e-5)[0], rng)
    order = rng.permutation(len(points))
    one, other = posed(NUMBERS, points), posed(NUMBERS, points[order])
    np.testing.assert_allclose(other.targets.places, one.targets.places, atol=1e-10)
    turns = [quaternion_to_rotation(each.orientation) for each in (one, other)]
    np.testing.assert_allclose(turns[1], turns[0][order], atol=1e-9)


def test_a_target_that_is_wrong_in_a_few_rows_keeps_its_place():
    rng = np.random.default_rng(3)
    points, _, _ = seen(rng, 60, 5, 1e-5)
    sound = posed(NUMBERS, points)
    points[:6, 2] += 0.05
    found = posed(NUMBERS, points)
    apart = [np.linalg.norm(each.targets.places[:, None] - each.targets.places, axis=2) for each in (sound, found)]
    np.testing.assert_allclose(apart[1], apart[0], atol=5e-5)
    assert np.flatnonzero(found.deviation > 1e-3).tolist() == [0, 1, 2, 3, 4, 5]


def test_rows_of_two_targets_or_of_a_line_tell_no_pose():
    points = np.full((4, 4, 3), np.nan)
    points[0, :2] = PLACES[:2]
    points[1, :3] = np.outer([0.0, 1.0, 2.0], [0.1, 0.2, 0.3])
    points[2, :3] = PLACES[:3]
    points[3] = PLACES[:4]
    assert telling(points).tolist() == [False, False, True, True]


def test_targets_that_never_meet_are_not_placed():
    """Three in some rows, three others in the other rows, one of both in common."""
    points = seen(np.random.default_rng(4), 10)[0]
    points[:5, 3:] = np.nan
    points[5:, :2] = np.nan
    assert posed(NUMBERS, points) is None


def test_targets_are_placed_one_beside_the_others():
    """No row shows all five, and the first shows three."""
    points = seen(np.random.default_rng(5), 30)[0]
    points[:5, :2] = np.nan
    points[5:15, 4] = np.nan
    points[15:, 0] = np.nan
    found = posed(NUMBERS, points)
    apart = np.linalg.norm(found.targets.places[:, None] - found.targets.places, axis=2)
    np.testing.assert_allclose(apart, np.linalg.norm(PLACES[:, None] - PLACES, axis=2), atol=1e-9)


def test_rows_are_taken_with_what_is_typical_of_all():
    found = posed(NUMBERS, without(seen(np.random.default_rng(6))[0], np.random.default_rng(7))).targets
    part = found.take(np.array([3, 1]))
    np.testing.assert_array_equal(part.points, found.points[[3, 1]])
    np.testing.assert_array_equal(part.typical, found.typical)
    np.testing.assert_allclose(
        found.typical, [np.sqrt((found.spread[:, :3] ** 2).mean()), np.sqrt((found.spread[:, 3:] ** 2).mean())]
    )
