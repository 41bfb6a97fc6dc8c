"""Cases of the trial, and the records of their results.

A **record** is what is known of one case after its seal was opened, as plain JSON (lengths m, angles rad)::

    {"id": "c017", "kind": "single", "robot": "ur10", "samples": 120, "measures": "position" | "pose",
     "noise": 2.5e-5,                  one sigma per axis, m
     "without": ["backlash"],          effects taken out of the library
     "hidden": ["temperature"],        columns taken out of the table
     "truth": {
        "effects": ["drift"],          what is really at work and large, by name; [] for none, or unlisted only
        "unlisted": "cable_pull" | null,   a cause that no library knows
        "parts": {"drift": {"ratio": 3.1, "main": true, "places": [{"kind": "joint", "name": "elbow_joint"}]}, ...},
                                       ratio: what it leaves after the best rigid alignment, rms per axis over noise;
                                       places: where it sits, most first, where few places are at fault
        "parameters": {"drift": {"translation x, base": 2e-4}},
                                       true values by effect and by the diagnosis's name of the parameter, SI
        "places": [{"kind": "joint", "name": ...}], "quantities": ["time", "order"],
                                       any of these is a right answer for what is unlisted, removed or hidden;
                                       quantity "none": it follows nothing that is recorded
        "near": [{"kind": "joint", "name": ...}],    these places and those beside them
        "needs": ["temperature"],      columns that the diagnosis should ask for (hidden condition)
        "outliers": [17, 80],
        "campaigns": 12,               of several campaigns: how many;
        "changes": [{"effect": "backlash", "place": {"kind": "joint", "name": ...}, "parameter": "lost motion, ...",
                     "how": "grows", "after": 4 | null, "amount": 2e-4, "deviations": 9.1}],
                                       what changes between them, SI; "after": number of the last one before, from 0;
        "shared": [{"effect": ..., "place": {...}, "parameter": ..., "group": "hall 1" | null}],
                                       what robots have in common, all of them or those of one hall;
        "own": [{"robot": "r03", "effect": ..., "place": {...}, "parameter": ...}]},   and what one robot has alone
     "said": {diagnosis JSON of formats.md; of several: of a comparison, of wear, of a fleet} | null,
     "fresh": {"rms_before": 1.2e-4, "rms_after": 2.0e-6,   rms distance on noise-free fresh samples, m: frames alone,
                                       and the corrected model
               "shares": {"drift": 0.9}} | null,            of each effect in the model, on the same samples
     "seconds": 0.4, "error": null | "the diagnosis failed: ..."}
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Known = Literal["single", "large", "visits", "lags", "pair", "many", "null", "hard"]
"""Kinds of which all causes are in the library."""
Together = Literal["same", "changed", "steady", "series", "fleet"]
"""Kinds of several campaigns."""
Kind = Literal[Known, "mixed", "removed", "hidden", "unlisted", "both", "real", Together]
How = Literal["", "changes", "begins", "jumps", "grows", "all", "hall"]
"""Kinds of change between campaigns of one robot; sharing of a fault among the robots of a fleet."""

ASKS = {"same": "comparison", "changed": "comparison", "steady": "wear", "series": "wear", "fleet": "fleet"}
"""Type of answer requested for each kind of several campaigns: the request says no more."""
SEVERAL = tuple(ASKS)
CONDITION = {
    "thermal_elongation": ("temperature",),
    "drift": ("time",),
    "backlash": ("approach",),
    "tracking_lag": ("velocity", "acceleration", "approach"),
}
"""Columns without which an effect is not observable; the diagnosis should ask for the first."""
LISTED = "campaigns.csv"
"""The list of several campaigns in a case's folder: ``campaign``, and ``date`` or ``robot`` and ``hall``."""


@dataclass(frozen=True)
class RobotChoice:
    """Robot of the trial: its name, URDF (text, path or ``builtin:<name>`` ...) and link that carries the target."""

    name: str
    urdf: str
    tool_frame: str


@dataclass(frozen=True)
class Several:
    """What a case of several campaigns adds: their number, what changes between them or is shared, and by how much.

    Attributes
    ----------
    campaigns
        How many: drawn between the two.
    how, moves
        Kind of change or of sharing, and the effect of which one parameter changes or is shared; both may be empty.
    change
        Size of a change over the parameter's standard deviation: of the difference between two campaigns for
        ``changes``, of one campaign else; drawn between the two, evenly in its logarithm.
    apart
        Effects of a fleet that one robot has, each another one.
    """

    campaigns: tuple[int, int]
    how: How = ""
    moves: str = ""
    change: tuple[float, float] = (4.0, 4.0)
    apart: tuple[str, ...] = ()


@dataclass(frozen=True)
class Case:
    """Specification of one test case: robot, hidden faults and their size, what is withheld, and the seed of the rest.

    Attributes
    ----------
    id, seed
        Name of its folder, which gives nothing away; everything else that is drawn follows from the seed.
    kind, robot
        Kind of case, and the robot that has the fault.
    effects, unlisted
        Effects at work that are to be found, and the name of a cause that no library knows, or ``None``.
    without, hidden
        Effects taken out of the library, and columns out of the table (``temperature`` stands for each link's, too).
    ratio
        Size of each effect: rms per axis after rigid alignment over the noise per axis, drawn between the two,
        evenly in its logarithm.
    samples
        Number of rows, drawn between the two.
    background
        Ratio at which every other effect is present, 0 for none.
    wants
        What the campaign must be like, beside what its faults want: ``repeats``, ``moving``, ``sensor:air`` ...
    heavy
        Whether the noise has Student's law, with 3 to 8 degrees of freedom.
    own
        ``file.py:NAME`` of a fault of the user's own; its name is the unlisted cause, or the only effect.
    several
        For the kinds of :data:`SEVERAL`.
    """

    id: str
    seed: int
    kind: Kind
    robot: RobotChoice
    effects: tuple[str, ...] = ()
    unlisted: str | None = None
    without: tuple[str, ...] = ()
    hidden: tuple[str, ...] = ()
    ratio: tuple[float, float] = (2.0, 6.0)
    samples: tuple[int, int] = (75, 140)
    background: float = 0.0
    wants: tuple[str, ...] = ()
    heavy: bool = False
    own: str = ""
    several: Several | None = None
