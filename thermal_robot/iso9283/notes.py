"""What a reader must know of the criteria beside the figures, a sentence each."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from thermal_robot.campaign.names import listed
from thermal_robot.campaign.plausible import SAME_COMMAND
from thermal_robot.iso9283.criteria import of_noise
from thermal_robot.iso9283.groups import CYCLES, PATH_CYCLES, Repeats
from thermal_robot.iso9283.parts import PathCriteria, PoseCriteria
from thermal_robot.iso9283.seen import Seen

_NAMED = 5


def notes_of(
    seen: Seen, groups: Sequence[Repeats], poses: Sequence[PoseCriteria], paths: Sequence[PathCriteria], alone: int
) -> Iterator[str]:
    """Yield the notes.

    Parameters
    ----------
    seen
        The campaign.
    groups
        Its repeats.
    poses, paths
        Their criteria.
    alone
        How many rows repeat nothing.
    """
    yield from _of_frames(seen)
    yield from _of_cycles(poses, paths)
    campaign = seen.campaign
    apart = [g.label for g in groups if np.ptp(campaign.q[g.rows], axis=0).max() > SAME_COMMAND]
    if apart:
        yield f"Rows of one label have different joint commands, which counts as scatter: {listed(apart, _NAMED)}."
    if campaign.noise_position:
        alone_shows = 1e3 * of_noise(campaign.noise_position)
        yield f"RP_l holds the noise of the instrument, which alone would show {alone_shows:.3g} mm."
    if alone:
        yield f"{alone} of {campaign.samples} rows repeat nothing, and count for the registration only."


def _of_frames(seen: Seen) -> Iterator[str]:
    many = len(seen.fitted) > 1
    frames = f"{' and '.join(seen.fitted)} frame{'s' if many else ''}"
    if seen.commanded is None:
        yield (
            f"AP and AT cannot be told: the unknown {frames} {'have' if many else 'has'} {seen.unknowns} unknowns, and "
            f"{seen.figures} figures of different poses were measured."
        )
    elif seen.fitted:
        yield (
            f"AP and AT are after registration: the {frames} {'are' if many else 'is'} fitted to the same measurements "
            f"({seen.unknowns} unknowns, {seen.figures} figures of different poses). They are smaller than against "
            "frames that are measured by themselves. RP, vAP and RT do not depend on it."
        )


def _of_cycles(poses: Sequence[PoseCriteria], paths: Sequence[PathCriteria]) -> Iterator[str]:
    few = sum(p.cycles < CYCLES for p in poses)
    if few:
        yield f"Fewer cycles than the standard's {CYCLES}: {few} of {len(poses)} poses."
    short = sum(p.cycles < PATH_CYCLES for p in paths)
    if short:
        yield f"Fewer cycles than the standard's {PATH_CYCLES}: {short} of {len(paths)} paths."
    several = [p.pose for p in poses if (p.directions or 0) > 1]
    if several:
        yield (
            "Reached from several directions, so that RP holds what vAP tells and is larger than the standard's, which "
            f"comes from one: {listed(several, _NAMED)}."
        )
