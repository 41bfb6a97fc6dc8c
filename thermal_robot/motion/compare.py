"""Wald tests of equal servo parameters in two logs of one robot: what changed between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from scipy.special import erfc

from thermal_robot.diagnosis.values import Estimate, jsonable
from thermal_robot.errors import CampaignError
from thermal_robot.motion import settings
from thermal_robot.motion.result import MotionDiagnosis
from thermal_robot.renderer import Rendered, registered_renderer

if TYPE_CHECKING:
    import pandas as pd

SCHEMA = "thermal-robot/motion-comparison/1"


@dataclass(frozen=True)
class Compared:
    """One parameter of one joint in both logs, as a data sheet gives it.

    Attributes
    ----------
    effect, title, joint, name, unit
        What it is; the joint is empty where all share it.
    values, stds
        Per log; ``None`` where its diagnosis does not tell the effect there.
    difference, std, z
        Second less first, its standard deviation, and the first over the second; ``None`` unless both tell it.
    p_value
        Two-sided probability of a difference as large by chance, not corrected for the other parameters.
    """

    effect: str
    title: str
    joint: str
    name: str
    unit: str
    values: tuple[float | None, float | None]
    stds: tuple[float | None, float | None]
    difference: float | None = None
    std: float | None = None
    z: float | None = None
    p_value: float | None = None

    @property
    def changed(self) -> bool:
        """Whether the difference is beyond three of its standard deviations."""
        return self.z is not None and abs(self.z) > settings.CLEAR


@dataclass(frozen=True, eq=False, repr=False)
class MotionComparison(Rendered):
    """What changed between two logs of one robot's motion.

    Attributes
    ----------
    logs
        Names of the two, the earlier one first.
    parameters
        Every effect that either tells, joint by joint, the surest change first.
    robot
        Which robot.
    weak
        Whether either has too few motions for its ± to be relied on.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> found = tr.compare("last_week/motion.toml", "today/motion.toml")  # doctest: +SKIP
    >>> [(one.effect, one.joint, one.z) for one in found.changes]  # doctest: +SKIP
    [('coulomb', 'elbow', 6.1)]
    """

    _kind: ClassVar[str] = "motion_comparison_"

    logs: tuple[str, str]
    parameters: tuple[Compared, ...]
    robot: str = ""
    weak: bool = False

    @property
    def changes(self) -> tuple[Compared, ...]:
        """Parameters that changed, the surest first."""
        return tuple(one for one in self.parameters if one.changed)

    @property
    def summary(self) -> str:
        """What changed in one plain sentence."""
        return str(registered_renderer().motion_comparison_headline(self))

    @property
    def table(self) -> pd.DataFrame:
        """All parameters as a table, index effect and joint."""
        import pandas as pd

        rows = [
            {"effect": one.effect, "joint": one.joint, "parameter": one.name, "unit": one.unit,
             **{f"{part} of {log}": values[k] for k, log in enumerate(self.logs)
                for part, values in (("value", one.values), ("std", one.stds))},
             "difference": one.difference, "std": one.std, "z": one.z, "p_value": one.p_value}
            for one in self.parameters
        ]  # fmt: skip
        return pd.DataFrame(rows, columns=None if rows else ["effect", "joint"]).set_index(["effect", "joint"])

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON object of the format ``thermal-robot/motion-comparison/1``."""
        told = [{**asdict(one), "changed": one.changed} for one in self.parameters]
        plain = {"schema": SCHEMA, "robot": self.robot, "logs": self.logs, "weak": self.weak, "parameters": told}
        return dict(jsonable({**plain, "summary": self.summary}))

    def __repr__(self) -> str:
        changed = ", ".join(dict.fromkeys(one.effect for one in self.changes)) or "nothing"
        return f"MotionComparison({', '.join(self.logs)}: {changed} changed)"


def compare_motions(first: MotionDiagnosis, second: MotionDiagnosis, names: Sequence[str] = ()) -> MotionComparison:
    """Wald test of equality of each servo parameter in two diagnoses of one robot; none where only one tells it.

    Parameters
    ----------
    first, second
        The earlier and the later one.
    names
        What they are called; by default their logs' names.

    Raises
    ------
    CampaignError
        If the logs have no joint in common.
    """
    if not set(first.log.joints) & set(second.log.joints):
        found = f"{', '.join(first.log.joints)}; {', '.join(second.log.joints)}"
        raise CampaignError("compare()", "the logs have no joint in common", found=found, expected="one robot")
    own = (first.log.name or "first", second.log.name or "second")
    called = tuple(names) or (own if own[0] != own[1] else (f"{own[0]} (1)", f"{own[1]} (2)"))
    told: list[dict[tuple[str, str, str, str], Estimate]] = [
        {(told.name, one.name, one.unit, d.joint_of(one)): one for told in d.shown for one in d.physical(told.name)}
        for d in (first, second)
    ]
    keys = dict.fromkeys(key for one in told for key in one)
    parameters = [_compared(key, [one.get(key) for one in told], (first, second)) for key in keys]
    parameters.sort(key=lambda one: -abs(one.z or 0.0))
    return MotionComparison((called[0], called[1]), tuple(parameters), first.log.robot.name, first.few or second.few)


def _compared(
    key: tuple[str, str, str, str], pair: list[Estimate | None], both: tuple[MotionDiagnosis, MotionDiagnosis]
) -> Compared:
    """Return difference, standard error, z and two-sided p-value of a parameter ``key``: effect, name, unit, joint."""
    effect, name, unit, joint = key
    (before, std_before), (after, std_after) = ((one.value, one.std) if one else (None, None) for one in pair)
    title = (both[0] if pair[0] else both[1]).title(effect, joint)
    known = Compared(effect, title, joint, name, unit, (before, after), (std_before, std_after))
    if before is None or after is None or std_before is None or std_after is None:
        return known
    difference, std = after - before, float(np.hypot(std_before, std_after))
    z = difference / std if std > 0.0 else 0.0
    return replace(known, difference=difference, std=std, z=z, p_value=float(erfc(abs(z) / np.sqrt(2.0))))
