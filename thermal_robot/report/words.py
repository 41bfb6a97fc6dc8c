"""Sentences of the reports on a diagnosis, and what is shown where space is short."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from thermal_robot.report import units

if TYPE_CHECKING:
    from thermal_robot.diagnosis.result import Diagnosis
    from thermal_robot.diagnosis.values import AnotherModel, Finding, Gap, Misfit, Unexplained, Wanted
    from thermal_robot.motion.result import MotionDiagnosis


MOST_WORDS = 45
"""Of a headline."""
WIDTH = 96
"""Columns of a text."""
_MOST_CAUSES = 3  # that a headline names; the others are counted
_MOST_OF_A_NAME = 9  # words: of a longer title the headline says the beginning
_WEIGHTY = 0.95  # of what all causes together explain: the fewest that hold it are named, the others counted
_CARRIES = 1.5  # times what is left of the fitted rows: more on held-out rows is not called noise
_UNKNOWN = ", which may or may not be noise: the campaign states none"
_SURE = 0.005  # a probability so near to 0 or 1 would be rounded to it, which is never claimed
_OR = ", or "  # between what is wrong with a table and what may be instead
_NOTHING = 0.9995e-9  # m: what is less rounds to no nanometre
# m: from which length on it is read times so much in which unit; what rounds to 1 mm is never written as 1e+03 µm
_LENGTHS = ((0.9995, 1.0, "m"), (0.9995e-3, 1e3, "mm"), (0.0, 1e6, "µm"))


def headline(diagnosis: Diagnosis) -> str:
    """Verdict of a diagnosis in one sentence of at most 45 words: size of the gap, causes, certainty, correction.

    It names at most three causes, the largest shares first, and counts the others. The fullest wording that fits is
    taken; the rest is left to :mod:`thermal_robot.report.words`.
    """
    return fitting(_wordings(diagnosis))


def fitting(wordings: Iterable[str]) -> str:
    """Return the first wording that a headline has room for, else the beginning of the last."""
    text = ""
    for text in wordings:
        if len(text.split()) <= MOST_WORDS:
            return text
    return " ".join(text.split()[:MOST_WORDS]).rstrip(".,;:") + "."


def _wordings(diagnosis: Diagnosis) -> Iterator[str]:
    """Yield the headline's sentence in all wordings, the fullest first."""
    size, left = length(diagnosis.gap.rms_before), diagnosis.unexplained
    remaining = diagnosis.remaining or left
    if diagnosis.misfit is not None:
        yield from misfit_sentences(diagnosis.misfit, diagnosis.reach)
    elif not diagnosis.verdict and not left.flagged:
        floor = _floor(diagnosis.gap)
        if diagnosis.gap.noise_known:
            yield f"No gap beyond the noise: the {size} between model and robot is what noise alone leaves ({floor})."
        else:
            yield (
                f"No effect was found, and no pattern in the gap of {size}: whether it is noise cannot be told, as the "
                "campaign states none and repeats no command."
            )
    elif not diagnosis.verdict:
        which = "none of the effects that were considered" if diagnosis.narrowed else "no known effect"
        for place in (_place(left), ""):
            yield f"The gap of {size} is explained by {which}{place}."
    elif not (found := causes(diagnosis)):
        gap = diagnosis.gap
        rest = _unexplained(diagnosis, remaining, gap.rms_before, gap.held_out.rms_before_with_aside)
        names = listed([_name(diagnosis, f) for f in causes(diagnosis, random=True)])
        how_sure = sure(diagnosis.probability)
        yield f"The gap of {size} is scatter: {names} ({how_sure}){rest}; no correction removes scatter."
    else:
        first, rivals = (_MOST_CAUSES, 2, 1), (True, False)
        worse, the = _worse(diagnosis), "the" if diagnosis.gap.worse else "The"
        for most, beside in product(first, rivals):
            named = weighty(found, most)
            told_of = [(_name(diagnosis, f), [*map(diagnosis.title, f.confounded_with)]) for f in named]
            names = causes_in_words(told_of, beside, len(found) - len(named))
            for told in _how_far(diagnosis, remaining, len(found) > 1):
                yield f"{worse}{the} gap of {size} comes from {names} ({sure(diagnosis.probability)}); {told}."


