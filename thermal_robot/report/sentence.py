"""The verdict in one plain sentence, short enough to be read aloud: at most 45 words and three causes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product
from typing import TYPE_CHECKING

from thermal_robot.report import units

if TYPE_CHECKING:
    from thermal_robot.diagnosis.parts import AnotherModel, Finding, Misfit, Unexplained
    from thermal_robot.diagnosis.result import Diagnosis

MOST_WORDS = 45
"""Of a headline."""
_MOST_CAUSES = 3  # that a headline names; the others are counted
_MOST_OF_A_NAME = 9  # words: of a longer title the headline says the beginning
_WEIGHTY = 0.01  # of the gap on held-out rows: an effect with less is counted among the smaller ones
_CARRIES = 1.5  # times what is left of the fitted rows: more on held-out rows is not called noise
_UNKNOWN = ", which may or may not be noise: the campaign states none"
_SURE = 0.995  # a probability above it would be rounded to 100 %, which is never claimed
_OR = ", or "  # between what is wrong with a table and what may be instead
_NOTHING = 0.9995e-9  # m: what is less rounds to no nanometre
# m: from which length on it is read times so much in which unit; what rounds to 1 mm is never written as 1e+03 µm
_LENGTHS = ((0.9995, 1.0, "m"), (0.9995e-3, 1e3, "mm"), (0.0, 1e6, "µm"))


def headline(diagnosis: Diagnosis) -> str:
    """Return the verdict as one sentence of at most 45 words.

    It names at most three causes, the largest shares first, and counts the others. Of what there is to say of them the
    fullest wording is taken that fits; the rest is left to :mod:`thermal_robot.report.details`.
    """
    return next((text for text in _wordings(diagnosis) if len(text.split()) <= MOST_WORDS), "") or _cut(
        list(_wordings(diagnosis))[-1]
    )


def _cut(text: str) -> str:
    return " ".join(text.split()[:MOST_WORDS]).rstrip(".,;:") + "."


def _wordings(diagnosis: Diagnosis) -> Iterator[str]:
    """Yield the sentence in all its wordings, the fullest first."""
    size, left = length(diagnosis.gap.rms_before), diagnosis.unexplained
    remaining = diagnosis.remaining or left
    if diagnosis.misfit is not None:
        yield from _misfit(diagnosis.misfit, diagnosis.reach)
    elif not diagnosis.verdict and not left.flagged:
        floor = length(diagnosis.gap.noise_floor)
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
    elif not (causes := systematic(diagnosis)):
        gap = diagnosis.gap
        rest = _unexplained(diagnosis, remaining, gap.rms_before, gap.held_out.rms_before_with_aside)
        names = listed([_name(diagnosis, f) for f in scattering(diagnosis)])
        yield f"The gap of {size} is scatter: {names} ({_sure(diagnosis)}){rest}; no correction removes scatter."
    else:
        first, rivals = (_MOST_CAUSES, 2, 1), (True, False)
        worse, the = _worse(diagnosis), "the" if diagnosis.gap.worse else "The"
        for most, beside in product(first, rivals):
            names = _causes(diagnosis, causes, most, beside)
            for told in _how_far(diagnosis, remaining, len(causes) > 1):
                yield f"{worse}{the} gap of {size} comes from {names} ({_sure(diagnosis)}); {told}."


def systematic(diagnosis: Diagnosis) -> list[Finding]:
    """Return the causes that a correction can remove, the largest share first."""
    return [f for f in map(diagnosis.finding, diagnosis.verdict) if not f.random]


def scattering(diagnosis: Diagnosis) -> list[Finding]:
    """Return the causes that no correction can remove."""
    return [f for f in map(diagnosis.finding, diagnosis.verdict) if f.random]


def weighty(causes: Sequence[Finding], most: int = _MOST_CAUSES) -> list[Finding]:
    """Return the causes that a headline names: those of some weight and size, at most so many, but always one."""
    known = [f for f in causes if sized(f)]
    return [f for f in known if (f.shrinkage or 0.0) >= _WEIGHTY][:most] or (known or list(causes))[:1]


def sized(finding: Finding) -> bool:
    """Whether the data determine any parameter of an effect: one without is not named first.

    Of a law values before and after may be free while their difference is not.
    """
    return bool(finding.quantity) or not finding.parameters or any(p.identified for p in finding.parameters)


def unnamed(diagnosis: Diagnosis) -> list[Finding]:
    """Return the causes that the headline counts without naming them."""
    text = headline(diagnosis)
    return [f for f in systematic(diagnosis) if _name(diagnosis, f) not in text]


def _worse(diagnosis: Diagnosis) -> str:
    """Begin with where the correction does harm: of another session or region the rest is not to be believed."""
    scheme = diagnosis.gap.worse
    if scheme is None:
        return ""
    pair = f"{length(scheme.rms_after)} with it, {length(scheme.rms_before)} without"
    return f"Correcting harms rows held out by {scheme.name} ({pair}): "


def _misfit(misfit: Misfit, reach: float) -> Iterator[str]:
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
    """Say in what the robot that was measured differs from the URDF, and which one it may be."""
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


def _sure(diagnosis: Diagnosis) -> str:
    probability = diagnosis.probability
    return f"{units.percent(probability, 0)} sure" if probability < _SURE else "more than 99 % sure"


def _causes(diagnosis: Diagnosis, causes: Sequence[Finding], most: int, beside: bool) -> str:
    """Name the first few, each with what the data cannot tell it from, and count the others."""
    named = weighty(causes, most)
    names = [_name(diagnosis, f) + (_doubt(diagnosis, f) if beside else " (in doubt)" * _doubted(f)) for f in named]
    fewer = len(causes) - len(named)
    return listed([*names, *(["a smaller one"] if fewer == 1 else [f"{fewer} smaller ones"] if fewer else [])])


def _name(diagnosis: Diagnosis, finding: Finding) -> str:
    words = diagnosis.title(finding.name).split()
    return " ".join(words) if len(words) <= _MOST_OF_A_NAME else " ".join(words[:_MOST_OF_A_NAME]).rstrip(",;") + "…"


def _doubted(finding: Finding) -> bool:
    return bool(finding.confounded_with)


def _doubt(diagnosis: Diagnosis, finding: Finding) -> str:
    rivals = [diagnosis.title(name) for name in finding.confounded_with]
    return f" (or {rivals[0] if len(rivals) == 1 else 'others'})" if rivals else ""


def _how_far(diagnosis: Diagnosis, remaining: Unexplained, several: bool) -> Iterator[str]:
    """Yield what correcting does, the fullest wording first; that it leaves more or harms elsewhere is always said."""
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
    scatter = "; there is also scatter" * bool(scattering(diagnosis))
    yield f"{full} and leaves {leaves}{_rest(diagnosis, remaining)}{hard}{scatter}"
    yield f"{full} and leaves {leaves}{_rest(diagnosis, remaining)}{hard}"
    short = f"correcting removes {units.percent(held.shrinkage)} on held-out data and leaves {leaves}"
    yield f"{short}{_rest(diagnosis, remaining)}{hard}"
    apart = remaining.flagged and remaining.rms > held.rms_after  # of rows set aside: the others are not called more
    more = (", outliers left out" if apart else ", more than noise") if remaining.flagged else ""
    yield f"{short}{more}{hard}"
    yield f"correcting leaves {leaves} on held-out data{more}{hard}"


def _rest(diagnosis: Diagnosis, remaining: Unexplained) -> str:
    gap, floor = diagnosis.gap, length(diagnosis.gap.noise_floor)
    if not remaining.flagged:
        if gap.held_out.rms_after < _CARRIES * max(gap.rms_after, gap.noise_floor):
            return f", which is noise ({floor})" if gap.noise_known else _UNKNOWN
        told = floor if gap.noise_known else "not stated"
        return f", while {length(gap.rms_after)} is left on the rows it was fitted to (noise: {told})"
    held = gap.held_out
    return _unexplained(diagnosis, remaining, held.rms_after, held.rms_after_with_aside) or ", which is more than noise"


def _unexplained(diagnosis: Diagnosis, remaining: Unexplained, of: float, with_aside: float | None) -> str:
    """Say how much of a size is not explained; empty where nothing is, or nobody knows how much.

    Where rows set aside are unexplained, too, they count in what remains but not in the size: it is told with them.
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
    """Return a length in the unit that a metrologist would use; what no instrument sees is not told in figures."""
    if metres < _NOTHING:
        return "less than 1 nm"
    factor, unit = next((f, u) for least, f, u in _LENGTHS if metres >= least)
    return f"{metres * factor:.3g} {unit}"


def listed(names: Sequence[str]) -> str:
    """Put names one after the other: ``a, b and c``."""
    return "".join(names) if len(names) < 2 else ", ".join(names[:-1]) + " and " + names[-1]


def _place(unexplained: Unexplained) -> str:
    parts = []
    if unexplained.locations and unexplained.depends_on:
        place = unexplained.locations[0]
        parts.append(f"enters most likely at {place.name if place.kind == 'joint' else 'the ' + place.kind}")
    if unexplained.depends_on:
        parts.append(f"follows {unexplained.depends_on[0].covariate}")
    return "; it " + " and ".join(parts) if parts else ""
