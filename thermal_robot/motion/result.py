"""The result of a diagnosis of motions: one frozen value, its tables and its JSON."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.diagnosis.result import SCHEMA, estimate_table
from thermal_robot.diagnosis.values import Finding, HeldOut, Unexplained, jsonable
from thermal_robot.files import write_text
from thermal_robot.motion.log import MotionLog

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class JointGap:
    """Rms of one joint's gap, rad (m of a prismatic joint): as it was, fitted, and in motions held out; its noise."""

    before: float
    after: float
    held_out: float
    noise: float


@dataclass(frozen=True, eq=False, repr=False)
class MotionDiagnosis:
    """Which effects make the joints not do what the model says, how sure, and how far the gap shrinks.

    The model is the joint that follows its command at once, or the position servo whose gain the log states.

    Attributes
    ----------
    log
        What was diagnosed; ``log.joints`` are those that were usable.
    joints
        Gap of each joint, by name.
    held_out
        Cross-validation by motion: rms over all joints, rad, simulated from the command alone.
    effects
        A finding for every effect, the largest share first; ``locations`` are joints.
    verdict, probability, summary, advice, warnings
        Names of the effects that are told; posterior probability of exactly these; the verdict and what to record next
        in a sentence each; what a reader should know about the log.
    unexplained
        What the effects leave, and what it follows.
    refused
        Kinds of motion of which no verdict is given, with their rms over that of the others.
    faults
        Sentences about the log's own faults.
    values
        By effect and joint (``""`` for all joints) the value that was fitted, SI.
    curves
        By joint: time, command, measured and simulated position, before and after, and number of the motion.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> found = tr.diagnose(tr.read_motion("motion.toml"))  # doctest: +SKIP
    >>> found.verdict  # doctest: +SKIP
    ('lag', 'coulomb')
    """

    log: MotionLog
    joints: Mapping[str, JointGap]
    held_out: HeldOut
    effects: tuple[Finding, ...]
    verdict: tuple[str, ...]
    probability: float
    unexplained: Unexplained
    values: Mapping[tuple[str, str], float]
    curves: Mapping[str, pd.DataFrame]
    refused: Mapping[str, float] = field(default_factory=dict)
    faults: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    summary: str = ""
    advice: str = ""
    shares: Mapping[str, float] = field(default_factory=dict)

    @property
    def rms_before(self) -> float:
        """Root mean square of the gap over all joints and readings, rad."""
        return _rms([one.before for one in self.joints.values()])

    @property
    def rms_after(self) -> float:
        """The same once the effects are at work."""
        return _rms([one.after for one in self.joints.values()])

    def finding(self, effect: str) -> Finding:
        """Return the finding of one effect; :class:`KeyError` where there is none of that name."""
        return {one.name: one for one in self.effects}[effect]

    @property
    def parameters(self) -> pd.DataFrame:
        """Parameters of all effects that are told, SI: see :func:`~thermal_robot.diagnosis.result.estimate_table`."""
        table = estimate_table((one.name, estimate) for one in self.effects for estimate in one.parameters)
        table.insert(0, "status", [one.status for one in self.effects for _ in one.parameters])
        return table

    @property
    def gaps(self) -> pd.DataFrame:
        """Rms of each joint's gap, rad: index joint; columns ``before``, ``after``, ``held_out``, ``noise``."""
        import pandas as pd

        return pd.DataFrame({name: asdict(one) for name, one in self.joints.items()}).T.rename_axis("joint")

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON object of the format ``thermal-robot/diagnosis/2``, which measures ``motion``."""
        left = self.unexplained
        return dict(
            jsonable(
                {
                    "schema": SCHEMA,
                    "campaign": {
                        "name": self.log.name,
                        "robot": self.log.robot.name,
                        "tool_frame": self.log.robot.tool_frame,
                        "samples": sum(len(m.position.time) for m in self.log.motions),
                        "motions": len(self.log.motions),
                        "measures": "motion",
                        "outliers": [],
                        "faults": self.faults,
                        "warnings": self.warnings,
                    },
                    "gap": {
                        "rms_before": self.rms_before,
                        "rms_after": self.rms_after,
                        "noise_floor": _rms([one.noise for one in self.joints.values()]),
                        "noise_source": "scatter",
                        "orientation": None,
                        "held_out": asdict(self.held_out),
                        "joints": {name: asdict(one) for name, one in self.joints.items()},
                    },
                    "verdict": {
                        "usable": bool(self.joints),
                        "reason": "" if self.joints else self.summary,
                        "effects": self.verdict,
                        "probability": self.probability,
                        "unexplained": left.flagged,
                        "left_out": self.left_out,
                        "no_verdict": self.refused,
                        "summary": self.summary,
                    },
                    "effects": [asdict(one) for one in self.effects],
                    "where": {"axes": {}, "joints": self.shares, "links": {}, "covariates": {}},
                    "unexplained": {
                        "rms": left.rms,
                        "p_value": left.p_value,
                        "reasons": left.reasons,
                        "locations": [{"kind": p.kind, "name": p.name, "probability": p.share} for p in left.locations],
                        "depends_on": [asdict(one) for one in left.depends_on],
                    },
                    "next": {"separates": [], "advice": self.advice, "samples": []},
                }
            )
        )

    def to_json(self, path: str | Path) -> None:
        """Write :meth:`to_dict` to a file, which appears whole or not at all."""
        write_text(path, json.dumps(self.to_dict(), indent=2, ensure_ascii=False) + "\n")

    def __repr__(self) -> str:
        return f"MotionDiagnosis({self.log.name!r}: {', '.join(self.verdict) or 'no effect'})"


def _rms(values: list[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values)))) if values else 0.0


def rms(values: Array) -> float:
    """Root mean square; zero of nothing."""
    return float(np.sqrt(np.mean(np.square(values)))) if len(values) else 0.0