def explanation(diagnosis: Diagnosis | MotionDiagnosis) -> list[Finding]:
    """Return the findings of the effects that the verdict names, the largest share first."""
    return [diagnosis.finding(name) for name in diagnosis.verdict]


def causes(diagnosis: Diagnosis, random: bool = False) -> list[Finding]:
    """Effects of the verdict that a correction removes, or those that scatter if ``random``; largest share first."""
    return [f for f in explanation(diagnosis) if f.random is random]


def weighty(found: Sequence[Finding], most: int = _MOST_CAUSES) -> list[Finding]:
    """Causes that a headline names: the fewest, at most ``most``, that hold 95 % of the explained share.

    Causes whose size the data do not determine are passed over, unless there are no others.
    """
    known = sorted(filter(sized, found), key=lambda f: -(f.shrinkage or 0.0)) or list(found)
    held = np.cumsum([max(f.shrinkage or 0.0, 0.0) for f in known] or [0.0])
    return known[: min(int(np.searchsorted(held, _WEIGHTY * held[-1])) + 1, most)]


def sized(finding: Finding) -> bool:
    """Whether the data determine any parameter of an effect.

    The values of a law may be undetermined while its difference is determined.
    """
    return bool(finding.quantity) or not finding.parameters or any(p.identified for p in finding.parameters)


def unnamed(diagnosis: Diagnosis) -> list[Finding]:
    """Causes that the headline counts without naming them."""
    text = headline(diagnosis)
    return [f for f in causes(diagnosis) if _name(diagnosis, f) not in text]


def _worse(diagnosis: Diagnosis) -> str:
    """Beginning of the headline where correcting harms rows held out by a cross-validation scheme; else empty."""
    scheme = diagnosis.gap.worse
    if scheme is None:
        return ""
    pair = f"{length(scheme.rms_after)} with it, {length(scheme.rms_before)} without"
    return f"Correcting harms rows held out by {scheme.name} ({pair}): "


def misfit_sentences(misfit: Misfit, reach: float) -> Iterator[str]:
    """Yield the sentence on why robot and table do not belong together, the fullest wording first."""
    fault, model = misfit.fault, misfit.model
    if model is not None:
        yield _another_model(model)
    elif fault is None:
        left = f"{misfit.turned:.2g} rad" if misfit.away is None else f"{length(misfit.away)} of {length(reach)}"
        yield (
            f"Robot and table do not describe the same motion ({left} remain): check units, signs and order of the "
            "joints, axes of the instrument, order of the quaternion, and that all rows belong to one set-up and the "
            "URDF to this robot."
        )
    else:
        struck = f" in {len(fault.rows)} rows" if fault.rows else ""
        fall = f"Mended, the gap falls from {length(fault.rms_before)} to {length(fault.rms_after)}."
        ways = fault.what.split(_OR)
        others = "", ", or another fault alike", f", or {len(ways) - 1} other faults alike"
        for what, rest in product((fault.what, ways[0] + others[min(len(ways), 3) - 1]), (f" {fall}", "")):
            yield f"The table is at fault{struck}, not the robot: {what}{'' if what.endswith('?') else '.'}{rest}"


def _another_model(model: AnotherModel) -> str:
    """Difference of the measured robot from the URDF, and which robot it may be."""
    factor, known = model.factor, ""
    if model.in_another_unit:
        return f"Robot and table do not describe the same motion: {model.unit}."
    if factor is not None:
        what = f"the links are about {factor:.2g} times as long as in the URDF"
    elif model.joint:
        what = f"{model.joint} would have to sit {length(model.off)} from where the URDF has it"
    else:
        what = "the URDF is of another robot"
    if model.fits is not None:
        known = f" {model.fits} fits: {length(model.remains)} remain."
    return f"Robot and table do not describe the same motion: {what}. Is it another model of the family?{known}"


