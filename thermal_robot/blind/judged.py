"""Scoring of one record: the questions that it answers, and which of them rightly.

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

Plain = Mapping[str, Any]
Record = Plain
Marks = dict[str, tuple[bool, ...]]

SIGMAS = 1.959963984540054
"""Half the width of a normal law's central 95 %, in standard deviations."""
LAW = "discovered."
ABSENT, PRESENT = 0.1, 0.5
"""Residual rms over the noise: an effect that leaves less counts as absent, one that leaves more as present."""
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


def marks(record: Record) -> Marks:
    """Score one record: one or several true or false answers by question; all wrong if the diagnosis failed."""
    answers = _ASKED[record["kind"]](record)
    return {name: (name in BAD,) * len(given) for name, given in answers.items()} if failed(record) else answers


def is_miss(record: Record) -> bool:
    """Whether the main question of this kind of case (:data:`HEADLINE`) is answered wrongly."""
    return not all(marks(record)[HEADLINE[record["kind"]]])


def failed(record: Record) -> bool:
    """Whether the diagnosis of a record ended in an error or gave no answer."""
    return record.get("error") is not None or record.get("said") is None


def said(record: Record) -> Plain:
    """Diagnosis of a record as plain values, or one without any finding where it failed."""
    return _SILENT if failed(record) else record["said"]


def at_work(record: Record) -> tuple[str, ...]:
    """Return the true effects of a case that the diagnosis is to find, without those of the background."""
    return tuple(record["truth"]["effects"])


def found(record: Record) -> frozenset[str]:
    """Effects to which the diagnosis gives the status ``found``."""
    return frozenset(e["name"] for e in said(record)["effects"] if e["status"] == "found")


def ratio(record: Record, effect: str) -> float | None:
    """Return an effect's residual rms over the noise, per axis; ``None`` where it is absent or its size unknown."""
    size = record["truth"].get("parts", {}).get(effect, {}).get("ratio")
    return None if size is None else float(size)


def is_absent(record: Record, effect: str) -> bool:
    """Whether an effect is not to be found, and leaves less than 0.1 of the noise in the background, too."""
    return effect not in at_work(record) and (ratio(record, effect) or 0.0) < ABSENT


def first_named(record: Record) -> str | None:
    """First effect of the verdict; ``None`` where it is empty."""
    return next(iter(said(record)["verdict"]["effects"]), None)


def unexplained(record: Record) -> bool:
    """Whether the diagnosis flags an unexplained residual."""
    return bool(said(record)["verdict"]["unexplained"])


def corrects(record: Record) -> bool:
    """Whether the corrected model holds an effect: one of the verdict that has a shrinkage.

    Random effects are in the verdict, too, but no correction removes them, and they have none.
    """
    named = set(said(record)["verdict"]["effects"])
    return any(e["name"] in named and e.get("shrinkage") for e in said(record)["effects"])


def is_right_law(record: Record, law: Plain) -> bool:
    """Whether a law's first place is that of the unlisted cause or beside it, and its quantity a right one as well."""
    truth = record["truth"]
    near = _sites(truth.get("near") or truth.get("places", ()))
    return any(site in near for site in _sites(law["locations"][:1])) and (
        law.get("quantity") in truth.get("quantities", ())
    )


def answer(record: Record) -> tuple[tuple[str, str] | None, str | None]:
    """Place and quantity that the diagnosis gives an unknown cause: its first law's, else the unexplained residual's.

    The quantity is ``none`` where an unexplained residual follows nothing.
    """
    left = said(record)["unexplained"]
    laws = [e for e in said(record)["effects"] if e["name"].startswith(LAW)][:1]
    places = [site for e in (*laws, left) for site in _sites(e["locations"][:1])]
    quantities = [e["quantity"] for e in laws if e.get("quantity")] + [d["covariate"] for d in left["depends_on"][:1]]
    return next(iter(places), None), next(iter(quantities), "none" if unexplained(record) else None)


def _yes(**answers: bool) -> Marks:
    return {question: (bool(given),) for question, given in answers.items()}


def _sites(places: Any) -> list[tuple[str, str]]:
    return [(place["kind"], place["name"]) for place in places]


def _extra(record: Record) -> set[str]:
    return {name for name in found(record) if is_absent(record, name)}


