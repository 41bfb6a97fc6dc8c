"""The parts of an answer, put together from the last explanation."""

from types import SimpleNamespace

import numpy as np
import pytest
from simulate import simulate

from thermal_robot import diagnose
from thermal_robot.diagnosis.answer import _left
from thermal_robot.diagnosis.examine import Examined
from thermal_robot.diagnosis.parts import Unexplained
from thermal_robot.inference.rows import in_a_row


def test_rows_set_aside_in_a_row_count_as_unexplained(rv_m2):
    """Those of a change that the explanation cannot follow are no gross errors, which stay out of the sum."""
    drifted = diagnose(simulate(rv_m2, ["drift"], seed=3)[0])
    known, n = drifted.fit, drifted.samples
    before, after = np.ones((n, 3)), np.full((n, 3), 0.1)
    after[[4, 5, 6, 30]] = 1.0
    aside = np.isin(np.arange(n), [4, 5, 6, 30])
    assert in_a_row(known.campaign, aside).sum() == 3
    looked = SimpleNamespace(
        left=Examined(Unexplained(True, 0.2, 1e-9), 1.0, "stated"),
        fit=SimpleNamespace(
            campaign=known.campaign,
            explanation=SimpleNamespace(outliers=aside),
            nominal=SimpleNamespace(gap=before),
            corrected=SimpleNamespace(gap=after),
        ),
    )
    gap = SimpleNamespace(rms_before=1.0)
    assert _left(looked, gap) == pytest.approx(0.2**2 + 3 / (n - 1))
    calm = SimpleNamespace(left=Examined(Unexplained(False, 0.0, 1.0), 1.0, "stated"), fit=looked.fit)
    assert _left(calm, gap) == 0.0