def sure(probability: float) -> str:
    """Say a probability in per cent, never as 0 or 100.

    Examples
    --------
    >>> from thermal_robot.report.words import sure
    >>> sure(0.0004), sure(0.84), sure(0.9999)
    ('less than 1 % sure', '84 % sure', 'more than 99 % sure')
    """
    if min(probability, 1.0 - probability) > _SURE:
        return f"{units.percent(probability, 0)} sure"
    return f"{'less than 1' if probability < 0.5 else 'more than 99'} % sure"


def causes_in_words(named: Iterable[tuple[str, Sequence[str]]], beside: bool, fewer: int) -> str:
    """Join the names of causes, each with its confounded alternatives in brackets, or ``in doubt`` unless ``beside``.

    The number of smaller causes without a name, ``fewer``, follows.
    """
    names = []
    for name, rivals in named:
        doubt = f"or {rivals[0] if len(rivals) == 1 else 'others'}" if beside else "in doubt"
        names.append(f"{name} ({doubt})" if rivals else name)
    return listed([*names, *(["a smaller one"] if fewer == 1 else [f"{fewer} smaller ones"] if fewer else [])])


def smaller_ones(names: Sequence[str]) -> str:
    """Say which causes the headline counts without naming them."""
    return f"{'The smaller one is' if len(names) == 1 else 'The smaller ones are'} {listed(names)}."


def _name(diagnosis: Diagnosis, finding: Finding) -> str:
    words = diagnosis.title(finding.name).split()
    return " ".join(words) if len(words) <= _MOST_OF_A_NAME else " ".join(words[:_MOST_OF_A_NAME]).rstrip(",;") + "…"


def _how_far(diagnosis: Diagnosis, remaining: Unexplained, several: bool) -> Iterator[str]:
    """Yield how far the correction shrinks the held-out gap, the fullest wording first; harm is always reported."""
    gap, held = diagnosis.gap, diagnosis.gap.held_out
    it = "them" if several else "it"
    if held.shrinkage < 0.0:
        pair = f"{length(held.rms_after)} with it and {length(held.rms_before)} without"
        yield f"correcting for {it} does not carry over to held-out data: their gap is {pair}"
        yield f"correcting harms held-out data: {pair}"
        return
    leaves, hard = length(held.rms_after), ""
    if gap.worse is not None:
        hard = ""  # said first
    elif gap.hardest is not None and gap.hardest.shrinkage < 0.0:
        hard = f"; but it harms rows held out by {gap.hardest.name}"
    elif gap.hardest is not None:
        hard = f"; held out by {gap.hardest.name}, {length(gap.hardest.rms_after)}"
    full = f"correcting for {it} removes {units.percent(held.shrinkage)} of its mean square on held-out data"
    scatter = "; there is also scatter" * bool(causes(diagnosis, random=True))
    yield f"{full} and leaves {leaves}{_rest(diagnosis, remaining)}{hard}{scatter}"
    yield f"{full} and leaves {leaves}{_rest(diagnosis, remaining)}{hard}"
    short = f"correcting removes {units.percent(held.shrinkage)} on held-out data and leaves {leaves}"
    yield f"{short}{_rest(diagnosis, remaining)}{hard}"
    apart = remaining.flagged and remaining.rms > held.rms_after  # of rows set aside: the others are not called more
    more = (", outliers left out" if apart else ", more than noise") if remaining.flagged else ""
    yield f"{short}{more}{hard}"
    yield f"correcting leaves {leaves} on held-out data{more}{hard}"


def _floor(gap: Gap) -> str:
    """Gap that noise alone would leave, by kind of measurement where there are several."""
    kinds = [f"{k.kind} {units.quantity(k.noise_floor, k.unit)}" for k in gap.kinds]
    return ", ".join(kinds) if len(kinds) > 1 else length(gap.noise_floor)


def _rest(diagnosis: Diagnosis, remaining: Unexplained) -> str:
    gap, floor = diagnosis.gap, _floor(diagnosis.gap)
    if not remaining.flagged:
        if gap.held_out.rms_after < _CARRIES * max(gap.rms_after, gap.noise_floor):
            return f", which is noise ({floor})" if gap.noise_known else _UNKNOWN
        told = floor if gap.noise_known else "not stated"
        return f", while {length(gap.rms_after)} is left on the rows it was fitted to (noise: {told})"
    held = gap.held_out
    return _unexplained(diagnosis, remaining, held.rms_after, held.rms_after_with_aside) or ", which is more than noise"


