"""The base does not stand where the file says."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from thermal_robot.effects.effect import ALONE, TWIST, UNSOURCED, Effect, Parameter, at_base

if TYPE_CHECKING:
    from thermal_robot.observations import Observations


@dataclass(frozen=True)
class BaseFrame(Effect):
    """The declared registration of the base is off by a constant twist in the root frame.

    Expected size 2 mm and 2 mrad. Only where the campaign declares ``base = "known"``: an unknown base is fitted before
    any effect is asked for. It is a twist of the first joint's placement, too, so that :class:`Geometric` contains it.
    Where the first joint turns about an axis of the root frame, its zero offset is a turn of the base about that axis
    alone, and no measurement of the tool tells which it is. ``alone`` names the one component that is off.
    """

    alone: str = ""

    name: ClassVar[str] = "base_frame"
    title: ClassVar[str] = "a misplaced base frame"
    size_spread: ClassVar[float] = UNSOURCED
    contained_in: ClassVar[tuple[str, ...]] = ("geometric",)
    frame: ClassVar[str] = "base"

    @property
    def weight(self) -> float:
        """One registration in ten is off in a single component."""
        return ALONE if self.alone else 1.0

    def variants(self, observations: Observations) -> tuple[Effect, ...]:
        """Return all components together, and each alone."""
        return (self, *(replace(self, alone=component) for component, _ in TWIST))

    def missing(self, observations: Observations) -> tuple[str, ...]:
        """Return the declaration that would make the base an effect."""
        return () if observations.campaign.base_known else ('frames.base = "known"',)

    def parameters(self, observations: Observations) -> tuple[Parameter, ...]:
        """Return the base's twist in the root frame: m and rad."""
        return tuple(
            Parameter(component, unit, 2e-3, "base", "base", (at_base(np.eye(6)[k]),))
            for k, (component, unit) in enumerate(TWIST)
            if self.alone in ("", component)
        )
