"""Random effects: variance components in the joints, drawn at each visit or once a commanded pose."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.effects.effect import Effect, Parameter

if TYPE_CHECKING:
    from thermal_robot.observations import Observations

_SAME = 1e-6  # rad or m: commands nearer than this repeat each other


@dataclass(frozen=True)
class RandomEffect(Effect):
    """Variance component: its parameter is a standard deviation, which no correction removes.

    It is estimated from the covariance of the residual, cov(row) = noise² I + Σ_j σ_j² J_j J_jᵀ, with J_j the Jacobian
    of the target by joint j, and one σ_j (rad or m) a joint and component.
    """

    random: ClassVar[bool] = True
    component: ClassVar[Literal["pose", "visit"]]
    """Whether σ_j counts once a commanded pose, or anew at each visit to it."""
    label: ClassVar[str]
    """What its parameter is."""
    factor: ClassVar[float]
    """The parameter over σ_j."""

    def parameters(self, observations: Observations) -> tuple[Parameter, ...]:
        """No parameters: the mean does not depend on a variance."""
        return ()

    def joints(self, chain: tuple[str, ...]) -> tuple[str, ...]:
        """Return the joints of a chain, in order, that are among ``places`` (all if empty) and not ``excluded``."""
        return tuple(j for j in chain if j in (self.places or chain) and j not in self.excluded)

    def drawn(self, command: Array, pose: NDArray[np.int64], size: float, rng: np.random.Generator) -> Array:
        """Random deviations (N,) of a joint from its commands, rad or m: normal, with deviation ``size``/``factor``.

        ``pose`` (N,) is the number of the commanded pose that each row is a visit to.
        """
        which = np.arange(len(pose)) if self.component == "visit" else np.unique(pose, return_inverse=True)[1]
        return np.asarray(size / self.factor * rng.normal(size=len(pose))[which])


@dataclass(frozen=True)
class EncoderResolution(RandomEffect):
    """Quantisation by the encoder: every joint stands at a step, the same at each repeat of a command.

    A step s leaves an even distribution over ± s/2, with standard deviation s/√12 (Widrow, *Statistical analysis of
    amplitude-quantized sampled-data systems*, 1961): a sawtooth of the command. Where no pose is repeated, only a step
    that shows in the command tells it from :class:`ExcessRepeatability`.
    """

    name: ClassVar[str] = "encoder_resolution"
    title: ClassVar[str] = "encoders that count in coarse steps"
    component: ClassVar[Literal["pose", "visit"]] = "pose"
    label: ClassVar[str] = "step"
    factor: ClassVar[float] = sqrt(12.0)

    def drawn(self, command: Array, pose: NDArray[np.int64], size: float, rng: np.random.Generator) -> Array:
        """Quantisation error (N,) of each command: nearest encoder position less the command; its zero is random."""
        first = size * rng.uniform()
        return first + size * np.round((command - first) / size) - command if size else np.zeros_like(command)


@dataclass(frozen=True)
class ExcessRepeatability(RandomEffect):
    """Excess repeatability error: every joint scatters anew at each visit to a pose with σ_j, rad or m.

    Only repeats of a pose show it: rows with the same label ``pose``, or, without that column, the same command again.
    """

    name: ClassVar[str] = "excess_repeatability"
    title: ClassVar[str] = "joints that scatter more than the instrument"
    needs: ClassVar[tuple[str, ...]] = ("pose",)
    component: ClassVar[Literal["pose", "visit"]] = "visit"
    label: ClassVar[str] = "standard deviation"
    factor: ClassVar[float] = 1.0

    def missing(self, observations: Observations) -> tuple[str, ...]:
        """Return the column ``pose`` unless some pose is repeated; rows with an empty label do not count."""
        labels = observations.campaign.pose_labels
        visits = np.round(observations.q / _SAME) if labels is None else labels[labels != ""]
        return () if len(np.unique(visits, axis=0)) < len(visits) else self.needs