def _unexplained(diagnosis: Diagnosis, remaining: Unexplained, of: float, with_aside: float | None) -> str:
    """Unexplained share in words; empty where there is none, or it is unknown.

    If the outliers are unexplained, too, they are counted in.
    """
    if not remaining.flagged or remaining.rms == 0.0:
        return ""
    if remaining.rms > of:
        count = len(diagnosis.outliers)
        if with_aside is None or not count:
            return ""
        aside = "the row" if count == 1 else f"the {count} rows"
        return f", or {length(with_aside)} with {aside} set aside in it, which nothing explains"
    return f", of which {length(remaining.rms)} is not explained" if diagnosis.gap.noise_known else ""


def length(metres: float) -> str:
    """Format a length in m, mm or µm with three digits; what rounds to no nanometre as ``less than 1 nm``."""
    if metres < _NOTHING:
        return "less than 1 nm"
    factor, unit = next((f, u) for least, f, u in _LENGTHS if metres >= least)
    return f"{metres * factor:.3g} {unit}"


def listed(names: Sequence[str], last: str = "and") -> str:
    """Join names: ``a, b and c``, or with another word before the last."""
    return "".join(names) if len(names) < 2 else f"{', '.join(names[:-1])} {last} {names[-1]}"


def _place(unexplained: Unexplained) -> str:
    parts = []
    if unexplained.locations and unexplained.depends_on:
        place = unexplained.locations[0]
        parts.append(f"enters most likely at {place.name if place.kind == 'joint' else 'the ' + place.kind}")
    if unexplained.depends_on:
        parts.append(f"follows {unexplained.depends_on[0].covariate}")
    return "; it " + " and ".join(parts) if parts else ""


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
_UNIT = r"[%°±]|([mµn]?m|[mµ]?rad|[mµ]?s|kg|K|N)\b"
_TOGETHER = re.compile(rf"(?<=\d) (?={_UNIT})|(?<=\bp) (?=[<=])|(?<=[<>=±²]) (?=\d)")


def displayed_status(finding: Finding) -> str:
    """Return the displayed status of a finding: not found, yet more probable than not, is in question."""
    doubtful = finding.status == "not_found" and (finding.probability or 0.0) >= _MORE_LIKELY
    return "in_question" if doubtful else finding.status


def by_status(diagnosis: Diagnosis | MotionDiagnosis) -> list[Finding]:
    """Return the findings in the order of display: found first, untestable last."""
    return [f for status in STATUS for f in diagnosis.effects if displayed_status(f) == status]


Lines = list[tuple[str, int]]


def described(finding: Finding, diagnosis: Diagnosis) -> tuple[Lines, list[tuple[str, str]], Lines]:
    """Return the description of an effect: text before its parameters, these as name and value, text after.

    Lines come with their indentation. A few parameters are all shown, in the order of the chain; of many the most
    significant.
    """
    known = [p for p in finding.parameters if p.identified and p.value is not None]
    chosen, heading, hidden = known, "", finding.unseen
    if len(known) > _ALL_UP_TO:
        chosen = sorted(known, key=lambda p: -abs(p.value or 0.0) / max(p.std or 0.0, 1e-300))[:_MOST]
        heading = f"the {_MOST} most significant of {len(known)} parameters:"
    more, where = len(known) - len(chosen), _places(finding)
    # where there is a size, it says what is known; a constant that the frames can take up is no news
    free = [] if finding.size else [p.name for p in finding.parameters if p not in known]
    names = in_words(free, most=4, between="; "), in_words(hidden, 6, "; ")  # they hold commas
    before = [(_rivals(finding, diagnosis), 0), (_law(finding), 0), (f"where: {where}" if where else "", 7)]
    before += [(_in_joints(finding), 2), (heading, 0)]
    after = [(f"and {more} more, listed in the JSON" if more else "", 0)]
    after += [(f"not determined by these data: {names[0]}" if free else "", 2)]
    after += [(f"{len(hidden)} not seen apart from the others or the frames: {names[1]}" if hidden else "", 2)]
    shown = [(p.name, units.estimate(p, chosen)) for p in chosen]
    return [line for line in before if line[0]], shown, [line for line in after if line[0]]


