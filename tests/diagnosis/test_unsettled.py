"""The figures that are told are those of the model that is saved; what has run away is not delivered."""

from dataclasses import replace

import numpy as np
import pytest
from simulate import simulate

from thermal_robot import diagnose
from thermal_robot.diagnosis.data_faults.misfit import unsettled
from thermal_robot.inference import exact
from thermal_robot.observations import Frames, observe


@pytest.fixture(scope="module")
def campaign(rv_m2):
    return simulate(rv_m2, ["joint_offset"], samples=60, seed=3)[0]


def run_away(observations, held, away):
    """A fit that ended elsewhere: the base stands off."""
    base = observations.frames.base.copy()
    base[:3, 3] += away
    return observe(observations.campaign, Frames(base, observations.frames.tool)), held


def test_a_fit_that_runs_away_is_not_delivered(campaign, monkeypatch):
    true = exact.gauss_newton
    monkeypatch.setattr(exact, "gauss_newton", lambda *given: run_away(*true(*given), 1e-3))
    found = diagnose(campaign, only="joint_offset")
    assert found.verdict == ()
    assert found.finding("joint_offset").needs == ("a fit that settles",)
    assert any("did not settle" in told and "joint_offset" in told for told in found.warnings)
    # the model that is saved leaves what is told: what registration leaves
    left = np.linalg.norm(found.model.predict(campaign)[0] - campaign.position, axis=1)
    assert np.sqrt((left**2).mean()) == pytest.approx(found.gap.rms_after, rel=1e-6)
    assert found.gap.held_out.rms_after == pytest.approx(found.gap.rms_after, rel=0.5)


def test_a_fit_that_settled_says_nothing(campaign):
    found = diagnose(campaign, only="joint_offset")
    assert found.verdict == ("joint_offset",)
    assert unsettled(found.fit) == ""
    assert not any("settle" in told for told in found.warnings)


def test_large_errors_are_told_of_the_model_that_is_saved(rv_m2):
    """Zeros that are off by ten degrees: whatever is delivered, the figure is that of the model."""
    q = simulate(rv_m2, samples=60, seed=4)[0]
    spoilt = replace(q, q=q.q + np.radians([0.0, 10.0, -12.0, 9.0, 0.0]))
    found = diagnose(spoilt, only=["joint_offset", "joint_gain"])
    left = np.linalg.norm(found.model.predict(spoilt)[0] - spoilt.position, axis=1)
    kept = ~found.rows.outliers
    assert np.sqrt((left[kept] ** 2).mean()) == pytest.approx(found.gap.rms_after, rel=1e-6)
    assert found.gap.rms_after < 3.0 * found.gap.held_out.rms_after
