"""The verdict in one plain sentence, and what to measure next."""

from __future__ import annotations

from collections.abc import Sequence

from thermal_robot.diagnosis.result import Finding, Gap, Unexplained

_PLAIN = {
    "base_frame": "a misplaced base frame",
    "tool_frame": "a misplaced tool frame",
    "joint_offset": "joint zero offsets",
    "joint_gain": "joint gain errors",
    "transmission_error": "periodic transmission errors",
    "backlash": "lost motion in the joints",
    "joint_compliance": "joints that yield to load",
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
    gap: Gap, found: Sequence[Finding], explained: Sequence[str], probability: float, unexplained: Unexplained
) -> str:
    """Return the verdict as one sentence."""
    size, floor = length(gap.rms_before), length(gap.noise_floor)
    if not explained:
        if not unexplained.flagged:
            return f"No gap beyond the noise: the {size} between model and robot is what noise alone leaves ({floor})."
        return f"The gap of {size} is explained by no known effect{_place(unexplained)}."
    names = [plain(name) for name in explained]
    listed = names[0] if len(names) == 1 else ", ".join(names[:-1]) + " and " + names[-1]
    by_name = {f.name: f for f in found}
    doubts = [
        f"{plain(n)} cannot be told from {' or '.join(map(plain, by_name[n].confounded_with))}"
        for n in explained
        if by_name[n].confounded_with
    ]
    sure = f"{min(probability, 0.999):.0%} sure" if probability < 0.995 else "more than 99 % sure"
    share = gap.held_out.shrinkage
    text = (
        f"The gap of {size} comes from {listed} ({sure.replace('%', ' %').replace('  ', ' ')}); "
        f"correcting for {'it' if len(names) == 1 else 'them'} removes {100 * share:.1f} % of its mean square on "
        f"held-out "
        f"data and leaves {length(gap.held_out.rms_after)}"
    )
    if unexplained.flagged:
        alone = gap.noise_source == "remainder"
        text += ", which is not explained" if alone else f", of which {length(unexplained.rms)} is not explained"
        text += _place(unexplained)
    else:
        text += f", which is noise ({floor})"
    return text + ("; but " + ", and ".join(doubts) if doubts else "") + "."


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
        return f"More poses over the whole range of every joint would tell {pair}.", groups
    missing = [f for f in found if f.status == "not_testable" and not any(n.startswith("frames.") for n in f.needs)]
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
