"""A diagnosis of motion as plain text: what the command line prints."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from thermal_robot.report import motion_words as words
from thermal_robot.report import units
from thermal_robot.report.plain_text import bar, by_heading, wrap
from thermal_robot.report.words import about_in_line, listed, one_sigma

if TYPE_CHECKING:
    from thermal_robot.diagnosis.values import Finding
    from thermal_robot.motion.compare import Compared, MotionComparison
    from thermal_robot.motion.result import MotionDiagnosis


def motion_text(diagnosis: MotionDiagnosis) -> str:
    """Write a diagnosis of motion for the person who recorded the log.

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
    facts = [wrap(said, f"{name.lower():11}") for name, said in words.facts(d).items()]
    if d.log.about:
        facts.append(wrap(about_in_line(d.log.about), f"{'about':11}"))
    blocks = [
        ["HOW FAR", *(_how_far(d) if d.usable else ())],
        ["WHICH", *(_which(d) if d.usable else ())],
        ["CANNOT BE TOLD", *(wrap(said, "  - ") for said in _cannot(d))],
        ["NO VERDICT OF THESE MOTIONS", *(wrap(said, "  - ") for said in words.refused(d))],
        ["THE LOG", *(wrap(fault, "  - ") for fault in (*d.faults, *d.warnings))],
        ["UNEXPLAINED", *(map(wrap, words.sentences(d)) if d.usable else ())],
        ["NEXT", *([wrap(d.advice)] if d.advice else [])],
    ]
    first = [wrap(said, "") for said in (d.summary, *words.details(d)) if said]
    return "\n\n".join("\n".join(block) for block in (first, facts, *(block for block in blocks if len(block) > 1)))


def _how_far(d: MotionDiagnosis) -> Iterator[str]:
    heads, rows = words.gaps(d)
    unit = {row[-1] for row in rows}
    lines = [heads, *rows]
    wide = [max(len(line[k]) for line in lines) for k in range(len(heads))]
    what = "torque" if d.unit == "N·m" else "gap"
    yield f"  rms {what} of each joint{f', {unit.pop()}' if len(unit) == 1 else ''}"
    shown = len(heads) if unit else len(heads) - 1
    for line in lines:
        yield "    " + "  ".join(f"{cell:<{w}}" if k == 0 else f"{cell:>{w}}" for k, (cell, w) in
                                 enumerate(zip(line[:shown], wide, strict=False)))  # fmt: skip
    held = d.held_out
    interval = f"95 % interval {units.interval(held.shrinkage_ci95)} %"
    yield f"  shrinkage, held out  {units.percent(held.shrinkage)}   {interval}"
    yield wrap(words.how_measured(d))


def _which(d: MotionDiagnosis) -> Iterator[str]:
    wide = max(len(one.name) for one in d.effects)
    yield f"    {'':{wide}}{'probability':>13}    share   of the gap, in motions held out"
    yield from by_heading(words.effects(d), lambda one, status: _effect(d, one, status, wide))
    if told := one_sigma(d):
        yield wrap(told)


def _effect(d: MotionDiagnosis, finding: Finding, status: str, wide: int) -> Iterator[str]:
    if status == "not_testable":
        yield wrap(words.needed(d, finding), f"    {finding.name:{wide}}{'':13}   ")
        return
    line = f"    {finding.name:{wide}}{units.probability(finding.probability):>13}"
    if status not in words.TOLD:
        yield line
        return
    yield f"{line}  {units.percent(finding.shrinkage):>7}   {bar(finding.shrinkage or 0.0)}".rstrip()
    if finding.confounded_with:
        yield wrap(f"these data cannot tell it from {', '.join(finding.confounded_with)}", " " * 6)
    known = words.parameters(d, finding.name)
    column = max((len(name) for name, _ in known), default=0)
    yield from (f"      {name:{column}}  {value}" for name, value in known)
    if told := words.places(d, finding.name):
        yield wrap(f"moves {told}", " " * 6, 2)


def _cannot(d: MotionDiagnosis) -> Iterator[str]:
    for group in d.separates:
        yield f"In this log {', '.join(group)} do the same."
    yield from words.always(d)


_MOST = 3  # changes that a headline names; the others are counted


def motion_comparison_headline(comparison: MotionComparison) -> str:
    """Return what changed between two logs of motion in one plain sentence."""
    first, second = comparison.logs
    told = [_change(one) for one in comparison.changes[:_MOST]]
    if not told:
        return f"Nothing changed between {first} and {second} beyond three standard deviations."
    fewer = len(comparison.changes) - len(told)
    return f"From {first} to {second} {listed([*told, *([f'{fewer} more'] if fewer else [])])} changed."


def _change(one: Compared) -> str:
    pair = " → ".join(units.together(one.values, one.unit))
    return f"{one.title} ({pair}, z = {one.z:.1f})".replace("-", "−")


def motion_comparison_text(comparison: MotionComparison) -> str:
    """Write a comparison of two logs of motion: every parameter in both, the difference, and how sure it is."""
    heads = ("effect", "parameter", *comparison.logs, "difference", "z")
    rows = [_compared(one) for one in comparison.parameters]
    wide = [max(len(line[k]) for line in (heads, *rows)) for k in range(len(heads))]
    lines = ["  ".join(f"{cell:<{w}}" for cell, w in zip(line, wide, strict=True)).rstrip() for line in (heads, *rows)]
    weak = "Fewer than eight motions in either log: ± is weak, and so is z."
    said = ["± is one standard deviation; z is the difference over its own.", *([weak] if comparison.weak else [])]
    return "\n\n".join((wrap(comparison.summary, ""), "\n".join(lines if rows else ["No effect is told."]),
                        wrap(" ".join(said), "")))  # fmt: skip


def _compared(one: Compared) -> tuple[str, ...]:
    pairs = [*zip(one.values, one.stds, strict=True), (one.difference, one.std)]
    told = [units.MISSING if v is None or s is None else units.measured(v, s, one.unit) for v, s in pairs]
    return one.effect, one.name, *told, units.MISSING if one.z is None else f"{one.z:.1f}".replace("-", "−")