def _known(record: Record) -> Marks:
    wanted, extra, strange = set(at_work(record)), _extra(record), unexplained(record)
    confounded = {e["name"] for e in said(record)["effects"] if e["status"] == "confounded"}
    escaped = confounded & set(said(record)["verdict"]["effects"])
    exact = wanted <= found(record) and not (extra or strange or escaped)
    if not wanted:
        return _yes(exact=exact, false_alarm=bool(extra) or strange)
    parts, first = record["truth"].get("parts", {}), {e["name"]: e["locations"][:1] for e in said(record)["effects"]}
    true = {name: _sites(parts.get(name, {}).get("places", ())) for name in at_work(record) if name in found(record)}
    told = [(_sites(first[name]), places) for name, places in true.items() if places]
    return {
        **_yes(exact=exact, first_named=first_named(record) in wanted, false_alarm=bool(extra)),
        "located": tuple(place == places[:1] for place, places in told),
        "among_places": tuple(bool(place) and place[0] in places for place, places in told),
    }


def _mixed(record: Record) -> Marks:
    """Score a mixture, whose effects may be too small to find: nothing false found, or wrongly called unexplained."""
    right = {e["name"] for e in said(record)["effects"] if e["name"].startswith(LAW) and is_right_law(record, e)}
    extra, strange = _extra(record) - right, unexplained(record) and not record["truth"].get("unlisted")
    return _yes(sound=not extra and not strange, false_alarm=bool(extra))


def _unknown(record: Record) -> Marks:
    """Score a case whose cause is not in the library: flagged, nothing else blamed, right place and quantity."""
    flagged, blameless = unexplained(record), not _blamed(record)
    truth, (place, quantity) = record["truth"], answer(record)
    answers = _yes(flagged=flagged, not_blamed=blameless, right=flagged and blameless)
    if truth.get("places"):
        places, near = truth["places"], truth.get("near") or truth["places"]
        answers |= _yes(place=place in _sites(places), near_place=place in _sites(near))
    if truth.get("quantities"):
        answers |= _yes(quantity=quantity in truth["quantities"])
    return answers


def _both(record: Record) -> Marks:
    answers, listed = _unknown(record), set(at_work(record)) <= found(record)
    return {**answers, **_yes(listed=listed, right=listed and all(answers["right"]))}


def _blamed(record: Record) -> bool:
    probability = {e["name"]: e["probability"] or 0.0 for e in said(record)["effects"]}
    strange = [n for n in said(record)["verdict"]["effects"] if not n.startswith(LAW) and is_absent(record, n)]
    return any(probability.get(name, 0.0) >= BLAME for name in strange)


def _hidden(record: Record) -> Marks:
    """Score a case whose cause follows a removed column; ``temperature`` stands for each link's, too."""

    def stems(columns: Any) -> set[str]:
        return {column.partition(".")[0] for column in columns}

    missing = [need for e in said(record)["effects"] if e["status"] == "not_testable" for need in e["needs"]]
    named, further = stems(missing) & stems(record["truth"]["needs"]), said(record)["next"]
    asks = any(name in stems(further.get("needs", ())) or name in further["advice"] for name in named)
    flagged, blameless = unexplained(record), not _blamed(record)
    right = asks and flagged and blameless
    return _yes(named=bool(named), asks=asks, flagged=flagged, not_blamed=blameless, right=right)


_WAYS = {"begins": "jump", "jumps": "jump", "grows": "trend"}
_HALL = "hall"


def _compared(record: Record) -> Marks:
    """Score a comparison of two campaigns: true and false changes, and effects at work that are in the verdict."""
    truth, told = record["truth"], said(record)
    right, others = _true_and_false(truth, told["changes"])
    kept = set(truth["effects"]) <= set(told["verdict"]["effects"])
    found_ = _yes(found=bool(right)) if truth["changes"] else {}
    exact = all(all(given) for given in found_.values()) and not others
    return {**_yes(exact=exact), **found_, **_yes(false_alarm=bool(others), listed=kept)}


def _followed(record: Record) -> Marks:
    """Score the answer on one robot over time: what changed, where, jump or trend, when and by how much."""
    truth, rings = record["truth"], [p for p in said(record)["parameters"] if p["alarm"]]
    right, others = _true_and_false(truth, rings)
    if not truth["changes"]:
        return _yes(exact=not others, false_alarm=bool(others))
    [change] = truth["changes"]
    jump = next((p["jump"] for p in right if p["jump"]), None)
    way = any(p["kind"] == _WAYS[change["how"]] for p in right)
    place = any(p["place"] == change["place"]["name"] for p in rings)
    answers = _yes(found=bool(right), way=way, place=place, false_alarm=bool(others))
    after, day = change["after"], True
    if after is not None:
        day = jump is not None and jump["after"] == after
        answers["day"] = (day,)
        answers["day_within"] = () if jump is None else (jump["earliest"] <= after < jump["latest"],)
    held = (abs(p["change"] - change["amount"]) <= SIGMAS * p["change_std"] for p in right[:1] if way)
    answers["amount"] = tuple(map(bool, held))
    return {**_yes(exact=bool(right) and way and day and not others), **answers}


