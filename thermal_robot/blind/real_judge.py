"""Whether the diagnosis of a changed real campaign is right: the rules stand in :mod:`thermal_robot.blind.real`."""

from __future__ import annotations

from typing import Any

Record = dict[str, Any]

WORSE = 1.1  # an absorbed cause may leave so many times what the control leaves
SIZE = 0.3  # relative error of a lost motion
CLAIM = (0.5, 1.25)  # rms reached over rms claimed


def judged(fault: str, record: Record, control: Record | None, remainder: float) -> tuple[bool, str]:
    """Return whether the answer is right, and the answer in short words.

    Parameters
    ----------
    fault
        What was asked.
    record, control
        As for :meth:`thermal_robot.blind.real.RealCase.judge`.
    remainder
        What a full geometry leaves of the campaign, rms distance, m.
    """
    said = record.get("said")
    if said is None:
        return False, str(record.get("error") or "no diagnosis")
    named = " ".join(said["verdict"]["effects"]) or "no effect"
    after = (record.get("fresh") or {}).get("rms_after")
    if fault == "backlash":
        right, more = _backlash(said, record["truth"])
    elif fault == "slip":
        right, more = _unexplained(said, record["truth"], "joint")
    elif fault == "hidden":
        right, more = _unexplained(said, record["truth"], "")
        asks = _finding(said, "thermal_elongation")
        right = right and asks.get("status") == "not_testable" and "temperature" in asks.get("needs", ())
        more += f"; thermal_elongation {asks.get('status', 'is no candidate')}"
    elif fault == "temperature":
        right, more = _names(said, "thermal_elongation"), ""
    elif after is None:
        right, more = False, "nothing predicted"
    elif fault == "later":
        claimed = said["gap"]["held_out"]["rms_after"]
        right = CLAIM[0] <= after / claimed <= CLAIM[1]
        more = f"claims {1e3 * claimed:.3f} mm, reaches {1e3 * after:.3f} mm"
    elif fault == "nothing":
        right = _names(said, "geometric") and after <= WORSE * remainder
        more = f"leaves {1e3 * after:.3f} mm, README {1e3 * remainder:.3f} mm"
    else:
        before = ((control or {}).get("fresh") or {}).get("rms_after")
        cause = {"offset": "joint_offset", "scale": "instrument_scale"}[fault]
        covered = _names(said, "geometric") or _names(said, cause)
        right = covered and before is not None and after < WORSE * before
        than = "no control" if before is None else f"control {1e3 * before:.3f} mm"
        more = f"leaves {1e3 * after:.3f} mm, {than}"
    return bool(right), f"{named}; {more}" if more else named


def _finding(said: Record, effect: str) -> Record:
    found: list[Record] = [e for e in said["effects"] if e["name"] == effect]
    return found[0] if found else {}


def _names(said: Record, effect: str) -> bool:
    return effect in said["verdict"]["effects"] and _finding(said, effect).get("status") == "found"


def _backlash(said: Record, truth: Record) -> tuple[bool, str]:
    part = truth["parts"]["backlash"]
    joint, size = part["places"][0]["name"], part["size"]
    found = _finding(said, "backlash")
    first = found["locations"][0]["name"] if found.get("locations") else "nowhere"
    values = [p["value"] for p in found.get("parameters", ()) if p["name"] == f"lost motion, {joint}"]
    value = values[0] if values and values[0] is not None else 0.0
    right = _names(said, "backlash") and first == joint and abs(value - size) <= SIZE * size
    return right, f"backlash first at {first}, {1e3 * value:.2g} mrad at {joint}"


def _unexplained(said: Record, truth: Record, kind: str) -> tuple[bool, str]:
    """Tell whether it is flagged, with one of the truth's quantities and, where a kind of place is given, places."""
    left = said["unexplained"]
    places = {(p["kind"], p["name"]) for p in truth["places"]}
    first = left["locations"][:1], [d["covariate"] for d in left["depends_on"][:1]]
    laws = [(e["locations"][:1], [e.get("quantity")]) for e in said["effects"] if e["name"].startswith("discovered.")]

    def holds(where: list[Record], quantity: list[Any]) -> bool:
        there = not kind or any((p["kind"], p["name"]) in places for p in where)
        return there and any(q in truth["quantities"] for q in quantity)

    flagged = bool(said["verdict"]["unexplained"])
    hit = [law for law in (*laws, first) if holds(*law)]
    where, quantity = hit[0] if hit else first
    shown = f"{where[0]['name'] if where else 'nowhere'}, {quantity[0] if quantity else 'nothing'}"
    return flagged and bool(hit), f"{'unexplained' if flagged else 'not flagged'}: {shown}"
