"""Candidates for what is wrong with a table, screened side by side: thousands at a glance, a few hundred at a look.

Where no frame is known, a linear map in place of a rigid motion (``Readings.relaxed``) tells what is wrong with the
joints whatever unit and axes the instrument has, so that faults of both sides are found apart, and two at once.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from operator import attrgetter

import numpy as np
from scipy.optimize import minimize_scalar

from thermal_robot.arrays import Array
from thermal_robot.diagnosis.data_faults import of_joints, of_measurements, of_pairing, settings
from thermal_robot.diagnosis.data_faults.kind import Fault, Kind, Offsets, Proposal
from thermal_robot.diagnosis.data_faults.readings import Readings, stacked
from thermal_robot.diagnosis.data_faults.struck import Struck, Tried, window
from thermal_robot.inference.frames import middle, soft

Chosen = list[tuple[Fault, Array, float]]
"""Faults, (3,) where the target then sits on the tool, m, and what is left at least, of what a robot at rest leaves."""


class Screen:
    """The faults that may have struck some rows, and those of them that are worth a closer look.

    Parameters
    ----------
    struck
        The rows.
    kinds
        Of faults to look for.
    """

    def __init__(self, struck: Struck, kinds: Sequence[Kind]) -> None:
        self.struck, self.asked, self._kinds = struck, 0, kinds

    def singly(self) -> list[Tried]:
        """Return each fault by itself, where the frames are known: distances on a few rows."""
        parts = [((p,), self.struck.sketch((p,), settings.SKETCHED)) for p in self._proposals(self._kinds)]
        frames = self.struck.frames
        assert frames is not None
        self.asked += len(parts)
        return [Tried(own, part.distance(frames), frames.tool[:3, 3]) for own, part in parts if part is not None]

    def both_sides(self) -> list[Tried]:
        """Return faults of the joints, of the measurements, and of both, one on each side: distances on a few rows."""
        joints = self._glanced([(), *((p,) for p in self._of_joints)])
        units = [p for p in self._measured if p.kind in of_measurements.UNITS]
        axes = [p for p in self._measured if p.kind in of_measurements.AXES]
        sides: list[Fault] = [(), *((p,) for p in (*units, *axes)), *((u, a) for u in units for a in axes)]
        asked = [((*own, *side), at, left) for own, at, left in joints for side in sides if len(own) + len(side) <= 2]
        looked = self._looked(asked)
        turns = [p for p in self._measured if p.kind in of_measurements.TURNS]
        if self.struck.readings.orientation is None:
            return looked
        looked.sort(key=attrgetter("typical"))
        near = [
            t for two in (False, True) for t in [t for t in looked if (len(t.fault) > 1) is two][: settings.SURVIVORS]
        ]
        more = [((*t.fault, *turn), t.place, 0.0) for t in near for turn in ((), *((p,) for p in turns))]
        return self._looked([own for own in more if len(own[0]) <= 2], turns=True)

    def two_of_joints(self) -> list[Tried]:
        """Return pairs of faults of the joints, among them any number that are reversed beside another fault."""
        others = [p for p in self._of_joints if not p.joints]
        signs = of_joints.sign_patterns(self.struck.readings.robot.n)[: settings.PAIRED_PATTERNS]
        scores: list[Array] = []
        made: list[Fault] = []
        turned = [
            Proposal(self._reversed((own < 0).sum()), *of_joints.reversing(own, self.struck.readings)) for own in signs
        ]
        for other in others:
            part = self.struck.sketch((other,), settings.RELAXED)
            if part is None:
                continue
            several = [replace(part, q=part.q * signs[:, None, :])]
            made += [(other, own) for own in turned]
            every = np.ones(len(part.q), dtype=bool)
            seconds = [p for p in others if p is not other and p.kind not in of_pairing.KINDS]
            several.append(stacked([p.repair(part, every) for p in seconds]))
            made += [(other, p) for p in seconds]
            scores += [middle(own.relaxed()[0]) for own in several]
        if not scores:
            return []
        self.asked += len(made)
        order = np.argsort(np.concatenate(scores), kind="stable")[: settings.MOST_SURVIVORS]
        return self._looked(self._glanced([made[k] for k in order]), turns=True)

    @cached_property
    def _of_joints(self) -> list[Proposal]:
        return [*self._proposals([k for k in self._kinds if k not in of_measurements.KINDS])]

    @cached_property
    def _measured(self) -> list[Proposal]:
        return [*self._proposals([k for k in self._kinds if k in of_measurements.KINDS])]

    def _reversed(self, joints: int) -> Kind:
        return of_joints.KINDS[0] if joints == 1 else of_joints.KINDS[1]

    def _proposals(self, kinds: Sequence[Kind]) -> Iterator[Proposal]:
        """Yield the faults of some kinds; of those that differ by a number the best of each family."""
        for kind in kinds:
            yield from kind.proposed(self.struck.readings)
            for family in kind.families(self.struck.readings):
                self.asked += len(family.tried)
                if (best := self._refined(family)) is not None:
                    yield best

    def _refined(self, family: Offsets) -> Proposal | None:
        """Return the best of a family: the best of those that are tried, then between its neighbours."""
        if len(family.tried) < 3:
            return None
        struck = self.struck
        if struck.frames is None and len(struck.rows) > settings.WINDOW:
            part = window(struck.readings)
            struck = replace(
                struck, readings=part, rows=np.ones(len(part.q), dtype=bool), distance=np.zeros(len(part.q))
            )
        found = [self._typical(struck, (family.of(number),)) for number in family.tried]
        k = int(np.argmin(found))
        if found[k] * settings.PROMISING > self._typical(struck, ()):
            return None
        low, high = family.tried[max(k - 1, 0)], family.tried[min(k + 1, len(found) - 1)]
        least = minimize_scalar(
            lambda number: np.log(min(self._typical(struck, (family.of(number),)), found[k] * settings.WORSE)),
            bounds=(low, high),
            method="bounded",
            options={"maxiter": settings.OFFSET_ROUNDS, "xatol": settings.OFFSET_SETTLED * (high - low)},
        )
        return family.of(float(least.x) if least.fun < np.log(found[k]) else family.tried[k])

    def _typical(self, struck: Struck, fault: Fault) -> float:
        part = struck.sketch(fault, settings.RELAXED)
        if part is None:
            return np.inf
        left = part.relaxed()[0] if struck.frames is None else part.distance(struck.frames)
        return float(np.exp(np.mean(np.log(np.maximum(left, settings.LEAST_GAP)))))

    def _glanced(self, faults: Sequence[Fault]) -> Chosen:
        """Return the faults that leave least of a linear map, fitted twice to the best of them."""
        own = [(fault, part) for fault in faults if (part := self.struck.sketch(fault, settings.RELAXED)) is not None]
        self.asked += len(faults)
        if not own:
            return []
        left, place = stacked([part for _, part in own]).relaxed()
        score = middle(left)
        best = np.argsort(score, kind="stable")[: max(round(settings.AGAIN * len(own)), settings.SURVIVORS)]
        left, place[best] = stacked([own[k][1] for k in best]).relaxed(soft(left[best]))
        again = middle(left)
        order = best[np.argsort(again, kind="stable")]
        again = np.sort(again)
        many = max(settings.SURVIVORS, int((again <= settings.NEAR * max(again[0], settings.LEAST_GAP)).sum()))
        least = again * own[0][1].maps_place
        chosen = zip(order, least, strict=True)
        return [(own[k][0], place[k], float(at)) for k, at in [*chosen][: min(many, settings.MOST_SURVIVORS)]]

    def _looked(self, chosen: Chosen, *, turns: bool = False) -> list[Tried]:
        """Return the faults with what rigid frames leave on a few rows; points must have the extent of the motion.

        Those of which even a map leaves more than a mend may are passed over.
        """
        self.asked += len(chosen)
        chosen = [own for own in chosen if own[2] <= settings.NEAR * settings.STILL[max(len(own[0]), 1) - 1]]
        parts = [self.struck.sketch(fault, settings.SKETCHED) for fault, *_ in chosen]
        own = [k for k, part in enumerate(parts) if part is not None and _extends(part)]
        found: list[Tried] = []
        for first in range(0, len(own), settings.ABREAST):
            some = own[first : first + settings.ABREAST]
            side = stacked([parts[k] for k in some])  # type: ignore[misc]
            frames = side.align(coarse=True, begun=np.stack([chosen[k][1] for k in some])[:, None, :])
            left = side.distance(frames, turns=turns)
            found += [Tried(chosen[k][0], own, at[:3, 3]) for k, own, at in zip(some, left, frames.tool, strict=True)]
        return found


def _extends(readings: Readings) -> bool:
    """Tell whether measured and predicted points are about as far from each other."""
    points = readings.poses[:, :3, 3] if readings.simulated_position is None else readings.simulated_position
    times = [float(np.abs(own - own.mean(axis=0)).sum()) for own in (readings.position, points)]
    return times[0] <= settings.EXTENT * times[1] and times[1] <= settings.EXTENT * times[0]
