"""What hangs on the prior sizes: nothing where the data decide."""

import numpy as np
import pytest
from simulate import simulate

from thermal_robot.diagnosis import settings
from thermal_robot.diagnosis.answer import prior_sensitivity
from thermal_robot.effects import choose
from thermal_robot.inference.fit import fit

RIVALS = choose(("joint_offset", "joint_gain", "backlash", "drift"), (), ())


def fitted(robot, times, effects=RIVALS):
    """One effect that moves the target by so many times the noise."""
    return fit(simulate(robot, ["backlash"], seed=2, ratio=(times, times), places=["joint_3"])[0], effects)


def test_a_certain_verdict_stays_certain(rv_m2):
    """Against nothing at all; that a small further effect hides beside it is never quite excluded."""
    alone = fitted(rv_m2, 5.0, choose(("backlash",), (), ()))
    beside = fitted(rv_m2, 5.0)
    for known, least in ((alone, 1.0 - 1e-9), (beside, 0.9)):
        assert [effect.name for effect, _ in known.effects] == ["backlash"]
        weighed = prior_sensitivity(known)
        assert min(weighed.smaller, weighed.larger) >= least


def test_noise_alone_is_less_certain_where_effects_may_be_smaller(rv_m2):
    """An effect of a third of its size hides in the noise more easily than one of three times it."""
    weighed = prior_sensitivity(fit(simulate(rv_m2, seed=4)[0], RIVALS))
    assert 0.3 < weighed.smaller < weighed.larger < 1.0


@pytest.mark.parametrize("times", [0.3, 0.5, 0.8, 1.5])
def test_it_is_a_probability(rv_m2, times):
    weighed = prior_sensitivity(fitted(rv_m2, times))
    assert 0.0 <= weighed.smaller <= 1.0
    assert 0.0 <= weighed.larger <= 1.0


def test_at_the_stated_sizes_it_is_the_probability_itself(rv_m2, monkeypatch):
    """Among the explanations that are compared again."""
    known = fitted(rv_m2, 0.5)
    monkeypatch.setattr(settings, "PRIOR_FACTOR", 1.0)
    weighed = prior_sensitivity(known)
    assert weighed.smaller == weighed.larger
    e = known.explanation
    assert e.discrepancy.form is None  # the same noise alone
    chosen = {effect.name for effect, _ in known.effects}
    compared = e.combinations[: settings.COMPARED]
    same = [{known.families[b] for b in c.blocks} == chosen for c in compared]
    p = e.probabilities[: len(compared)]
    assert weighed.smaller == pytest.approx(p[np.array(same)].sum() / p.sum(), abs=1e-3)
