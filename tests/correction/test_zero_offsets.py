"""Zeros for the controller: with the sign that mends them, of explicit offsets and of those inside geometry."""

from dataclasses import replace

import denavit
import numpy as np
import pytest
from conftest import load_arm
from readers import model_of
from simulate import simulate

from thermal_robot import CorrectedModel, diagnose, load_robot
from thermal_robot import simulate as run_of
from thermal_robot.campaign import Units
from thermal_robot.correction import zero_offsets
from thermal_robot.correction.constant import NONE, TOLD, UNSEEN
from thermal_robot.effects import Geometric, JointGain, JointOffset, gate
from thermal_robot.kinematics import exp6, tool_poses
from thermal_robot.observations import Frames
from thermal_robot.prediction import Spread

ASIDE = Frames(np.eye(4), exp6([0.05, 0.02, 0.1, 0.0, 0.0, 0.0]))
"""A target that stands off the axis of the last joint."""


def test_what_is_added_to_the_commands_brings_the_robot_where_it_was_meant_to_be(rv_m2, configurations):
    offsets = np.array([1e-3, -2e-3, 3e-3, -4e-3, 5e-3])
    table = zero_offsets(model_of(rv_m2, (JointOffset(), offsets), base_known=True, tool_known=True, frames=ASIDE))
    assert set(table["zero"]) == {TOLD}
    q = configurations(rv_m2, 20)
    real = tool_poses(rv_m2, q + table["add_to_command"].to_numpy() + offsets)
    np.testing.assert_allclose(real, tool_poses(rv_m2, q), atol=1e-12)


def test_units_and_deviations_are_those_of_the_campaign(awkward):
    offsets, n = np.full(awkward.n, 1e-3), awkward.n
    model = model_of(
        awkward, (JointOffset(), offsets), base_known=True, tool_known=True, units=Units("deg", "mm"), frames=ASIDE
    )
    model = replace(
        model, spread=Spread(np.diag(np.arange(1.0, n + 1) ** 2) * 1e-8, *np.zeros((2, 3)), prior=np.full(n, 0.01))
    )
    table = zero_offsets(model)
    slides = np.array([kind == "prismatic" for kind in awkward.joint_types])
    assert table["unit"].tolist() == np.where(slides, "mm", "deg").tolist()
    scale = np.where(slides, 1e3, np.degrees(1.0))
    np.testing.assert_allclose(table["add_to_command"], -1e-3 * scale, rtol=1e-6)
    np.testing.assert_allclose(table["std"], 1e-4 * np.arange(1, n + 1) * scale, rtol=1e-6)


def test_what_frames_can_take_up_is_not_told(rv_m2):
    model = model_of(rv_m2, (JointOffset(), np.full(5, 1e-3)), frames=ASIDE)
    assert zero_offsets(model)["zero"].tolist() == [UNSEEN, TOLD, TOLD, TOLD, UNSEEN]
    assert zero_offsets(model)["add_to_command"].tolist()[0] == 0.0
    base = model_of(rv_m2, (JointOffset(), np.full(5, 1e-3)), base_known=True, frames=ASIDE)
    assert zero_offsets(base)["zero"].tolist() == [TOLD, TOLD, TOLD, TOLD, UNSEEN]


def test_what_the_model_does_not_hold_is_said(rv_m2):
    assert set(zero_offsets(model_of(rv_m2, base_known=True, tool_known=True, frames=ASIDE))["zero"]) == {NONE}
    gain = model_of(rv_m2, (JointGain(), np.full(5, 1e-3)), base_known=True, tool_known=True, frames=ASIDE)
    assert set(zero_offsets(gain)["zero"]) == {NONE}
    one = JointOffset(places=("joint_3",))
    assert zero_offsets(model_of(rv_m2, (one, [2e-3]), frames=ASIDE))["zero"].tolist() == [
        UNSEEN,
        NONE,
        TOLD,
        NONE,
        UNSEEN,
    ]


