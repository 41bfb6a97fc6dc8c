"""What the data want on the side where it cannot be is told with the usual mistake, and not named."""

from dataclasses import replace

import numpy as np
import pytest
from simulate import simulate

from thermal_robot import diagnose
from thermal_robot.diagnosis.cautions import contradicted
from thermal_robot.diagnosis.signs import wrong_sides
from thermal_robot.effects import choose
from thermal_robot.inference.fit import fit
from thermal_robot.observations import observe
from thermal_robot.robot import load_robot


def gravity_up(campaign):
    robot = campaign.robot
    return replace(campaign, robot=load_robot(robot.urdf, robot.tool_frame, gravity=-robot.gravity))


def torque_reversed(campaign):
    torque = observe(campaign).torque
    columns = {f"torque.{n}": -t for n, t in zip(campaign.robot.joint_names, torque.T, strict=True)}
    return replace(campaign, covariates={**campaign.covariates, **columns})


def column_reversed(campaign, name, about=0.0):
    changed = {k: 2.0 * about - v for k, v in campaign.covariates.items() if k.startswith(name)}
    return replace(campaign, covariates={**campaign.covariates, **changed})


@pytest.mark.parametrize(
    ("effect", "spoil", "said"),
    [
        ("joint_compliance", gravity_up, "gravity points up"),
        ("joint_compliance", torque_reversed, "the sign of torque.* is reversed"),
        ("backlash", lambda c: column_reversed(c, "approach."), "approach is reversed"),
        (
            "thermal_elongation",
            lambda c: column_reversed(c, "temperature", c.reference_temperature),
            "check the temperature column",
        ),
    ],
)
def test_a_reversed_column_is_told_and_its_effect_is_not_named(rv_m2, effect, spoil, said):
    plain = simulate(rv_m2, [effect], seed=11, ratio=(4.0, 6.0))[0]
    sound, spoilt = (fit(c, choose()) for c in (plain, spoil(plain)))
    assert wrong_sides(sound) == ()
    assert any(said in sentence for sentence in wrong_sides(spoilt))
    for known, values in [*sound.effects, *spoilt.effects]:
        sides = [p.positive for p in known.parameters(sound.nominal)]
        assert not known.places or len(values) < len(sides)
        if not known.places:
            assert (values[np.array(sides)] >= 0.0).all()
    assert [e.name for e, _ in sound.effects] == [effect]
    assert effect not in [e.name for e, _ in spoilt.effects]


@pytest.mark.parametrize(("share", "told"), [(-1.0, True), (-0.3, True), (0.0, False), (0.3, False), (1.0, False)])
def test_torques_that_go_against_gravity_are_told_whatever_explains_the_gap(rv_m2, share, told):
    """Friction and errors of the sensor as large as what holds the arm."""
    plain = simulate(rv_m2, ["joint_offset"], seed=5)[0]
    torque = observe(plain).torque
    read = share * torque + 0.15 * torque.std() * np.random.default_rng(5).normal(size=torque.shape)
    columns = {f"torque.{n}": t for n, t in zip(rv_m2.joint_names, read.T, strict=True)}
    notes = contradicted(replace(plain, covariates={**plain.covariates, **columns}))
    assert any("the sign of torque.* is reversed" in note for note in notes) == told
    assert contradicted(plain) == []


def test_directions_that_nobody_recorded_are_not_reversed_but_wrongly_derived(rv_m2):
    plain = simulate(rv_m2, ["backlash"], seed=11, ratio=(4.0, 6.0))[0]
    spoilt = column_reversed(plain, "approach.")
    derived = tuple(name for name in plain.covariates if name.startswith("approach."))
    (said,) = wrong_sides(fit(replace(spoilt, derived=derived), choose()))
    assert "the robot does not go straight" in said
    assert "reversed" not in said


@pytest.mark.slow
def test_the_sentence_stands_in_text_and_json(rv_m2):
    plain = simulate(rv_m2, ["backlash"], seed=3, ratio=(4.0, 6.0))[0]
    found = diagnose(column_reversed(plain, "approach."))
    assert any("approach is reversed" in w for w in found.to_dict()["campaign"]["warnings"])
    assert "approach is reversed" in " ".join(str(found).split())
