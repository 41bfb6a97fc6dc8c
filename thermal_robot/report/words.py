"""The sentences that text and page share, and what is shown where there is not room for all."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from thermal_robot.report import units

if TYPE_CHECKING:
    from thermal_robot.diagnosis.parts import Estimate, Finding
    from thermal_robot.diagnosis.result import Diagnosis

STATUS = {
    "found": "found",
    "confounded": "cannot be told apart",
    "contained": "part of what was found",
    "in_question": "in question",
    "not_found": "not found",
    "not_testable": "not testable with these data",
}
_ALL_UP_TO = 7
_MOST = 6
_NO_TENTH = 0.0005  # a share that rounds to 0.0 %
_NEGLIGIBLE = 0.005  # share of the gap that is not worth a line
_MORE_LIKELY = 0.5
_UNLIKELY = 0.02  # probability of a place that is not worth naming
_SOURCES = {
    "stated": "the instrument's noise as the campaign states it",
    "repeats": "from the differences between repeated commands",
    "scatter": "the instrument's noise and the scatter of the joints that was found",
    "remainder": "an upper bound, from the remainder itself: the campaign states no noise and repeats no command",
}


NO_BREAK = "\u00a0"
_TOGETHER = re.compile(r"(?<=\d) (?=(%|[mµn]?m\b|[mµ]?rad\b))|(?<=\bp) (?=[<=])|(?<=[<>=]) (?=\d)")


def told_as(finding: Finding) -> str:
    """Return the status under which a finding is shown: not found, yet more probable than not, it is in question."""
    doubtful = finding.status == "not_found" and (finding.probability or 0.0) >= _MORE_LIKELY
    return "in_question" if doubtful else finding.status


def by_status(diagnosis: Diagnosis) -> list[Finding]:
    """Return the findings in the order in which they are shown: what was found first, what is not testable last."""
    return [f for status in STATUS for f in diagnosis.effects if told_as(f) == status]


@dataclass(frozen=True)
class Shown:
    """An effect's parameters as far as they are printed.

    Attributes
    ----------
    heading
        What was chosen; empty where all are shown.
    shown
        Name, and value with its standard deviation and unit.
    more
        How many identified ones are not shown.
    undetermined
        Names of those that the data do not determine; empty where there is none.
    unseen
        How many the data do not see, or not beside the others, with their names; empty where there is none.
    """

    heading: str
    shown: tuple[tuple[str, str], ...]
    more: int
    undetermined: str
    unseen: str


def parameters(finding: Finding) -> Shown:
    """Choose the parameters to print: all of a few in the order of the chain, else the most significant."""
    known = [p for p in finding.parameters if p.identified and p.value is not None]
    chosen, heading = known, ""
    if len(known) > _ALL_UP_TO:
        chosen = sorted(known, key=lambda p: -_significance(p))[:_MOST]
        heading = f"the {_MOST} most significant of {len(known)} parameters:"
    # where there is a size, it says what is known; a constant that the frames can take up is no news
    undetermined = [] if finding.size else [p.name for p in finding.parameters if p not in known]
    return Shown(
        heading,
        tuple((p.name, units.estimate(p, chosen)) for p in chosen),
        len(known) - len(chosen),
        in_words(undetermined, most=4, between="; "),  # names hold commas
        _unseen(finding.unseen),
    )


def _unseen(names: Sequence[str]) -> str:
    """Say how many parameters are not seen and which; empty where there are none."""
    listed = in_words(names, most=6, between="; ")
    return f"{len(names)} not seen apart from the others or the frames: {listed}" if names else ""


def _significance(parameter: Estimate) -> float:
    return abs(parameter.value or 0.0) / max(parameter.std or 0.0, 1e-300)


def in_words(names: Sequence[str], most: int = 10, between: str = ", ") -> str:
    """List names, at most so many, then say how many more there are."""
    more = len(names) - most
    if more <= 0:
        return between.join(names)
    return f"{between.join(names[:most])} and {more} more"


def bound(sentence: str) -> str:
    """Keep numbers and their units on one line."""
    return _TOGETHER.sub(NO_BREAK, sentence)


def rows_in_words(rows: Sequence[int], most: int = 10) -> str:
    """Say which rows of the file: ``rows 17, 80 and 3 more``."""
    return f"{'row' if len(rows) == 1 else 'rows'} {in_words([str(r) for r in rows], most)}"


def set_aside(diagnosis: Diagnosis) -> str:
    """Say which rows were set aside, and how rows are counted: ``as outliers: rows 8, 24, 74, 90 of the file ...``."""
    rows = f"as outliers: {rows_in_words(diagnosis.outliers)} of the file (its header is row 1)"
    return rows if diagnosis.outliers else "no row"


def struck(diagnosis: Diagnosis) -> str:
    """Say which rows a fault of the table struck; empty where it struck all, or there is none."""
    fault = diagnosis.misfit.fault if diagnosis.misfit else None
    return rows_in_words(fault.rows) if fault and fault.rows else ""


def rows_used(diagnosis: Diagnosis) -> str:
    """Say how many rows were set aside, and how many were not: ``116 of 120 rows, 4 set aside``."""
    aside, samples = len(diagnosis.outliers), diagnosis.samples
    return f"{samples - aside} of {samples} rows, {aside} set aside" if aside else f"all {samples} rows"


def hardest(diagnosis: Diagnosis) -> str:
    """Say how far it shrinks where rows are held out in the hardest way; empty where that is as on average."""
    scheme = diagnosis.gap.hardest
    if scheme is None:
        return ""
    before, after = units.together((scheme.rms_before, scheme.rms_after), "m")
    times = units.number(scheme.rms_after / diagnosis.gap.held_out.rms_after, 2)
    return f"{before} → {after}, held out by {scheme.name} ({scheme.held_out}): {times} times the average"


def places(finding: Finding, most: int = 4) -> str:
    """Say where an effect sits, its largest shares first; empty where that is not known."""
    shown = [p for p in finding.locations if p.share >= _NEGLIGIBLE][:most] or list(finding.locations[:1])
    said = ", ".join(f"{p.words} {units.percent(p.share)}" for p in shown)
    rest = finding.locations[len(shown) :]
    if not rest:
        return said
    return f"{said} and {more(len(rest), rest[0].share)}"


def more(count: int, largest: float) -> str:
    """Count the places that are not listed, and say the largest share of them."""
    said = "less than 0.1 %" if largest < _NO_TENTH else f"at most {units.percent(largest)}"
    return f"{count} more, {said}"


def turned(diagnosis: Diagnosis) -> list[str]:
    """Say first which quantities are read with the other sign: all else rests on it."""
    return [f"Note: {said}." for said in diagnosis.warnings if "read with the other sign" in said]


def verdict(diagnosis: Diagnosis) -> str:
    """Name the explanation and how probable exactly this one is."""
    if not diagnosis.usable:
        return "none: robot and table do not belong together"
    names = in_words(diagnosis.verdict) or "no effect"
    said = f"{names}; probability of exactly this explanation {units.probability(diagnosis.probability)}"
    return said + ("; a remainder stays unexplained" if diagnosis.unexplained.flagged else "")


def campaign(diagnosis: Diagnosis) -> str:
    """Say what was measured on which robot."""
    what = "position and orientation" if diagnosis.measures == "pose" else "position"
    name = f"{diagnosis.campaign}: " if diagnosis.campaign else ""
    rows = f"{diagnosis.samples} {'row' if diagnosis.samples == 1 else 'rows'}"
    return f"{name}robot {diagnosis.robot}, tool frame {diagnosis.tool_frame}, {rows}, {what} measured"


def noise(diagnosis: Diagnosis, floor: str) -> str:
    """Say what noise alone would leave, where that is known from, and how the gap after compares with it."""
    gap = diagnosis.gap
    parts = [floor, _SOURCES.get(gap.noise_source, gap.noise_source)]
    if gap.noise_floor > 0.0:
        parts.append(f"the gap after correction is {gap.rms_after / gap.noise_floor:.2f} times that")
    return "; ".join(p for p in parts if p)


def with_aside(diagnosis: Diagnosis) -> str:
    """Say what the rows set aside do to the gap on rows held out; empty where there are none."""
    held, count = diagnosis.gap.held_out, len(diagnosis.outliers)
    if not count or held.rms_before_with_aside is None or held.rms_after_with_aside is None:
        return ""
    before, after = units.together((held.rms_before_with_aside, held.rms_after_with_aside), "m")
    return f"with the {'row' if count == 1 else f'{count} rows'} set aside in it: {before} → {after}"


def noise_of(diagnosis: Diagnosis) -> str:
    """Say the same of a diagnosis that stands alone, in the unit that suits the gap."""
    gap = diagnosis.gap
    return noise(diagnosis, units.together((gap.rms_before, gap.rms_after, gap.noise_floor), "m")[2])


def needs(finding: Finding, joints: Sequence[str]) -> str:
    """Say what would make an effect testable; one name stands for the columns of all joints or links."""
    by_quantity: dict[str, list[str]] = {}
    for need in finding.needs:
        quantity, dot, _ = need.partition(".")
        by_quantity.setdefault(quantity + dot, []).append(need)
    named = []
    for quantity, columns in by_quantity.items():
        of_joints = any(c.removeprefix(quantity) in joints for c in columns)
        named.append(columns[0] if len(columns) == 1 else f"{quantity}<{'joint' if of_joints else 'link'}>")
    return one_of(named)


def law(finding: Finding) -> str:
    """Describe a law that was discovered in the data, its size and what it usually is; empty for a known effect."""
    if not finding.quantity:
        return ""
    described = finding.describes or f"it follows {finding.quantity}"
    large = " and ".join(units.measured(s.value, s.std, s.unit) for s in finding.size)
    told = [f"a law found in the data: {described}", f"{finding.size[0].what} {large}" if large else ""]
    return "; ".join(part for part in (*told, f"usually {finding.usually}" if finding.usually else "") if part)


def in_joints(finding: Finding) -> str:
    """Say how much a known effect does in each joint, the largest first; empty where its parameters say it."""
    if finding.quantity or not finding.size:
        return ""
    told = [f"{s.place} {units.measured(s.value, s.std, s.unit)}" for s in finding.size]
    return f"{finding.size[0].what}: {in_words(told, most=4)}"


def rivals(finding: Finding, diagnosis: Diagnosis) -> str:
    """Say of which effect it is a part, or what it cannot be told from and how to see what is not preferred."""
    if not finding.confounded_with:
        return ""
    if finding.status == "contained":
        return f"its part of {', '.join(finding.confounded_with)}"
    said = f"these data cannot tell it from {', '.join(finding.confounded_with)}"
    others = [name for name in finding.confounded_with if not diagnosis.is_frame(name)]
    if finding.name not in diagnosis.verdict or not others:
        return said
    return f"{said}; --without {finding.name} shows what would then stand in its place"


def left_out(diagnosis: Diagnosis) -> str:
    """Say which effects the user left out, and how he asked for that; empty where he did not."""
    out, kept = diagnosis.left_out, [f.name for f in diagnosis.effects if f.quantity is None]
    if not out:
        return ""
    if len(out) <= len(kept):
        return f"by request (--without {' '.join(out)}): {', '.join(out)}"
    return f"by request all but {', '.join(kept)} (--only {' '.join(kept)})"


def one_sigma(diagnosis: Diagnosis) -> str:
    """Say what ± means; empty where it does not stand anywhere."""
    told = any(f.size or any(p.identified and p.std for p in f.parameters) for f in diagnosis.effects)
    return "± is one standard deviation (1 sigma)." if told else ""


def laws(diagnosis: Diagnosis) -> list[Finding]:
    """Return the laws that were discovered, as far as they belong to the explanation."""
    return [f for f in map(diagnosis.finding, diagnosis.verdict) if f.quantity is not None]


def sentences(diagnosis: Diagnosis) -> Iterator[str]:
    """Say in plain words what the explanation leaves."""
    left = diagnosis.unexplained
    if not left.flagged:
        chance = units.p_value(left.p_value)
        if diagnosis.gap.noise_known:
            yield f"Nothing: what remains is no larger and no more structured than the noise ({chance})."
        else:
            yield f"No pattern was found in what remains ({chance})."
            yield "Whether it is as small as the noise cannot be told: the campaign states none and repeats no command."
        return
    known = " beyond the noise" if diagnosis.gap.noise_known else ""
    size = f"{units.quantity(left.rms, 'm')} rms{known}" if left.rms > 0 else "a remainder"
    yield f"The known effects leave {size} that chance does not explain ({units.p_value(left.p_value)})."
    for reason in left.reasons:
        yield f"{reason[:1].upper()}{reason[1:].rstrip('.')}."
    if left.locations:
        likely = [p for p in left.locations if p.share >= _UNLIKELY][:3] or left.locations[:1]
        spots = [f"{p.words} ({units.probability(p.share)})" for p in likely]
        yield f"It enters most probably at {one_of(spots)}."
    known_laws = laws(diagnosis)
    if left.depends_on and not known_laws:
        quantities = [f"{d.covariate} ({units.p_value(d.p_value)})" for d in left.depends_on[:3]]
        yield f"It follows {', '.join(quantities)}."
    for found in known_laws:
        yield f"{found.name} describes part of it: {found.describes or 'a law'}."


def one_of(items: Sequence[str]) -> str:
    """List alternatives: ``a, b or c``."""
    if len(items) < 2:
        return "".join(items)
    return f"{', '.join(items[:-1])} or {items[-1]}"
