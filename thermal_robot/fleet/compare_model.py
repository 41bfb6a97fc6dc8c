"""A model file in the place of a campaign: what a comparison can know where the rows are no longer at hand.

The file holds the effects that were found with their values, the covariance C of frames and parameters, the deviation
π that each parameter was expected to have, and the ranges that were measured. The frames marginalised, the rows alone
say of its parameters θ, by Bayes' theorem for a linear model with normal errors,

    G = C⁻¹ − π⁻²,   b = C⁻¹ θ.

Of all that the model does not hold the file says nothing: neither that it is there, nor that it is not.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.campaign.names import LABELS
from thermal_robot.correction import CorrectedModel
from thermal_robot.effects import Effect
from thermal_robot.effects.apply import displacement
from thermal_robot.errors import CampaignError
from thermal_robot.files import is_file
from thermal_robot.fleet import compare_settings
from thermal_robot.observations import Observations, observe
from thermal_robot.prediction import Spread
from thermal_robot.robot import Robot

Ranges = Mapping[str, tuple[float, float]]

_SUFFIX = ".json"


@dataclass(frozen=True, eq=False)
class Known:
    """A model file; what a comparison reads of a diagnosis and of its fit.

    Attributes
    ----------
    campaign
        What it is called.
    model
        The model.
    q
        (N, n) poses within the ranges that were measured: the rows themselves are gone.
    corrected
        Observations of the corrected model there.
    variants
        None: which other effects were compared the file does not say.
    samples
        None.
    """

    campaign: str
    model: CorrectedModel
    q: Array
    corrected: Observations
    variants: Mapping[str, tuple[Effect, ...]] = field(default_factory=dict)
    samples: int = 0

    @property
    def spread(self) -> Spread:
        """How far its predictions may be off."""
        assert self.model.spread is not None  # known() refuses others
        return self.model.spread

    @property
    def effects(self) -> tuple[tuple[Effect, Array], ...]:
        """Its effects with their values, SI."""
        return self.model.effects

    @property
    def robot(self) -> str:
        """Name of the robot."""
        return self.model.robot.name

    @property
    def tool_frame(self) -> str:
        """Link that carries the target."""
        return self.model.robot.tool_frame

    @property
    def verdict(self) -> tuple[str, ...]:
        """Names of its effects."""
        return tuple(dict.fromkeys(effect.name for effect, _ in self.effects))

    @property
    def summary(self) -> str:
        """What it is, in one sentence."""
        held = ", ".join(dict.fromkeys(effect.title for effect, _ in self.effects))
        return f"A model file; it holds {held or 'no effect'}."

    def odds(self, name: str) -> float:
        """Odds of an effect, of which the file says no more than that it was found: those of a coin."""
        return 1.0

    def probability(self, name: str) -> float:
        """Return whether it holds an effect."""
        return float(name in self.verdict)


def is_model(path: object) -> bool:
    """Whether this is the path of a file that may be a model."""
    return isinstance(path, (str, Path)) and Path(path).suffix.lower() == _SUFFIX and is_file(Path(path))


def known(model: CorrectedModel, name: str) -> Known:
    """Return a model as something to compare.

    Parameters
    ----------
    model
        From a file.
    name
        What to call it.

    Raises
    ------
    CampaignError
        If it rests on a simulator, or does not say how sure it is.
    """
    if model.simulated:
        raise CampaignError(
            name, "this model corrects a simulator's predictions, which it does not hold", expected="its campaign"
        )
    spread = model.spread
    if spread is None or spread.prior is None or any(joint not in spread.ranges for joint in model.robot.joint_names):
        raise CampaignError(
            name,
            "this model does not say how sure it is: it was written by an older program",
            expected="its campaign, or a model that `diagnose --model` writes today",
        )
    q = poses(model.robot, spread.ranges)
    return Known(name, model, q, observed(model, q, spread.ranges))


def poses(robot: Robot, ranges: Ranges) -> Array:
    """(N, n) joint positions spread evenly over the ranges that were measured."""
    low, high = (np.array([ranges[name][end] for name in robot.joint_names]) for end in (0, 1))
    return np.asarray(np.random.default_rng(0).uniform(low, high, (compare_settings.POSES, robot.n)))


def observed(model: CorrectedModel, q: Array, common: Ranges) -> Observations:
    """Return the corrected model at (N, n) poses, every condition going once through its range."""
    covariates = {}
    for k, name in enumerate(model.needs):
        low, high = common.get(name, (0.0, 0.0))
        if high < low:  # none in common: halfway between the two
            low = high = 0.5 * (low + high)
        # a golden step for each, so that conditions do not run together
        turn = np.modf(np.arange(len(q)) * 0.6180339887498949 * (k + 1))[0]
        covariates[name] = np.where(turn < 0.5, low, high) if name.startswith("approach") else low + turn * (high - low)
    samples = model.samples_at(q, covariates)
    samples = replace(samples, labels={label: np.full(len(q), "one to come") for label in LABELS})
    moved, _ = displacement(observe(samples, model.frames), model.effects)
    return observe(samples, model.frames, displacement=moved)
