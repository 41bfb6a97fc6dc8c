"""What an error may follow, its unit, and that only what varies is listed."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import SAMPLES, commanded

from thermal_robot.effects.quantities import GRAVITY, REACH, began, driving, position_of, quantities, quantity, unit
from thermal_robot.kinematics import tool_poses
from thermal_robot.observations import observe


@pytest.mark.parametrize(
    ("name", "turning", "sliding"),
    [
        ("{}", "rad", "m"),
        ("encoder.{}", "rad", "m"),
        ("velocity.{}", "rad/s", "m/s"),
        ("acceleration.{}", "rad/s²", "m/s²"),
        ("torque.{}", "N·m", "N"),
        ("approach.{}", "", ""),
    ],
)
def test_a_quantity_of_a_joint_has_the_unit_of_how_the_joint_moves(awkward, name, turning, sliding):
    for joint, kind in zip(awkward.joint_names, awkward.joint_types, strict=True):
        assert unit(awkward, name.format(joint)) == (sliding if kind == "prismatic" else turning)


def test_what_no_joint_of_the_chain_records_has_no_known_unit(awkward):
    assert {unit(awkward, name) for name in ("velocity.nobody", "torque", "time.start", "reach.w")} == {""}


def test_other_quantities_have_the_unit_of_their_column(rv_m2):
    expected = {"time": "s", "temperature": "°C", "temperature.hand": "°C", "payload": "kg", "reach.x": "m"}
    assert {name: unit(rv_m2, name) for name in expected} == expected
    assert {unit(rv_m2, name) for name in ("order", "session", "speed", "gravity.x", "humidity")} == {""}


def test_a_joint_that_is_called_like_a_column_is_still_a_joint(awkward):
    # the awkward arm has a link and a joint of one name; a joint named like a quantity is its position
    renamed = replace(awkward, joint_names=("time", *awkward.joint_names[1:]))
    assert unit(renamed, "time") == ("m" if awkward.joint_types[0] == "prismatic" else "rad")


def test_what_does_not_vary_is_no_quantity(rv_m2):
    q = commanded(rv_m2).q.copy()
    q[:, 1] = 0.3
    recorded = {"temperature": np.full(SAMPLES, 21.0), "payload": np.linspace(0.0, 2.0, SAMPLES)}
    found = quantities(observe(replace(commanded(rv_m2, recorded), q=q)))
    assert "payload" in found
    assert not {"temperature", "joint_2", "session"} & set(found)
    assert all(values.shape == (SAMPLES,) and np.ptp(values) > 0 for values in found.values())


def test_a_joint_that_stands_still_and_a_twin_are_no_quantities(rv_m2):
    campaign = commanded(rv_m2)
    q = campaign.q.copy()
    q[:, 1] = 0.3 + 7e-7 * np.linspace(-1.0, 1.0, SAMPLES)
    recorded = {"encoder.joint_3": q[:, 2] + 1e-4 * np.sin(np.arange(SAMPLES)), "encoder.joint_2": q[:, 1]}
    found = quantities(observe(replace(campaign, q=q, covariates=recorded)))
    assert {"joint_1", "joint_3"} < set(found)
    assert not {"joint_2", "encoder.joint_2", "encoder.joint_3"} & set(found)


def test_a_wrist_that_keeps_pointing_down_has_no_direction_of_gravity(rv_m2):
    campaign = commanded(rv_m2)
    q = np.tile(campaign.q[:1], (SAMPLES, 1))
    q[:, 0] = np.linspace(-1.0, 1.0, SAMPLES)  # about the vertical
    q[:, 4] += 1e-3 * np.linspace(0.0, 1.0, SAMPLES)
    assert not set(GRAVITY) & set(quantities(observe(replace(campaign, q=q))))


def test_the_row_stands_in_for_a_clock_only_where_there_is_none(rv_m2):
    np.testing.assert_array_equal(quantities(observe(commanded(rv_m2)))["order"], np.arange(SAMPLES))
    for clock in ("time", "order"):
        values = 5.0 + 2.0 * np.arange(SAMPLES)
        found = quantities(observe(commanded(rv_m2, {clock: values})))
        assert {"time", "order"} & set(found) == {clock}
        np.testing.assert_array_equal(found[clock], values)


def test_a_session_counts_in_the_alphabet(rv_m2):
    labels = np.array(["b", "a", "c", "a", "b", "b", "a", "c", "c", "a"])
    campaign = replace(commanded(rv_m2), labels={"session": labels})
    np.testing.assert_array_equal(quantities(observe(campaign))["session"], [1, 0, 2, 0, 1, 1, 0, 2, 2, 0])
    one = replace(campaign, labels={"session": np.array(["a"] * SAMPLES)})
    assert quantity(observe(one), "session") is None


@pytest.mark.parametrize("arm", ["rv_m2", "ur10", "awkward"], indirect=True)
def test_gravity_in_the_tool_is_a_unit_vector_that_points_down(arm):
    observations = observe(commanded(arm))
    seen = np.column_stack([quantity(observations, name) for name in GRAVITY])
    np.testing.assert_allclose(np.linalg.norm(seen, axis=1), 1.0, rtol=1e-12)
    poses = tool_poses(arm, observations.q)
    down = arm.gravity / np.linalg.norm(arm.gravity)
    np.testing.assert_allclose(np.einsum("nij,nj->ni", poses[:, :3, :3], seen), np.tile(down, (SAMPLES, 1)), atol=1e-12)
    reach = np.column_stack([quantity(observations, name) for name in REACH])
    np.testing.assert_allclose(reach, poses[:, :3, 3], atol=1e-12)


def test_without_gravity_nothing_points_down(rv_m2):
    floating = observe(replace(commanded(rv_m2), robot=replace(rv_m2, gravity=np.zeros(3))))
    assert not set(GRAVITY) & set(quantities(floating))


def test_what_drives_an_effect_has_its_unit_and_varies(rv_m2):
    recorded = {"temperature": np.linspace(20.0, 25.0, SAMPLES), "payload": np.ones(SAMPLES)}
    observations = observe(commanded(rv_m2, recorded))
    name, its_unit, values = driving(observations, "temperature")
    assert (name, its_unit) == ("temperature", "°C")
    np.testing.assert_array_equal(values, recorded["temperature"])
    assert driving(observations, "payload") is None
    assert driving(observations, "humidity") is None
    assert position_of(observations, "joint_2")[:2] == ("position of joint_2", "rad")
    np.testing.assert_array_equal(position_of(observations, "joint_2")[2], observations.q[:, 1])


def test_a_session_begins_with_the_first_of_its_rows_in_whatever_order(rv_m2):
    clock = np.arange(float(SAMPLES))[::-1]
    campaign = commanded(rv_m2, {"time": clock})
    assert began(observe(campaign), clock) == {"": 0.0}
    labels = {"session": np.repeat(["late", "early"], [4, SAMPLES - 4])}
    seen = observe(replace(campaign, labels=labels))
    assert began(seen, clock) == {"early": 0.0, "late": float(SAMPLES - 4)}
