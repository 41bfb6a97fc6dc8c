"""The batch engine against Pinocchio, arm by arm."""

import numpy as np
import pytest
import reference

from thermal_robot import kinematics as kin
from thermal_robot.errors import RobotError
from thermal_robot.kinematics import settings

ROWS = 200
TOLERANCE = 1e-10


def same(ours, theirs):
    assert ours.shape == theirs.shape
    np.testing.assert_allclose(ours, theirs, rtol=0.0, atol=TOLERANCE)


def same_frames(ours, theirs):
    for field in ("rotations", "positions", "tool_rotation", "tool_position"):
        same(getattr(ours, field), getattr(theirs, field))


def test_frames_are_pinocchios(arm, configurations):
    q = configurations(arm, ROWS)
    same_frames(kin.chain_frames(arm, q), reference.chain_frames(arm, q))


@pytest.mark.parametrize("each_row", [True, False], ids=["a displacement for each row", "one for all"])
def test_displaced_frames_are_pinocchios(arm, configurations, each_row):
    rows = 100
    q = configurations(arm, rows)
    rng = np.random.default_rng(1)

    def channel(*shape):
        return rng.normal(0.0, 0.2, ((rows, *shape) if each_row else shape))

    displaced = kin.Displacement(channel(arm.n), channel(len(arm.segments), 6), channel(6), channel(6))
    same_frames(kin.chain_frames(arm, q, displaced), reference.chain_frames(arm, q, displaced))
    same(kin.tool_poses(arm, q, displaced), reference.tool_poses(arm, q, displaced))


@pytest.mark.parametrize("point", [(0.0, 0.0, 0.0), (0.05, -0.1, 0.2)], ids=["tool", "point"])
def test_jacobians_are_pinocchios(arm, configurations, point):
    q = configurations(arm, ROWS)
    same(kin.frame_jacobians(arm, q, point=point), reference.frame_jacobians(arm, q, point=point))


@pytest.mark.parametrize("point", [(0.0, 0.0, 0.0), (0.05, -0.1, 0.2)], ids=["tool", "point"])
def test_placement_sensitivities_are_pinocchios_regressor(arm, configurations, point):
    q = configurations(arm, ROWS)
    same(
        kin.placement_sensitivities(arm, q, point=point),
        reference.placement_sensitivities(arm, q, point=point),
    )


def test_gravity_torques_are_pinocchios(arm, configurations):
    q = configurations(arm, ROWS)
    payload = np.random.default_rng(2).uniform(0.0, 8.0, ROWS)
    load = {"payload": payload, "payload_com": (0.03, -0.02, 0.1)}
    same(kin.gravity_torques(arm, q), reference.gravity_torques(arm, q))
    same(kin.gravity_torques(arm, q, **load), reference.gravity_torques(arm, q, **load))


def test_chunks_do_not_show(rv_m2, configurations, monkeypatch):
    q = configurations(rv_m2, 1000)
    rng = np.random.default_rng(3)
    displaced = kin.Displacement(
        joint=rng.normal(size=(1000, 5)), base=rng.normal(size=6), tool=rng.normal(size=(1000, 6))
    )

    def everything():
        frames = kin.chain_frames(rv_m2, q, displaced)
        jacobians = kin.frame_jacobians(rv_m2, q, frames=frames)
        return (
            frames.positions,
            frames.tool_position,
            jacobians,
            kin.placement_sensitivities(rv_m2, q, frames=frames),
        )

    at_once = everything()
    monkeypatch.setattr(settings, "CHUNK", 97)
    for whole, pieces in zip(at_once, everything(), strict=True):
        np.testing.assert_allclose(pieces, whole, rtol=0.0, atol=1e-14)


def test_frames_may_be_handed_on_in_any_memory_layout(rv_m2, configurations):
    q = configurations(rv_m2, 20)
    frames = kin.chain_frames(rv_m2, q)
    copied = kin.ChainFrames(
        *(
            np.ascontiguousarray(a)
            for a in (frames.rotations, frames.positions, frames.tool_rotation, frames.tool_position)
        )
    )
    for function in (kin.frame_jacobians, kin.placement_sensitivities, kin.gravity_torques):
        same(function(rv_m2, q, frames=copied), function(rv_m2, q))


def test_a_point_may_differ_from_row_to_row(rv_m2, configurations):
    q = configurations(rv_m2, 7)
    points = np.random.default_rng(4).normal(size=(7, 3))
    together = kin.frame_jacobians(rv_m2, q, point=points)
    for row in range(7):
        same(together[row], kin.frame_jacobians(rv_m2, q[row], point=points[row])[0])


def test_no_configuration_gives_no_row(rv_m2):
    q = np.empty((0, 5))
    assert kin.tool_poses(rv_m2, q).shape == (0, 4, 4)
    assert kin.placement_sensitivities(rv_m2, q).shape == (0, 6, len(rv_m2.segments), 6)
    assert kin.gravity_torques(rv_m2, q, payload=np.empty(0)).shape == (0, 5)


def test_one_configuration_is_one_row(rv_m2):
    q = np.array([0.1, 0.2, -0.3, 0.4, 0.5])
    same(kin.tool_poses(rv_m2, q), kin.tool_poses(rv_m2, q[None]))


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda r: kin.tool_poses(r, np.zeros((3, 4))), r"\(3, 4\) do not fit robot 'rv_m2' of 5 joints"),
        (lambda r: kin.tool_poses(r, np.zeros((2, 3, 5))), r"expected \(N, 5\)"),
        (
            lambda r: kin.tool_poses(r, np.zeros((3, 5)), kin.Displacement(base=np.zeros((2, 6)))),
            r"displacement 'base' of shape \(2, 6\)",
        ),
        (lambda r: kin.frame_jacobians(r, np.zeros((3, 5)), point=np.zeros(2)), r"a point of shape \(2,\)"),
        (
            lambda r: kin.gravity_torques(r, np.zeros((3, 5)), payload=np.zeros(2)),
            r"a payload of shape \(2,\)",
        ),
        (
            lambda r: kin.gravity_torques(r, np.zeros((3, 5)), payload_com=[0, 0]),
            r"payload_com of shape \(2,\)",
        ),
    ],
)
def test_shapes_that_do_not_fit_are_said(rv_m2, call, words):
    with pytest.raises(RobotError, match=words):
        call(rv_m2)
