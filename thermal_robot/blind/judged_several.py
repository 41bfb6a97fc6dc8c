"""What is said of several campaigns, judged: what changed, when and how; what robots share.

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

from collections.abc import Mapping
from typing import Any

Plain = Mapping[str, Any]
Marks = dict[str, tuple[bool, ...]]

_SIGMAS = 1.959963984540054
_WAYS = {"begins": "jump", "jumps": "jump", "grows": "trend"}
_HALL = "hall"


def compared(truth: Plain, said: Plain) -> Marks:
    """Judge a comparison of two campaigns.

    Parameters
    ----------
    truth
        As in :mod:`thermal_robot.blind.cases`.
    said
        Of the format ``thermal-robot/comparison/1``.
    """
    kept = set(truth["effects"]) <= set(said["verdict"]["effects"])
    right, others = _parted(truth, said["changes"])
    if not truth["changes"]:
        return {"exact": (not others,), "false_alarm": (bool(others),), "listed": (kept,)}
    found = bool(right)
    return {"exact": (found and not others,), "found": (found,), "false_alarm": (bool(others),), "listed": (kept,)}


def followed(truth: Plain, said: Plain) -> Marks:
    """Judge what is said of a robot over time.

    Parameters
    ----------
    truth
        As in :mod:`thermal_robot.blind.cases`.
    said
        Of the format ``thermal-robot/wear/1``.
    """
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
    """Judge the summary of a fleet.

    Parameters
    ----------
    truth
        As in :mod:`thermal_robot.blind.cases`.
    said
        Of the format ``thermal-robot/fleet/1``.
    """
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
    return bool(abs(told["change"] - amount) <= _SIGMAS * told["change_std"])


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
