"""Effects that scatter: variances in the joints, anew at each visit or once a commanded pose."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.effects.effect import Effect, Parameter

if TYPE_CHECKING:
    from thermal_robot.observations import Observations


@dataclass(frozen=True)
class RandomEffect(Effect):
    """An effect whose parameter is the size of a scatter: no column follows from it, and no correction takes it away.

    It is told from the covariance of what remains, cov(row) = noise² I + Σ_j σ_j² J_j J_jᵀ, with J_j how joint j moves
    the target and one σ_j (rad or m) a joint and component.
    """

    random: ClassVar[bool] = True
    component: ClassVar[Literal["pose", "visit"]]
    """Whether σ_j counts once a commanded pose, or anew at each visit to it."""
    label: ClassVar[str]
    """What its parameter is."""
    factor: ClassVar[float]
    """The parameter over σ_j."""

    def parameters(self, observations: Observations) -> tuple[Parameter, ...]:
        """Return none: a mean does not depend on it."""
        return ()

    def joints(self, chain: tuple[str, ...]) -> tuple[str, ...]:
        """Return the joints of a chain that it may be in, in their order."""
        return tuple(j for j in chain if j in (self.places or chain) and j not in self.excluded)

    def drawn(self, command: Array, pose: NDArray[np.int64], size: float, rng: np.random.Generator) -> Array:
        """Draw (N,) deviations of a joint from its commands, rad or m: normal, of the standard deviation ``size``.

        ``pose`` (N,) is the number of the commanded pose that each row is a visit to.
        """
        which = np.arange(len(pose)) if self.component == "visit" else np.unique(pose, return_inverse=True)[1]
        return np.asarray(size / self.factor * rng.normal(size=len(pose))[which])
