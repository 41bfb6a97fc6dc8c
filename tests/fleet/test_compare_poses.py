"""Predictions of two models, frames aligned."""

from dataclasses import replace

import numpy as np
import pytest
from compared import FRAMES, OFFSETS, diagnosed, moved

from thermal_robot.fleet.compare import _predicted
from thermal_robot.observations import Frames


@pytest.fixture(scope="module")
def one():
    return diagnosed(1)


def test_another_place_of_base_and_target_is_no_difference(one):
    base, _ = FRAMES["there"]
    shifted = np.eye(4)
    shifted[:3, 3] = [1e-3, -2e-3, 5e-4]
    frames = Frames(base @ one.model.frames.base, shifted @ one.model.frames.tool)
    spread = replace(one.model.spread, beyond=np.full(3, one.model.spread.beyond.mean()))
    model = replace(one.model, spread=spread)
    other = replace(one, model=replace(model, frames=frames))
    (found,) = _predicted([replace(one, model=model), other], ["a", "b"])
    assert found.rms < 2e-8
    assert found.agrees
    assert found.beyond == 0.0
    assert found.stated > 1e-6


def test_a_changed_zero_shows_as_the_arm_would_move(one):
    """The difference is that of the nominal robot's own poses, aligned by a fit that knows nothing of the program."""
    step = 2e-3
    (effect, values), *rest = one.model.effects
    names = one.model.robot.joint_names
    places = effect.places or names
    changed = values.copy()
    changed[places.index(names[2])] += step
    other = replace(one, model=replace(one.model, effects=((effect, changed), *rest)))
    (found,) = _predicted([one, other], ["a", "b"])
    assert not found.agrees
    assert found.beyond > 0.9
    robot, q = one.model.robot, one.rows.q

    def points(q):
        pose = robot.forward(q)
        return pose[:, :3, 3] + pose[:, :3, :3] @ one.model.frames.tool[:3, 3], pose[:, :3, :3]

    (here, turns), (there, _) = points(q), points(q + step * np.eye(5)[2])
    gap, width = (there - here).ravel(), len(q)
    cross = np.zeros((width, 3, 3))
    for k in range(3):
        cross[:, :, k] = np.cross(np.eye(3)[k], here)
    columns = np.concatenate([np.tile(np.eye(3), (width, 1, 1)), cross, turns], axis=2).reshape(3 * width, 9)
    left = gap - columns @ np.linalg.lstsq(columns, gap)[0]
    assert found.rms == pytest.approx(np.sqrt((left**2).sum() / width), rel=0.03)


def test_a_joint_that_is_held_is_the_same_to_the_jitter_of_its_encoder(one):
    """Ranges of a held joint that miss each other by a microradian are one; by more, nothing is common."""
    joint = one.model.robot.joint_names[4]

    def held(at, rows):
        ranges = {**one.model.spread.ranges, joint: (at, at)}
        model = replace(one.model, spread=replace(one.model.spread, ranges=ranges))
        q = rows.q.copy()
        q[:, 4] = at
        return replace(one, model=model, rows=replace(rows, q=q))

    for apart, common in ((0.0, True), (2e-6, True), (-2e-6, True), (0.1, False)):
        (found,) = _predicted([held(0.3, one.rows), held(0.3 + apart, one.rows)], ["a", "b"])
        assert bool(found.note) != common


def test_every_pair_is_compared(one):
    days = [one, diagnosed(2, frame="there"), diagnosed(3, moved(4e-4))]
    found = _predicted(days, ["a", "b", "c"])
    assert [p.campaigns for p in found] == [("a", "b"), ("a", "c"), ("b", "c")]
    assert found[1].rms > 2.0 * found[0].rms
    assert len(OFFSETS) == one.model.robot.n


def test_without_deviations_nothing_is_said(one):
    bare = replace(one, model=replace(one.model, spread=None))
    (found,) = _predicted([one, bare], ["a", "b"])
    assert found.poses == 0
    assert "does not state" in found.note
