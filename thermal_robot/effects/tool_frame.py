"""The target does not sit on the tool where the file says."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from thermal_robot.effects.effect import ALONE, TWIST, UNSOURCED, Effect, Parameter, at_tool

if TYPE_CHECKING:
    from thermal_robot.observations import Observations


@dataclass(frozen=True)
class ToolFrame(Effect):
    """The declared place of the target is off by a constant twist in the tool frame.

    Expected size 2 mm and 2 mrad; a campaign of positions shows the three translations only. Only where the campaign
    declares ``tool = "known"``: an unknown tool is fitted before any effect is asked for. ``turns``: the three
    rotations are parameters, too; ``None`` asks the campaign, while a model keeps what it was fitted with, as commands
    to be predicted carry no measured orientation. ``alone`` names the one component that is off. Turned about the last
    joint's axis, the tool is where that joint's zero offset would put it.
    """

    turns: bool | None = None
    alone: str = ""

    name: ClassVar[str] = "tool_frame"
    title: ClassVar[str] = "a misplaced tool frame"
    size_spread: ClassVar[float] = UNSOURCED
    frame: ClassVar[str] = "tool"

    def missing(self, observations: Observations) -> tuple[str, ...]:
        """Return the declaration that would make the tool an effect."""
        campaign = observations.campaign
        # a simulator predicts the declared target: an unknown tool is not refitted to it
        return () if campaign.tool_known or campaign.simulated_position is not None else ('frames.tool = "known"',)

    @property
    def weight(self) -> float:
        """One target in ten is off in a single component."""
        return ALONE if self.alone else 1.0

    def variants(self, observations: Observations) -> tuple[Effect, ...]:
        """Return the components that the campaign shows together, and each of all alone."""
        own = replace(self, turns=self._turns(observations))
        return (own, *(replace(own, alone=component) for component, _ in TWIST))

    def _turns(self, observations: Observations) -> bool:
        return observations.campaign.measures == "pose" if self.turns is None else self.turns

    def parameters(self, observations: Observations) -> tuple[Parameter, ...]:
        """Return the tool's twist in the tool frame: m, and rad where orientation is measured."""
        return tuple(
            Parameter(component, unit, 2e-3, "tool", "tool", (at_tool(np.eye(6)[k]),))
            for k, (component, unit) in enumerate(TWIST)
            if (self.alone == component if self.alone else k < 3 or self._turns(observations))
        )
