"""Result of a diagnosis as a frozen dataclass, with its tables and its JSON.

This module knows nothing of reports: the renderer registered in :mod:`thermal_robot.renderer` puts it into words.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from thermal_robot.correction.holding import FORMATS
from thermal_robot.correction.model import CorrectedModel
from thermal_robot.diagnosis.values import (
    Estimate,
    Finding,
    Gap,
    Misfit,
    RobotFile,
    Rows,
    Sensitivity,
    Unexplained,
    Wanted,
    Where,
    is_frame,
    jsonable,
)
from thermal_robot.effects.catalogue import of_effect
from thermal_robot.kinematics import rotation_to_rpy
from thermal_robot.renderer import RenderedPage, registered_renderer

if TYPE_CHECKING:
    import pandas as pd
    from numpy.typing import ArrayLike

    from thermal_robot.campaign import Campaign
    from thermal_robot.diagnosis.next_measurement import NextSamples
    from thermal_robot.diagnosis.updated import Updated
    from thermal_robot.inference.fit import Fit
    from thermal_robot.iso9283.performance import Performance
    from thermal_robot.shapes import Arm

SCHEMA = "thermal-robot/diagnosis/2"


def with_summary(diagnosis: Diagnosis) -> Diagnosis:
    """Diagnosis with its summary and advice in words."""
    renderer = registered_renderer()
    return replace(diagnosis, summary=renderer.headline(diagnosis), advice=renderer.advice(diagnosis))


def estimate_table(estimates: Iterable[tuple[str, Estimate]]) -> pd.DataFrame:
    """Estimates as a data frame with the names of their effects; NaN where a parameter is not identified.

    Index (effect, parameter); columns ``value``, ``std`` (one sigma), ``unit`` and ``identified``.
    """
    import pandas as pd

    told = list(estimates)
    index = pd.MultiIndex.from_tuples([(name, e.name) for name, e in told], names=("effect", "parameter"))
    rows = [(e.value, e.std, e.unit, e.identified) for _, e in told]
    table = pd.DataFrame(rows, index=index, columns=["value", "std", "unit", "identified"])
    return table.astype({"value": float, "std": float, "identified": bool})


def frame_table(model: CorrectedModel) -> pd.DataFrame:
    """Poses of base and target as a data frame, as declared or fitted.

    Index ``base`` (the root frame in the measurement frame) and ``tool`` (the target in the tool frame); columns ``x``
    ``y`` ``z`` in m, and ``roll`` ``pitch`` ``yaw`` in rad, as in a URDF; NaN for a target of which positions alone
    were measured, unless declared: a point has no direction.
    """
    import pandas as pd

    frames = {"base": model.frames.base, "tool": model.frames.tool}
    told = [[*pose[:3, 3], *rotation_to_rpy(pose[:3, :3])] for pose in frames.values()]
    table = pd.DataFrame(told, index=list(frames), columns=["x", "y", "z", "roll", "pitch", "yaw"])
    if model.measures != "pose" and not model.settings.tool_known:
        table.loc["tool", ["roll", "pitch", "yaw"]] = np.nan
    return table


@dataclass(frozen=True, eq=False, repr=False)
class Diagnosis(RenderedPage):
    """Result of a diagnosis: where the gap lies, which effects cause it, how far a correction shrinks it.

    Attributes
    ----------
    campaign, robot, tool_frame, samples, measures, joint_names, reach
        Names of campaign, robot and tool frame, number of rows, kind of measurement; joints, root to tool; diagonal of
        the measured volume, m.
    outliers, left_out
        Row numbers in the file of the measurements set aside; names of the effects left out by request.
    gap, effects, where, unexplained, rows
        The parts of the answer, effects ordered by held-out share, and the same measurement by measurement.
    remaining
        The residual of the whole fit, discovered laws included, while ``unexplained`` is that of the known effects
        alone; ``None`` where the two are the same.
    verdict, probability
        Names of the effects of the fit, largest share first, then of the random effects that were found; posterior
        probability of exactly this explanation.
    separates, wanted
        Groups of effects that further measurements would have to tell apart; the next measurement, ``None`` where
        nothing is needed.
    model, fit, sensitivity
        The corrected model, the fit behind it, and how far the verdict depends on the prior sizes.
    summary, advice, warnings
        The verdict, and what to measure next, in one plain sentence each; what a reader should know about the data.
    misfit
        Why nothing can be said of the robot: robot and table do not belong together; ``None`` where they do.
    performance
        Criteria of ISO 9283, AP before the correction and after it; ``None`` without repeats.
    says
        What its rows say, for a reader.
    about
        What stands on the first page of a report: serial numbers, operator, date.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> found = tr.diagnose(tr.demo_campaign())
    >>> found.verdict, found.usable, found.reason, found.narrowed, found.outliers
    (('thermal_elongation', 'backlash'), True, '', False, (8, 24, 74, 90))
    >>> found.gap.rms_after < found.gap.rms_before
    True
    >>> list(found.parameters.columns)
    ['status', 'value', 'std', 'unit', 'identified']
    >>> found.covariance.shape, found.residuals.shape, found.frames.shape
    ((6, 6), (120, 9), (2, 6))
    >>> found.files  # no robot file holds elongation or lost motion
    ()
    """

    campaign: str
    robot: str
    tool_frame: str
    samples: int
    measures: str
    joint_names: tuple[str, ...]
    outliers: tuple[int, ...]
    gap: Gap
    effects: tuple[Finding, ...]
    where: Where
    unexplained: Unexplained
    verdict: tuple[str, ...]
    probability: float
    separates: tuple[tuple[str, ...], ...]
    model: CorrectedModel
    rows: Rows
    summary: str = ""
    advice: str = ""
    warnings: tuple[str, ...] = field(default=())
    remaining: Unexplained | None = None
    reach: float = float("inf")
    left_out: tuple[str, ...] = ()
    wanted: Wanted | None = None
    sensitivity: Sensitivity | None = None
    fit: Fit | None = None
    misfit: Misfit | None = None
    performance: Performance | None = None
    says: str = ""
    about: Mapping[str, str] = field(default_factory=dict)

    @property
    def usable(self) -> bool:
        """Whether robot and table describe the same motion, so that something can be said of the robot."""
        return self.misfit is None

    @property
    def reason(self) -> str:
        """What is wrong with the table, and the remedy; empty where it is usable."""
        return "" if self.usable else f"{self.summary} {self.advice}"

    def explain(self, effect: str) -> Any:
        """Draw partial residuals of one effect, place by place: with and without it, over the quantity that drives it.

        Returns a :class:`matplotlib.figure.Figure`; raises :class:`EffectError` if the fit does not hold the effect.

        Examples
        --------
        >>> figure = tr.diagnose(tr.demo_campaign()).explain("backlash")
        >>> figure.savefig("backlash.png")
        """
        from thermal_robot.diagnosis.attribution import explained

        return registered_renderer().explain_figure(explained(self._fitted(), effect))

    def next_samples(self, count: int = 10) -> NextSamples:
        """Optimal design: samples that best separate the leading explanations.

        Examples
        --------
        >>> samples = tr.diagnose(tr.demo_campaign()).next_samples(3)
        >>> len(samples.to_table())
        3
        """
        from thermal_robot.diagnosis.next_measurement import next_samples

        return next_samples(self._fitted(), count)

    def update(self, rows: Campaign | pd.DataFrame) -> Updated:
        """Update with new rows of the same robot, in time independent of the number of old rows (docs/update.md).

        Effects, settings and places stay; all else is that of a fresh fit of them to all rows. Rows may be a campaign
        of the same robot and kind, or a table of its columns. :class:`CampaignError` says what does not fit.

        Examples
        --------
        >>> import numpy as np
        >>> campaign, new = tr.demo_campaign(), np.arange(120) % 6 == 0
        >>> tr.diagnose(campaign.take(~new)).update(campaign.take(new))
        Updated('demo': backlash, thermal_elongation; 120 rows; the choice stands)
        """
        from thermal_robot.diagnosis.updated import update

        return update(self, rows)

    def _fitted(self) -> Fit:
        if self.fit is None:
            raise ValueError("this diagnosis was made without its fit")
        return self.fit

    def arm(self, rows: ArrayLike) -> Arm | None:
        """Link poses in some of the :attr:`rows`, with the shares of the arm's places, for a drawing.

        ``rows`` (R,) are positions in :attr:`rows`, from 0 on. ``None`` where nothing is known of places: this
        diagnosis is not usable, or was made without its fit.

        Examples
        --------
        >>> arm = tr.diagnose(tr.demo_campaign()).arm([0, 1])
        >>> arm.poses.shape
        (2, 8, 4, 4)
        """
        from thermal_robot.shapes import arm

        if not self.usable or self.fit is None:
            return None
        return arm(self.model.robot, self.rows.q[np.asarray(rows, dtype=np.int64)], self.where.places)

    @property
    def parameters(self) -> pd.DataFrame:
        """Parameters of all reported effects as a data frame, SI, in the order of the findings.

        ``status`` of the effect and the columns of :func:`~thermal_robot.diagnosis.result.estimate_table`.
        """
        table = estimate_table((finding.name, estimate) for finding in self.effects for estimate in finding.parameters)
        table.insert(0, "status", [finding.status for finding in self.effects for _ in finding.parameters])
        return table

    @property
    def residuals(self) -> pd.DataFrame:
        """Gap and residual as a data frame by ``row``, the row number in the file, in root frame axes.

        Columns ``gap.x`` … and ``remainder.x`` … in m, of poses also ``.rx`` ``.ry`` ``.rz`` in rad, the turn of
        several targets in the axes of their common frame; ``held_out.before`` and ``held_out.after``, distance in m
        when held out (NaN where set aside); ``set_aside``.
        """
        import pandas as pd

        rows = self.rows
        axes = ("x", "y", "z", "rx", "ry", "rz")[: rows.gap.shape[1]]
        pairs = (("gap", rows.gap), ("remainder", rows.remainder))
        columns = {f"{kind}.{axis}": values[:, k] for kind, values in pairs for k, axis in enumerate(axes)}
        held = {"held_out.before": rows.held_out_before, "held_out.after": rows.held_out_after}
        return pd.DataFrame({**columns, **held, "set_aside": rows.outliers}, index=pd.Index(rows.rows, name="row"))

    @property
    def frames(self) -> pd.DataFrame:
        """Base and target as declared or fitted, SI: see :func:`~thermal_robot.diagnosis.result.frame_table`."""
        return frame_table(self.model)

    @property
    def covariance(self) -> pd.DataFrame:
        """Covariance of the identified parameters, SI: see :func:`~thermal_robot.diagnosis.findings.covariance`.

        Its diagonal is the square of ``std`` in :attr:`parameters`. Not in it: zeros that are told inside a larger
        effect, of which they are a part.
        """
        from thermal_robot.diagnosis.findings import covariance

        if self.model.spread is None:
            raise ValueError("this diagnosis was made without the covariance of its parameters")
        return covariance(self._fitted(), self.model.spread.covariance)

    @property
    def files(self) -> tuple[RobotFile, ...]:
        """Expected gap with each kind of robot file alone: :class:`~thermal_robot.diagnosis.values.RobotFile`.

        Empty where no file holds any of the model, or nothing can be held out.
        """
        gaps = self.model.files if self.fit is not None else ()
        names = [tuple(name for name, own in FORMATS.items() if own.holds == gap.holds) for gap in gaps]
        own = zip(names, gaps, strict=True)
        return tuple(RobotFile(**{**vars(gap), "files": some, "alone": bool(gap.alone)}) for some, gap in own)

    @property
    def narrowed(self) -> bool:
        """Whether the user restricted the candidate effects."""
        return bool(self.left_out)

    def finding(self, effect: str) -> Finding:
        """Return the finding of one effect.

        Raises
        ------
        UnknownEffectError
            If it was not a candidate; says which name was probably meant. It is a ``KeyError``, too.

        Examples
        --------
        >>> tr.diagnose(tr.demo_campaign()).finding("backlash").status
        'found'
        """
        return of_effect({f.name: f for f in self.effects}, effect)

    def title(self, effect: str) -> str:
        """Name of an effect in plain words.

        Examples
        --------
        >>> tr.diagnose(tr.demo_campaign()).title("backlash")
        'lost motion in the joints'
        """
        own = next((f.title for f in self.effects if f.name == effect), "")
        return own or effect.replace("_", " ")

    def is_frame(self, effect: str) -> bool:
        """Whether an effect is the displacement of an unknown frame.

        Examples
        --------
        >>> tr.diagnose(tr.demo_campaign()).is_frame("backlash")
        False
        """
        return is_frame(self.effects, effect)

    def to_dict(self) -> dict[str, Any]:
        """JSON object of the format ``thermal-robot/diagnosis/2``.

        Examples
        --------
        >>> list(tr.diagnose(tr.demo_campaign()).to_dict())
        ['schema', 'campaign', 'gap', 'verdict', 'effects', 'where', 'unexplained', 'next']
        """
        left = self.unexplained
        plain: dict[str, Any] = {
            "schema": SCHEMA,
            "campaign": dict(
                name=self.campaign,
                robot=self.robot,
                tool_frame=self.tool_frame,
                samples=self.samples,
                measures=self.measures,
                outliers=self.outliers,
                warnings=self.warnings,
            ),
            "gap": _gap_as_json(self.gap),
            "verdict": {
                "usable": self.usable,
                "reason": self.reason,
                "effects": self.verdict,
                "probability": self.probability,
                "unexplained": left.flagged,
                "left_out": self.left_out,
                "summary": self.summary,
                "if_prior_sizes": None if self.sensitivity is None else asdict(self.sensitivity),
            },
            "effects": [asdict(finding) for finding in self.effects],
            "where": asdict(self.where),
            "unexplained": {
                "rms": left.rms,
                "p_value": left.p_value,
                "reasons": left.reasons,
                "locations": [{"kind": p.kind, "name": p.name, "probability": p.share} for p in left.locations],
                "depends_on": [asdict(d) for d in left.depends_on],
            },
            "next": {"separates": self.separates, "advice": self.advice, "samples": self._samples()},
        }
        if self.files:
            plain["files"] = [asdict(told) for told in self.files]
        if self.performance is not None:
            plain["performance"] = self.performance.to_dict()
        return dict(jsonable(plain))

    def _samples(self) -> list[dict[str, Any]]:
        return [] if self.fit is None or not self.usable else self.next_samples().to_list()

    def __repr__(self) -> str:
        return f"Diagnosis({self.campaign!r}: {', '.join(self.verdict) or 'no effect'})"


def _gap_as_json(gap: Gap) -> dict[str, Any]:
    turned = {"rms_before": gap.orientation_before, "rms_after": gap.orientation_after}
    kinds = {"kinds": [asdict(kind) for kind in gap.kinds]} if gap.kinds else {}
    return {
        **kinds,
        "rms_before": gap.rms_before,
        "rms_after": gap.rms_after,
        "noise_floor": gap.noise_floor,
        "noise_source": gap.noise_source,
        "orientation": None if gap.orientation_before is None else turned,
        "held_out": asdict(gap.held_out),
        "schemes": [asdict(scheme) for scheme in gap.schemes],
        "hardest": None if gap.hardest is None else gap.hardest.name,
    }
