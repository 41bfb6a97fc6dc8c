"""Plain text of what a campaign after a crash says."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from thermal_robot.report import units
from thermal_robot.report.plain_text import wrap
from thermal_robot.report.words import listed, misfit_sentences

if TYPE_CHECKING:
    from thermal_robot.diagnosis.crash import Crash, Moved

_SHOWN = 6
"""Candidates that are listed: the named ones, and a few that were not."""


def crash_headline(crash: Crash) -> str:
    """One sentence: what moved."""
    named = crash.named
    if crash.misfit is not None:
        return f"Not the crash: {next(iter(misfit_sentences(crash.misfit, crash.reach)))}"
    if crash.verdict == "nothing":
        return "No zero and no link stands out beside the ordinary errors of an arm."
    zeros = [f"{one.name} by {_first(one)}" for one in named if one.kind == "joint"]
    links = [f"what {one.name} carries by {_first(one)}" for one in named if one.kind == "link"]
    unnamed = "which of them the rows do not tell"
    said = []
    if crash.verdict in ("zero", "both"):
        said.append(f"the zero of {listed(zeros)}" if zeros else f"a joint's zero, {unnamed}")
    if crash.verdict in ("link", "both"):
        where = f"it has {listed(links)} elsewhere" if links else unnamed
        said.append(f"the URDF or a bent link: {where}")
    return f"It is {', and '.join(said)} ({units.probability(crash.probability)} sure)."


def crash_text(crash: Crash) -> str:
    """Plain text of the result: what moved, the probability of each candidate, what cannot be told, what to do."""
    return "\n".join([wrap(crash_headline(crash), ""), *_rest(crash)])


def _rest(crash: Crash) -> Iterator[str]:
    if crash.misfit is not None:
        return
    before, after = units.together((crash.rms_before, crash.rms_after), "m")
    yield ""
    yield wrap(f"{crash.samples} rows: the gap is {before}; with what moved, and ordinary errors, {after} are left.")
    wide = max((len(one.name) for one in crash.moved), default=0)
    for one in crash.moved[: max(_SHOWN, len(crash.named))]:
        kind = "zero of" if one.kind == "joint" else "carried by"
        yield f"  {kind:<11}{one.name:<{wide}}  {units.probability(one.probability):>8}   {_first(one)}"
    if crash.hidden:
        yield wrap(
            f"Not told: the zero of {listed(crash.hidden)}, which the unknown base or tool takes up, or which the "
            "target does not see. Declare the frame known, or put the target off the last axis."
        )
    yield wrap(_ADVICE[crash.verdict])


_ADVICE = {
    "zero": "Next: master that joint again at its mark, or write the zero (thermal-robot diagnose --only joint_offset "
    "--model, then correct --offsets); measure ten poses again.",
    "link": "Next: compare the drawing of the arm with the URDF (variant, flange, riser). If it is the right one, the "
    "link is bent: diagnose --model, then correct --urdf.",
    "both": "Next: master the joint again, then measure again: what is left is the URDF or a link.",
    "nothing": "Next: diagnose, for other causes: lost motion, a gear, a brake.",
}


def _first(one: Moved) -> str:
    """Largest move of a candidate, with one standard deviation."""
    known = [k for k, (value, std) in enumerate(zip(one.values, one.stds, strict=True)) if abs(value) >= 2.0 * std]
    # of a link its shift says most; a turn where it only turned
    k = max(known or [0], key=lambda k: (one.units[k] == "m", abs(one.values[k])))
    return units.measured(one.values[k], one.stds[k], one.units[k])
