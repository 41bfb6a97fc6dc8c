"""Covariates that an error may follow: their units, what is rounding or rest or a twin, and what drives an effect."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import SAMPLES, commanded

from thermal_robot.effects.quantities import (
    GRAVITY,
    REACH,
    began,
    driving,
    position_of,
    quantities,
    quantity,
    resolution,
    torque_columns,
    unit,
    varies,
    without_twins,
)
from thermal_robot.kinematics import tool_poses
from thermal_robot.observations import observe

RNG = np.random.default_rng(4)
STILL = 0.7 + 7e-7 * RNG.uniform(-1.0, 1.0, 200)  # to 1.4 µrad, however many digits


def test_a_quantity_has_the_unit_of_its_column_and_of_how_its_joint_moves(awkward, rv_m2):
    per_joint = {"{}": "rad", "encoder.{}": "rad", "velocity.{}": "rad/s", "acceleration.{}": "rad/s²"}
    for joint, kind in zip(awkward.joint_names, awkward.joint_types, strict=True):
        slides = kind == "prismatic"
        for name, turning in per_joint.items():
            assert unit(awkward, name.format(joint)) == (turning.replace("rad", "m") if slides else turning)
        assert unit(awkward, f"torque.{joint}") == ("N" if slides else "N·m")
        assert unit(awkward, f"approach.{joint}") == ""
    expected = {"time": "s", "temperature": "°C", "temperature.hand": "°C", "payload": "kg", "reach.x": "m"}
    unknown = (
        "order",
        "session",
        "speed",
        "gravity.x",
        "humidity",
        "velocity.nobody",
        "torque",
        "time.start",
        "reach.w",
    )
    assert {name: unit(rv_m2, name) for name in (*expected, *unknown)} == {**expected, **dict.fromkeys(unknown, "")}
    # a joint that is called like a column is still a joint
    renamed = replace(awkward, joint_names=("time", *awkward.joint_names[1:]))
    assert unit(renamed, "time") == ("m" if awkward.joint_types[0] == "prismatic" else "rad")


@pytest.mark.parametrize(
    ("values", "unit", "said"),
    [
        (STILL, "rad", False),
        (np.where(RNG.random(200) < 0.5, 21.0, 21.125), "°C", False),  # the last digit of a sensor
        (np.round(RNG.uniform(21.0, 21.6, 200), 1), "°C", True),
        (np.where(RNG.random(200) < 0.5, 20.0, 35.0), "°C", True),  # two days, not two digits
        (np.where(RNG.random(200) < 0.5, 0.0, 1.0), "rad", True),  # two poses
        (np.where(RNG.random(200) < 0.5, 0.0, 1.2), "kg", True),
        (np.where(RNG.random(200) < 0.5, -1.0, 1.0), "", True),
        (RNG.uniform(-1.0, 1.0, 200), "rad", True),
        (np.full(200, 3.0), "kg", False),
        (np.array([]), "rad", False),
    ],
)
def test_what_varies_by_no_more_than_it_is_read_to_does_not_vary(values, unit, said):
    assert varies(values, resolution(values, unit)) is said


def test_digits_beyond_what_an_instrument_tells_do_not_count():
    fine = np.round(RNG.uniform(20.0, 30.0, 500), 6)
    found = [resolution(values, "°C") for values in (fine, np.round(fine, 1), np.arange(0.0, 100.0, 5.0))]
    assert found == [0.05, pytest.approx(0.1), 0.5]


def test_a_twin_goes_and_what_says_more_or_stands_alone_stays():
    q = RNG.uniform(-1.0, 1.0, 300)
    readings = {
        "elbow": q,
        "shoulder": q[::-1],
        "encoder.elbow": q + 1e-3 * RNG.standard_normal(300),
        "encoder.shoulder": q,  # of another joint's motion: somebody exchanged the columns, and it says more
        "temperature": 20.0 + q,
        "temperature.arm": 20.0 + q,
        "temperature.hand": 20.0 + q**2,
        "encoder.nobody": q,
    }
    twins = {"encoder.elbow", "temperature.arm"}
    assert set(without_twins(readings, ("elbow", "shoulder"))) == set(readings) - twins
    alone = dict.fromkeys(twins, STILL)
    assert without_twins(alone, ("elbow",)) == alone


def test_only_what_varies_is_a_quantity(rv_m2):
    q = commanded(rv_m2).q.copy()
    q[:, 1] = 0.3 + 7e-7 * np.linspace(-1.0, 1.0, SAMPLES)
    recorded = {
        "temperature": np.full(SAMPLES, 21.0),
        "payload": np.linspace(0.0, 2.0, SAMPLES),
        "encoder.joint_3": q[:, 2] + 1e-4 * np.sin(np.arange(SAMPLES)),
        "encoder.joint_2": q[:, 1],
    }
    found = quantities(observe(replace(commanded(rv_m2, recorded), q=q)))
    assert {"payload", "joint_1", "joint_3"} <= set(found)
    assert not {"temperature", "joint_2", "session", "encoder.joint_2", "encoder.joint_3"} & set(found)
    assert all(values.shape == (SAMPLES,) and np.ptp(values) > 0 for values in found.values())
    # a wrist that keeps pointing down has no direction of gravity, and without gravity nothing points down
    turned = np.tile(commanded(rv_m2).q[:1], (SAMPLES, 1))
    turned[:, 0] = np.linspace(-1.0, 1.0, SAMPLES)  # about the vertical
    turned[:, 4] += 1e-3 * np.linspace(0.0, 1.0, SAMPLES)
    floating = replace(commanded(rv_m2), robot=replace(rv_m2, gravity=np.zeros(3)))
    for campaign in (replace(commanded(rv_m2), q=turned), floating):
        assert not set(GRAVITY) & set(quantities(observe(campaign)))


def test_the_row_stands_in_for_a_clock_only_where_there_is_none(rv_m2):
    np.testing.assert_array_equal(quantities(observe(commanded(rv_m2)))["order"], np.arange(SAMPLES))
    for clock in ("time", "order"):
        values = 5.0 + 2.0 * np.arange(SAMPLES)
        found = quantities(observe(commanded(rv_m2, {clock: values})))
        assert {"time", "order"} & set(found) == {clock}
        np.testing.assert_array_equal(found[clock], values)


def test_a_session_counts_in_the_alphabet_and_begins_with_the_first_of_its_rows(rv_m2):
    labels, clock = np.array(list("bacabbacca")), np.arange(float(SAMPLES))[::-1]
    campaign = commanded(rv_m2, {"time": clock}, labels={"session": labels})
    np.testing.assert_array_equal(quantities(observe(campaign))["session"], [1, 0, 2, 0, 1, 1, 0, 2, 2, 0])
    assert quantity(observe(replace(campaign, labels={"session": np.array(["a"] * SAMPLES)})), "session") is None
    assert began(observe(replace(campaign, labels={})), clock) == {"": 0.0}
    assert began(observe(campaign), clock) == {"a": 0.0, "b": 4.0, "c": 1.0}


@pytest.mark.parametrize("arm", ["rv_m2", "ur10", "awkward"], indirect=True)
def test_gravity_in_the_tool_is_a_unit_vector_that_points_down(arm):
    observations = observe(commanded(arm))
    seen, reach = (np.column_stack([quantity(observations, name) for name in names]) for names in (GRAVITY, REACH))
    np.testing.assert_allclose(np.linalg.norm(seen, axis=1), 1.0, rtol=1e-12)
    poses, down = tool_poses(arm, observations.q), arm.gravity / np.linalg.norm(arm.gravity)
    np.testing.assert_allclose(np.einsum("nij,nj->ni", poses[:, :3, :3], seen), np.tile(down, (SAMPLES, 1)), atol=1e-12)
    np.testing.assert_allclose(reach, poses[:, :3, 3], atol=1e-12)


def test_what_drives_an_effect_has_its_unit_and_varies(rv_m2):
    recorded = {"temperature": np.linspace(20.0, 25.0, SAMPLES), "payload": np.ones(SAMPLES)}
    observations = observe(commanded(rv_m2, recorded))
    name, its_unit, values = driving(observations, "temperature")
    assert (name, its_unit) == ("temperature", "°C")
    np.testing.assert_array_equal(values, recorded["temperature"])
    assert driving(observations, "payload") is driving(observations, "humidity") is None
    assert position_of(observations, "joint_2")[:2] == ("position of joint_2", "rad")
    np.testing.assert_array_equal(position_of(observations, "joint_2")[2], observations.q[:, 1])


def test_a_joints_torque_is_read_from_its_sensor_and_from_the_payload_where_it_is_computed(rv_m2):
    torques = tuple(f"torque.{joint}" for joint in rv_m2.joint_names)

    def seen(**columns):
        return observe(commanded(rv_m2, {c: np.full(SAMPLES, v) for c, v in columns.items()}))

    for columns, expected in (
        ((), ()),
        (("payload",), ("payload",)),
        (("payload", torques[1]), ("payload", torques[1])),
        (("payload", *torques), torques),
        (torques[::-1], torques),
        (("torque.gripper", "temperature"), ()),
    ):
        assert torque_columns(seen(**dict.fromkeys(columns, 1.0))) == expected
    # these columns are what the torque follows
    columns = {"payload": 1.0, "torque.joint_2": 5.0, "temperature": 20.0}
    before, followed = seen(**columns).torque, set()
    for column, value in columns.items():
        if not np.array_equal(seen(**{**columns, column: value + 1.0}).torque, before):
            followed.add(column)
    assert set(torque_columns(seen(**columns))) == followed
