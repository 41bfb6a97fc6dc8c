"""The criteria of one pose or one path: frozen values without behaviour."""

from __future__ import annotations

from dataclasses import dataclass

from thermal_robot.iso9283.criteria import Accuracy, AlongPath, Drift, Repeatability, Variation


@dataclass(frozen=True)
class PoseCriteria:
    """AP, RP, vAP and drift of one pose.

    Attributes
    ----------
    pose
        Its label.
    cycles
        How often it was repeated.
    directions
        From how many directions it was approached; ``None`` where that is unknown.
    repeatability
        RP, of all cycles.
    accuracy
        AP; ``None`` where the frames take up all that was measured.
    corrected
        AP against the prediction of a corrected model; ``None`` without one.
    variation, variation_cycles
        vAP, and the number of cycles from each direction that counts, two or more; ``None`` and empty with fewer than
        two such directions.
    drift, drift_cycles
        Drift, and the number of cycles at each measuring time; ``None`` and empty with fewer than two times.
    """

    pose: str
    cycles: int
    directions: int | None
    repeatability: Repeatability
    accuracy: Accuracy | None = None
    corrected: Accuracy | None = None
    variation: Variation | None = None
    variation_cycles: tuple[int, ...] = ()
    drift: Drift | None = None
    drift_cycles: tuple[int, ...] = ()


@dataclass(frozen=True)
class PathCriteria:
    """AT and RT of one path.

    Attributes
    ----------
    path
        Its label.
    points
        How many of its points were repeated.
    cycles
        How often each was, the least of all.
    repeatability
        RT.
    accuracy, corrected
        AT, and AT against the prediction of a corrected model; ``None`` as for a pose.
    """

    path: str
    points: int
    cycles: int
    repeatability: AlongPath
    accuracy: AlongPath | None = None
    corrected: AlongPath | None = None
