"""Links that grow with temperature: the virtual prismatic joints of Kluz et al."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from thermal_robot.effects.effect import Effect, Parameter, at_segment

if TYPE_CHECKING:
    from thermal_robot.observations import Observations


@dataclass(frozen=True)
class ThermalElongation(Effect):
    """Every segment lengthens with its link's temperature: Δl_s = α_s l_s (T_link − T_reference).

    Equation 5 of Kluz et al. (2018) with a coefficient of its own for each segment, along the virtual prismatic
    joint of their Eqs 6-8. Expected size 1.5e-5 /K (steel 1.2e-5, aluminium 2.3e-5).

    Where the temperature rises steadily with time it resembles :class:`Drift`, but moves the tool by an amount
    that depends on the pose; at constant temperature it is contained in :class:`Geometric`.
    """

    name: ClassVar[str] = "thermal_elongation"

    def missing(self, observations: Observations) -> tuple[str, ...]:
        """Return ``temperature`` unless a temperature that applies to a segment varies."""
        return () if any(observations.varies(column) for column in self.reads(observations)) else ("temperature",)

    def reads(self, observations: Observations) -> tuple[str, ...]:
        """Return the temperatures that apply to the segments."""
        links = dict.fromkeys(s.parent_link for s in observations.robot.segments if s.length > 1e-9)
        own = [f"temperature.{link}" for link in links if f"temperature.{link}" in observations.covariates]
        general = ["temperature"] if len(own) < len(links) and "temperature" in observations.covariates else []
        return (*own, *general)

    def parameters(self, observations: Observations) -> tuple[Parameter, ...]:
        """One coefficient of expansion a segment; 1/K."""
        reference = observations.campaign.reference_temperature
        found = []
        for s, segment in enumerate(observations.robot.segments):
            temperature = observations.temperature(segment.parent_link)
            if temperature is None or segment.length < 1e-9:
                continue
            along = np.concatenate([segment.direction, np.zeros(3)]) * segment.length
            twist = (temperature - reference)[:, None] * along
            label = f"strain per kelvin of {segment.name}"
            found.append(Parameter(label, "1/K", 1.5e-5, "link", segment.parent_link, (at_segment(s, twist),)))
        return tuple(found)
