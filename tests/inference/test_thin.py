"""As many rows as a scan needs: all of them, or some that stand for all."""

from dataclasses import replace

import numpy as np
import pytest
from simulate import simulate

from thermal_robot.effects import choose
from thermal_robot.inference import settings
from thermal_robot.inference.fit import fit
from thermal_robot.inference.grouping import in_a_row
from thermal_robot.inference.screening import Thin


@pytest.fixture(scope="module")
def known(rv_m2):
    """A fit with an effect at work, gross errors, and a spell of rows that were knocked."""
    campaign = simulate(rv_m2, ["joint_offset"], samples=150, seed=3, outliers=0.05)[0]
    position = campaign.position.copy()
    position[np.argsort(campaign.covariates["time"])[60:64]] += 5e-3
    return fit(replace(campaign, position=position), choose(("joint_offset",), (), ()))


@pytest.fixture
def thinned(known, monkeypatch):
    monkeypatch.setattr(settings, "ENOUGH_ROWS", 90)
    return Thin.of(known)


def test_below_the_limit_all_rows_are_there(known):
    thin, e = Thin.of(known), known.explanation
    assert thin.observations is known.corrected
    assert thin.linear is e.linear
    # the knocked rows follow each other, scattered gross errors do not
    assert thin.changed[np.argsort(known.campaign.covariates["time"])[60:64]].all()
    assert thin.changed.sum() < e.outliers.sum()


def test_above_it_rows_are_drawn_once_and_in_order(known, thinned):
    assert thinned.observations.campaign.samples == 90
    rows = [int(np.flatnonzero((known.campaign.q == q).all(axis=1))[0]) for q in thinned.observations.q]
    assert rows == sorted(set(rows))
    e = known.explanation
    np.testing.assert_array_equal(thinned.linear.gap, e.linear.gap[rows])
    np.testing.assert_array_equal(thinned.linear.frames, e.linear.frames[rows])
    for own, whole in zip(thinned.linear.blocks, e.linear.blocks, strict=True):
        np.testing.assert_array_equal(own.columns, whole.columns[rows])
    np.testing.assert_array_equal(thinned.changed, in_a_row(known.campaign, e.outliers)[rows])
    # the corrected model is the same: its gap at these rows is the one it had among all
    np.testing.assert_allclose(thinned.observations.gap, known.corrected.gap[rows], rtol=0, atol=1e-12)
    # the same campaign always gets the same rows
    np.testing.assert_array_equal(Thin.of(known).observations.q, thinned.observations.q)


def test_the_rows_drawn_stand_for_all(known, thinned, monkeypatch):
    clock = known.campaign.covariates["time"]
    share = np.mean(thinned.observations.campaign.covariates["time"] < np.median(clock))
    assert share == pytest.approx(0.5, abs=4.0 * 0.5 / np.sqrt(90))
    blocks = known.explanation.best.blocks
    own = thinned.target(blocks).white
    monkeypatch.undo()
    sound = Thin.of(known).target(blocks).white
    # four of its standard deviations: that of a normal law's median of |x|, 1.17/√n of it
    assert np.median(np.abs(own)) == pytest.approx(np.median(np.abs(sound)), rel=4.0 * 1.17 / np.sqrt(own.size))


def test_targets_hold_what_is_left_beside_some_blocks(known):
    thin = Thin.of(known)
    blocks = known.explanation.best.blocks
    assert blocks
    calm = replace(thin, changed=np.zeros(150, dtype=bool))
    before, after = calm.target(()), thin.target(blocks)
    frames = thin.linear.frames.shape[2]
    assert before.basis.shape[1] == frames
    assert after.basis.shape[1] > frames
    columns = thin.linear.blocks[blocks[0]].columns
    assert before.worth(columns).gain > 50.0
    # rows that changed weigh fully, however far they are
    assert (after.root[thin.changed].min(axis=0) >= after.root.max(axis=0) * (1.0 - 1e-9)).all()
    spoilt = known.explanation.outliers & ~thin.changed
    assert after.root[spoilt].max() < 0.2 * after.root.max()
