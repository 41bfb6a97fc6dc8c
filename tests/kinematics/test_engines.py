"""Every engine passes the same tests, against Pinocchio's own model of the robot."""

import numpy as np
import pytest
import reference

from thermal_robot import kinematics as kin
from thermal_robot.kinematics import compiled, lanes, settings, thin
from thermal_robot.kinematics.frames import engine_for

ROWS = 150
POINT = np.array([0.05, -0.1, 0.2])
COM = np.array([0.03, -0.02, 0.1])


@pytest.fixture(params=["thin", "lanes", "compiled"])
def engine(request):
    """Each engine in turn."""
    if request.param == "compiled":
        pytest.importorskip("numba", reason="the compiled engine is in the extra fast: numba is not installed")
    return {"thin": thin, "lanes": lanes, "compiled": compiled}[request.param]


@pytest.fixture
def q(arm, configurations):
    """Configurations within the limits, those with all joints at zero and at a quarter turn among them."""
    drawn = configurations(arm, ROWS)
    drawn[0], drawn[1] = 0.0, 0.5 * np.pi
    return drawn


def written(function, robot, q, *arguments, shape):
    """Results of an engine; what it leaves out stays no number."""
    out = np.full((len(q), *shape), np.nan)
    function(robot, q, *arguments, out)
    return out


def same(ours, theirs):
    np.testing.assert_allclose(ours, theirs, rtol=0.0, atol=1e-12 * max(1.0, np.abs(theirs).max()))


def test_poses(engine, arm, q):
    same(written(engine.poses, arm, q, shape=(4, 4)), reference.tool_poses(arm, q))


@pytest.mark.parametrize("point", [None, POINT], ids=["tool", "point"])
def test_jacobians(engine, arm, q, point):
    ours = written(engine.jacobians, arm, q, point, shape=(6, arm.n))
    same(ours, reference.frame_jacobians(arm, q, point=np.zeros(3) if point is None else point))


@pytest.mark.parametrize("point", [None, POINT], ids=["tool", "point"])
def test_placements(engine, arm, q, point):
    ours = written(engine.placements, arm, q, point, shape=(6, len(arm.segments), 6))
    same(ours, reference.placement_sensitivities(arm, q, point=np.zeros(3) if point is None else point))


@pytest.mark.parametrize("mass", [0.0, 3.0, np.linspace(0.0, 8.0, ROWS)], ids=["none", "one", "each"])
def test_gravity(engine, arm, q, mass):
    ours = written(engine.gravity, arm, q, np.asarray(mass), COM, shape=(arm.n,))
    same(ours, reference.gravity_torques(arm, q, payload=mass, payload_com=COM))


def test_a_point_of_each_row(engine, awkward, configurations):
    q, points = configurations(awkward, ROWS), np.random.default_rng(1).normal(size=(ROWS, 3))
    jacobians = written(engine.jacobians, awkward, q, points, shape=(6, awkward.n))
    placements = written(engine.placements, awkward, q, points, shape=(6, len(awkward.segments), 6))
    for i in range(0, ROWS, 30):
        same(jacobians[i], reference.frame_jacobians(awkward, q[i], point=points[i])[0])
        same(placements[i], reference.placement_sensitivities(awkward, q[i], point=points[i])[0])


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_what_is_no_number_is_never_hidden(engine, arm, q, bad):
    for joint in range(arm.n):
        spoilt = q.copy()
        spoilt[7, joint] = bad
        with np.errstate(invalid="ignore"):
            found = written(engine.poses, arm, spoilt, shape=(4, 4)).reshape(ROWS, -1)
        moves = np.ptp(reference.tool_poses(arm, q[7] + np.outer([0.0, 0.3], np.eye(arm.n)[joint])), axis=0).any()
        assert np.all(np.isfinite(found[7])) != moves
        assert np.all(np.isfinite(np.delete(found, 7, axis=0)))


def test_frames_of_a_campaign_are_in_the_same_place(engine, arm, q):
    frames = kin.chain_frames(arm, q)
    poses = written(engine.poses, arm, q, shape=(4, 4))
    same(poses[:, :3, :3], frames.tool_rotation)
    same(poses[:, :3, 3], frames.tool_position)


def test_pinocchio_is_for_few_and_for_chains_that_are_not_long(rv_m2, monkeypatch):
    assert engine_for(rv_m2, 1) is thin
    assert engine_for(rv_m2, settings.FEW) is thin
    assert engine_for(rv_m2, settings.FEW + 1) is lanes
    monkeypatch.setattr(settings, "MOST_PLACEMENTS", len(rv_m2.segments) - 1)
    assert engine_for(rv_m2, 1) is lanes


def test_compiled_lanes_are_for_very_many_and_for_those_who_have_numba(rv_m2, monkeypatch):
    monkeypatch.setattr(compiled, "installed", lambda: True)
    assert engine_for(rv_m2, settings.MANY - 1) is lanes
    assert engine_for(rv_m2, settings.MANY) is compiled
    monkeypatch.setattr(compiled, "installed", lambda: False)
    assert engine_for(rv_m2, 10 * settings.MANY) is lanes