def in_words(names: Sequence[str], most: int = 10, between: str = ", ") -> str:
    """List a limited number of names, and count the others."""
    more = len(names) - most
    if more <= 0:
        return between.join(names)
    return f"{between.join(names[:most])} and {more} more"


def bound(sentence: str) -> str:
    """Bind numbers to their units by non-breaking spaces."""
    return _TOGETHER.sub(NO_BREAK, sentence)


def _rows(rows: Sequence[int]) -> str:
    """Row numbers of the file: ``rows 17, 80 and 3 more``."""
    return f"{'row' if len(rows) == 1 else 'rows'} {in_words([str(r) for r in rows])}"


def facts(diagnosis: Diagnosis) -> dict[str, str]:
    """Return the first facts of a report by heading: verdict, campaign, outliers, rows used, effects left out."""
    what = diagnosis.says or ("position and orientation" if diagnosis.measures == "pose" else "position")
    name = f"{diagnosis.campaign}: " if diagnosis.campaign else ""
    rows = f"{diagnosis.samples} {'row' if diagnosis.samples == 1 else 'rows'}"
    campaign = f"{name}robot {diagnosis.robot}, tool frame {diagnosis.tool_frame}, {rows}, {what} measured"
    told = {"Verdict": "none: robot and table do not belong together", "Campaign": campaign}
    if diagnosis.usable:
        told["Verdict"] = verdict(diagnosis, in_words(diagnosis.verdict))
        aside = f"as outliers: {_rows(diagnosis.outliers)} (lines of the file; of a data frame, its index)"
        told["Set aside"] = aside if diagnosis.outliers else "no row"
        told |= {"Rows used": rows_used(diagnosis), "Left out": _left_out(diagnosis)}
    elif diagnosis.misfit and diagnosis.misfit.fault and diagnosis.misfit.fault.rows:
        told["Struck"] = _rows(diagnosis.misfit.fault.rows)
    return {heading: said for heading, said in told.items() if said}


def about(stated: Mapping[str, str]) -> dict[str, str]:
    """Return what the user stated of the measurements, such as serial numbers, operator, date, by readable name."""
    return {capitalised(name.replace("_", " ")): said for name, said in stated.items()}


def about_in_line(stated: Mapping[str, str]) -> str:
    """Return names and values that the user stated of the measurements, such as serial numbers, in one line."""
    return ", ".join(f"{name.replace('_', ' ')} {said}" for name, said in stated.items())


def rows_used(diagnosis: Diagnosis) -> str:
    """Return the number of rows used and set aside: ``116 of 120 rows, 4 set aside``."""
    aside, samples = len(diagnosis.outliers), diagnosis.samples
    return f"{samples - aside} of {samples} rows, {aside} set aside" if aside else f"all {samples} rows"


def hardest(diagnosis: Diagnosis) -> str:
    """Shrinkage under the least favourable scheme of cross-validation; empty where it is as on average."""
    scheme = diagnosis.gap.hardest
    if scheme is None:
        return ""
    before, after = units.together((scheme.rms_before, scheme.rms_after), "m")
    times = units.number(scheme.rms_after / diagnosis.gap.held_out.rms_after, 2)
    return f"{before} → {after}, held out by {scheme.name} ({scheme.held_out}): {times} times the average"


def _places(finding: Finding, most: int = 4) -> str:
    """Places of an effect in words, the largest shares first; empty where unknown."""
    shown = [p for p in finding.locations if p.share >= _NEGLIGIBLE][:most] or list(finding.locations[:1])
    said = ", ".join(f"{p.words} {units.percent(p.share)}" for p in shown)
    rest = finding.locations[len(shown) :]
    return f"{said} and {more(len(rest), rest[0].share)}" if rest else said


def more(count: int, largest: float) -> str:
    """Return the number of places not listed, with the largest share among them."""
    said = "less than 0.1 %" if largest < _NO_TENTH else f"at most {units.percent(largest)}"
    return f"{count} more, {said}"


