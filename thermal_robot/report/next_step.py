"""What to measure or to record next, in one sentence; no word where nothing is needed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from thermal_robot.report import units
from thermal_robot.report.sentence import headline, listed

if TYPE_CHECKING:
    from thermal_robot.diagnosis.parts import Wanted
    from thermal_robot.diagnosis.result import Diagnosis

_UNTESTED = 2  # effects that are named with the column that they need


def advice(diagnosis: Diagnosis) -> str:
    """Return what to do or to measure next in one sentence; empty where nothing is needed."""
    wanted = diagnosis.wanted
    if diagnosis.misfit is not None:
        fault, model = diagnosis.misfit.fault, diagnosis.misfit.model
        first = f"{fault.remedy[:1].upper()}{fault.remedy[1:]}" if fault else "Mend the table"
        if fault and fault.what not in headline(diagnosis):
            first = f"All of these do the same: {fault.what}. {first}"
        if model is not None and model.in_another_unit:
            first = "Write the lengths of the URDF in m"
        elif model is not None:
            first = f"Take the URDF of the robot that was measured{f', such as {model.fits}' if model.fits else ''}"
        return f"{first}; then diagnose again."
    if wanted is None:
        return ""
    told = _told(diagnosis, wanted)
    if wanted.kind == "frame":
        declared = f" ({wanted.name})" if wanted.name else ""
        return f"A frame measured on its own, and declared known{declared}, would {told}."
    if wanted.kind == "range":
        return f"More poses over the whole range of every joint would {told}."
    if wanted.kind == "pose":
        return f"The pose that would best {told}: {_pose(diagnosis, wanted)}."
    if wanted.kind == "repeats" and wanted.apart:
        return f"Repeat some poses, and label them in a column {wanted.name}: this would {told}."
    if wanted.kind == "repeats":
        return "Repeat a few poses in another order and on another day: this shows how much of the remainder repeats."
    if wanted.apart:
        return f"Repeat some poses with another load, and record {wanted.name}: this would {told}."
    return f"Record {wanted.name}: {_left(wanted)}, and {_then(diagnosis, wanted)}."


def _told(diagnosis: Diagnosis, wanted: Wanted) -> str:
    names = _titles(diagnosis, wanted.apart[:2])
    if len(names) == 1:
        return f"show whether to believe in {names[0]}"
    return f"tell {' from '.join(names)}" if names else "tell the leading explanations apart"


def _left(wanted: Wanted) -> str:
    own = wanted.follows and wanted.place.endswith(wanted.follows)
    enters = f" enters at {wanted.place}" if wanted.place else ""
    follows = f" follows {'its position' if own else wanted.follows}" if wanted.follows else ""
    return "a remainder" + (" and".join(part for part in (enters, follows) if part) or " is unexplained")


def _then(diagnosis: Diagnosis, wanted: Wanted) -> str:
    if wanted.whether:
        return f"this would show whether {wanted.whether} causes it"
    untested = _titles(diagnosis, wanted.untested[:_UNTESTED])
    if len(wanted.untested) > _UNTESTED:
        untested.append(f"{len(wanted.untested) - _UNTESTED} more")
    return f"{listed(untested)} could not be tested" if untested else "this may be what it follows"


def _titles(diagnosis: Diagnosis, names: Sequence[str]) -> list[str]:
    return [diagnosis.title(name) for name in names]


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
    return ", ".join(f"{name} {value}" for name, value in said.items()).replace("-", "−")
