"""The value of a calibration: what is told, in parts and as a model, and what it says of a remainder."""

from dataclasses import FrozenInstanceError

import numpy as np
import pytest

import thermal_robot as tr

NOISE = 3e-5
OFF = {"joint_2": 1e-3, "joint_3": -7e-4}


@pytest.fixture(scope="module")
def campaign():
    return tr.simulate(
        "builtin:rv_m2", {"joint_offset": OFF}, rows=60, noise=NOISE, base=np.eye(4), tool_frame="tool0", seed=6,
        measures="pose", noise_orientation=1e-4,
    )  # fmt: skip


def test_zeros_are_told_inside_the_geometry_and_as_they_are(campaign):
    found = tr.calibrate(campaign)
    assert [(effect.name, effect.inside) for effect in found.effects] == [
        ("joint_offset", "geometric"),
        ("geometric", "geometric"),
    ]
    told = found.parameters.loc["joint_offset"]
    for joint, true in OFF.items():
        one = told.loc[f"zero offset, {joint}"]
        assert one.value == pytest.approx(true, abs=4.0 * one["std"])
    assert "zero offset, joint_1" in found.effects[0].unseen  # the base does the same


def test_alone_they_are_known_better(campaign):
    both, alone = tr.calibrate(campaign).parameters, tr.calibrate(campaign, "joint_offset").parameters
    shared = both.loc["joint_offset"].index.intersection(alone.loc["joint_offset"].index)
    assert len(shared) >= 2
    assert (alone.loc["joint_offset"].loc[shared, "std"] <= both.loc["joint_offset"].loc[shared, "std"]).all()


def test_turns_shrink_as_places_do(campaign):
    found = tr.calibrate(campaign)
    assert found.turned_after < found.turned_before
    assert found.turned_after == pytest.approx(np.sqrt(3.0) * 1e-4, rel=0.2)
    assert found.rms_after == pytest.approx(np.sqrt(3.0) * NOISE, rel=0.2)
    positions = tr.calibrate(tr.simulate("builtin:rv_m2", rows=40, noise=NOISE, tool_frame="tool0"), "backlash")
    assert positions.turned_before is positions.turned_after is None


def test_its_model_leaves_what_it_says(campaign):
    found = tr.calibrate(campaign)
    left = found.model.predict(campaign)[0] - campaign.position
    assert np.sqrt((left**2).sum(axis=1).mean()) == pytest.approx(found.rms_after, rel=1e-6)
    assert found.model.frames is found.fit.corrected.frames
    assert list(found.frames.index) == ["base", "tool"]


def test_a_remainder_that_is_no_noise_is_said_and_widens_deviations():
    worn = {"joint_offset": OFF, "backlash": {"joint_3": 8e-4}}
    campaign = tr.simulate("builtin:rv_m2", worn, rows=80, noise=2e-5, tool_frame="tool0", seed=2)
    without, whole = (tr.calibrate(campaign, names) for names in ("joint_offset", ["joint_offset", "backlash"]))
    assert without.unexplained
    assert not whole.unexplained
    narrow = np.sqrt(np.diag(without.fit.explanation.values[0][1]))
    told = without.parameters["std"].dropna()
    assert (told.to_numpy() >= narrow[: len(told)] * (1.0 - 1e-9)).all()
    assert (told.to_numpy() > 1.05 * narrow[: len(told)]).any()


def test_it_is_frozen_and_short_in_a_list(campaign):
    found = tr.calibrate(campaign)
    assert repr(found) == "Calibration('simulated': joint_offset, geometric)"
    with pytest.raises(FrozenInstanceError):
        found.noise = 1.0
