"""Which columns a joint's torque is read from."""

import numpy as np
from helpers import SAMPLES, commanded

from thermal_robot.effects.quantities import torque_columns
from thermal_robot.observations import observe


def read(robot, *columns):
    return torque_columns(observe(commanded(robot, {c: np.ones(SAMPLES) for c in columns})))


def test_a_payload_counts_where_a_torque_has_to_be_computed(rv_m2):
    torques = tuple(f"torque.{joint}" for joint in rv_m2.joint_names)
    assert read(rv_m2) == ()
    assert read(rv_m2, "payload") == ("payload",)
    assert read(rv_m2, "payload", torques[1]) == ("payload", torques[1])
    assert read(rv_m2, "payload", *torques) == torques
    assert read(rv_m2, *torques[::-1]) == torques


def test_a_torque_of_no_joint_of_the_chain_is_not_read(rv_m2):
    assert read(rv_m2, "torque.gripper", "temperature") == ()


def test_these_columns_are_what_the_torque_follows(rv_m2):
    columns = {"payload": 1.0, "torque.joint_2": 5.0, "temperature": 20.0}
    before = observe(commanded(rv_m2, {c: np.full(SAMPLES, v) for c, v in columns.items()})).torque
    followed = set()
    for column in columns:
        changed = {c: np.full(SAMPLES, v + (c == column)) for c, v in columns.items()}
        if not np.array_equal(observe(commanded(rv_m2, changed)).torque, before):
            followed.add(column)
    assert set(read(rv_m2, *columns)) == followed
