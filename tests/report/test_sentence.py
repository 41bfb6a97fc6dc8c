"""The sentence: what is said where a correction does not hold on rows that it has not seen."""

from dataclasses import replace

import pytest
from simulate import simulate

from thermal_robot import diagnose
from thermal_robot.report.sentence import headline


@pytest.fixture(scope="module")
def drifted(rv_m2):
    return diagnose(simulate(rv_m2, ["drift"], seed=3)[0])


def said(diagnosis, **held):
    gap = replace(diagnosis.gap, held_out=replace(diagnosis.gap.held_out, **held))
    return headline(replace(diagnosis, gap=gap))


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