def turned(diagnosis: Diagnosis) -> list[str]:
    """Return the warnings of quantities that were read with the opposite sign, as notes."""
    return [f"Note: {said}." for said in diagnosis.warnings if "read with the other sign" in said]


def verdict(diagnosis: Diagnosis | MotionDiagnosis, names: str) -> str:
    """Explanation and its posterior probability in words; nothing has one where a remainder stays unexplained."""
    left = diagnosis.unexplained.flagged
    sure = f"; probability of exactly this explanation {units.probability(diagnosis.probability)}"
    said = f"{names or 'no effect'}{sure if names or not left else ''}"
    return said + ("; a remainder stays unexplained" if left else "")


def noise(diagnosis: Diagnosis, floor: str = "") -> str:
    """Return the expected gap from noise alone, its source, and the comparison with the residual.

    The ``floor`` is written in the unit that suits the gap, unless it is given.
    """
    gap = diagnosis.gap
    floor = floor or units.together((gap.rms_before, gap.rms_after, gap.noise_floor), "m")[2]
    own = (units.together((k.noise_floor, k.rms_after), k.unit) for k in gap.kinds)
    kinds = [f"{k.kind} {least}, {left} left" for k, (least, left) in zip(gap.kinds, own, strict=True)]
    parts = [*([floor] if len(kinds) < 2 else []), *kinds, _SOURCES.get(gap.noise_source, gap.noise_source)]
    if gap.noise_floor > 0.0 and len(kinds) < 2:
        parts.append(f"the gap after correction is {gap.rms_after / gap.noise_floor:.2f} times that")
    return "; ".join(filter(None, parts))


def with_aside(diagnosis: Diagnosis) -> str:
    """Shrinkage on held-out rows with the outliers included; empty without any."""
    held, count = diagnosis.gap.held_out, len(diagnosis.outliers)
    if not count or held.rms_before_with_aside is None or held.rms_after_with_aside is None:
        return ""
    before, after = units.together((held.rms_before_with_aside, held.rms_after_with_aside), "m")
    return f"with the {'row' if count == 1 else f'{count} rows'} set aside in it: {before} → {after}"


def needs(finding: Finding, joints: Sequence[str]) -> str:
    """Columns that would make an effect testable, one name for those of all joints or links."""
    by_quantity: dict[str, list[str]] = {}
    for need in finding.needs:
        quantity, dot, _ = need.partition(".")
        by_quantity.setdefault(quantity + dot, []).append(need)
    named = []
    for quantity, columns in by_quantity.items():
        of_joints = any(c.removeprefix(quantity) in joints for c in columns)
        named.append(columns[0] if len(columns) == 1 else f"{quantity}<{'joint' if of_joints else 'link'}>")
    return listed(named, "or")


def _law(finding: Finding) -> str:
    """Return the description of a discovered law, its size and usual cause; empty for a known effect."""
    if not finding.quantity:
        return ""
    described = finding.describes or f"it follows {finding.quantity}"
    large = " and ".join(units.measured(s.value, s.std, s.unit) for s in finding.size)
    told = [f"a law found in the data: {described}", f"{finding.size[0].what} {large}" if large else ""]
    return "; ".join(part for part in (*told, f"usually {finding.usually}" if finding.usually else "") if part)


def _in_joints(finding: Finding) -> str:
    """Size of a known effect in each joint, the largest first; empty for discovered laws or without such sizes."""
    if finding.quantity or not finding.size:
        return ""
    told = [f"{s.place} {units.measured(s.value, s.std, s.unit)}" for s in finding.size]
    return f"{finding.size[0].what}: {in_words(told, most=4)}"


def _rivals(finding: Finding, diagnosis: Diagnosis) -> str:
    """Container or confounded alternatives of an effect, and how to see the others."""
    if not finding.confounded_with:
        return ""
    if finding.status == "contained":
        return f"its part of {', '.join(finding.confounded_with)}"
    said = f"these data cannot tell it from {', '.join(finding.confounded_with)}"
    others = [name for name in finding.confounded_with if not diagnosis.is_frame(name)]
    if finding.name not in diagnosis.verdict or not others:
        return said
    return f"{said}; --without {finding.name} shows what would then stand in its place"


