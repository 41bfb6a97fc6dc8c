"""The sentence: what is said where a correction does not hold on rows that it has not seen."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from simulate import simulate

from thermal_robot import diagnose
from thermal_robot.diagnosis.diagnose import _left
from thermal_robot.diagnosis.result import Unexplained
from thermal_robot.diagnosis.verdict import sentence
from thermal_robot.inference.rows import in_a_row


@pytest.fixture(scope="module")
def drifted(rv_m2):
    return diagnose(simulate(rv_m2, ["drift"], seed=3)[0])


def said(diagnosis, **held):
    gap = replace(diagnosis.gap, held_out=replace(diagnosis.gap.held_out, **held))
    left = diagnosis.unexplained
    return sentence(gap, diagnosis.effects, diagnosis.verdict, diagnosis.probability, left, left, reach=1.0)


def test_what_holds_on_held_out_rows_leaves_noise(drifted):
    assert drifted.verdict == ("drift",)
    assert said(drifted) == drifted.summary
    assert "which is noise" in drifted.summary


def test_a_correction_that_harms_held_out_rows_is_said_to(drifted):
    text = said(drifted, rms_before=0.252e-3, rms_after=4.96e-3, shrinkage=-386.0)
    assert "does not carry over to held-out data: their gap is 4.96 mm with it and 252 µm without" in text
    assert "which is noise" not in text
    assert "removes" not in text


def test_far_more_on_held_out_rows_than_on_fitted_ones_is_not_called_noise(drifted):
    floor = drifted.gap.noise_floor
    assert "which is noise" in said(drifted, rms_after=1.4 * floor)
    assert "are left of the rows it was fitted to" in said(drifted, rms_after=1.8 * floor)


def test_rows_set_aside_in_a_row_count_as_unexplained(drifted):
    """Those of a change that the explanation cannot follow are no gross errors, which stay out of the sum."""
    fit, n = drifted.fit, drifted.samples
    before, after = np.ones((n, 3)), np.full((n, 3), 0.1)
    after[[4, 5, 6, 30]] = 1.0
    aside = np.isin(np.arange(n), [4, 5, 6, 30])
    assert in_a_row(fit.campaign, aside).sum() == 3
    looked = SimpleNamespace(
        remaining=Unexplained(True, 0.2, 1e-9),
        fit=SimpleNamespace(
            campaign=fit.campaign,
            explanation=SimpleNamespace(outliers=aside),
            nominal=SimpleNamespace(gap=before),
            corrected=SimpleNamespace(gap=after),
        ),
    )
    gap = SimpleNamespace(rms_before=1.0)
    assert _left(looked, gap) == pytest.approx(0.2**2 + 3 / (n - 1))
    calm = SimpleNamespace(remaining=Unexplained(False, 0.0, 1.0), fit=looked.fit)
    assert _left(calm, gap) == 0.0
