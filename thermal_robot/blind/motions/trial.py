"""The trial of motions: logs of drawn worlds are diagnosed, and the answers judged."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context

import numpy as np

from thermal_robot.blind.motions import sizes
from thermal_robot.blind.motions.fault import EVERYTHING, FAULTS, NOTHING, UNLISTED
from thermal_robot.blind.motions.world import Unseen, draw_log, draw_world
from thermal_robot.motion.diagnose import diagnose_motion

ALWAYS = frozenset({"lag", "droop"})
"""Effects that every servo has if it is not stated."""
MARKS = ("named", "first", "alone", "placed", "flagged")
"""Names of the scores of an :class:`Answer`."""


@dataclass(frozen=True)
class Case:
    """Test case: a fault by name, the seed of its world, and whether the servos are stated."""

    fault: str
    seed: int
    joints: int = 3
    motions: int = 10
    stated: bool = True


@dataclass(frozen=True)
class Answer:
    """True fault and diagnosis of one case.

    ``size`` (SI) and ``joint`` of the fault; ``verdict`` the effects named, largest share first; ``groups`` what each
    is confounded with; ``places`` the joints of each; ``shares`` of the gap; ``flagged`` whether something stays
    unexplained; ``rms`` of the gap before, after and held out, encoder counts; ``seconds`` of the diagnosis;
    ``failure`` why there was none.
    """

    case: Case
    size: float = 0.0
    joint: str = ""
    verdict: tuple[str, ...] = ()
    groups: tuple[tuple[str, ...], ...] = ()
    places: tuple[tuple[str, ...], ...] = ()
    shares: tuple[float, ...] = ()
    flagged: bool = False
    rms: tuple[float, float, float] = (0.0, 0.0, 0.0)
    seconds: float = 0.0
    failure: str = ""

    @property
    def reported(self) -> tuple[tuple[str, ...], ...]:
        """Effects of the verdict, each with those confounded with it; without lag and droop if servos are unstated."""
        usual = frozenset() if self.case.stated else ALWAYS
        pairs = zip(self.verdict, self.groups, strict=True)
        return tuple((name, *group) for name, group in pairs if name not in usual)

    @property
    def named(self) -> bool:
        """Whether a right effect, or one confounded with it, is reported; where no effect is right, whether none is."""
        right = FAULTS.get(self.case.fault, ())
        return any(set(right) & set(names) for names in self.reported) if right else not self.reported

    @property
    def first(self) -> bool:
        """Whether a right effect, or one confounded with it, has the largest share of those reported."""
        return bool(self.reported) and bool(set(FAULTS.get(self.case.fault, ())) & set(self.reported[0]))

    @property
    def alone(self) -> bool:
        """Whether the answer is right (:attr:`named`), and no other effect is reported."""
        return self.named and len(self.reported) <= 1

    @property
    def placed(self) -> bool:
        """Whether a right effect is in the verdict, located in the fault's joint; true for a fault without a joint."""
        own = zip(self.verdict, self.places, strict=True)
        return not self.joint or any(n in FAULTS.get(self.case.fault, ()) and self.joint in p for n, p in own)


def ask(case: Case) -> Answer:
    """Run one case: simulate its log, diagnose it and return the answer; no diagnosis if no drawn fault is visible."""
    rng = np.random.default_rng([case.seed, EVERYTHING.index(case.fault), case.joints])
    world = draw_world(rng, case.joints, case.motions)
    try:
        log, fault = draw_log(rng, world, case.fault, case.stated)
    except Unseen:
        return Answer(case, failure="unseen")
    began = time.perf_counter()
    found = diagnose_motion(log)
    told = [found.finding(name) for name in found.verdict]
    held = found.held_out.rms_after
    return Answer(
        case,
        fault.size,
        log.joints[fault.joint] if fault.joint >= 0 else "",
        found.verdict,
        tuple(one.confounded_with for one in told),
        tuple(tuple(place.name for place in one.locations) for one in told),
        tuple(float(one.shrinkage or 0.0) for one in told),
        found.unexplained.flagged,
        (found.rms_before / world.count, found.rms_after / world.count, held / world.count),
        time.perf_counter() - began,
    )


def plan(
    seed: int, count: int, faults: Iterable[str] = EVERYTHING, *, joints: int = 0, stated: bool = True
) -> list[Case]:
    """Return ``count`` cases of each fault, seeded from ``seed`` on; ``joints`` 0 takes two to seven joints in turn."""
    low, high = sizes.JOINTS
    return [
        Case(fault, seed + number, joints or low + (seed + number) % (high - low + 1), stated=stated)
        for number in range(count)
        for fault in faults
    ]


def run(cases: Sequence[Case], workers: int = 1, progress: Callable[[Answer], None] = lambda _: None) -> list[Answer]:
    """Run all cases in parallel processes; ``progress`` is called with each answer in the order of the cases."""
    found = []
    with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
        for answer in pool.map(ask, cases):
            progress(answer)
            found.append(answer)
    return found


def table(answers: Sequence[Answer]) -> list[dict[str, object]]:
    """Score by fault: number of diagnosed cases, and shares named, first, alone, in the right joint and flagged."""
    rows = []
    for fault in EVERYTHING:
        own = [one for one in answers if one.case.fault == fault and not one.failure]
        if own:
            marks = {mark: float(np.mean([getattr(one, mark) for one in own])) for mark in MARKS}
            rows.append({"fault": fault, "asked": len(own), **marks})
    return rows


def text(answers: Sequence[Answer]) -> str:
    """Format the score of the trial: a table by fault, summary shares, and the wrong or failed answers one by one."""
    lines = [f"{'fault':16} asked  named  first  alone  place  unexplained"]
    for row in table(answers):
        shares = "".join(f"{100 * float(str(row[mark])):6.0f}%" for mark in MARKS)
        lines.append(f"{row['fault']!s:16} {row['asked']!s:>5}{shares}")
    told = [one for one in answers if not one.failure]
    listed = [one for one in told if one.case.fault in FAULTS]
    if listed:
        named, first = (np.mean([getattr(one, mark) for one in listed]) for mark in ("named", "first"))
        lines.append(f"of {len(listed)} faults that an effect knows: named {named:.0%}, first {first:.0%}")
    silent = [not one.reported for one in told if one.case.fault == NOTHING]
    if silent:
        lines.append(f"{NOTHING}: silent {np.mean(silent):.0%}")
    blamed = [bool(one.reported) for one in told if one.case.fault in UNLISTED]
    if blamed:
        lines.append(f"unlisted: blamed on an effect {np.mean(blamed):.0%}")
    for one in answers:
        if one.failure or not one.named:
            said = one.failure or ", ".join(one.verdict) or "no effect"
            lines.append(f"  {one.case.fault}, seed {one.case.seed}, {one.case.joints} joints: {said}")
    return "\n".join(lines)