def _left_out(diagnosis: Diagnosis) -> str:
    """Effects that the user left out, and by which option; empty without any."""
    out, kept = diagnosis.left_out, [f.name for f in diagnosis.effects if f.quantity is None]
    if not out:
        return ""
    if len(out) <= len(kept):
        return f"by request (--without {' '.join(out)}): {', '.join(out)}"
    return f"by request all but {', '.join(kept)} (--only {' '.join(kept)})"


def one_sigma(diagnosis: Diagnosis | MotionDiagnosis) -> str:
    """Say that ± is one standard deviation; empty where the report shows none."""
    told = any(f.size or any(p.identified and p.std for p in f.parameters) for f in diagnosis.effects)
    return "± is one standard deviation (1 sigma)." if told else ""


def laws(diagnosis: Diagnosis) -> list[Finding]:
    """Effects of the verdict that are laws discovered in the data, not known effects."""
    return [f for f in explanation(diagnosis) if f.quantity is not None]


def sentences(diagnosis: Diagnosis) -> Iterator[str]:
    """Yield sentences on the residual that no effect explains: size, significance, place, and what it depends on."""
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
        yield f"{capitalised(reason).rstrip('.')}."
    if left.locations:
        likely = [p for p in left.locations if p.share >= _UNLIKELY][:3] or left.locations[:1]
        spots = [f"{p.words} ({units.probability(p.share)})" for p in likely]
        yield f"It enters most probably at {listed(spots, 'or')}."
    known_laws = laws(diagnosis)
    if left.depends_on and not known_laws:
        quantities = [f"{d.covariate} ({units.p_value(d.p_value)})" for d in left.depends_on[:3]]
        yield f"It follows {', '.join(quantities)}."
    for found in known_laws:
        yield f"{found.name} describes part of it: {found.describes or 'a law'}."


_SURER = 0.05  # by which a single effect is surer than all together, so that a reader asks why
_TOLD, _MOST_OTHERS = 0.01, 3  # probability from which another effect is told that may be at work, and how many are


def details(diagnosis: Diagnosis) -> Iterator[str]:
    """Yield sentences for what headline and tables leave out: smaller causes, confounding, scatter, harm elsewhere."""
    if not diagnosis.usable:
        return
    found, chance = causes(diagnosis), causes(diagnosis, random=True)
    if slight := [diagnosis.title(f.name) for f in unnamed(diagnosis)]:
        yield smaller_ones(slight)
    for f in found:
        if f.confounded_with:
            rivals = " or ".join(map(diagnosis.title, f.confounded_with))
            yield f"{capitalised(diagnosis.title(f.name))} cannot be told apart from {rivals}."
    if unsized := [diagnosis.title(f.name) for f in found if not sized(f)]:
        yield f"How large it is these data do not determine: {listed(unsized)}."
    yield from _beside(diagnosis)
    if found and chance:
        names = listed([diagnosis.title(f.name) for f in chance])
        yield f"There is also scatter, which no correction removes: {names}."
    if laws := sum(f.quantity is not None for f in found):
        which = "None of the effects that were considered" if diagnosis.narrowed else "No known effect"
        shapes = "the shape of the law that was" if laws == 1 else f"the shapes of the {laws} laws that were"
        yield f"{which} has {shapes} found."
    yield from _elsewhere(diagnosis)


def _beside(diagnosis: Diagnosis) -> Iterator[str]:
    """Yield a sentence where the whole explanation is less probable than each of its effects, naming likely others."""
    joint, own = diagnosis.probability, [f.probability or 0.0 for f in explanation(diagnosis)]
    if not own or min(own) - joint < _SURER:
        return
    told = {f.name: f.probability for f in diagnosis.effects if f.probability and f.status == "not_found"}
    others = sorted((name for name in told if told[name] >= _TOLD), key=lambda name: -told[name])[:_MOST_OTHERS]
    named = listed([f"{diagnosis.title(name)} ({units.probability(told[name])})" for name in others])
    beside = f", most probably {named}" if others else ""
    told_apart = f"That nothing else is at work is {units.percent(joint)} sure, less than each by itself"
    yield f"{told_apart}: the rest is others{beside}."


