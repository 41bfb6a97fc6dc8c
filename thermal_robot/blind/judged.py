"""One record judged: which questions it answers, and which of them rightly.

A diagnosis that failed answers every question wrongly. Questions by kind:

============= =====================================================================================================
exact         found are the effects at work and no other, nothing unexplained, nothing named that is confounded
first_named   the first effect of the verdict is at work
false_alarm   something is found that is not at work; where nothing is, also: something is called unexplained
sound         nothing is found that is not at work, and nothing called unexplained where all is in the library
listed        all effects at work are found
located       the first place of an effect that was found rightly is its first true place
among_places  ... is one of its true places
flagged       something is called unexplained
not_blamed    the verdict holds no effect with probability 0.9 or more that is not at work
place         the first place of the law that was discovered, else of the remainder, is a true one
near_place    ... is a true one or beside it along the chain
quantity      the same of the quantity that it follows; rightly none where none is recorded
named         an effect that is not testable names the column that was hidden
asks          it does, and the advice says so too
right         removed, unlisted: flagged and nothing blamed; both: that, and listed; hidden: that, and asked for;
              real: what the record says
============= =====================================================================================================

An effect that is not among the truth's but leaves 0.1 noise or more is no false alarm: it is at work. Below 0.5 it is
not asked for either. Of several campaigns:

============= =====================================================================================================
exact         same, steady: nothing is told to have changed; changed, series: that is told which did change, rightly in
              all that is asked of it, and nothing else; fleet: all that is shared and nothing else is called shared
found         the effect and the place of what changed are told
false_alarm   something else is told to have changed; something is called shared that is not
listed        same, changed: all effects at work keep their name
way           series: it is told as a jump or as a trend, rightly; what began is a jump from nothing
day           the two campaigns between which it began or jumped
day_within    ... lie within the 95 % interval that is told, where it is told as a jump
place         the joint rings, whatever effect is blamed
amount        the 95 % interval of its size holds the true one, where it is found and its way is right
shared_found  what robots share is called shared: of one hall, by these robots' hall
own_kept      what one robot has alone is not called shared
own_named     ... is told of that robot: it stands out, or its diagnosis has it
============= =====================================================================================================
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, get_args

from thermal_robot.blind.cases import SEVERAL, Known

SIGMAS = 1.959963984540054
"""Half the width of a normal law's central 95 %, in standard deviations."""
_WAYS = {"begins": "jump", "jumps": "jump", "grows": "trend"}
_HALL = "hall"


def compared(truth: Plain, said: Plain) -> Marks:
    """Judge a comparison of two campaigns, of the format ``thermal-robot/comparison/1``."""
    kept = set(truth["effects"]) <= set(said["verdict"]["effects"])
    right, others = _parted(truth, said["changes"])
    if not truth["changes"]:
        return {"exact": (not others,), "false_alarm": (bool(others),), "listed": (kept,)}
    found = bool(right)
    return {"exact": (found and not others,), "found": (found,), "false_alarm": (bool(others),), "listed": (kept,)}


def followed(truth: Plain, said: Plain) -> Marks:
    """Judge what is said of a robot over time, of the format ``thermal-robot/wear/1``."""
    rings = [p for p in said["parameters"] if p["alarm"]]
    right, others = _parted(truth, rings)
    if not truth["changes"]:
        return {"exact": (not others,), "false_alarm": (bool(others),)}
    [change] = truth["changes"]
    found, jump = bool(right), next((p["jump"] for p in right if p["jump"]), None)
    way = any(p["kind"] == _WAYS[change["how"]] for p in right)
    place = any(p["place"] == change["place"]["name"] for p in rings)
    answers: Marks = {"found": (found,), "way": (way,), "place": (place,), "false_alarm": (bool(others),)}
    day = True
    if change["after"] is not None:
        day = jump is not None and jump["after"] == change["after"]
        answers["day"] = (day,)
        answers["day_within"] = () if jump is None else (jump["earliest"] <= change["after"] < jump["latest"],)
    answers["amount"] = tuple(_holds(p, change["amount"]) for p in right[:1] if way)
    return {"exact": (found and way and day and not others,), **answers}


