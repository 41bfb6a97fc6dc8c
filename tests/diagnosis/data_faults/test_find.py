"""A fault of the table is named, where it struck and how much it explains; a sound table has none."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from conftest import load_arm
from several import LONG, table_of
from simulate import simulate
from spoilt_tables import SPOILT, measured_at, paired_late, with_joints

from thermal_robot import read_campaign
from thermal_robot.campaign import campaign_from_table
from thermal_robot.diagnosis.data_faults import data_fault
from thermal_robot.diagnosis.data_faults.find import KINDS
from thermal_robot.diagnosis.data_faults.of_measurements import TURNS

NOISE = 25e-6
OF_TURNS = {kind.name for kind in TURNS}
DATA = os.environ.get("THERMAL_ROBOT_DATA")
PUBLIC = ("ur5_jacobi", "open_cases/case_001", "open_cases/case_005", "open_cases/case_012", "open_cases/case_015")


@pytest.fixture(scope="session")
def sound():
    """Poses of a UR10 whose joints' zeros are off."""
    return simulate(load_arm("ur10"), ["joint_offset"], samples=60, seed=4, noise=NOISE, turning=3e-5)[0]


def test_every_kind_of_fault_is_tried_here():
    assert {kind.name for kind in KINDS} == set(SPOILT)
    assert len(KINDS) == 18


@pytest.mark.parametrize("kind", SPOILT)
def test_a_fault_is_named(sound, kind):
    found = data_fault(SPOILT[kind](sound))
    assert kind in found.kinds
    # what is left is the robot's own gap
    assert found.rms_after < 20.0 * NOISE < 0.01 * found.rms_before
    assert found.rows == ()


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("name", ["rv_m2", "panda"])
def test_a_sound_table_has_no_fault(name, seed):
    effects = [["joint_offset"], ["geometric", "drift"], ["backlash"], []][seed]
    sound = simulate(load_arm(name), effects, samples=40, seed=seed, outliers=0.1, heavy=True, ratio=(20.0, 60.0))[0]
    assert data_fault(sound) is None


def test_measurements_in_no_order_are_mended_by_nothing(sound):
    shuffled = np.random.default_rng(0).permutation(sound.samples)
    assert data_fault(measured_at(sound, shuffled)) is None


@pytest.mark.parametrize("share", [0.15, 0.45])
def test_a_fault_of_some_rows_is_named_with_them(sound, share):
    struck = np.random.default_rng(1).random(sound.samples) < share
    found = data_fault(paired_late(replace(sound, orientation=None, noise_orientation=None), struck))
    # the row above is also where the arm was some time before
    assert {"clock offset", "shifted rows"} & set(found.kinds)
    named = np.isin(sound.rows, found.rows)
    # the first row has none before it; where the arm hardly moved a late row is no other
    assert (named != struck).mean() < 0.05
    reversed_in_some = with_joints(sound, lambda q: np.where(struck[:, None], -q, q), 2)
    found = data_fault(reversed_in_some)
    assert found.kinds == ("reversed joint",)
    assert (np.isin(sound.rows, found.rows) != struck).mean() < 0.05


def test_what_the_instrument_stands_on_cannot_tell_is_said_to_be_so(sound):
    """With an unknown base a mirrored axis is any axis, and two exchanged ones, but for the orientations."""
    points = replace(sound, orientation=None, noise_orientation=None)
    found = data_fault(SPOILT["mirrored axis"](points))
    assert set(found.kinds) == {"mirrored axis", "exchanged axes"}
    assert "x, y or z" in found.what
    assert data_fault(SPOILT["mirrored axis"](sound)).kinds == ("mirrored axis",)


@pytest.mark.slow
@pytest.mark.skipif(DATA is None, reason="THERMAL_ROBOT_DATA is not set")
@pytest.mark.parametrize("name", PUBLIC)
def test_faults_of_public_campaigns_are_named(name):
    campaign = read_campaign(Path(DATA) / name)
    assert data_fault(campaign) is None
    asked = [k for k in SPOILT if k not in OF_TURNS or campaign.orientation is not None]
    asked = [k for k in asked if k != "clock offset" or "time" in campaign.covariates]
    named = [k for k in asked if (found := data_fault(SPOILT[k](campaign))) is not None and k in found.kinds]
    assert len(named) >= 0.9 * len(asked)


@pytest.mark.slow
@pytest.mark.skipif(DATA is None, reason="THERMAL_ROBOT_DATA is not set")
def test_rows_paired_late_are_found_beside_errors_of_a_light_arm():
    """Between neighbouring poses the arm moves seven times what registration leaves of it."""
    campaign = read_campaign(Path(DATA) / "wam_jacobi").take(np.arange(60))
    struck = np.isin(np.arange(60), 1 + np.random.default_rng(0).permutation(59)[:28])
    assert data_fault(campaign) is None
    found = data_fault(measured_at(campaign, np.where(struck, np.arange(60) - 1, np.arange(60))))
    assert "shifted rows" in found.kinds
    assert (np.isin(campaign.rows, found.rows) != struck).mean() < 0.05


@pytest.mark.parametrize(("kind", "order"), [("exchanged axes", "yxz"), ("mirrored axis", "xyz")])
def test_a_fault_of_the_axes_is_named_where_several_targets_tell_the_pose(kind, order):
    """It mirrors the turn that they tell with them."""
    arm = load_arm("ur10")
    exact = simulate(arm, ["joint_offset"], samples=60, seed=4, noise=NOISE * 1e-3, turning=1e-12, ratio=(3e3, 6e3))[0]
    table = table_of(exact, LONG, np.random.default_rng(0))
    struck = table.copy()
    for k in range(1, 5):
        struck[[f"{axis}.{k}" for axis in "xyz"]] = table[[f"{axis}.{k}" for axis in order]].to_numpy()
        struck[f"z.{k}"] *= -1.0 if kind == "mirrored axis" else 1.0
    assert data_fault(campaign_from_table(arm, table)) is None
    found = data_fault(campaign_from_table(arm, struck))
    assert kind in found.kinds
    assert found.rms_after < 20.0 * NOISE
