"""Definitions of the words of a result, each once a page, by the word."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from thermal_robot.report import units

if TYPE_CHECKING:
    from thermal_robot.diagnosis.result import Diagnosis
    from thermal_robot.diagnosis.values import Finding
    from thermal_robot.fleet.wear_result import Wear
    from thermal_robot.motion.result import MotionDiagnosis

Meaning = tuple[str, str]
"""A word, and what it means."""


def of_diagnosis(diagnosis: Diagnosis) -> list[Meaning]:
    """Gap, rows held out, share, probability, and what cannot be told apart: words that the page has."""
    if not diagnosis.usable:
        return []
    held = diagnosis.gap.held_out
    return [
        ("gap", "The distance between measured and predicted pose, once unknown frames are fitted."),
        (
            "held out",
            f"Rows that a fit did not see: a part of them at a time is left out ({held.scheme}, {held.folds} folds), "
            "predicted by a fit to all others, and compared with what was measured. So these figures say what a "
            "correction does for measurements that are still to come, if they are like these. Figures of rows held out "
            "have the noise of these rows in them.",
        ),
        _share("rows"),
        *_of_effects(diagnosis),
    ]


def of_motion(diagnosis: MotionDiagnosis) -> list[Meaning]:
    """Share, probability, and what cannot be told apart; a page of motion says beside its figures what is held out."""
    return [_share("motions"), *_of_effects(diagnosis)] if diagnosis.usable else []


def _share(rows: str) -> Meaning:
    return (
        "shrinkage, share",
        f"The part of the gap's mean square that goes away on {rows} held out: 90 % less of it leaves a third of the "
        "gap, 99 % a tenth. An effect's share is what it takes off on average over all orders in which the effects can "
        "be added, so that shares add up.",
    )


def _of_effects(diagnosis: Diagnosis | MotionDiagnosis) -> Iterator[Meaning]:
    known = {finding.name: finding for finding in diagnosis.effects}
    named = [known[name] for name in diagnosis.verdict if name in known]
    own = [f.probability for f in named if f.probability is not None]
    if own:
        each = units.probability(min(own))
        yield (
            "probability",
            "Of an effect: that it is at work, whatever else is. Of the explanation: that exactly its effects are at "
            f"work, no other and no further one. {'Each effect' if len(own) > 1 else 'The effect'} here is "
            f"{each if each[:1] in '<>' else f'at least {each}'} probable, the explanation "
            f"{units.probability(diagnosis.probability)}: what is missing to 100 % belongs to explanations that have "
            "one effect more, or another in the place of one.",
        )
    statuses = {finding.status for finding in diagnosis.effects}
    if "confounded" in statuses or any(f.confounded_with and f.status == "found" for f in named):
        yield "cannot be told apart", _confounded(diagnosis, named)
    if "contained" in statuses:
        yield (
            "part of what was found",
            "A larger effect that was found can do all that this one can: its size is that part of the larger one, and "
            "nothing is to be corrected twice.",
        )
    if "not_testable" in statuses:
        yield "not testable", "The effect may be at work or not: only with what stands after “needs” can it be seen."


def _confounded(diagnosis: Diagnosis | MotionDiagnosis, named: list[Finding]) -> str:
    pair = next(([f.name, *f.confounded_with] for f in named if f.confounded_with), [])
    between = f" between {' and '.join(pair[:2])}" if pair else ""
    next_ = "what to measure is said under Next" if diagnosis.advice or diagnosis.separates else "measure more poses"
    return (
        f"Also called confounded: in these data both effects do the same. A correction is right with either, near what "
        f"was measured; the cause is open. Repair nothing because of it before the choice{between} is made: {next_}."
    )


def of_comparison(comparison: Mapping[str, Any]) -> list[Meaning]:
    """Chance, difference, and statuses of a comparison's effects."""
    statuses = {effect["status"] for effect in comparison["effects"]}
    told = [
        (
            "by chance",
            "How often campaigns of a robot that did not change differ as much as this or more, by their noise alone "
            "(χ² test). It is of one line alone: of a hundred lines, one falls below 1 % without any change.",
        ),
        ("difference", "Between the two campaigns that are furthest apart in standard deviations, later less earlier."),
        (
            "stated",
            "The standard deviation that the two models themselves state of the difference of their predictions. "
            "Beyond twice that in many poses, a model is wrong or the robot changed.",
        ),
    ]
    if "contradicts" in statuses:
        lost = "No two campaigns agree on its size, so it is no property of the robot: another cause does the same."
        told.append(("loses its name", lost))
    if "not_compared" in statuses:
        told.append(("not compared", "Only one campaign determines it: what it was in the others nobody can tell."))
    return told


def of_fleet(summary: Mapping[str, Any]) -> list[Meaning]:
    """Chance, mean, spread and rivals of a fleet's tables."""
    told = []
    if summary["gathered"] or summary["shared"]:
        chance = "How often robots that are all alike would show this by the luck of who was measured."
        told.append(("by chance", chance))
    if summary["shared"]:
        told += [
            (
                "mean, spread",
                "The mean over all robots that can tell the parameter, whether the effect was found there or not, and "
                "the standard deviation between robots, without what each does not know of its own. Effects that do "
                "nearly the same may show one cause in two lines: the upper one counts.",
            )
        ]
    if summary["apart"]:
        told.append(("stands out", "How probable it is that the robot is unlike the others of its own group."))
    if any(one["confounded_with"] for one in summary["found"]):
        told.append(("(or …)", "Its data cannot tell the effect from this one: both would do the same there."))
    return told


def of_wear(wear: Wear, limits: float) -> list[Meaning]:
    """Control limits at so many standard deviations, alarm, probability of a change, chance."""
    return [
        (
            "control chart",
            "A dot is the value that a campaign has by itself, all other parameters as they are over time, with one "
            f"standard deviation. Grey: within {limits:g} of them about where the parameter began, with the scatter of "
            "the campaigns in it; a dot beyond is orange. The line is what is told: it stays, jumps or moves. A jump "
            "lies in the upright band with 95 %. Dashed: the limit that was given.",
        ),
        (
            "alarm",
            f"Without any change at most {units.percent(wear.false_alarm)} of such series ring at all, whatever the "
            "parameter and the day. A single dot beyond its limits is no alarm yet: among many dots some are.",
        ),
        ("moved", "How probable it is that the parameter changes at all, in whatever way."),
        ("by chance", "At most so many series without any change show a move as clear."),
    ]


def of_trial() -> list[Meaning]:
    """Interval, fresh samples and size of a blind trial."""
    return [
        (
            "95 % interval",
            "The shares of all such cases that agree with the count of these (Wilson's score interval): wide where "
            "cases are few.",
        ),
        ("exactly", "Every effect at work is named, and nothing else."),
        (
            "claimed, fresh samples",
            "What the diagnosis says of its rows held out, and what poses that it never saw say.",
        ),
        ("size", "The rms that the effect leaves in the gap, in units of the rms of the noise."),
    ]
