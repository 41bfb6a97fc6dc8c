"""The verdict in one plain sentence, and what to measure next."""

from __future__ import annotations

from collections.abc import Sequence

from thermal_robot.diagnosis.result import Finding, Gap, Unexplained
from thermal_robot.effects import RANDOM

_ANOTHER_MOTION = 0.02
_ANOTHER_TURN = 0.2  # rad
_WEIGHTY = 0.01  # of the gap on held-out rows: an effect with less is named last
_CARRIES = 1.5  # times what is left of the fitted rows: more on held-out rows is not called noise
_PLAIN = {
    "base_frame": "a misplaced base frame",
    "tool_frame": "a misplaced tool frame",
    "joint_offset": "joint zero offsets",
    "joint_gain": "joint gain errors",
    "transmission_error": "periodic transmission errors",
    "backlash": "lost motion in the joints",
    "joint_compliance": "joints that yield to load",
    "tracking_lag": "joints that trail their command",
    "link_compliance": "links that bend under load",
    "thermal_bending": "links that bow with heat",
    "encoder_resolution": "encoders that count in coarse steps",
    "excess_repeatability": "joints that scatter more than the instrument",
    "geometric": "geometric errors of the links",
    "thermal_elongation": "thermal elongation of the links",
    "drift": "drift of the base or the instrument",
    "instrument_scale": "a scale error of the instrument",
}


def plain(effect: str) -> str:
    """Return an effect's name in plain words."""
    return _PLAIN.get(effect, effect.replace("_", " "))


def length(metres: float) -> str:
    """Return a length in the unit that a metrologist would use."""
    scaled, unit = (metres * 1e3, "mm") if metres >= 1e-3 else (metres * 1e6, "µm")
    return f"{scaled:.3g} {unit}"


def sentence(
    gap: Gap,
    found: Sequence[Finding],
    explained: Sequence[str],
    probability: float,
    unexplained: Unexplained,
    remaining: Unexplained,
    *,
    reach: float,
    narrowed: bool = False,
) -> str:
    """Return the verdict as one sentence.

    Parameters
    ----------
    gap, found, explained, probability, unexplained
        Parts of the diagnosis; ``explained`` in order of share.
    remaining
        What is left when laws that were discovered are taken off, too.
    reach
        Size of the volume that was measured, m: a gap after correction of more than a fiftieth of it is not a robot's.
    narrowed
        Whether effects were left out by request.
    """
    size, floor = length(gap.rms_before), length(gap.noise_floor)
    if gap.rms_after > _ANOTHER_MOTION * reach or (gap.orientation_after or 0.0) > _ANOTHER_TURN:
        turned = gap.rms_after <= _ANOTHER_MOTION * reach
        left = f"{gap.orientation_after:.2g} rad" if turned else f"{length(gap.rms_after)} of {length(reach)}"
        return (
            f"Robot and table do not describe the same motion ({left} remain): check units, signs and order of the "
            "joints, axes of the instrument, order of the quaternion, and that all rows belong to one set-up."
        )
    which = "none of the effects that were considered" if narrowed else "no known effect"
    if not explained:
        if not unexplained.flagged:
            return f"No gap beyond the noise: the {size} between model and robot is what noise alone leaves ({floor})."
        return f"The gap of {size} is explained by {which}{_place(unexplained)}."
    by_name = {f.name: f for f in found}
    chance = [n for n in explained if n in RANDOM]
    explained = [n for n in explained if n not in RANDOM]
    sure = f"{100 * probability:.0f} % sure" if probability < 0.995 else "more than 99 % sure"
    scatter = _listed([plain(n) for n in chance]) if chance else ""
    if not explained:
        left = f", of which {length(remaining.rms)} is not explained" if remaining.flagged and remaining.rms else ""
        return f"The gap of {size} is scatter: {scatter} ({sure}){left}; no correction takes scatter away."
    weighty = [n for n in explained if (by_name[n].shrinkage or 0.0) >= _WEIGHTY] or list(explained[:1])
    words = {n: by_name[n].describes or plain(n) for n in explained}
    slight = [words[n] for n in explained if n not in weighty]
    listed = _listed([words[n] for n in weighty]) + (f", and, hardly to be seen, {_listed(slight)}" if slight else "")
    them = "them" if len(explained) > 1 else "it"
    text = f"The gap of {size} comes from {listed} ({sure}); correcting for {them} "
    if gap.held_out.shrinkage < 0.0:
        text += (
            "does not carry over to held-out data: their gap is "
            f"{length(gap.held_out.rms_after)} with it and {length(gap.held_out.rms_before)} without"
        )
    else:
        text += (
            f"removes {100 * gap.held_out.shrinkage:.1f} % of its mean square on held-out data and leaves "
            f"{length(gap.held_out.rms_after)}"
        )
    if not remaining.flagged:
        if gap.held_out.rms_after < _CARRIES * max(gap.rms_after, gap.noise_floor):
            text += f", which is noise ({floor})"
        else:
            text += f", while {length(gap.rms_after)} are left of the rows it was fitted to (noise: {floor})"
    elif gap.noise_source == "remainder" or remaining.rms == 0.0:
        text += ", which is more than noise" + _place(remaining)
    else:
        text += f", of which {length(remaining.rms)} is not explained" + _place(remaining)
    if laws := sum(bool(by_name[n].describes) for n in explained):
        text += f"; {which} has {'that shape' if laws == 1 else 'these shapes'}"
    if scatter:
        text += f"; besides there is scatter, which no correction takes away: {scatter}"
    doubts = [
        f"{plain(n)} cannot be told from {' or '.join(map(plain, by_name[n].confounded_with))}"
        for n in explained
        if by_name[n].confounded_with
    ]
    return text + ("; but " + ", and ".join(doubts) if doubts else "") + "."


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


def advise(found: Sequence[Finding], unexplained: Unexplained) -> tuple[str, tuple[tuple[str, ...], ...]]:
    """Return what to measure next in one sentence, and the groups of effects that it would separate."""
    groups = tuple(dict.fromkeys(tuple(sorted((f.name, *f.confounded_with))) for f in found if f.confounded_with))
    groups = tuple(g for g in groups if not {"base_frame", "tool_frame"} & set(g) or len(groups) == 1)
    if groups:
        pair = " from ".join(plain(n) for n in groups[0][:2])
        if {"base_frame", "tool_frame"} & set(groups[0]):
            return f"A frame measured on its own, and declared known, would tell {pair}.", groups
        return f"More poses over the whole range of every joint would tell {pair}.", groups
    # repeats are not recorded but made: the last advice asks for them
    missing = [
        f
        for f in found
        if f.status == "not_testable" and f.needs != ("pose",) and not any(n.startswith("frames.") for n in f.needs)
    ]
    if unexplained.flagged and missing:
        columns = sorted({n.split(".")[0] for f in missing for n in f.needs})
        listed = ", ".join(plain(f.name) for f in missing)
        return f"Record {', '.join(columns)}: {listed} could not be tested, and a remainder is unexplained.", ()
    if unexplained.flagged:
        return (
            "Repeat a few poses, in another order and on another day: it tells what is repeatable in the remainder.",
            (),
        )
    return "Nothing: the data determine the explanation.", ()
