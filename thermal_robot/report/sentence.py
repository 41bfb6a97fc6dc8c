"""The verdict in one plain sentence, and what to measure next."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from thermal_robot.diagnosis.parts import Finding, Unexplained
    from thermal_robot.diagnosis.result import Diagnosis

_ANOTHER_MOTION = 0.02  # of the volume that was measured: a gap after correction above it is not a robot's
_ANOTHER_TURN = 0.2  # rad: the same of orientation; no joint errs by eleven degrees
_WEIGHTY = 0.01  # of the gap on held-out rows: an effect with less is named last
_CARRIES = 1.5  # times what is left of the fitted rows: more on held-out rows is not called noise
_SURE = 0.995  # a probability above it would be rounded to 100 %, which is never claimed
# m: from which length on it is read times so much in which unit; what rounds to 1 mm is never written as 1e+03 µm
_LENGTHS = ((0.9995, 1.0, "m"), (0.9995e-3, 1e3, "mm"), (0.0, 1e6, "µm"))


def headline(diagnosis: Diagnosis) -> str:
    """Return the verdict as one sentence."""
    gap, left = diagnosis.gap, diagnosis.unexplained
    remaining = diagnosis.remaining or left
    size = length(gap.rms_before)
    if _another_motion(diagnosis):
        return _misfit(diagnosis)
    which = "none of the effects that were considered" if diagnosis.narrowed else "no known effect"
    if not diagnosis.verdict:
        if not left.flagged:
            floor = length(gap.noise_floor)
            return f"No gap beyond the noise: the {size} between model and robot is what noise alone leaves ({floor})."
        return f"The gap of {size} is explained by {which}{_place(left)}."
    found = [diagnosis.finding(name) for name in diagnosis.verdict]
    causes, chance = [f for f in found if not f.random], [diagnosis.title(f.name) for f in found if f.random]
    probability = diagnosis.probability
    sure = f"{100 * probability:.0f} % sure" if probability < _SURE else "more than 99 % sure"
    if not causes:
        rest = f", of which {length(remaining.rms)} is not explained" if remaining.flagged and remaining.rms else ""
        return f"The gap of {size} is scatter: {_listed(chance)} ({sure}){rest}; no correction removes scatter."
    text = f"The gap of {size} comes from {_causes(diagnosis, causes)} ({sure}); correcting for "
    text += ("them " if len(causes) > 1 else "it ") + _how_far(diagnosis) + _rest(diagnosis, remaining)
    if laws := sum(f.quantity is not None for f in causes):
        text += f"; {which} has {'that shape' if laws == 1 else 'these shapes'}"
    if chance:
        text += f"; there is also scatter, which no correction removes: {_listed(chance)}"
    doubts = [
        f"{diagnosis.title(f.name)} cannot be told apart from {' or '.join(map(diagnosis.title, f.confounded_with))}"
        for f in causes
        if f.confounded_with
    ]
    return text + ("; but " + ", and ".join(doubts) if doubts else "") + "."


def _another_motion(diagnosis: Diagnosis) -> bool:
    gap = diagnosis.gap
    return gap.rms_after > _ANOTHER_MOTION * diagnosis.reach or (gap.orientation_after or 0.0) > _ANOTHER_TURN


def _misfit(diagnosis: Diagnosis) -> str:
    gap, reach = diagnosis.gap, diagnosis.reach
    turned = gap.rms_after <= _ANOTHER_MOTION * reach
    left = f"{gap.orientation_after:.2g} rad" if turned else f"{length(gap.rms_after)} of {length(reach)}"
    return (
        f"Robot and table do not describe the same motion ({left} remain): check units, signs and order of the "
        "joints, axes of the instrument, order of the quaternion, and that all rows belong to one set-up."
    )


def _causes(diagnosis: Diagnosis, causes: Sequence[Finding]) -> str:
    """Name those that weigh something first."""
    weighty = [f for f in causes if (f.shrinkage or 0.0) >= _WEIGHTY] or list(causes[:1])
    slight = [diagnosis.title(f.name) for f in causes if f not in weighty]
    first = _listed([diagnosis.title(f.name) for f in weighty])
    return first + (f", and, barely visible, {_listed(slight)}" if slight else "")


def _how_far(diagnosis: Diagnosis) -> str:
    held = diagnosis.gap.held_out
    if held.shrinkage < 0.0:
        return (
            f"does not carry over to held-out data: their gap is {length(held.rms_after)} with it and "
            f"{length(held.rms_before)} without"
        )
    return (
        f"removes {100 * held.shrinkage:.1f} % of its mean square on held-out data and leaves {length(held.rms_after)}"
    )


def _rest(diagnosis: Diagnosis, remaining: Unexplained) -> str:
    gap, floor = diagnosis.gap, length(diagnosis.gap.noise_floor)
    if not remaining.flagged:
        if gap.held_out.rms_after < _CARRIES * max(gap.rms_after, gap.noise_floor):
            return f", which is noise ({floor})"
        return f", while {length(gap.rms_after)} is left on the rows it was fitted to (noise: {floor})"
    if gap.noise_source == "remainder" or remaining.rms == 0.0:
        return ", which is more than noise" + _place(remaining)
    return f", of which {length(remaining.rms)} is not explained" + _place(remaining)


def length(metres: float) -> str:
    """Return a length in the unit that a metrologist would use."""
    factor, unit = next((f, u) for least, f, u in _LENGTHS if metres >= least)
    return f"{metres * factor:.3g} {unit}"


def _listed(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else ", ".join(names[:-1]) + " and " + names[-1]


def _place(unexplained: Unexplained) -> str:
    parts = []
    if unexplained.locations and unexplained.depends_on:
        place = unexplained.locations[0]
        parts.append(f"enters most likely at {place.name if place.kind == 'joint' else 'the ' + place.kind}")
    if unexplained.depends_on:
        parts.append(f"follows {unexplained.depends_on[0].covariate}")
    return "; it " + " and ".join(parts) if parts else ""


def advice(diagnosis: Diagnosis) -> str:
    """Return what to measure next in one sentence."""
    if diagnosis.separates:
        apart = " from ".join(map(diagnosis.title, diagnosis.separates[0][:2]))
        if any(diagnosis.is_frame(name) for name in diagnosis.separates[0]):
            return f"A frame measured on its own, and declared known, would tell {apart}."
        return f"More poses over the whole range of every joint would tell {apart}."
    # repeats are not recorded but made: the last advice asks for them
    missing = [
        f
        for f in diagnosis.effects
        if f.status == "not_testable" and f.needs != ("pose",) and not diagnosis.is_frame(f.name)
    ]
    # what is no column, such as masses in the URDF, cannot be recorded
    columns = sorted({n.split(".")[0] for f in missing for n in f.needs if " " not in n})
    if diagnosis.unexplained.flagged and columns:
        untested = _listed([diagnosis.title(f.name) for f in missing])
        return f"Record {_listed(columns)}: {untested} could not be tested, and a remainder is unexplained."
    if diagnosis.unexplained.flagged:
        return "Repeat a few poses in another order and on another day: this shows how much of the remainder repeats."
    return "Nothing: the data determine the explanation."