def capitalised(words: str) -> str:
    """Capitalise the first letter."""
    return words[:1].upper() + words[1:]


def _elsewhere(diagnosis: Diagnosis) -> Iterator[str]:
    """Yield a sentence for each cross-validation scheme in which the correction enlarges the gap."""
    for scheme in diagnosis.gap.schemes if diagnosis.verdict else ():
        if scheme.shrinkage < 0.0:
            before, after = units.together((scheme.rms_before, scheme.rms_after), "m")
            yield f"Held out by {scheme.name} ({scheme.held_out}), the correction does harm: {before} → {after}."


_MOST_UNTESTED = 2  # effects that are named with the column that they need


def advice(diagnosis: Diagnosis) -> str:
    """Say in one sentence what to measure or mend next; empty where nothing is needed."""
    wanted = diagnosis.wanted
    if diagnosis.misfit is not None:
        fault, model = diagnosis.misfit.fault, diagnosis.misfit.model
        first = capitalised(fault.remedy) if fault else "Mend the table"
        if fault and fault.what not in headline(diagnosis):
            first = f"All of these do the same: {fault.what}. {first}"
        if model is not None and model.in_another_unit:
            first = "Write the lengths of the URDF in m"
        elif model is not None:
            first = f"Take the URDF of the robot that was measured{f', such as {model.fits}' if model.fits else ''}"
        return f"{first}; then diagnose again."
    if wanted is None:
        return ""
    names = [diagnosis.title(name) for name in wanted.apart[:2]]
    told = f"tell {' from '.join(names)}" if names else "tell the leading explanations apart"
    told = f"show whether to believe in {names[0]}" if len(names) == 1 else told
    if wanted.kind == "repeats" and not names:
        return "Repeat a few poses in another order and on another day: this shows how much of the remainder repeats."
    if wanted.kind == "column" and not names:
        return f"Record {wanted.name}: {_why(diagnosis, wanted)}."
    declared = f" ({wanted.name})" if wanted.name else ""
    pose = _pose(diagnosis, wanted)
    return _TO_DO[wanted.kind].format(told=told, declared=declared, name=wanted.name, pose=pose)


_TO_DO = {
    "frame": "A frame measured on its own, and declared known{declared}, would {told}.",
    "range": "More poses over the whole range of every joint would {told}.",
    "pose": "The pose that would best {told}: {pose}.",
    "repeats": "Repeat some poses, and label them in a column {name}: this would {told}.",
    "column": "Repeat some poses with another load, and record {name}: this would {told}.",
}


def _why(diagnosis: Diagnosis, wanted: Wanted) -> str:
    """Say where a residual enters and what it follows, and what recording the wanted column would show."""
    own = wanted.follows and wanted.place.endswith(wanted.follows)
    enters = f" enters at {wanted.place}" if wanted.place else ""
    follows = f" follows {'its position' if own else wanted.follows}" if wanted.follows else ""
    remainder = " and".join(filter(None, (enters, follows))) or " is unexplained"
    untested = [diagnosis.title(name) for name in wanted.untested[:_MOST_UNTESTED]]
    if more := len(wanted.untested) - len(untested):
        untested.append(f"{more} more")
    why = f"{listed(untested)} could not be tested" if untested else "this may be what it follows"
    return f"a remainder{remainder}, and " + (
        f"this would show whether {wanted.whether} causes it" if wanted.whether else why
    )


def _pose(diagnosis: Diagnosis, wanted: Wanted) -> str:
    known = diagnosis.rows.units
    by_unit: dict[str, list[str]] = {}
    for name in wanted.position:
        by_unit.setdefault(known.get(name, ""), []).append(name)
    said = {
        name: value
        for unit, names in by_unit.items()
        for name, value in zip(names, units.together([wanted.position[n] for n in names], unit), strict=True)
    }
    said |= {name: units.quantity(value, known.get(name, "")) for name, value in wanted.conditions.items()}
    told = [f"{name} {value}".replace("-", "−") for name, value in said.items()]
    return ", ".join([*(f"{name} {value}" for name, value in wanted.labels.items()), *told])
