"""A fault of the table is named, where it struck and how much it explains; a sound table has none."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from conftest import load_arm
from helpers import some
from several import LONG, table_of
from simulate import simulate
from spoilt_tables import DRAWN, SPOILT, coupled, measured_at, paired_late, with_joints

from thermal_robot import read_campaign
from thermal_robot.campaign import campaign_from_table
from thermal_robot.diagnosis.data_faults import data_fault
from thermal_robot.diagnosis.data_faults.faults import TURNS
from thermal_robot.diagnosis.data_faults.find import KINDS
from thermal_robot.robot import load_robot

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
    assert len(KINDS) == 19


@pytest.mark.parametrize("kind", some(SPOILT, 5))
def test_a_fault_is_named(sound, kind):
    found = data_fault(SPOILT[kind](sound))
    assert kind in found.kinds
    # what is left is the robot's own gap
    assert found.rms_after < 20.0 * NOISE < 0.01 * found.rms_before
    assert found.rows == ()


@pytest.mark.parametrize(("name", "seed"), some([("rv_m2", 0), ("panda", 1), ("rv_m2", 2), ("panda", 3)], 3))
def test_a_sound_table_has_no_fault(name, seed):
    effects = [["joint_offset"], ["geometric", "drift"], ["backlash"], []][seed]
    sound = simulate(load_arm(name), effects, samples=40, seed=seed, outliers=0.1, heavy=True, ratio=(20.0, 60.0))[0]
    assert data_fault(sound) is None


@pytest.mark.slow
def test_measurements_in_no_order_are_mended_by_nothing(sound):
    shuffled = np.random.default_rng(0).permutation(sound.samples)
    assert data_fault(measured_at(sound, shuffled)) is None


@pytest.mark.parametrize("share", some([0.15, 0.45, 0.55, 0.65], 3))
def test_a_fault_of_some_rows_is_named_with_them(sound, share):
    struck = np.random.default_rng(1).random(sound.samples) < share
    points = replace(sound, orientation=None, noise_orientation=None)
    found = data_fault(with_joints(points, lambda q: np.where(struck[:, None], -q, q), 2))
    assert found.kinds == ("reversed joint",)
    # a joint that is near zero counts alike both ways, and the rows that were struck are most
    assert (np.isin(sound.rows, found.rows) != struck).mean() < 0.05
    if share < 0.5:
        found = data_fault(paired_late(points, struck))
        # the row above is also where the arm was some time before
        assert {"clock offset", "shifted rows"} & set(found.kinds)
        # the first row has none before it; where the arm hardly moved a late row is no other
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


@pytest.mark.parametrize(("kind", "order"), some([("exchanged axes", "yxz"), ("mirrored axis", "xyz")], 2))
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


ARMS = (("rv_m2", 1), ("panda", 2), ("ur10", 3))


@pytest.mark.parametrize(("kind", "arm", "seed"), some(((kind, *arm) for kind in DRAWN for arm in ARMS), 10))
def test_faults_of_drawn_joints_and_sizes_are_named(kind, arm, seed):
    rng = np.random.default_rng(seed)
    sound = simulate(load_arm(arm), ["joint_offset"], samples=50, seed=seed, noise=NOISE, ratio=(20.0, 60.0))[0]
    spoilt, words = DRAWN[kind](sound, rng)
    found = data_fault(spoilt)
    assert kind in found.kinds
    assert all(word in found.what for word in words)


PAIRS = [
    ("reversed joint", "metric unit"),
    ("reversed joints", "inch"),
    ("reversed joints", "degrees read as rad"),
    ("exchanged joints", "inch"),
    ("coupled joints", "reversed joint"),
    ("coupled joints", "reversed joints"),
    ("zero off by 90°", "degrees read as rad"),
    ("coupled joints", "mirrored axis"),
    ("zero off by 180°", "exchanged joints"),
]


@pytest.mark.slow
@pytest.mark.parametrize(("pair", "seed"), some(((pair, seed) for seed in (1, 2) for pair in PAIRS), 2))
def test_two_faults_at_once_are_named_in_one_sentence(pair, seed):
    rng = np.random.default_rng(seed)
    arm = load_arm(["ur10", "panda"][seed % 2])
    spoilt = simulate(arm, ["joint_offset"], samples=60, seed=seed, noise=NOISE, ratio=(20.0, 60.0))[0]
    for kind in pair:
        spoilt, _ = DRAWN[kind](spoilt, rng)
    found = data_fault(spoilt)
    assert set(pair) <= set(found.kinds)
    assert " and " in found.what
    assert found.rms_after < 0.02 * found.rms_before


@pytest.mark.parametrize("unit", some(["quaternion order", "conjugate quaternion", "angles of orientations"], 3))
def test_turns_of_another_convention_are_named_beside_a_fault_of_the_joints(sound, unit):
    found = data_fault(SPOILT[unit](SPOILT["reversed joint"](sound)))
    assert set(found.kinds) == {"reversed joint", unit}
    assert "elbow_joint is reversed" in found.what


# a wrist whose axes meet above a turning column, links in one plane: its own mirror image
_LINK = '<joint name="{0}" type="revolute"><parent link="{1}"/><child link="{2}"/><origin xyz="{3}"/><axis xyz="{4}"/>'
_LINK += '<limit lower="-3" upper="3" effort="1" velocity="1"/></joint>'
MIRRORED = [("0 0 0.4", "0 0 1"), ("0.1 0 0", "0 1 0"), ("0 0 0.6", "0 1 0")]
MIRRORED += [("0.2 0 0.1", "1 0 0"), ("0.5 0 0", "0 1 0"), ("0.1 0 0", "1 0 0")]


def test_reversed_joints_come_before_the_mirrored_instrument_that_does_the_same():
    links = "".join(f'<link name="l{k}"/>' for k in range(7))
    joints = "".join(_LINK.format(f"a{k + 1}", f"l{k}", f"l{k + 1}", *own) for k, own in enumerate(MIRRORED))
    arm = load_robot(f'<robot name="mirrored">{links}{joints}</robot>', tool_frame="l6")
    sound = simulate(arm, ["joint_offset"], samples=60, seed=1, noise=NOISE)[0]
    found = data_fault(with_joints(sound, np.negative, 0, 3, 5))
    assert found.kinds == ("reversed joints", "exchanged axes", "mirrored axis")
    assert found.what.startswith("a1, a4 and a6 count the other way round (as a KUKA's do), or ")
    only = data_fault(with_joints(sound, np.negative, 1, 4))
    assert "a2 and a5 count the other way round" in only.what


FACTORS = (1e3, 1e-3, 25.4, 1.0 / 25.4, 0.0254, 1.0 / 0.0254)


@pytest.mark.parametrize(("factor", "part"), some(((f, part) for f in FACTORS for part in (False, True)), 5))
def test_another_unit_is_told_by_its_factor_in_all_rows_or_in_some(sound, factor, part):
    struck = np.random.default_rng(0).random(sound.samples) < (0.3 if part else 2.0)
    spoilt = replace(sound, position=np.where(struck[:, None], factor, 1.0) * sound.position)
    found = data_fault(spoilt)
    assert found.kinds == (("metric unit",) if round(np.log10(factor), 6) % 1.0 == 0.0 else ("inch",))
    assert f"lengths are {max(factor, 1.0 / factor):.4g} times too {'large' if factor > 1.0 else 'small'}" in found.what
    assert found.rows == (tuple(int(r) for r in sound.rows[struck]) if part else ())


@pytest.mark.slow
def test_what_makes_the_robot_stand_still_mends_nothing():
    """Positions of another robot in a corner of its own: with joints that hardly move any table fits a little."""
    arm, other = load_arm("ur10"), load_arm("panda")
    sound = simulate(arm, samples=60, seed=2)[0]
    foreign = simulate(other, samples=60, seed=5)[0].position
    assert data_fault(replace(sound, position=0.05 * foreign)) is None


@pytest.mark.parametrize(
    ("joint", "other", "sign"),
    some([(2, 1, -1.0), (2, 1, 1.0), (4, 5, 1.0), (4, 5, -1.0), (5, 4, -1.0), (5, 4, 1.0)], 6),
)
def test_a_coupling_is_told_with_its_sign(sound, joint, other, sign):
    found = data_fault(coupled(sound, joint, other, sign))
    assert "coupled joints" in found.kinds
    names, word = sound.robot.joint_names, "plus" if sign > 0 else "minus"
    assert f"{names[joint]} holds {names[joint]} {word} {names[other]}" in found.what
    assert ("Fanuc" in found.what) == ((joint, other, sign) == (2, 1, -1.0))


@pytest.mark.parametrize(("by", "own"), some([(-1, "x y z w"), (1, "w x y z")], 2))
def test_quaternions_under_headers_of_another_order_are_told_either_way(sound, by, own):
    found = data_fault(replace(sound, orientation=np.roll(sound.orientation, by, axis=1)))
    assert "quaternion order" in found.kinds
    assert f"in the order {own}" in found.what
    assert found.rms_after < 20.0 * NOISE


def test_a_pair_of_faults_is_told_once(sound):
    shifted = np.array(sound.q) + np.array([0.0, 0.0, np.pi, np.pi / 2, 0.0, 0.0])
    pairs = data_fault(replace(sound, q=shifted)).what.split(", or ")
    assert len({frozenset(pair.split(" and ")) for pair in pairs}) == len(pairs)