@pytest.mark.parametrize("turning", [None, 3e-5])
def test_zeros_inside_geometry_are_those_of_the_diagnosis(turning):
    """And the true ones, which were put there with the errors of axes beside them."""
    campaign, truth = denavit.off(load_arm("ur10"), 3, turning=turning)
    found = diagnose(campaign, only=["geometric", "joint_offset"])
    assert found.verdict == ("geometric",)
    table = zero_offsets(found.model).set_index("joint")
    known = {p.name.split(", ")[1]: p for p in found.finding("joint_offset").parameters if p.identified}
    assert len(known) >= 4
    for joint, zero in known.items():
        row = table.loc[joint]
        assert row["zero"] == TOLD
        assert -row["add_to_command"] == pytest.approx(zero.value, abs=0.5 * zero.std)
        assert row["std"] == pytest.approx(zero.std, rel=0.2)
        true = truth[list(campaign.robot.joint_names).index(joint)]
        assert abs(-row["add_to_command"] - true) < 4.0 * row["std"]
    assert table["zero"].iloc[[0, -1]].tolist() == [UNSEEN, UNSEEN]


def test_geometry_that_is_a_zero_is_told_as_one(rv_m2):
    """A placement turned about its joint's own axis, and nothing else."""
    geometry = Geometric()
    model = model_of(rv_m2, (geometry, np.zeros(42)), base_known=True, tool_known=True, frames=ASIDE)
    from thermal_robot.correction.constant import rows_of_every_kind

    listed = gate.checked(geometry, rows_of_every_kind(model_of(rv_m2)))
    segment = next(s for s, one in enumerate(rv_m2.segments) if one.name == "joint_3")
    axis = rv_m2.chain.axes[rv_m2.segments[segment].index]
    twist = np.concatenate([np.zeros(3), 2e-3 * axis])
    values = [twist @ p.responses[0].values if p.responses[0].index == segment else 0.0 for p in listed]
    whole = replace(model, effects=((geometry, np.array(values)),))
    table = zero_offsets(whole)
    np.testing.assert_allclose(table["add_to_command"], [0, 0, -2e-3, 0, 0], atol=1e-12)


def wide(model, std, prior=None):
    """The model with such deviations of its zeros."""
    return replace(model, spread=Spread(np.diag(np.square(std)), np.zeros(3), np.zeros(3), prior=prior))


def test_a_zero_that_the_data_leave_as_wide_as_it_was_is_not_determined(rv_m2):
    model = model_of(rv_m2, (JointOffset(), np.full(5, 2e-3)), base_known=True, tool_known=True, frames=ASIDE)
    std = np.array([4.9e-4, 5.1e-4, 1e-4, 9e-4, 1e-5])
    table = zero_offsets(wide(model, std, np.full(5, 1e-3)))
    assert table["zero"].tolist() == [TOLD, UNSEEN, TOLD, UNSEEN, TOLD]
    np.testing.assert_allclose(table["add_to_command"], [-2e-3, 0.0, -2e-3, 0.0, -2e-3])
    assert table["std"].isna().tolist() == [False, True, False, True, False]
    assert zero_offsets(wide(model, std, np.full(5, 1e-2)))["zero"].tolist() == [TOLD] * 5
    # a file of an older program: what the effect expects of itself, which is 1 mrad
    assert zero_offsets(wide(model, std))["zero"].tolist() == [TOLD, UNSEEN, TOLD, UNSEEN, TOLD]


@pytest.mark.parametrize("effects", [["joint_offset"], ["geometric", "joint_offset"]])
def test_what_a_diagnosis_does_not_identify_is_not_to_be_entered(effects, tmp_path):
    zeros = {"joint_offset": {"shoulder_lift_joint": 2e-3, "elbow_joint": -1.5e-3}}
    ur5 = load_robot("example-robot-data:ur5", "tool0")
    verdicts = []
    for seed in range(4):
        campaign = run_of(ur5, zeros, rows=40, noise=2e-4, seed=seed, base_known=False)
        found = diagnose(campaign, only=effects)
        found.model.save(tmp_path / "model.json")
        told = zero_offsets(CorrectedModel.load(tmp_path / "model.json")).set_index("joint")["zero"] == TOLD
        identified = {p.name.split(", ")[1] for p in found.finding("joint_offset").parameters if p.identified}
        assert set(told.index[told]) == identified
        verdicts += [len(identified) < len(found.finding("joint_offset").parameters)]
    assert any(verdicts)  # and some are not


def test_small_zeros_are_left_out_on_request(rv_m2):
    model = diagnose(simulate(rv_m2, ["joint_offset"], seed=2)[0], only=["joint_offset"]).model
    all_, few = zero_offsets(model), zero_offsets(model, min_sigma=1e3)
    assert (all_["add_to_command"] != 0.0).any()
    assert not few["add_to_command"].any()
