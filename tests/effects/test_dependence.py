"""A model asks for what its effects depend on in their places, and for nothing that they merely read."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest

from thermal_robot import observe, simulate
from thermal_robot.effects import Backlash, Effect, JointCompliance, Parameter, ThermalElongation, at_joint
from thermal_robot.effects.apply import depends_on


@pytest.fixture(scope="module")
def seen(rv_m2):
    return observe(simulate(rv_m2, {"backlash": 1e-4}, rows=30, seed=2))


@pytest.mark.parametrize("joint", ["joint_2", "joint_5"])
def test_lost_motion_in_one_joint_depends_on_that_joint_alone(seen, joint):
    assert depends_on(Backlash(places=(joint,)), seen) == (f"approach.{joint}",)


def test_lost_motion_in_all_joints_depends_on_all(seen, rv_m2):
    assert depends_on(Backlash(), seen) == tuple(f"approach.{joint}" for joint in rv_m2.joint_names)


def test_a_column_that_equals_another_here_counts(seen):
    link = seen.robot.segments[-1].parent_link
    covariates = {**seen.covariates, f"temperature.{link}": seen.covariates["temperature"]}
    both = observe(replace(seen.campaign, covariates=covariates))
    assert depends_on(ThermalElongation(places=(link,)), both) == (f"temperature.{link}",)


def test_a_column_that_does_not_vary_counts(seen):
    steady = {**seen.covariates, "payload": np.full(30, 1.5), "approach.joint_3": np.ones(30)}
    constant = observe(replace(seen.campaign, covariates=steady))
    assert depends_on(JointCompliance(places=("joint_2",)), constant) == ("payload",)
    assert depends_on(Backlash(places=("joint_3",)), constant) == ("approach.joint_3",)


@dataclass(frozen=True)
class Either(Effect):
    """Follows the speed, or the payload where no speed is recorded; of equal rows nobody can tell which."""

    name: ClassVar[str] = "either"
    title: ClassVar[str] = "either"
    needs: ClassVar[tuple[str, ...]] = ("speed", "payload")

    def parameters(self, observations):
        values = [c for n in self.needs if (c := observations.covariates.get(n)) is not None]
        return (Parameter("share", "rad", 1e-3, "joint", "joint_1", (at_joint(0, np.sum(values, axis=0) > 0.0),)),)


def test_columns_of_which_one_is_needed_are_both_kept(seen):
    some = {**seen.covariates, "speed": np.ones(30), "payload": np.ones(30)}
    assert depends_on(Either(), observe(replace(seen.campaign, covariates=some))) == ("speed", "payload")