def _true_and_false(truth: Plain, told: list[Plain]) -> tuple[list[Plain], list[Plain]]:
    """Split reported changes into those whose effect and place are those of a true change, and all others."""
    true = {(c["effect"], c["place"]["name"]) for c in truth["changes"]}
    right = [one for one in told if (one["effect"], one["place"]) in true]
    return right, [one for one in told if one not in right]


def _shared(record: Record) -> Marks:
    """Judge a fleet's summary, yes or no: shared faults found, no false alarm, single robots' faults kept apart."""
    truth, told = record["truth"], said(record)
    called = [s for s in told["shared"] if not any(_same(s, true) for true in truth["shared"])]
    true_ones = {true["effect"] for true in truth["shared"]}
    alarm = bool(called) or any(g["effect"] not in true_ones for g in told["gathered"])
    found_ = tuple(_is_shared(true, told) for true in truth["shared"])
    return {
        "exact": (all(found_) and not alarm,),
        "shared_found": found_,
        "false_alarm": (alarm,),
        "own_kept": tuple(not any(_same(s, own) for s in called) for own in truth["own"]),
        "own_named": tuple(_is_named(own, told) for own in truth["own"]),
    }


def _same(told: Plain, true: Plain) -> bool:
    return bool((told["effect"], told["parameter"]) == (true["effect"], true["parameter"]))


def _is_shared(true: Plain, told: Plain) -> bool:
    if true["group"] is None:
        return any(_same(s, true) for s in told["shared"])
    here = [s for s in told["shared"] if _same(s, true) and s["label"] == _HALL]
    most = [max(s["groups"], key=lambda g: abs(g["mean"]))["group"] for s in here if s["groups"]]
    gathers = [g["group"] for g in told["gathered"] if g["effect"] == true["effect"] and g["label"] == _HALL]
    return true["group"] in (*most, *gathers)


def _is_named(own: Plain, told: Plain) -> bool:
    apart = any(_same(a, own) and a["robot"] == own["robot"] for a in told["apart"])
    place = own["effect"], own["robot"], own["place"]["name"]
    return apart or any((c["effect"], c["robot"], c["place"]) == place for c in told["found"])


_ASKED: dict[str, Callable[[Record], Marks]] = {
    **dict.fromkeys(KNOWN, _known),
    "mixed": _mixed,
    **dict.fromkeys(("removed", "unlisted"), _unknown),
    "both": _both,
    "hidden": _hidden,
    "real": lambda record: _yes(right=record.get("right", False)),
    **dict.fromkeys(("same", "changed"), _compared),
    **dict.fromkeys(("steady", "series"), _followed),
    "fleet": _shared,
}


def true_words(truth: Plain) -> tuple[str, ...]:
    """Return the true changes, shared faults and single robots' faults of several campaigns, in short words."""
    words = []
    for c in truth.get("changes", ()):
        day = "" if c["after"] is None else f", after campaign {c['after'] + 1}"
        words.append(f"{c['effect']} {c['how']}, {c['place']['name']}{day}")
    words += [f"{s['parameter']} shared by {s['group'] or 'all'}" for s in truth.get("shared", ())]
    return (*words, *(f"{own['parameter']} of {own['robot']}" for own in truth.get("own", ())))


def said_words(kind: str, said: Plain) -> tuple[str, ...]:
    """Return the changes, alarms or shared faults that the diagnosis of several campaigns reports, in short words."""
    if kind in ("same", "changed"):
        return tuple(f"{c['effect']}, {c['place'] or 'everywhere'}" for c in said["changes"])
    if kind in ("steady", "series"):
        rings = [(p, p["jump"]) for p in said["parameters"] if p["alarm"]]
        return tuple(
            f"{p['parameter']}: {p['kind']}" + (f" after campaign {jump['after'] + 1}" if jump else "")
            for p, jump in rings
        )
    together = (f"{s['parameter']} shared" + (f" by {s['label']}" if s["label"] else "") for s in said["shared"])
    return (*together, *(f"{g['effect']} gathers in {g['group']}" for g in said["gathered"]))