def shared(truth: Plain, said: Plain) -> Marks:
    """Judge the summary of a fleet, of the format ``thermal-robot/fleet/1``."""
    called = [s for s in said["shared"] if not any(_same(s, true) for true in truth["shared"])]
    true_ones = {true["effect"] for true in truth["shared"]}
    gathered = [g for g in said["gathered"] if g["effect"] not in true_ones]
    found = tuple(_is_shared(true, said) for true in truth["shared"])
    kept = tuple(not any(_same(s, own) for s in called) for own in truth["own"])
    alarm = bool(called or gathered)
    return {
        "exact": (all(found) and not alarm,),
        "shared_found": found,
        "false_alarm": (alarm,),
        "own_kept": kept,
        "own_named": tuple(_is_named(own, said) for own in truth["own"]),
    }


def true_words(truth: Plain) -> tuple[str, ...]:
    """Say in short words what was true of several campaigns."""
    changes = (
        f"{c['effect']} {c['how']}, {c['place']['name']}"
        + ("" if c["after"] is None else f", after campaign {c['after'] + 1}")
        for c in truth.get("changes", ())
    )
    together = (f"{s['parameter']} shared by {s['group'] or 'all'}" for s in truth.get("shared", ()))
    alone = (f"{own['parameter']} of {own['robot']}" for own in truth.get("own", ()))
    return (*changes, *together, *alone)


def said_words(kind: str, said: Plain) -> tuple[str, ...]:
    """Say in short words what was answered of several campaigns."""
    if kind in ("same", "changed"):
        return tuple(f"{c['effect']}, {c['place'] or 'everywhere'}" for c in said["changes"])
    if kind in ("steady", "series"):
        rings = (p for p in said["parameters"] if p["alarm"])
        return tuple(
            f"{p['parameter']}: {p['kind']}" + (f" after campaign {p['jump']['after'] + 1}" if p["jump"] else "")
            for p in rings
        )
    together = (f"{s['parameter']} shared" + (f" by {s['label']}" if s["label"] else "") for s in said["shared"])
    return (*together, *(f"{g['effect']} gathers in {g['group']}" for g in said["gathered"]))


def _parted(truth: Plain, told: list[Plain]) -> tuple[list[Plain], list[Plain]]:
    """Part what is told to have changed into what did, and what did not."""
    true = {(c["effect"], c["place"]["name"]) for c in truth["changes"]}
    right = [one for one in told if (one["effect"], one["place"]) in true]
    return right, [one for one in told if one not in right]


def _holds(told: Plain, amount: float) -> bool:
    return bool(abs(told["change"] - amount) <= SIGMAS * told["change_std"])


def _same(told: Plain, true: Plain) -> bool:
    return bool((told["effect"], told["parameter"]) == (true["effect"], true["parameter"]))


def _is_shared(true: Plain, said: Plain) -> bool:
    if true["group"] is None:
        return any(_same(s, true) for s in said["shared"])
    here = [s for s in said["shared"] if _same(s, true) and s["label"] == _HALL]
    most = [max(s["groups"], key=lambda g: abs(g["mean"]))["group"] for s in here if s["groups"]]
    gathers = [g["group"] for g in said["gathered"] if g["effect"] == true["effect"] and g["label"] == _HALL]
    return true["group"] in (*most, *gathers)


def _is_named(own: Plain, said: Plain) -> bool:
    apart = any(_same(a, own) and a["robot"] == own["robot"] for a in said["apart"])
    place = own["effect"], own["robot"], own["place"]["name"]
    return apart or any((c["effect"], c["robot"], c["place"]) == place for c in said["found"])


Plain = Mapping[str, Any]
Record = Plain
Marks = dict[str, tuple[bool, ...]]

LAW = "discovered."
ABSENT, PRESENT = 0.1, 0.5  # × noise: what leaves less is not there, what leaves more is
BLAME = 0.9
BAD = frozenset({"false_alarm"})
"""Questions to which yes is wrong."""
KNOWN: tuple[str, ...] = get_args(Known)
HEADLINE = {
    **dict.fromkeys((*KNOWN, *SEVERAL), "exact"),
    "mixed": "sound",
    **dict.fromkeys(("removed", "hidden", "unlisted", "both", "real"), "right"),
}
"""The question that decides whether a case of a kind is a miss."""
_SILENT: dict[str, Any] = {
    "verdict": {"effects": [], "probability": None, "unexplained": False},
    "effects": [],
    "unexplained": {"locations": [], "depends_on": []},
    "next": {"advice": ""},
    **{what: [] for what in ("changes", "parameters", "shared", "gathered", "apart", "found")},
}


