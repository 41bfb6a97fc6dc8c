"""How often something held, and how sure that is."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from scipy.stats import binomtest


@dataclass(frozen=True)
class Rate:
    """So many successes in so many trials."""

    successes: int
    trials: int

    @property
    def value(self) -> float | None:
        """Their share; ``None`` without trials."""
        return self.successes / self.trials if self.trials else None

    @property
    def interval(self) -> tuple[float, float] | None:
        """Wilson's score interval, 95 % (Wilson 1927, J. Am. Stat. Assoc. 22, 209); ``None`` without trials."""
        if not self.trials:
            return None
        bounds = binomtest(self.successes, self.trials).proportion_ci(0.95, method="wilson")
        return float(bounds.low), float(bounds.high)


def rate(outcomes: Iterable[bool]) -> Rate:
    """Count outcomes."""
    counted = list(outcomes)
    return Rate(sum(counted), len(counted))
