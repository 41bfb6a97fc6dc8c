"""Ripple beside other effects: it is named and shrinks the gap, and does not stand in for what is no wave."""

import numpy as np
import pytest
from helpers import NOISE, with_law
from inference.test_ripple import rippling

from thermal_robot import diagnose
from thermal_robot.diagnosis import prune
from thermal_robot.diagnosis.prune import forward_selection
from thermal_robot.effects import JointRipple, choose
from thermal_robot.effects.law import Discovered
from thermal_robot.inference.fit import fit


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_ripple_is_named_with_its_orders(rv_m2, seed):
    true = JointRipple().having("joint_2", 26.6, 1.0).having("joint_3", 17.26, 1.0)
    found = diagnose(rippling(rv_m2, true, (2e-4, 3e-4), seed))
    assert found.verdict == ("joint_ripple",)
    assert not found.unexplained.flagged
    held = dict(found.fit.effects[0][0].arguments().items())
    assert sorted(held["joints"]) == ["joint_2", "joint_3"]
    values = found.fit.effects[0][1].reshape(-1, 2)
    sizes = dict(zip(held["joints"], np.hypot(*values.T), strict=True))
    assert sizes["joint_2"] == pytest.approx(2e-4, rel=0.2)
    assert sizes["joint_3"] == pytest.approx(3e-4, rel=0.2)
    assert found.gap.held_out.rms_after == pytest.approx(np.sqrt(3.0) * NOISE, rel=0.15)


@pytest.mark.slow
def test_who_leaves_ripple_out_gets_none(rv_m2):
    true = JointRipple().having("joint_2", 26.6, 1.0)
    plain = fit(rippling(rv_m2, true, (3e-4,), 0), choose(without=("joint_ripple",)))
    wider = forward_selection(plain, 1, lambda _: None) or plain
    assert not any(isinstance(effect, JointRipple) for effect, _ in wider.effects)


@pytest.mark.slow
def test_a_ripple_that_is_held_stays_where_none_is_generated_anew(rv_m2, monkeypatch):
    """Evidence and rows held out decide of it, and no generator."""
    rippled = forward_selection(
        fit(rippling(rv_m2, JointRipple().having("joint_2", 26.6, 1.0), (3e-4,), 0), choose()), 1, str
    )
    assert any(isinstance(effect, JointRipple) for effect, _ in rippled.effects)
    monkeypatch.setattr(prune, "waves", lambda _: JointRipple())
    again = forward_selection(rippled, 2, str) or rippled
    assert any(isinstance(effect, JointRipple) for effect, _ in again.effects)
    assert JointRipple.name in again.variants


@pytest.mark.slow
def test_a_step_is_no_sum_of_waves(rv_m2):
    step = Discovered(place="joint_2", quantity="joint_2", shape="step", marks=(0.2,), unit="rad")
    campaign = with_law(rv_m2, step, (0.0, 6e-4), seed=4)[0]
    found = diagnose(campaign)
    assert found.verdict == ("discovered.1",)
    law = next(effect for effect, _ in found.fit.effects)
    assert (law.place, law.quantity) == ("joint_2", "joint_2")
