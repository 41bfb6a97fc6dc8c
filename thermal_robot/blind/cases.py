"""What the trial asks: cases, and the records that it keeps of them.

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
        "outliers": [17, 80]},
     "said": {diagnosis JSON of formats.md} | null,
     "fresh": {"rms_before": 1.2e-4, "rms_after": 2.0e-6,   rms distance on noise-free fresh samples, m: frames alone,
                                       and the corrected model
               "shares": {"drift": 0.9}} | null,            of each effect in the model, on the same samples
     "seconds": 0.4, "error": null | "the diagnosis failed: ..."}
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Kind = Literal[
    "single",
    "large",
    "visits",
    "lags",
    "pair",
    "many",
    "null",
    "hard",
    "mixed",
    "removed",
    "hidden",
    "unlisted",
    "both",
    "real",
]


@dataclass(frozen=True)
class RobotChoice:
    """A robot of the trial.

    Attributes
    ----------
    name
        As shown.
    urdf
        A path, ``builtin:<name>`` or ``example-robot-data:<name>``.
    tool_frame
        Link that carries the target.
    """

    name: str
    urdf: str
    tool_frame: str


@dataclass(frozen=True)
class Case:
    """One robot with its hidden fault.

    Attributes
    ----------
    id
        Name of its folder: tells nothing.
    seed
        Everything else that is drawn follows from it.
    kind
        What is asked.
    robot
        Whose fault it is.
    effects
        Those really at work and large.
    unlisted
        Name of a cause that no library knows, or ``None``.
    without
        Effects taken out of the library before the diagnosis.
    hidden
        Columns (``temperature`` stands for ``temperature.<link>`` too) taken out of the table.
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
