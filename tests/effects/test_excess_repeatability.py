"""Scatter that only repeats of a pose show."""

from dataclasses import replace

import numpy as np
from helpers import commanded

from thermal_robot.effects import ExcessRepeatability
from thermal_robot.observations import observe


def missing(campaign):
    return ExcessRepeatability().missing(observe(campaign))


def test_it_needs_a_pose_that_is_visited_twice(rv_m2):
    once = commanded(rv_m2)
    assert missing(once) == ("pose",)
    q = once.q.copy()
    q[7] = q[2] + 1e-9
    assert missing(replace(once, q=q)) == ()
    q[7, 3] += 1e-4
    assert missing(replace(once, q=q)) == ("pose",)


def test_labels_of_poses_go_before_commands(rv_m2):
    q = np.tile(commanded(rv_m2).q[:1], (10, 1))
    same = replace(commanded(rv_m2), q=q)
    assert missing(same) == ()
    apart = replace(same, labels={"pose": np.array([f"p{k}" for k in range(10)])})
    assert missing(apart) == ("pose",)
    unlabelled = replace(same, labels={"pose": np.array(["p"] + [""] * 9)})
    assert missing(unlabelled) == ("pose",)
    twice = replace(commanded(rv_m2), labels={"pose": np.array(["p", "", "p"] + [""] * 7)})
    assert missing(twice) == ()


def test_its_parameter_is_the_scatter_itself():
    assert (ExcessRepeatability.component, ExcessRepeatability.factor) == ("visit", 1.0)
    assert ExcessRepeatability.label == "standard deviation"