def failed(record: Record) -> bool:
    """Whether there is no diagnosis."""
    return record.get("error") is not None or record.get("said") is None


def said(record: Record) -> Mapping[str, Any]:
    """Return the diagnosis, or one that says nothing where it failed."""
    return _SILENT if failed(record) else record["said"]


def at_work(record: Record) -> tuple[str, ...]:
    """Return the effects that are to be found."""
    return tuple(record["truth"]["effects"])


def found(record: Record) -> frozenset[str]:
    """Return the effects that the diagnosis claims."""
    return frozenset(e["name"] for e in said(record)["effects"] if e["status"] == "found")


def ratio(record: Record, effect: str) -> float | None:
    """Return what an effect truly leaves, over the noise; ``None`` where it is absent or its size unknown."""
    part = record["truth"].get("parts", {}).get(effect)
    return None if part is None or part.get("ratio") is None else float(part["ratio"])


def first_named(record: Record) -> str | None:
    """Return the first effect of the verdict."""
    return next(iter(said(record)["verdict"]["effects"]), None)


def unexplained(record: Record) -> bool:
    """Whether the diagnosis calls something unexplained."""
    return bool(said(record)["verdict"]["unexplained"])


def corrects(record: Record) -> bool:
    """Whether the corrected model holds anything beside the frames: an effect that is named and shrinks the gap.

    Effects that scatter are named, too, but no correction takes them away: they shrink nothing at all.
    """
    named = set(said(record)["verdict"]["effects"])
    return any(e["name"] in named and e.get("shrinkage") for e in said(record)["effects"])


def is_absent(record: Record, effect: str) -> bool:
    """Whether an effect is not at work, not even in the background."""
    return effect not in at_work(record) and (ratio(record, effect) or 0.0) < ABSENT


def marks(record: Record) -> Marks:
    """Judge one record: answers by question, one or one for each effect found; what cannot be asked is missing."""
    answers = _ASKED[record["kind"]](record)
    if failed(record):
        return {name: (name in BAD,) * len(given) for name, given in answers.items()}
    return answers


def is_miss(record: Record) -> bool:
    """Whether the question that matters most for this kind is answered wrongly."""
    return not all(marks(record)[HEADLINE[record["kind"]]])


def _known(record: Record) -> Marks:
    """Judge a case whose causes are all in the library."""
    wanted = set(at_work(record))
    confounded = {e["name"] for e in said(record)["effects"] if e["status"] == "confounded"}
    escaped = confounded & set(said(record)["verdict"]["effects"])
    extra = _extra(record)
    exact = wanted <= found(record) and not extra and not unexplained(record) and not escaped
    if not wanted:
        return {"exact": (exact,), "false_alarm": (bool(extra) or unexplained(record),)}
    places = [_located(record, name) for name in at_work(record) if name in found(record)]
    told = [p for p in places if p is not None]
    return {
        "exact": (exact,),
        "first_named": (first_named(record) in wanted,),
        "false_alarm": (bool(extra),),
        "located": tuple(first for first, _ in told),
        "among_places": tuple(among for _, among in told),
    }


def _extra(record: Record) -> set[str]:
    """Return what is claimed and is not at work."""
    return {name for name in found(record) if is_absent(record, name)}


def is_right_law(record: Record, law: Plain) -> bool:
    """Whether a law has the place, or one beside it, and the quantity of a cause that no effect may explain."""
    truth = record["truth"]
    near = [_site(p) for p in truth.get("near") or truth.get("places", ())]
    return any(_site(p) in near for p in law["locations"][:1]) and law.get("quantity") in truth.get("quantities", ())


def _mixed(record: Record) -> Marks:
    """Judge a case whose effects may be too small to be seen: nothing else must be."""
    right = {e["name"] for e in said(record)["effects"] if e["name"].startswith(LAW) and is_right_law(record, e)}
    extra, strange = _extra(record) - right, unexplained(record) and not record["truth"].get("unlisted")
    return {"sound": (not extra and not strange,), "false_alarm": (bool(extra),)}


