"""Encoders that count in coarse steps."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.effects.random_effect import RandomEffect


@dataclass(frozen=True)
class EncoderResolution(RandomEffect):
    """Every joint stands on a step of its encoder: the same error at each repeat of a command.

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
        """Return how far the nearest step is from each command; chance has only where the encoder's zero lies."""
        first = size * rng.uniform()
        return first + size * np.round((command - first) / size) - command if size else np.zeros_like(command)
