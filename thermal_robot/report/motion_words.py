"""The sentences of a diagnosis of motion, which text and page share, and its text for the command line."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from thermal_robot.report import units, words
from thermal_robot.report.plain_text import bar, bullets, by_heading, sheet, wrap
from thermal_robot.tables import aligned

if TYPE_CHECKING:
    from thermal_robot.diagnosis.values import Finding
    from thermal_robot.motion.compare import Compared, MotionComparison
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
    return words.fitting(_wordings(diagnosis))


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
            causes = _causes(d, words.weighty(found, most), places, rivals, len(found))
            for far in _how_far(d):
                yield f"The joints miss the {_model(d)} by {size}: {causes} ({words.sure(d.probability)}); {far}."


def _model(d: MotionDiagnosis) -> str:
    """Name what the joints are compared with: command, simulated servos, or torques of their masses."""
    if d.unit == "N·m":
        return "torques of their masses"
    return "simulated servos" if d.stated else "command"


def _causes(d: MotionDiagnosis, named: Sequence[Finding], places: bool, rivals: bool, count: int) -> str:
    """Join the names of causes, with main joint (``places``) and confounded ``rivals``; say how many more there are."""
    told = [(d.title(f.name, main_joint(f) if places else ""), [*map(d.title, f.confounded_with)]) for f in named]
    return words.causes_in_words(told, rivals, count - len(named))


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
        yield words.smaller_ones([d.title(one.name, main_joint(one)) for one in unsaid])
    hidden = [d.title(name) for name in d.verdict if not d.visible(name)]
    if hidden:
        why = "since no joint moves by twice its noise or the stated tolerance"
        yield f"Told, but not shown, {why}: {words.listed(hidden)}."
    if d.few and d.shown:
        count = len(d.log.motions)
        here = "There is 1 motion" if count == 1 else f"There are {count} motions"
        yield f"{here}: ± is weak below eight, as readings of one motion share errors."


def always(d: MotionDiagnosis) -> Iterator[str]:
    """Yield a sentence for each found effect that no log of this kind can tell from another cause."""
    named = {one.name for one in d.shown}
    torque = any(motion.torque is not None for motion in d.log.motions)
    if "lag" in named and not torque:
        yield "Without a torque column, viscous friction in the joint and damping in the servo are one: both are lag."
    if "zero" in named and not torque:
        yield "Without a torque column, a zero that is off and a constant torque are one: both are told as zero."
    if "droop" in named or (len(d.joints) == 1 and named & {"kp", "payload"} and not torque):
        yield "A softer servo and heavier masses droop alike, unless the stiffness or the torque is known."
    if "torque_limit" in named and not torque:
        yield "A weak supply and a wrong motor constant saturate alike, without columns of volts and current."
    one_sign = [name for name in d.joints if "dead_zone" in named and _one_sign(d, name)]
    if one_sign:
        yield f"Under a load of one sign play looks like a zero: so it is in {words.listed(one_sign)}."
    if named & {"coulomb", "stribeck", "armature"} and not d.stated and d.unit == "rad":
        yield "The servos' stiffness is not stated: friction and inertia are told over it, in rad and s²."


def _one_sign(d: MotionDiagnosis, joint: str) -> bool:
    load = np.asarray(d.curves[joint]["load"])
    return bool(min(np.mean(load > 0.0), np.mean(load < 0.0)) < _ONE_SIGN)


def refused(d: MotionDiagnosis) -> list[str]:
    """Return the kinds of motion of which no verdict is given, each with why."""
    return [f"{kind}: {times:.1f} times what the other kinds leave" for kind, times in d.refused.items()]


def sentences(d: MotionDiagnosis) -> Iterator[str]:
    """Yield sentences on the remainder of the gap that the effects do not explain."""
    left = d.unexplained
    if not left.flagged:
        yield "What remains follows neither position, velocity, load nor time in motions held out."
        return
    pattern = " with a pattern that holds in motions held out" if left.depends_on else ""
    stays = "The effects leave" if d.verdict else "No effect is told, and what stays is"
    yield f"{stays} {units.quantity(left.rms, d.unit)} rms{pattern}."
    yield from (f"{words.capitalised(reason).rstrip('.')}." for reason in left.reasons)
    if left.depends_on[1:]:
        yield f"It follows {words.listed([one.covariate for one in left.depends_on])}."


_TELLS: tuple[tuple[frozenset[str], str], ...] = (
    (frozenset({"delay", "lag", "armature"}), "motions with steps and quick reversals, since smooth ones look alike"),
    (frozenset({"coulomb", "dead_zone", "stribeck", "load_friction"}), "slow reversals at several loads"),
    (frozenset({"zero", "dead_zone"}), "a motion with loads of both signs"),
    (frozenset({"payload", "load_friction"}), "reversals while the load is carried"),
    (
        frozenset({"droop", "payload", "kp", "zero", "gain", "masses"}),
        "the torque of the joints, as columns tau.<joint>",
    ),
    (
        frozenset({"speed_limit", "acceleration_limit", "lag"}),
        "steps of several sizes: a lag takes the same time for each",
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
        return f"Record {what}: this would tell {words.listed([d.title(name) for name in group[:3]], 'from')}."
    if d.refused:
        kinds = words.listed(list(d.refused)[:_MOST_KINDS])
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
    "dead_zone": "An error within which the servo does nothing, or play in the gear. Or the contrary, starting force: "
    "at any error the drive gives so much more, to overcome friction.",
    "torque_limit": "The servo gives no more torque: beyond it the joint falls behind. forcerange in an MJCF.",
    "speed_limit": "The servo leads its set point to the command no faster than this: its profile's speed, or a ramp.",
    "acceleration_limit": "The servo leads its set point with no more acceleration than this: its profile's.",
    "low_stop": "The joint runs against something at the lower end of its range.",
    "high_stop": "The joint runs against something at the upper end of its range.",
    "payload": "A mass at the tool that the model does not have, or has too much.",
    "masses": "Links are heavier or lighter than in the model.",
    "contact": "The tool touches a plane, which keeps it from where it is commanded, and drags at it.",
    "offset": "The torque channel reads this where there is no torque.",
    "viscous": "Friction in proportion to velocity: damping in an MJCF.",
    "torque_constant": "The torque channel reads too much or too little, in proportion.",
}
"""What an effect means, and where it goes in a simulator."""


def effects(d: MotionDiagnosis) -> list[Finding]:
    """Return the effects in the order of display; of those that were found, the ones that are visible."""
    shown = {one.name for one in d.shown}
    return [one for one in words.by_status(d) if one.name in shown or one.status not in TOLD]


def needed(d: MotionDiagnosis, finding: Finding) -> str:
    """Say which columns would make an effect testable, if any would."""
    told = words.needs(finding, list(d.joints))
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
    """Return the first facts of a report by heading: verdict, size of the log, effects left out."""
    readings = max((len(one) for one in d.curves.values()), default=0)
    seconds = sum(float(m.position.time[-1] - m.position.time[0]) for m in d.log.motions)
    name = f"{d.log.name}: " if d.log.name else ""
    told = {
        "Verdict": words.verdict(d, ", ".join(d.verdict)),
        "Motion": f"{name}robot {d.log.robot.name}, {len(d.log.motions)} motions of {len(d.joints)} joints, "
        f"{seconds:.0f} s, {readings} readings of each joint",
    }
    if d.left_out:
        told["Left out"] = f"by request: {', '.join(d.left_out)}"
    return told


def how_measured(d: MotionDiagnosis) -> str:
    """Say how the gap is defined (measured less simulated, or torques), and what held out means."""
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


def motion_text(diagnosis: MotionDiagnosis) -> str:
    """Write a diagnosis of motion as plain text.

    Parameters
    ----------
    diagnosis
        The result.

    Returns
    -------
    str
        Plain text, at most 96 columns wide unless a name is longer, without a newline at the end: the verdict, how far
        each joint's gap shrinks, which effects cause it, what the log cannot tell, what stays unexplained, what to
        record next.
    """
    d = diagnosis
    named = {**facts(d), "About": words.about_in_line(d.log.about)}
    sections: dict[str, Iterable[str]] = {
        "HOW FAR": _gap_by_joint(d) if d.usable else (),
        "WHICH": _which(d) if d.usable else (),
        "CANNOT BE TOLD": bullets(_cannot(d)),
        "NO VERDICT OF THESE MOTIONS": bullets(refused(d)),
        "THE LOG": bullets((*d.faults, *d.warnings)),
        "UNEXPLAINED": map(wrap, sentences(d) if d.usable else ()),
        "NEXT": map(wrap, filter(None, [d.advice])),
    }
    return sheet(filter(None, (d.summary, *details(d))), named, sections)


def _gap_by_joint(d: MotionDiagnosis) -> Iterator[str]:
    heads, rows = gaps(d)
    unit = {row[-1] for row in rows}
    what = "torque" if d.unit == "N·m" else "gap"
    yield f"  rms {what} of each joint{f', {unit.pop()}' if len(unit) == 1 else ''}"
    shown = len(heads) if unit else len(heads) - 1
    yield from (f"    {line}" for line in aligned([line[:shown] for line in (heads, *rows)]))
    held = d.held_out
    interval = f"95 % interval {units.interval(held.shrinkage_ci95)} %"
    yield f"  shrinkage, held out  {units.percent(held.shrinkage)}   {interval}"
    yield wrap(how_measured(d))


def _which(d: MotionDiagnosis) -> Iterator[str]:
    wide = max(len(one.name) for one in d.effects)
    yield f"    {'':{wide}}{'probability':>13}    share   of the gap, in motions held out"
    yield from by_heading(effects(d), lambda one, status: _effect(d, one, status, wide))
    if told := words.one_sigma(d):
        yield wrap(told)


def _effect(d: MotionDiagnosis, finding: Finding, status: str, wide: int) -> Iterator[str]:
    if status == "not_testable":
        yield wrap(needed(d, finding), f"    {finding.name:{wide}}{'':13}   ")
        return
    line = f"    {finding.name:{wide}}{units.probability(finding.probability):>13}"
    if status not in TOLD:
        yield line
        return
    yield f"{line}  {units.percent(finding.shrinkage):>7}   {bar(finding.shrinkage or 0.0)}".rstrip()
    if finding.confounded_with:
        yield wrap(f"these data cannot tell it from {', '.join(finding.confounded_with)}", " " * 6)
    known = parameters(d, finding.name)
    column = max((len(name) for name, _ in known), default=0)
    yield from (f"      {name:{column}}  {value}" for name, value in known)
    if told := places(d, finding.name):
        yield wrap(f"moves {told}", " " * 6, 2)


def _cannot(d: MotionDiagnosis) -> Iterator[str]:
    for group in d.separates:
        yield f"In this log {words.listed(group)} do the same."
    yield from always(d)


_MOST_CHANGES = 3  # changes that a headline names; the others are counted


def motion_comparison_headline(comparison: MotionComparison) -> str:
    """Return what changed between two logs of motion in one plain sentence."""
    first, second = comparison.logs
    told = [_change(one) for one in comparison.changes[:_MOST_CHANGES]]
    if not told:
        return f"Nothing changed between {first} and {second} beyond three standard deviations."
    fewer = len(comparison.changes) - len(told)
    return f"From {first} to {second} {words.listed([*told, *([f'{fewer} more'] if fewer else [])])} changed."


def _change(one: Compared) -> str:
    pair = " → ".join(units.together(one.values, one.unit))
    return f"{one.title} ({pair}, z = {one.z:.1f})".replace("-", "−")


def motion_comparison_text(comparison: MotionComparison) -> str:
    """Write a comparison of two logs of motion: every parameter in both, the difference, and how sure it is."""
    heads = ("effect", "parameter", *comparison.logs, "difference", "z")
    rows = [_compared(one) for one in comparison.parameters]
    lines = aligned([heads, *rows], left=range(len(heads)))
    weak = "Fewer than eight motions in either log: ± is weak, and so is z."
    said = ["± is one standard deviation; z is the difference over its own.", *([weak] if comparison.weak else [])]
    return "\n\n".join((wrap(comparison.summary, ""), "\n".join(lines if rows else ["No effect is told."]),
                        wrap(" ".join(said), "")))  # fmt: skip


def _compared(one: Compared) -> tuple[str, ...]:
    pairs = [*zip(one.values, one.stds, strict=True), (one.difference, one.std)]
    told = [units.MISSING if v is None or s is None else units.measured(v, s, one.unit) for v, s in pairs]
    return one.effect, one.name, *told, units.MISSING if one.z is None else f"{one.z:.1f}".replace("-", "−")
