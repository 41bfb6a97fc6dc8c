"""Plain text of a diagnosis, of a calibration and of a campaign after a crash, for the command line."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from textwrap import fill
from typing import TYPE_CHECKING

from thermal_robot.report import units, words
from thermal_robot.report.words import WIDTH
from thermal_robot.report.words import needs as needed

if TYPE_CHECKING:
    from thermal_robot.diagnosis.calibration import Calibrated, Calibration
    from thermal_robot.diagnosis.crash import Crash, Moved
    from thermal_robot.diagnosis.result import Diagnosis
    from thermal_robot.diagnosis.values import Finding

_BAR = 24
_NAME = 26


def text(diagnosis: Diagnosis) -> str:
    """Write a diagnosis as plain text.

    Parameters
    ----------
    diagnosis
        The result.

    Returns
    -------
    str
        Plain text, at most 96 columns wide unless a name is longer, without a newline at the end: the verdict, how
        far the gap shrinks, which effects cause it, where they act, what stays unexplained, what to measure next. Of a
        table that does not fit the robot what is wrong with it, and nothing of the robot.
    """
    facts = {**words.facts(diagnosis), "Rows used": "", "About": words.about_in_line(diagnosis.about)}
    sections: dict[str, Iterable[str]] = {"NEXT": [wrap(diagnosis.advice)]}
    first = [diagnosis.summary]
    if diagnosis.usable:
        first = [*words.turned(diagnosis), diagnosis.summary, *words.details(diagnosis)]
        sections = {
            "HOW FAR": _how_far(diagnosis),
            "WHICH": _which(diagnosis),
            "WHERE": _where(diagnosis),
            "UNEXPLAINED": map(wrap, words.sentences(diagnosis)),
            "ISO 9283": _criteria(diagnosis),
            "NEXT": _next(diagnosis),
        }
    return sheet(first, facts, sections | {"WARNINGS": bullets(diagnosis.warnings)})


def sheet(first: Iterable[str], facts: Mapping[str, str], sections: Mapping[str, Iterable[str]]) -> str:
    """Join sentences, facts by their names, and lines by their headings; what is empty is left out."""
    named = [wrap(said, f"{name.lower():11}") for name, said in facts.items() if said]
    blocks = [[heading, *lines] for heading, lines in sections.items()]
    told = [[wrap(said, "") for said in first], named, *(block for block in blocks if len(block) > 1)]
    return "\n\n".join("\n".join(block) for block in told)


def bullets(sentences: Iterable[str]) -> list[str]:
    """Break sentences into lines, each after a dash."""
    return [wrap(said, "  - ") for said in sentences]


def wrap(sentence: str, indent: str = "  ", hang: int = 0) -> str:
    """Break a sentence into lines, but not between a number and its unit; the first line begins with ``indent``."""
    rest = " " * (len(indent) + hang)
    lines = fill(words.bound(sentence), WIDTH, initial_indent=indent, subsequent_indent=rest, break_on_hyphens=False)
    return lines.replace(words.NO_BREAK, " ")


def _how_far(diagnosis: Diagnosis) -> Iterator[str]:
    gap, held = diagnosis.gap, diagnosis.gap.held_out
    before, after, held_before, held_after, floor = units.together(
        (gap.rms_before, gap.rms_after, held.rms_before, held.rms_after, gap.noise_floor), "m"
    )
    lines = [("gap, rms distance", before, after, words.rows_used(diagnosis))]
    if gap.orientation_before is not None:
        turned = units.together((gap.orientation_before, gap.orientation_after), "rad")
        lines.append(("gap of orientation, rms", turned[0], turned[1], ""))
    said = f"not used for the fit: {held.scheme}, {held.folds} folds"
    lines.append(("gap on rows held out", held_before, held_after, said))
    wide = max(len(cell) for line in lines for cell in line[1:3])
    for name, first, second, note in lines:
        yield f"  {name:{_NAME}}{first:>{wide}} → {second:<{wide}}   {note}".rstrip()
    if told := words.with_aside(diagnosis):
        yield wrap(told, f"  {'':{_NAME}}")
    interval = f"95 % interval {units.interval(held.shrinkage_ci95)} %"
    yield f"  {'shrinkage, held out':{_NAME}}{units.percent(held.shrinkage)}   {interval}"
    if told := words.hardest(diagnosis):
        yield wrap(told, f"  {'hardest hold-out':{_NAME}}")
    yield wrap(words.noise(diagnosis, floor), f"  {'noise floor':{_NAME}}")
    yield wrap(
        "Shrinkage is the share of the gap's mean square that the correction removes. Figures of rows held out "
        "have the noise of these rows in them."
    )


def _which(diagnosis: Diagnosis) -> Iterator[str]:
    wide = max([len(f.name) for f in diagnosis.effects], default=0)
    yield f"    {'':{wide}}{'probability':>13}   share of the gap, on rows held out (95 %)"
    yield from by_heading(diagnosis.effects, lambda finding, status: _effect(finding, status, wide, diagnosis))
    if told := words.one_sigma(diagnosis):
        yield wrap(told)


def by_heading(effects: Sequence[Finding], told: Callable[[Finding, str], Iterable[str]]) -> Iterator[str]:
    """Yield lines on the effects, grouped by displayed status below headings; ``told`` gives those of one effect."""
    for status, heading in words.STATUS.items():
        group = [one for one in effects if words.displayed_status(one) == status]
        if group:
            yield f"  {heading}"
        elif status == "found":
            yield "  found: none"
        for one in group:
            yield from told(one, status)


def _effect(finding: Finding, status: str, wide: int, diagnosis: Diagnosis) -> Iterator[str]:
    if status == "not_testable":
        needs = needed(finding, diagnosis.joint_names)
        yield wrap(f"needs {needs}", f"    {finding.name:{wide}}{'':13}   ")
        return
    bounds = f"  ({units.interval(finding.shrinkage_ci95)} %)" if finding.shrinkage_ci95 else ""
    line = f"    {finding.name:{wide}}{units.probability(finding.probability):>13}   "
    line += f"{units.percent(finding.shrinkage):>7}{bounds}"
    if status not in ("found", "confounded", "contained"):
        rivals = ", ".join(finding.confounded_with)
        yield wrap(f"; cannot be told apart from {rivals}", line) if rivals else line
        return
    yield line
    before, shown, after = words.described(finding, diagnosis)
    yield from (wrap(told, " " * 6, hang) for told, hang in before)
    column = max([len(name) for name, _ in shown], default=0)
    yield from (f"      {name:{column}}  {value}" for name, value in shown)
    yield from (wrap(told, " " * 6, hang) for told, hang in after)


def _where(diagnosis: Diagnosis) -> Iterator[str]:
    where = diagnosis.where
    yield "  share of the gap's mean square"
    yield from _bars("axis of the root frame", where.axes, ranked=False)
    yield from _bars("joint", where.joints)
    yield from _bars("link", where.links)
    yield from _bars("beyond joints and links", where.beyond)
    yield from _bars("recorded quantity: what a law of it alone would explain", where.covariates)


def _bars(heading: str, shares: Mapping[str, float], ranked: bool = True, most: int = 7) -> Iterator[str]:
    """Bar chart of shares in characters: the ``most`` largest from 0.5 % on, or unsorted without that bound."""
    if not shares:
        return
    ordered = sorted(shares.items(), key=lambda item: -item[1]) if ranked else list(shares.items())
    shown = [(name, s) for name, s in ordered if not ranked or s >= 0.005][:most]
    yield f"  {heading}"
    wide = max([_NAME, *(len(name) for name, _ in shown)])
    for name, share in shown:
        yield f"    {name:{wide}}  {bar(share):{_BAR}}  {units.percent(share):>7}"
    if not shown:
        yield "    none above 0.5 %"
    elif rest := ordered[len(shown) :]:
        yield f"    {words.more(len(rest), rest[0][1])}"


def bar(share: float) -> str:
    """Draw a share as a bar of characters, full at one."""
    halves = round(2 * _BAR * min(max(share, 0.0), 1.0)) if share == share else 0
    return "█" * (halves // 2) + "▌" * (halves % 2)


def _criteria(diagnosis: Diagnosis) -> Iterator[str]:
    """Yield the ISO 9283 criteria of the worst pose and path; nothing without repeats."""
    found = diagnosis.performance
    if found is None:
        return
    for name, value, after in (
        ("pose accuracy AP", found.accuracy, found.corrected),
        ("pose repeatability RP", found.repeatability, None),
        ("path accuracy AT", found.path_accuracy, found.path_corrected),
        ("path repeatability RT", found.path_repeatability, None),
    ):
        if value is not None:
            shown = units.together((value, after), "m")
            yield f"  {name:{_NAME}}{' → '.join(shown if after is not None else shown[:1])}"
    said = [f"The worst of {found.extent}."]
    if found.corrected is not None or found.path_corrected is not None:
        said.append("After the arrow: corrected, of poses held out.")
    if found.registered:
        said.append(f"AP and AT are after registration of {' and '.join(found.registered)} to the same rows.")
    yield wrap(" ".join(said))


def _next(diagnosis: Diagnosis) -> Iterator[str]:
    if diagnosis.advice:
        yield wrap(diagnosis.advice)
    yield from bullets(f"to tell apart: {', '.join(group)}" for group in diagnosis.separates)


def calibration_text(calibration: Calibration) -> str:
    """Plain text of a calibration.

    Parameters
    ----------
    calibration
        The result.

    Returns
    -------
    str
        Plain text without a newline at the end: how far the gap shrinks on the rows that were fitted, every parameter
        with one standard deviation, and what the data do not tell.
    """
    return "\n".join(_lines(calibration))


def _lines(found: Calibration) -> Iterator[str]:
    yield wrap(
        f"{found.robot}, {found.tool_frame}: {found.samples} samples of {found.measures}, {len(found.outliers)} set "
        f"aside. Fitted as asked, not chosen: {words.in_words([effect.title for effect in found.effects])}.",
        "",
    )
    sizes = [("gap, rms", found.rms_before, found.rms_after, "m")]
    if found.turned_before is not None and found.turned_after is not None:
        sizes.append(("turn, rms", found.turned_before, found.turned_after, "rad"))
    for name, before, after, unit in sizes:
        yield f"{name:<16}{' → '.join(units.together([before, after], unit))} on the rows that were fitted"
    yield f"noise, per axis {units.quantity(found.noise, 'm')}"
    if found.unexplained:
        yield wrap(
            "What is left is not noise: something else is at work, and deviations are widened by what it may do. "
            "diagnose() says what it may be.",
            "",
        )
    for effect in found.effects:
        yield from ("", *_calibrated(effect))
    for warning in found.warnings:
        yield wrap(f"Note: {warning}", "")


def _calibrated(effect: Calibrated) -> Iterator[str]:
    part = f", a part of {effect.inside}" if effect.inside not in ("", effect.name) else ""
    yield f"{effect.title} ({effect.name}{part}), ± one standard deviation"
    known = [p for p in effect.parameters if p.identified]
    width = max((len(p.name) for p in known), default=0)
    for p in known:
        yield f"  {p.name:<{width}}  {units.estimate(p, known)}"
    hidden = [p.name for p in effect.parameters if not p.identified]
    for label, names in (("not determined", hidden), ("not seen apart from the others or the frames", effect.unseen)):
        if names:
            yield wrap(f"{label}: {words.in_words(names, between='; ')}")


_SHOWN = 6
"""Candidates that are listed: the named ones, and a few that were not."""


def crash_headline(crash: Crash) -> str:
    """Say in one sentence what a crash moved: the zero of a joint, a link, both or nothing; or why it is not told."""
    named = crash.named
    if crash.misfit is not None:
        return f"Not the crash: {next(iter(words.misfit_sentences(crash.misfit, crash.reach)))}"
    if crash.verdict == "nothing":
        return "No zero and no link stands out beside the ordinary errors of an arm."
    zeros = [f"{one.name} by {_first(one)}" for one in named if one.kind == "joint"]
    links = [f"what {one.name} carries by {_first(one)}" for one in named if one.kind == "link"]
    unnamed = "which of them the rows do not tell"
    said = []
    if crash.verdict in ("zero", "both"):
        said.append(f"the zero of {words.listed(zeros)}" if zeros else f"a joint's zero, {unnamed}")
    if crash.verdict in ("link", "both"):
        where = f"it has {words.listed(links)} elsewhere" if links else unnamed
        said.append(f"the URDF or a bent link: {where}")
    return f"It is {', and '.join(said)} ({units.probability(crash.probability)} sure)."


def crash_text(crash: Crash) -> str:
    """Plain text on a crash: what moved, the probability of each candidate, what cannot be told, what to do."""
    return "\n".join([wrap(crash_headline(crash), ""), *_of_crash(crash)])


def _of_crash(crash: Crash) -> Iterator[str]:
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
            f"Not told: the zero of {words.listed(crash.hidden)}, which the unknown base or tool takes up, or which "
            "the target does not see. Declare the frame known, or put the target off the last axis."
        )
    yield wrap(_ADVICE[crash.verdict if crash.named or crash.verdict == "nothing" else "untold"])


_ADVICE = {
    "zero": "Next: master that joint again at its mark, or write the zero (thermal-robot diagnose --only joint_offset "
    "--model, then correct --offsets); measure ten poses again.",
    "link": "Next: compare the drawing of the arm with the URDF (variant, flange, riser). If it is the right one, the "
    "link is bent: diagnose --model, then correct --urdf.",
    "both": "Next: master the joint again, then measure again: what is left is the URDF or a link.",
    "untold": "Next: measure forty further poses, with the target farther off the last axis: these do not tell.",
    "nothing": "Next: diagnose, for other causes: lost motion, a gear, a brake.",
}


def _first(one: Moved) -> str:
    """Largest move of a candidate beyond two standard deviations, with one; a shift goes before a turn."""
    known = [k for k, (value, std) in enumerate(zip(one.values, one.stds, strict=True)) if abs(value) >= 2.0 * std]
    # of a link its shift says most; a turn where it only turned
    k = max(known or [0], key=lambda k: (one.units[k] == "m", abs(one.values[k])))
    return units.measured(one.values[k], one.stds[k], one.units[k])
