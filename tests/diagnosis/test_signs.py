"""What counts the other way is read with the other sign where all that can tell agree, and is told first."""

from dataclasses import replace

import numpy as np
import pytest
from conftest import load_arm
from simulate import simulate

from thermal_robot import CorrectedModel, calibrate, diagnose
from thermal_robot.diagnosis.data_checks import SAID, STRAIGHT, as_counted
from thermal_robot.effects import choose
from thermal_robot.inference.fit import fit
from thermal_robot.observations import observe
from thermal_robot.robot import load_robot

ARMS = ("rv_m2", "panda", "ur10")


def gravity_up(campaign):
    robot = campaign.robot
    return replace(campaign, robot=load_robot(robot.urdf, robot.tool_frame, gravity=-robot.gravity))


def with_torques(campaign, signs):
    torque = observe(campaign).torque * signs
    columns = {f"torque.{n}": t for n, t in zip(campaign.robot.joint_names, torque.T, strict=True)}
    return replace(campaign, covariates={**campaign.covariates, **columns})


def mirrored(campaign, name, about=0.0):
    changed = {k: 2.0 * about - v for k, v in campaign.covariates.items() if k.startswith(name)}
    return replace(campaign, covariates={**campaign.covariates, **changed})


SPOILT = {
    "torque": ("joint_compliance", lambda c: with_torques(c, -1.0)),
    "gravity": ("joint_compliance", gravity_up),
    "approach": ("backlash", lambda c: mirrored(c, "approach.")),
    "temperature": ("thermal_elongation", lambda c: mirrored(c, "temperature", c.reference_temperature)),
}


@pytest.mark.parametrize("arm", ARMS)
@pytest.mark.parametrize("quantity", SPOILT)
def test_what_counts_the_other_way_is_read_with_the_other_sign(quantity, arm):
    effect, spoil = SPOILT[quantity]
    plain = simulate(load_arm(arm), [effect], seed=11, ratio=(4.0, 6.0))[0]
    spoilt = spoil(plain)
    read = as_counted(spoilt)
    assert read.warnings[0] == SAID[quantity]
    assert read.turned == (() if quantity == "gravity" else (quantity,))
    np.testing.assert_array_equal(read.robot.gravity, plain.robot.gravity)
    for name, values in plain.covariates.items():
        np.testing.assert_allclose(read.covariates[name], values, atol=1e-12)
    assert [e.name for e, _ in fit(read, choose([effect], (), ())).effects] == [effect]


@pytest.mark.parametrize("arm", ARMS)
@pytest.mark.parametrize("seed", [3, 8])
@pytest.mark.parametrize("names", [[], ["geometric"], *([effect] for effect, _ in SPOILT.values())])
def test_what_counts_as_it_should_stays(names, seed, arm):
    plain = with_torques(simulate(load_arm(arm), names, seed=seed, ratio=(1.0, 6.0))[0], 1.0)
    read = as_counted(plain)
    assert (read.turned, read.warnings) == ((), plain.warnings)
    np.testing.assert_array_equal(read.robot.gravity, plain.robot.gravity)


def test_where_those_that_can_tell_disagree_nothing_is_turned(rv_m2):
    """Half of the joints count the load: no one sign is right."""
    plain = simulate(rv_m2, ["joint_compliance"], seed=11, ratio=(4.0, 6.0))[0]
    mixed = with_torques(plain, np.where(np.arange(rv_m2.n) == 1, 1.0, -1.0))
    assert as_counted(mixed).turned == ()


@pytest.mark.parametrize(("share", "told"), [(-1.0, True), (-0.3, True), (0.0, False), (0.3, False), (1.0, False)])
def test_torques_that_go_against_gravity_are_told_whatever_explains_the_gap(rv_m2, share, told):
    """Friction and errors of the sensor as large as what holds the arm; nothing yields, so that nothing is turned."""
    plain = simulate(rv_m2, ["joint_offset"], seed=5)[0]
    torque = observe(plain).torque
    read = share * torque + 0.15 * torque.std() * np.random.default_rng(5).normal(size=torque.shape)
    columns = {f"torque.{n}": t for n, t in zip(rv_m2.joint_names, read.T, strict=True)}
    found = as_counted(replace(plain, covariates={**plain.covariates, **columns}))
    assert any("the sign of torque.* is reversed" in note for note in found.warnings) == told
    assert found.turned == ()


def test_directions_that_nobody_recorded_are_not_reversed_but_wrongly_derived(rv_m2):
    plain = simulate(rv_m2, ["backlash"], seed=11, ratio=(4.0, 6.0))[0]
    derived = tuple(name for name in plain.covariates if name.startswith("approach."))
    found = as_counted(replace(mirrored(plain, "approach."), derived=derived))
    assert (found.turned, found.warnings[0]) == ((), STRAIGHT)


def test_a_calibration_reads_it_so_too(rv_m2):
    plain = simulate(rv_m2, ["backlash"], seed=3, ratio=(4.0, 6.0))[0]
    sound, other = calibrate(plain, "backlash"), calibrate(mirrored(plain, "approach."), "backlash")
    np.testing.assert_allclose(other.parameters.value, sound.parameters.value, rtol=1e-6)
    assert other.warnings[0] == SAID["approach"]


@pytest.mark.slow
def test_the_model_reads_samples_and_new_rows_as_the_campaign(rv_m2, tmp_path):
    """The table of samples counts the other way as that of the campaign does; so do rows that are added."""
    plain = simulate(rv_m2, ["backlash"], seed=3, ratio=(4.0, 6.0))[0]
    spoilt = mirrored(plain, "approach.")
    sound, found = diagnose(plain), diagnose(spoilt)
    assert found.verdict == sound.verdict
    assert SAID["approach"] == found.to_dict()["campaign"]["warnings"][0]
    assert SAID["approach"][:40] in " ".join(str(found).split())
    found.model.save(tmp_path / "model.json")
    for model in (found.model, CorrectedModel.load(tmp_path / "model.json")):
        for samples in (spoilt, spoilt.to_frame()):
            position = model.predict(samples)
            position = position[0] if isinstance(position, tuple) else position[["x", "y", "z"]].to_numpy()
            expected = sound.model.predict(plain)[0] / (1.0 if samples is spoilt else plain.units.length_scale)
            np.testing.assert_allclose(position, expected, rtol=1e-7)
    more = found.update(spoilt.take(np.arange(10)))
    np.testing.assert_allclose(more.model.predict(spoilt)[0], found.model.predict(spoilt)[0], atol=2e-4)
