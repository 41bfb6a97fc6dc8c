"""The result of a diagnosis of motions: one frozen value, its tables and its JSON."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.diagnosis.result import SCHEMA, estimate_table
from thermal_robot.diagnosis.values import Estimate, Finding, HeldOut, Unexplained, jsonable
from thermal_robot.motion import settings
from thermal_robot.motion.effects import EFFECTS, TORQUE_EFFECTS, physical
from thermal_robot.motion.log import MotionLog, joint_kinds
from thermal_robot.renderer import RenderedPage, registered_renderer

if TYPE_CHECKING:
    import pandas as pd


def with_summary(diagnosis: MotionDiagnosis) -> MotionDiagnosis:
    """Return the diagnosis with its summary and advice."""
    renderer = registered_renderer()
    return replace(diagnosis, summary=renderer.motion_headline(diagnosis), advice=renderer.motion_advice(diagnosis))


@dataclass(frozen=True)
class JointGap:
    """Rms of one joint's gap, rad or m: without effects, with them fitted, in motions held out; encoder noise."""

    before: float
    after: float
    held_out: float
    noise: float


@dataclass(frozen=True, eq=False, repr=False)
class MotionDiagnosis(RenderedPage):
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
        By effect and joint the value that was fitted, SI; of all joints by ``""`` or, of the links' masses, by the name
        that the parameter has in the finding; of a simulator that made the log also its step and its friction's creep.
    curves
        By joint: time, command, measured and simulated position, before and after, load and number of the motion.
    shares
        Of the gap's mean square that goes away, by joint.
    unit
        SI unit of the gap of a joint that turns: rad, or N·m where torques were recorded.
    moves
        By effect and joint, rms by which it alone moves what is simulated.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> found = tr.diagnose(tr.read_motion("motion.toml"))  # doctest: +SKIP
    >>> found.verdict  # doctest: +SKIP
    ('lag', 'coulomb')
    """

    _kind: ClassVar[str] = "motion_"
    _figure: ClassVar[str] = "plot_motions"

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
    unit: str = "rad"
    moves: Mapping[tuple[str, str], float] = field(default_factory=dict)

    @property
    def usable(self) -> bool:
        """Whether any joint of the log could be diagnosed."""
        return bool(self.joints)

    @property
    def few(self) -> bool:
        """Whether there are fewer motions than count as independent (8), so that standard errors are unreliable."""
        return len(self.log.motions) < settings.CLUSTERS

    @property
    def narrowed(self) -> bool:
        """Whether effects were left out by request."""
        return bool(self.left_out)

    @property
    def stated(self) -> bool:
        """Whether the log states the stiffness of any servo, so that the model is a servo and not the command."""
        return any(servo.kp for servo in self.log.servos.values())

    def unit_of(self, joint: str) -> str:
        """Return the SI unit of a joint's gap."""
        slides = joint_kinds(self.log.robot).get(joint) == "prismatic"
        return {"rad": "m", "N·m": "N"}[self.unit] if slides else self.unit

    def title(self, effect: str, joint: str = "") -> str:
        """Return an effect's name in plain words; of one joint where one is named."""
        if joint:
            single = {one.name: one.singular for one in (*EFFECTS, *TORQUE_EFFECTS)}.get(effect) or self.title(effect)
            return f"{single} in {joint}"
        own = next((one.title for one in self.effects if one.name == effect), "")
        return own or effect.replace("_", " ")

    def visible(self, effect: str) -> tuple[str, ...]:
        """Return joints that an effect moves, rms, by at least twice the noise and the tolerance of the log."""
        least = {name: self.log.visible_from(name, one.noise) for name, one in self.joints.items()}
        return tuple(name for name, size in least.items() if self.moves.get((effect, name), 0.0) >= size)

    @property
    def shown(self) -> tuple[Finding, ...]:
        """Findings of the verdict that visibly move any joint, the largest share first."""
        return tuple(one for one in map(self.finding, self.verdict) if self.visible(one.name))

    @property
    def separates(self) -> tuple[tuple[str, ...], ...]:
        """Groups of effects that these data cannot tell apart, each in the order of the findings."""
        found: list[set[str]] = []
        for one in self.shown:
            if one.confounded_with:
                group = {one.name, *one.confounded_with}
                joined = [other for other in found if other & group]
                found = [*(other for other in found if not other & group), group.union(*joined)]
        order = [one.name for one in self.effects]
        return tuple(tuple(name for name in order if name in group) for group in found)

    def physical(self, effect: str) -> tuple[Estimate, ...]:
        """Return the parameters of an effect in the joints where it is visible, as a data sheet gives them, SI.

        Friction and limits in N·m and inertias in kg·m² where the servo's stiffness is known, else over it.
        """
        seen, found = self.visible(effect), []
        for estimate in self.finding(effect).parameters:
            joint = self.joint_of(estimate)
            if joint in seen or (seen and not joint):
                commanded = self.curves[joint]["command"] if joint in self.curves else ()
                found.append(physical(effect, estimate, self.log.servo(joint), np.asarray(commanded)))
        return tuple(found)

    def joint_of(self, estimate: Estimate) -> str:
        """Return the joint of a parameter; empty where all joints share it."""
        joint = estimate.name.rpartition(", ")[2]
        return joint if joint in self.log.joints else ""

    @property
    def rms_before(self) -> float:
        """Root mean square of the joints' rms gaps, each joint weighing one, in ``unit``."""
        return rms([one.before for one in self.joints.values()])

    @property
    def rms_after(self) -> float:
        """Root mean square of the joints' rms gaps with the effects fitted, each weighing one, in ``unit``."""
        return rms([one.after for one in self.joints.values()])

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
    def residuals(self) -> pd.DataFrame:
        """Gap and remainder of every reading, rad (m of a prismatic joint).

        Index ``joint``, ``motion`` (number of it, from 0) and ``time``, s; columns ``gap``, measured less what the
        model says, and ``remainder``, measured less what it says with the effects at work.
        """
        import pandas as pd

        if not self.curves:
            return pd.DataFrame(columns=["gap", "remainder"])
        whole = pd.concat(dict(self.curves), names=["joint"]).set_index(["motion", "time"], append=True).droplevel(1)
        return pd.DataFrame(
            {"gap": whole["measured"] - whole["nominal"], "remainder": whole["measured"] - whole["simulated"]}
        )

    @property
    def gaps(self) -> pd.DataFrame:
        """Rms of each joint's gap, rad: index joint; columns ``before``, ``after``, ``held_out``, ``noise``."""
        import pandas as pd

        return pd.DataFrame({name: asdict(one) for name, one in self.joints.items()}).T.rename_axis("joint")

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON object of the format ``thermal-robot/diagnosis/2``, which measures ``motion``."""
        plain = {
            "schema": SCHEMA,
            "campaign": self._campaign(),
            "gap": self._gap(),
            "verdict": {
                "usable": self.usable,
                "reason": "" if self.usable else self.summary,
                "effects": self.verdict,
                "probability": self.probability,
                "unexplained": self.unexplained.flagged,
                "left_out": self.left_out,
                "no_verdict": self.refused,
                "summary": self.summary,
            },
            "effects": [asdict(one) for one in self.effects],
            "where": {"axes": {}, "joints": self.shares, "links": {}, "covariates": {}},
            "unexplained": self._left(),
            "next": {"separates": self.separates, "advice": self.advice, "samples": []},
        }
        return dict(jsonable(plain))

    def _campaign(self) -> dict[str, Any]:
        log, samples = self.log, sum(len(motion.position.time) for motion in self.log.motions)
        plain = {"name": log.name, "robot": log.robot.name, "tool_frame": log.robot.tool_frame, "samples": samples}
        plain |= {"motions": len(log.motions), "measures": "motion", "outliers": []}
        return {**plain, "faults": self.faults, "warnings": self.warnings}

    def _gap(self) -> dict[str, Any]:
        return {
            "rms_before": self.rms_before,
            "rms_after": self.rms_after,
            "noise_floor": rms([one.noise for one in self.joints.values()]),
            "noise_source": "scatter",
            "orientation": None,
            "held_out": asdict(self.held_out),
            "joints": {name: asdict(one) for name, one in self.joints.items()},
        }

    def _left(self) -> dict[str, Any]:
        left = self.unexplained
        places = [{"kind": one.kind, "name": one.name, "probability": one.share} for one in left.locations]
        told = {"rms": left.rms, "p_value": left.p_value, "reasons": left.reasons, "locations": places}
        return {**told, "depends_on": [asdict(one) for one in left.depends_on]}

    def __repr__(self) -> str:
        return f"MotionDiagnosis({self.log.name!r}: {', '.join(self.verdict) or 'no effect'})"


def rms(values: Array | Sequence[float]) -> float:
    """Return the root mean square of values; 0 if there are none."""
    return float(np.sqrt(np.mean(np.square(values)))) if len(values) else 0.0
