"""Column names of the format, and suggestions for typing errors."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable

POSITION = ("x", "y", "z")
ORIENTATION = ("qw", "qx", "qy", "qz")
SIMULATED_POSITION = ("sim.x", "sim.y", "sim.z")
SIMULATED_ORIENTATION = ("sim.qw", "sim.qx", "sim.qy", "sim.qz")
POSES = {
    "position": POSITION,
    "orientation": ORIENTATION,
    "simulated_position": SIMULATED_POSITION,
    "simulated_orientation": SIMULATED_ORIENTATION,
}
"""Columns of each part of a pose that a campaign holds."""
LABELS = ("session", "pose", "path")
ENDS = ("socket", "other_socket")  # Labels of the two sockets whose distance a row says
KINDS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "position": (POSITION, ()),
    "pose": ((*POSITION, *ORIENTATION), ()),
    "socket": ((), ("stand", "socket")),
    "spacing": (("distance",), ("stand", *ENDS)),
    "plane": ((), ("plane",)),
    "distance": (("distance",), ("anchor",)),
    "pixel": (("u", "v"), ("camera",)),
    "controller": ((*POSITION, *ORIENTATION), ()),
}
"""Columns of each kind of measurement: its figures and its labels."""
TOUCHED = tuple(kind for kind, (figures, _) in KINDS.items() if not figures)
"""Kinds whose rows hold no figure: the robot is led to what they name."""
APART = ("spacing",)
"""Kinds in whose rows no robot is."""
BESIDE = tuple(kind for kind, (figures, _) in KINDS.items() if not {*POSITION} & {*figures} and kind not in APART)
"""Kinds that need no instrument for positions."""
KIND = "kind"  # Column that says which kind each row is
OPTIONAL = {
    "plane": ("height",),
    "pixel": ("board.x", "board.y", "board.z"),
}
"""Figures that rows of a kind may have, 0 where they have none."""
OF_KINDS = tuple(dict.fromkeys(label for _, labels in KINDS.values() for label in labels))
NOISE = "noise"  # Column of the instrument's one sigma of each row
STD = ("std.x", "std.y", "std.z")
OUTSIDE = "outside"
MISSED = "miss.direction"  # Columns that predictions and corrected commands have beside their own
TILT = ("tilt.x", "tilt.y")
CLOCK = ("time", "order")  # Columns that tell when a row was measured; where both are there, the first
PLAIN_COVARIATES = (*CLOCK, "temperature", "payload", "speed", *TILT)
PER_JOINT = ("approach", "velocity", "acceleration", "torque", "encoder")
PER_LINK = ("temperature",)
MEASURED = (*POSITION, *ORIENTATION)
SIMULATED = (*SIMULATED_POSITION, *SIMULATED_ORIENTATION)
RESERVED = (*MEASURED, *SIMULATED, *LABELS, *PLAIN_COVARIATES, NOISE)  # Names that mean the same in every campaign

_LIKE = 0.5
"""Likeness (0..1, by :mod:`difflib`) from which a name is offered for another: half of the letters stand in order. It
decides only what a message proposes, never what is accepted, so it lies below the 0.6 of difflib itself."""


def nearest(name: str, candidates: Iterable[str], count: int = 3, cutoff: float = _LIKE) -> list[str]:
    """Known names most similar to ``name``, best first, case-insensitive."""
    by_lower: dict[str, str] = {}
    for candidate in candidates:
        by_lower.setdefault(candidate.lower(), candidate)
    close = difflib.get_close_matches(name.lower(), by_lower, n=count, cutoff=cutoff)
    return [by_lower[lower] for lower in close]


def did_you_mean(name: str, candidates: Iterable[str], cutoff: float = _LIKE) -> str:
    """Suggestion ``"; did you mean 'elbow_joint'?"``, or empty without a similar name."""
    close = nearest(name, candidates, count=1, cutoff=cutoff)
    return f"; did you mean {close[0]!r}?" if close else ""


def listed(names: Iterable[str], limit: int = 12) -> str:
    """Names in quotes, separated by commas, cut off after ``limit``."""
    quoted = [repr(name) for name in names]
    more = f" and {len(quoted) - limit} more" if len(quoted) > limit else ""
    return ", ".join(quoted[:limit]) + more


def tilted(column: str) -> str | None:
    """Link in a column name ``tilt.<link>.x`` or ``.y``; empty for ``tilt.x`` (the base), ``None`` for other names."""
    found = re.fullmatch(r"tilt\.(?:(.+)\.)?[xy]", column, re.DOTALL)
    return None if found is None else found[1] or ""


def conditions(joints: Iterable[str], links: Iterable[str]) -> dict[str, None]:
    """Condition columns of the format for a robot, in order, as keys of a dict."""
    joints, links = tuple(joints), tuple(links)
    per_joint = (f"{quantity}.{joint}" for quantity in PER_JOINT for joint in joints)
    per_link = (f"{quantity}.{link}" for quantity in PER_LINK for link in links)
    return dict.fromkeys((*PLAIN_COVARIATES, *per_joint, *per_link, *(f"tilt.{k}.{a}" for k in links for a in "xy")))


def target_of(column: str) -> tuple[str, int] | None:
    """Axis and number of a target in a column name such as ``x.1``; ``None`` for other columns."""
    found = re.fullmatch(r"([xyz])\.([1-9][0-9]*)", column)
    return None if found is None else (found[1], int(found[2]))


def axes_of(target: int) -> tuple[str, str, str]:
    """Names of the position columns of a target by its number k: ``x.k``, ``y.k``, ``z.k``."""
    return f"x.{target}", f"y.{target}", f"z.{target}"


def of_kinds() -> set[str]:
    """Return the names of all figure and label columns of all kinds of measurement, and of the column ``kind``."""
    optional = {column for columns in OPTIONAL.values() for column in columns}
    return {KIND} | optional | {column for groups in KINDS.values() for group in groups for column in group}


def reading_scale(column: str, length: float) -> float:
    """Return the SI factor of a measured column: ``length`` (m per unit) for lengths, 1 for quaternions and pixels."""
    return 1.0 if column in (*ORIENTATION, *KINDS["pixel"][0]) else length


def split_name(column: str) -> tuple[str, str]:
    """Split a column name such as ``approach.elbow_joint`` at the dot into quantity and place (empty without a dot)."""
    quantity, _, place = column.partition(".")
    return quantity, place
