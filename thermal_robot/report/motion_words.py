"""The sentences of a diagnosis of motion, which text and page share."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from thermal_robot.report import units
from thermal_robot.report.words import by_status, capitalised, fitting, listed, needs, sure, verdict, weighty

if TYPE_CHECKING:
    from thermal_robot.diagnosis.values import Finding
    from thermal_robot.motion.result import MotionDiagnosis

TOLD = ("found", "confounded")
"""Statuses of effects of which more is told."""
_MOST = 3  # causes that a headline names; the others are counted
_MAJORITY = 0.5  # of an effect's share: the joint that holds more is named
_ONE_SIGN = 0.02  # of a joint's readings: a load that has the other sign in fewer has one sign
_MOST_KINDS = 4  # of motion that are named in a sentence


def motion_headline(diagnosis: MotionDiagnosis) -> str:
    """Return the verdict as one sentence of at most 45 words.

    It names the fewest causes that hold 95 % of what is explained, at most three, with the joint where one holds most,
    and counts the others. Of what there is to say the fullest wording is taken that fits.
    """
    return fitting(_wordings(diagnosis))


def _wordings(d: MotionDiagnosis) -> Iterator[str]:
    size, found = units.quantity(d.rms_before, d.unit), list(d.shown)
    if not d.usable:
        yield "No joint of this log tells anything of its servo."
    elif not found and d.unexplained.flagged:
        which = "none of the effects that were considered" if d.narrowed else "no known effect"
        yield f"The gap of {size} between joints and {_model(d)} is explained by {which}: {_reason(d)}."
        yield f"The gap of {size} between joints and {_model(d)} is explained by {which}."
    elif not found:
        yield f"No effect of a servo is seen in the gap of {size} between joints and {_model(d)}."
    else:
        for most, places, rivals in product((_MOST, 2, 1), (True, False), (True, False)):
            causes = _causes(d, found, most, places, rivals)
            for far in _how_far(d):
                yield f"The joints miss the {_model(d)} by {size}: {causes} ({sure(d.probability)}); {far}."


def _model(d: MotionDiagnosis) -> str:
    """Return the reference of the joints, without its article."""
    if d.unit == "N·m":
        return "torques of their masses"
    return "simulated servos" if d.stated else "command"


def _causes(d: MotionDiagnosis, found: Sequence[Finding], most: int, places: bool, rivals: bool) -> str:
    """Name the first few, each with its joint and what the data cannot tell it from, and count the others."""
    named = weighty(found, most)
    names = []
    for one in named:
        others = [d.title(name) for name in one.confounded_with]
        beside = f" (or {others[0] if len(others) == 1 else 'others'})" if rivals else " (in doubt)"
        names.append(d.title(one.name, main_joint(one) if places else "") + (beside if others else ""))
    fewer = len(found) - len(named)
    return listed([*names, *(["a smaller one"] if fewer == 1 else [f"{fewer} smaller ones"] if fewer else [])])


def main_joint(finding: Finding) -> str:
    """Return the joint that holds more than half of an effect; empty where none does."""
    shares = [max(place.share, 0.0) for place in finding.locations]
    if not shares or max(shares) <= _MAJORITY * sum(shares):
        return ""
    return finding.locations[int(np.argmax(shares))].name


def _how_far(d: MotionDiagnosis) -> Iterator[str]:
    """Yield how far the gap shrinks in motions held out, the fullest wording first."""
    held = d.held_out
    left, before = units.quantity(held.rms_after, d.unit), units.quantity(held.rms_before, d.unit)
    more = ", more than noise" if d.unexplained.flagged else ""
    out = "motions held out" + ("" if d.unit == "N·m" else ", simulated from the command alone,")
    if held.shrinkage < 0.0:
        yield f"but {out} are no better with it: {left}, and {before} without"
        return
    yield f"{out} keep {left} of it, {units.percent(held.shrinkage)} of the mean square less{more}"
    yield f"{out} keep {left} of it{more}"
    yield f"{out} keep {left} of it"
    yield f"motions held out keep {left} of it"


def _reason(d: MotionDiagnosis) -> str:
    return d.unexplained.reasons[0].rstrip(".") if d.unexplained.reasons else "what remains has a pattern"


def details(d: MotionDiagnosis) -> Iterator[str]:
    """Yield a sentence for each thing that the headline leaves out."""
    if not d.usable:
        return
    text = d.summary or motion_headline(d)
    unsaid = [one for one in d.shown if d.title(one.name) not in text and f"{d.title(one.name, 'x')[:-2]} " not in text]
    if unsaid:
        names = listed([d.title(one.name, main_joint(one)) for one in unsaid])
        yield f"{'The smaller one is' if len(unsaid) == 1 else 'The smaller ones are'} {names}."
    hidden = [d.title(name) for name in d.verdict if not d.visible(name)]
    if hidden:
        yield f"Told, but not shown, since no joint moves by twice its noise or the stated tolerance: {listed(hidden)}."
    if d.few and d.shown:
        count = len(d.log.motions)
        here = "There is 1 motion" if count == 1 else f"There are {count} motions"
        yield f"{here}: ± is weak below eight, as readings of one motion share errors."


def always(d: MotionDiagnosis) -> Iterator[str]:
    """Yield what no log of this kind can tell apart, of the effects that were found."""
    named = {one.name for one in d.shown}
    torque = any(motion.torque is not None for motion in d.log.motions)
    if "lag" in named and not torque:
        yield "Without a torque column, viscous friction in the joint and damping in the servo are one: both are lag."
    if "zero" in named and not torque:
        yield "Without a torque column, a zero that is off and a constant torque are one: both are told as zero."
    if "droop" in named:
        yield "A softer servo and heavier masses droop alike, unless the stiffness or the torque is known."
    if "torque_limit" in named and not torque:
        yield "A weak supply and a wrong motor constant saturate alike, without columns of volts and current."
    one_sign = [name for name in d.joints if "dead_zone" in named and _one_sign(d, name)]
    if one_sign:
        yield f"Under a load of one sign play looks like a zero: so it is in {listed(one_sign)}."
    if named & {"coulomb", "stribeck", "armature"} and not d.stated and d.unit == "rad":
        yield "The servos' stiffness is not stated: friction and inertia are told over it, in rad and s²."


def _one_sign(d: MotionDiagnosis, joint: str) -> bool:
    load = np.asarray(d.curves[joint]["load"])
    return bool(min(np.mean(load > 0.0), np.mean(load < 0.0)) < _ONE_SIGN)


def refused(d: MotionDiagnosis) -> list[str]:
    """Return the kinds of motion of which no verdict is given, each with why."""
    return [f"{kind}: {times:.1f} times what the other kinds leave" for kind, times in d.refused.items()]


def sentences(d: MotionDiagnosis) -> Iterator[str]:
    """Say in plain words what the explanation leaves."""
    left = d.unexplained
    if not left.flagged:
        yield "What remains follows neither position, velocity, load nor time in motions held out."
        return
    yield f"The effects leave {units.quantity(left.rms, d.unit)} rms with a pattern that holds in motions held out."
    yield from (f"{capitalised(reason).rstrip('.')}." for reason in left.reasons)
    if left.depends_on:
        yield f"It follows {listed([one.covariate for one in left.depends_on])}."


_TELLS: tuple[tuple[frozenset[str], str], ...] = (
    (frozenset({"delay", "lag", "armature"}), "motions with steps and quick reversals, since smooth ones look alike"),
    (frozenset({"coulomb", "dead_zone", "stribeck", "load_friction"}), "slow reversals at several loads"),
    (frozenset({"zero", "dead_zone"}), "a motion with loads of both signs"),
    (frozenset({"payload", "load_friction"}), "reversals while the load is carried"),
    (
        frozenset({"droop", "payload", "kp", "zero", "gain", "masses"}),
        "the torque of the joints, as columns tau.<joint>",
    ),
    (frozenset({"torque_limit", "kp", "lag"}), "volts and current, as columns volts and current.<joint>"),
)
"""What to record next to tell effects apart: the first line that holds two of a group."""
_FOLLOWS = {
    "velocity": "motions at several constant velocities",
    "load": "the same motions with another payload",
    "time": "the temperature of the joints (temperature.<joint>)",
}
"""What to record next where a remainder follows a quantity; of a position the whole range."""


def motion_advice(d: MotionDiagnosis) -> str:
    """Return what to record next in one sentence; empty where nothing is needed."""
    named = {one.name for one in d.shown}
    torque = any(motion.torque is not None for motion in d.log.motions)
    if not d.usable:
        return "Mend what is wrong with the log, and diagnose again."
    for group in d.separates:
        what = next((told for those, told in _TELLS if len(those & set(group)) > 1), "motions of another kind")
        return f"Record {what}: this would tell {listed([d.title(name) for name in group[:3]], 'from')}."
    if d.refused:
        kinds = listed(list(d.refused)[:_MOST_KINDS])
        return f"Look at the motions without a verdict ({kinds}) for contact, a stop or a fault of the log."
    if d.unexplained.flagged and d.unexplained.depends_on:
        what = d.unexplained.depends_on[0].covariate
        how = _FOLLOWS.get(what, "slow motions, forth and back, over its whole range")
        return f"Record {how}: what remains follows {what}."
    if d.few:
        return "Record more motions, eight or more: what is held out and what ± says then rest on independent ones."
    if "lag" in named and not torque:
        return "Record the torque of the joints (tau.<joint>): it tells damping in the joint from the servo's lag."
    if named & {"coulomb", "armature"} and not d.stated:
        return "State the servos' stiffness, [servo.<joint>] kp: friction and inertia are then told in N·m and kg·m²."
    return ""


MEANS = {
    "zero": "The encoder's or command's zero is off by a constant angle.",
    "gain": "The joint moves by more or less than commanded, in proportion: a wrong count per turn or gear ratio.",
    "delay": "The command arrives late: bus, filter or interpolation. The joint's own motion keeps its shape.",
    "lag": "The joint follows like a first-order filter of damping over stiffness: in an MJCF damping, times kp.",
    "armature": "The drive's own inertia, seen through its gear: joint armature in an MJCF.",
    "droop": "The joint sags under its load, as a spring would: one over the servo's stiffness, kp in an MJCF.",
    "kp": "The servo is stiffer or softer than stated.",
    "coulomb": "Friction that does not depend on velocity; the joint stops short: frictionloss in an MJCF.",
    "load_friction": "Friction that grows with the torque the gear carries.",
    "stribeck": "Friction that is larger at rest than in motion: the joint sticks, then jumps.",
    "dead_zone": "An error within which the servo does nothing, or play in the gear.",
    "torque_limit": "The servo gives no more torque: beyond it the joint falls behind. forcerange in an MJCF.",
    "low_stop": "The joint runs against something at the lower end of its range.",
    "high_stop": "The joint runs against something at the upper end of its range.",
    "payload": "A mass at the tool that the model does not have, or has too much.",
    "masses": "Links are heavier or lighter than in the model.",
    "contact": "The tool touches a plane and cannot go where it is commanded.",
    "offset": "The torque channel reads this where there is no torque.",
    "viscous": "Friction in proportion to velocity: damping in an MJCF.",
    "torque_constant": "The torque channel reads too much or too little, in proportion.",
}
"""What an effect means, and where it goes in a simulator."""


def effects(d: MotionDiagnosis) -> list[Finding]:
    """Return the effects in the order of display; of those that were found, the ones that are visible."""
    shown = {one.name for one in d.shown}
    return [one for one in by_status(d) if one.name in shown or one.status not in TOLD]


def needed(d: MotionDiagnosis, finding: Finding) -> str:
    """Say which columns would make an effect testable, if any would."""
    told = needs(finding, list(d.joints))
    return f"needs {told}" if told else "has no meaning for this log"


def parameters(d: MotionDiagnosis, effect: str) -> list[tuple[str, str]]:
    """Return the parameters of an effect where it is visible, in units for reading: name and value ± std."""
    known = d.physical(effect)
    return [(one.name, units.estimate(one, known)) for one in known]


def places(d: MotionDiagnosis, effect: str) -> str:
    """Say how far an effect alone moves each joint where it is visible, the farthest first."""
    moved = {joint: d.moves[effect, joint] for joint in d.visible(effect) if (effect, joint) in d.moves}
    farthest = sorted(moved, key=lambda joint: -moved[joint])
    return ", ".join(f"{joint} {units.quantity(moved[joint], d.unit_of(joint))}" for joint in farthest)


def facts(d: MotionDiagnosis) -> dict[str, str]:
    """Return what stands above all else, by its heading: verdict, motion, and which effects count."""
    readings = max((len(one) for one in d.curves.values()), default=0)
    seconds = sum(float(m.position.time[-1] - m.position.time[0]) for m in d.log.motions)
    name = f"{d.log.name}: " if d.log.name else ""
    told = {
        "Verdict": verdict(d, ", ".join(d.verdict)),
        "Motion": f"{name}robot {d.log.robot.name}, {len(d.log.motions)} motions of {len(d.joints)} joints, "
        f"{seconds:.0f} s, {readings} readings of each joint",
    }
    if d.left_out:
        told["Left out"] = f"by request: {', '.join(d.left_out)}"
    return told


def how_measured(d: MotionDiagnosis) -> str:
    """Say what the gap is, and what held out means."""
    held = d.held_out
    out = f"Held out means that a motion was not used for the fit ({held.folds} parts of the motions in turn)"
    if d.unit == "N·m":
        return f"The gap is measured torque less that of the model's masses along the measured motion. {out}."
    begins = "the measured position at its beginning and the command"
    return f"The gap is measured less simulated position. {out} and is simulated from {begins} alone."


def gaps(d: MotionDiagnosis) -> tuple[tuple[str, ...], list[list[str]]]:
    """Return the gap of every joint before, after and held out, and its noise: heads and rows; angles in one unit."""
    rows = []
    for unit in dict.fromkeys(map(d.unit_of, d.joints)):
        names = [joint for joint in d.joints if d.unit_of(joint) == unit]
        best = units.scale(unit, max(max(d.joints[j].before, d.joints[j].after) for j in names))
        for joint in names:
            one = d.joints[joint]
            sizes = (one.before, one.after, one.held_out, one.noise)
            rows.append([joint, *(units.number(best.factor * size) for size in sizes), best.unit])
    return ("joint", "before", "after", "held out", "noise", "unit"), rows