def _located(record: Record, effect: str) -> tuple[bool, bool] | None:
    """Tell whether the first place is the first true one, and one of them; ``None`` where it sits everywhere."""
    true = [_site(p) for p in record["truth"].get("parts", {}).get(effect, {}).get("places", ())]
    if not true:
        return None
    told = next(e for e in said(record)["effects"] if e["name"] == effect)["locations"]
    first = _site(told[0]) if told else None
    return first == true[0], first in true


def _site(place: Mapping[str, Any]) -> tuple[str, str]:
    return place["kind"], place["name"]


def _unknown(record: Record) -> Marks:
    """Judge a case one cause of which is not in the library, or was taken from it."""
    flagged, blameless = unexplained(record), not _blamed(record)
    truth, (place, quantity) = record["truth"], answer(record)
    answers: Marks = {"flagged": (flagged,), "not_blamed": (blameless,), "right": (flagged and blameless,)}
    if truth.get("places"):
        answers["place"] = (place in [_site(p) for p in truth["places"]],)
        answers["near_place"] = (place in [_site(p) for p in truth.get("near") or truth["places"]],)
    if truth.get("quantities"):
        answers["quantity"] = (quantity in truth["quantities"],)
    return answers


def _both(record: Record) -> Marks:
    """Judge a case with one or two listed effects beside a cause that is not in the library."""
    answers, listed = _unknown(record), set(at_work(record)) <= found(record)
    return {**answers, "listed": (listed,), "right": (listed and all(answers["right"]),)}


def _blamed(record: Record) -> bool:
    probability = {e["name"]: e["probability"] or 0.0 for e in said(record)["effects"]}
    strange = [n for n in said(record)["verdict"]["effects"] if not n.startswith(LAW) and is_absent(record, n)]
    return any(probability.get(name, 0.0) >= BLAME for name in strange)


def answer(record: Record) -> tuple[tuple[str, str] | None, str | None]:
    """Return where the unknown cause enters and what it follows: a discovered law's word counts before the rest's.

    Where something is called unexplained and follows nothing, that is ``none``.
    """
    left = said(record)["unexplained"]
    laws = [e for e in said(record)["effects"] if e["name"].startswith(LAW)][:1]
    places = [_site(p) for e in (*laws, left) for p in e["locations"][:1]]
    quantities = [e["quantity"] for e in laws if e.get("quantity")] + [d["covariate"] for d in left["depends_on"][:1]]
    return next(iter(places), None), next(iter(quantities), "none" if unexplained(record) else None)


def _hidden(record: Record) -> Marks:
    """Judge a case whose cause follows a column that was taken away."""
    missing = [e for e in said(record)["effects"] if e["status"] == "not_testable"]
    named = {_stem(need) for e in missing for need in e["needs"]} & {_stem(n) for n in record["truth"]["needs"]}
    further = said(record)["next"]
    told = {_stem(need) for need in further.get("needs", ())}
    asks = any(name in told or name in further["advice"] for name in named)
    flagged, blameless = unexplained(record), not _blamed(record)
    return {
        "named": (bool(named),),
        "asks": (asks,),
        "flagged": (flagged,),
        "not_blamed": (blameless,),
        "right": (asks and flagged and blameless,),
    }


def _stem(column: str) -> str:
    """``temperature`` stands for ``temperature.<link>`` too."""
    return column.partition(".")[0]


def _several(judge: Callable[[Plain, Plain], Marks]) -> Callable[[Record], Marks]:
    return lambda record: judge(record["truth"], said(record))


_ASKED: dict[str, Callable[[Record], Marks]] = {
    **dict.fromkeys(KNOWN, _known),
    "mixed": _mixed,
    **dict.fromkeys(("removed", "unlisted"), _unknown),
    "both": _both,
    "hidden": _hidden,
    "real": lambda record: {"right": (bool(record.get("right", False)),)},
    **dict.fromkeys(("same", "changed"), _several(compared)),
    **dict.fromkeys(("steady", "series"), _several(followed)),
    "fleet": _several(shared),
}
