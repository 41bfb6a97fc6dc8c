"""Drift of pose characteristics: how AP and RP of one pose change over time (ISO 9283:1998, 7.6)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from thermal_robot.iso9283.accuracy import accuracy
from thermal_robot.iso9283.attained import Attained, Three, three
from thermal_robot.iso9283.repeatability import repeatability


@dataclass(frozen=True)
class Drift:
    """Largest changes against the first measuring time.

    Attributes
    ----------
    accuracy, accuracy_angles
        dAP_p, m, and dAP_a, dAP_b, dAP_c, rad: change of AP; ``None`` where AP cannot be told.
    repeatability, repeatability_angles
        dRP_l, m, and dRP_a, dRP_b, dRP_c, rad: change of RP.
    shift
        How far the barycentre went, m. It is no criterion of the standard, whose dAP_p does not see a pose that goes
        from one side of the commanded pose to the other.
    """

    accuracy: float | None
    repeatability: float
    shift: float
    accuracy_angles: Three | None = None
    repeatability_angles: Three | None = None


def drift_of(attained: Sequence[Attained], commanded: Sequence[Attained] | None = None) -> Drift:
    """Compute the drift of one pose.

    Parameters
    ----------
    attained
        Of each measuring time, first to last: two times or more, each of two cycles or more.
    commanded
        Of each measuring time, as for :func:`~thermal_robot.iso9283.accuracy.accuracy`; ``None`` where AP cannot be
        told.
    """
    spread = [repeatability(each) for each in attained]
    away = None if commanded is None else [accuracy(a, c) for a, c in zip(attained, commanded, strict=True)]
    gone = [float(np.linalg.norm(each.barycentre - attained[0].barycentre)) for each in attained]
    return Drift(
        None if away is None else _largest([a.position for a in away]),
        _largest([r.position for r in spread]),
        max(gone),
        None if away is None else _largest_of_three([a.angles for a in away]),
        _largest_of_three([r.angles for r in spread]),
    )


def _largest(values: Sequence[float]) -> float:
    return max(abs(value - values[0]) for value in values)


def _largest_of_three(values: Sequence[Three | None]) -> Three | None:
    known = np.array([value for value in values if value is not None])
    return three(np.abs(known - known[0]).max(axis=0)) if len(known) == len(values) else None
