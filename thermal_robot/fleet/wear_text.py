"""A robot over time in words: one sentence, then a line for each parameter that may have moved."""

from __future__ import annotations

from collections.abc import Iterator

from thermal_robot.fleet.wear_result import Crossing, Wear, Worn

_LIKELY = 0.5
"""Probability from which on a parameter that does not ring is named beside those that do."""


def summary(wear: Wear) -> str:
    """Return one sentence: what moved, how and when."""
    span = f"{len(wear.campaigns)} campaigns of {wear.robot}"
    if not wear.alarms:
        return f"Over {span} nothing moves that would not by chance in {_share(wear.false_alarm)} of such series."
    told = "; ".join(_moves(wear, worn) for worn in wear.alarms)
    return f"Over {span}: {told}."


def text(wear: Wear) -> str:
    """Return the whole result in words; SI units.

    Parameters
    ----------
    wear
        The result.

    Returns
    -------
    str
        Lines: the sentence, the campaigns, what moved with chance, probability and limit, what stayed, what cannot be
        compared, notes.
    """
    return "\n".join(_lines(wear))


def _lines(wear: Wear) -> Iterator[str]:
    yield summary(wear)
    yield ""
    first, last = wear.campaigns[0], wear.campaigns[-1]
    days = f", {first.date} to {last.date}, {last.time:.0f} days" if wear.dated else ", in order; no dates, so no rates"
    yield f"campaigns    {len(wear.campaigns)}{days}"
    yield f"alarms       at most {_share(wear.false_alarm)} of series without a change ring"
    yield f"scatter      {wear.scatter:.2f} of what the deviations say; nothing moved: {wear.nothing:.1%}"
    for worn in wear.parameters:
        if worn.alarm:
            yield ""
            yield from _of_one(wear, worn)
    likely = [w for w in wear.parameters if not w.alarm and w.comparable and w.moved > _LIKELY]
    if likely:
        yield ""
        yield from (f"perhaps      {_moves(wear, w)}: {w.moved:.0%}, but no alarm" for w in likely)
    yield ""
    yield from _others(wear, {w.parameter for w in likely})
    yield from (f"note         {note}" for note in wear.notes)


def _of_one(wear: Wear, worn: Worn) -> Iterator[str]:
    yield f"ALARM        {_moves(wear, worn)}"
    kinds = ", ".join(f"{kind} {p:.0%}" for kind, p in worn.kinds.items() if p >= 0.005)
    yield f"             chance of such an alarm without a change: at most {worn.chance:.1g}; {kinds}"
    if worn.jump:
        a, b = wear.campaigns[worn.jump.earliest], wear.campaigns[worn.jump.latest]
        yield f"             95 %: between {_when(wear, a.name, a.date)} and {_when(wear, b.name, b.date)}"
    if worn.confounded_with:
        yield f"             cannot be told from a change of {', '.join(worn.confounded_with)}"
    if worn.crossing:
        yield f"             {_reaches(worn.crossing, worn.unit)}"


def _others(wear: Wear, named: set[str]) -> Iterator[str]:
    stays = [w for w in wear.parameters if w.comparable and not w.alarm and w.parameter not in named]
    if stays:
        yield f"stays        {'; '.join(f'{w.parameter} (moved: {w.moved:.1%})' for w in stays)}"
    yield from (f"limit        {w.parameter}: {_reaches(w.crossing, w.unit)}" for w in stays if w.crossing is not None)
    hidden = [w for w in wear.parameters if not w.comparable]
    for reason in dict.fromkeys(w.reason for w in hidden):
        names = ", ".join(w.parameter for w in hidden if w.reason == reason)
        yield f"not compared {names}: {reason}"


def _moves(wear: Wear, worn: Worn) -> str:
    """Say how one parameter moves."""
    name = f"{worn.title}, {worn.parameter}"
    if worn.jump is not None:
        a, b = wear.campaigns[worn.jump.after], wear.campaigns[worn.jump.after + 1]
        where = f"between {_when(wear, a.name, a.date)} and {_when(wear, b.name, b.date)}"
        size = f"{worn.jump.size:+.3g} ± {worn.jump.std:.2g} {worn.unit}"
        return f"{name} jumped by {size} {where} ({worn.jump.probability:.0%})"
    if worn.rate is not None:
        return f"{name} moves by {worn.rate.value:+.3g} ± {worn.rate.std:.2g} {worn.unit} a day"
    how = "moves steadily" if worn.kind == "trend" else "wanders"
    return f"{name} {how}, by {worn.change:+.3g} ± {worn.change_std:.2g} {worn.unit} from first to last"


def _when(wear: Wear, name: str, date: str) -> str:
    return f"{name} ({date})" if wear.dated else name


def _reaches(crossing: Crossing, unit: str) -> str:
    limit = f"limit {crossing.limit:.3g} {unit}"
    if crossing.state == "passed":
        return f"{limit}: passed"
    if crossing.state == "never":
        return f"{limit}: never, as it does not go there"
    if crossing.state == "unknown":
        return f"{limit}: not foreseen, for lack of a rate"
    expected, low, high = crossing.dates
    return f"{limit}: about {expected} (95 %: {low} to {high or 'never'})"


def _share(probability: float) -> str:
    return f"{100.0 * probability:.2g} %"
