"""What is said beside the figures."""

from dataclasses import replace

import numpy as np
from clouds import cell

from thermal_robot.iso9283 import performance

SCATTER = 1e-5 * np.random.default_rng(0).normal(size=(200, 3))


def notes(campaign):
    return " ".join(performance(campaign).notes)


def test_a_test_as_the_standard_has_it_needs_no_note(rv_m2):
    assert performance(cell(rv_m2, np.tile(np.arange(5), 30), SCATTER[:150])).notes == ()


def test_registration_is_told_with_its_unknowns(rv_m2):
    campaign = replace(cell(rv_m2, np.tile(np.arange(5), 30), SCATTER[:150]), base_known=False)
    assert "the base frame is fitted" in notes(campaign)
    assert "6 unknowns, 15 figures" in notes(campaign)
    assert "base and tool frames are fitted" in notes(replace(campaign, tool_known=False))
    three = replace(campaign.take(np.isin(np.arange(150) % 5, (0, 1, 2))), tool_known=False)
    assert "AP and AT cannot be told: the unknown base and tool frames have 9 unknowns, and 9" in notes(three)


def test_few_cycles_and_lone_rows_are_counted(rv_m2):
    said = notes(cell(rv_m2, [*np.tile(np.arange(3), 30), 3, 3, 4], SCATTER[:93]))
    assert "Fewer cycles than the standard's 30: 1 of 4 poses." in said
    assert "1 of 93 rows repeat nothing" in said
    path = {"path": np.array(["seam"] * 12)}
    assert "standard's 10: 1 of 1 paths" in notes(cell(rv_m2, np.tile([0, 1], 6), SCATTER[:12], labels=path))


def test_a_pose_from_several_directions_is_named(rv_m2):
    number, sign = np.tile([0, 1], 30), np.ones(60)
    sign[::4] = -1.0
    campaign = cell(rv_m2, number, SCATTER[:60], covariates={"approach.joint_1": sign})
    assert "larger than the standard's, which comes from one: 'P1'." in notes(campaign)


def test_commands_that_differ_under_one_label_are_named(rv_m2):
    campaign = cell(rv_m2, np.tile([0, 1], 30), SCATTER[:60])
    q = campaign.q.copy()
    q[1, 2] += 0.01
    assert "different joint commands, which counts as scatter: 'P2'" in notes(replace(campaign, q=q))


def test_the_instrument_has_its_share(rv_m2):
    campaign = cell(rv_m2, np.tile([0, 1], 30), SCATTER[:60], noise_position=1e-5)
    assert "alone would show 0.0362 mm" in notes(campaign)
