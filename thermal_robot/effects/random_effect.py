"""Effects that scatter: variances in the joints, anew at each visit or once a commanded pose."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal

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
