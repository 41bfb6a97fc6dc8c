"""The result of a diagnosis: plain frozen values, and their JSON."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from thermal_robot.correction import CorrectedModel

if TYPE_CHECKING:
    from thermal_robot.diagnosis.next_samples import NextSamples
    from thermal_robot.diagnosis.schemes import FoldScheme
    from thermal_robot.diagnosis.sensitivity import Sensitivity
    from thermal_robot.inference.fit import Fit

Array = NDArray[np.float64]
Status = Literal["found", "not_found", "not_testable", "confounded"]

SCHEMA = "thermal-robot/diagnosis/1"


@dataclass(frozen=True)
class Location:
    """A place and its share of the gap's mean square (or, for a remainder, its probability)."""

    kind: str
    name: str
    share: float


@dataclass(frozen=True)
class Estimate:
    """A parameter: SI value with its standard deviation, both ``None`` where the data do not determine it."""

    name: str
    value: float | None
    std: float | None
    unit: str
    identified: bool


@dataclass(frozen=True)
class Finding:
    """What the data say of one effect.

    Attributes
    ----------
    name
        The effect's name.
    status
        ``found``, ``not_found``, ``not_testable`` or ``confounded``.
    probability
        Posterior probability that it is at work; ``None`` where it is not testable.
    shrinkage, shrinkage_ci95
        Its share of the gap's mean square, on data not used for the fit: Shapley value over the explanation for an
        effect that belongs to it; what adding it brings for another; ``None`` where it is not testable.
    needs
        What would make it testable.
    confounded_with
        Effects that the data cannot tell it from.
    locations
        Where it sits, largest share first.
    parameters
        Its estimates; empty where it does not belong to the explanation.
    quantity, shape, describes
        Of a law that was discovered: what it follows, how, and a sentence about it; ``None`` otherwise.
    """

    name: str
    status: Status
    probability: float | None = None
    shrinkage: float | None = None
    shrinkage_ci95: tuple[float, float] | None = None
    needs: tuple[str, ...] = ()
    confounded_with: tuple[str, ...] = ()
    locations: tuple[Location, ...] = ()
    parameters: tuple[Estimate, ...] = ()
    quantity: str | None = None
    shape: str | None = None
    describes: str | None = None


@dataclass(frozen=True)
class HeldOut:
    """How far the gap shrinks on rows that were not used for the fit: rms distances in m, shares 0..1."""

    scheme: str
    folds: int
    rms_before: float
    rms_after: float
    shrinkage: float
    shrinkage_ci95: tuple[float, float]


@dataclass(frozen=True)
class Gap:
    """Rms distances in m (orientation: rad) over the rows that are not outliers; ``None`` without orientation."""

    rms_before: float
    rms_after: float
    noise_floor: float
    noise_source: str
    held_out: HeldOut
    orientation_before: float | None = None
    orientation_after: float | None = None
    schemes: tuple[FoldScheme, ...] = ()


@dataclass(frozen=True)
class Where:
    """Shares 0..1 of the gap's mean square: by axis of the root frame, joint, link, and recorded quantity.

    Axes sum to one. Joints and links share what the explanation explains. A quantity's share is what a smooth law of
    it alone would explain, so these overlap.
    """

    axes: Mapping[str, float]
    joints: Mapping[str, float]
    links: Mapping[str, float]
    covariates: Mapping[str, float]


@dataclass(frozen=True)
class Dependence:
    """A recorded quantity that the remainder follows, with the p-value after counting every quantity that was tried."""

    covariate: str
    p_value: float


@dataclass(frozen=True)
class Unexplained:
    """What the explanation leaves beyond the noise.

    Attributes
    ----------
    flagged
        Whether it is larger or more structured than the noise allows.
    rms
        Its rms distance, m: noise subtracted where a stated noise or repeats tell it, all of it where nothing does; 0
        where nothing is left.
    p_value
        Of the most telling test, after counting all of them.
    reasons
        Plain sentences: which test says so.
    locations
        Where it most probably enters.
    depends_on
        The quantities that it follows, most telling first.
    """

    flagged: bool
    rms: float
    p_value: float
    reasons: tuple[str, ...] = ()
    locations: tuple[Location, ...] = ()
    depends_on: tuple[Dependence, ...] = ()


@dataclass(frozen=True, eq=False)
class Rows:
    """What the figures show, one row a measurement, N rows.

    Attributes
    ----------
    rows
        (N,) row numbers in the file.
    gap, remainder
        (N, m) before and after, root frame axes: m, and rad.
    outliers
        (N,) True where set aside.
    position
        (N, 3) predicted position of the target in the root frame, m.
    q
        (N, n) commanded joint positions.
    covariates
        Recorded quantities by name, (N,).
    held_out_before, held_out_after
        (N,) distance in m while the row was held out; NaN where it was set aside.
    """

    rows: NDArray[np.int64]
    gap: Array
    remainder: Array
    outliers: NDArray[np.bool_]
    position: Array
    q: Array
    covariates: Mapping[str, Array]
    held_out_before: Array
    held_out_after: Array


@dataclass(frozen=True, eq=False, repr=False)
class Diagnosis:
    """Where the gap lies, which effects cause it, how far it shrinks.

    Attributes
    ----------
    campaign, robot, tool_frame, samples, measures
        What was diagnosed.
    joint_names
        Movable joints, root to tool.
    outliers
        Row numbers in the file of the measurements set aside.
    gap, effects, where, unexplained
        The parts of the answer; effects are ordered by held-out share.
    verdict
        Names of the effects of the explanation, largest share first.
    probability
        Posterior probability of exactly this explanation.
    summary
        One plain sentence.
    advice, separates
        What to measure next.
    model
        The corrected model.
    rows
        Measurement by measurement.
    warnings
        What a reader should know about the data.
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
    summary: str
    advice: str
    separates: tuple[tuple[str, ...], ...]
    model: CorrectedModel
    rows: Rows
    warnings: tuple[str, ...] = field(default=())
    sensitivity: Sensitivity | None = None
    fit: Fit | None = None

    def explain(self, effect: str) -> Any:
        """Draw what is left before and after one effect, against the quantity that drives it, place by place.

        Parameters
        ----------
        effect
            Name of an effect of the explanation.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        EffectError
            If it does not belong to the explanation.
        """
        from thermal_robot.diagnosis.one_effect import explained
        from thermal_robot.report import explain_figure

        return explain_figure(explained(self._fitted(), effect))

    def next_samples(self, count: int = 10) -> NextSamples:
        """Choose samples that would best separate the leading explanations; ``to_table()`` makes a table of them."""
        from thermal_robot.diagnosis.next_samples import next_samples

        return next_samples(self._fitted(), count)

    def _fitted(self) -> Fit:
        if self.fit is None:
            raise ValueError("this diagnosis was made without its fit")
        return self.fit

    def finding(self, effect: str) -> Finding:
        """Return what is said of one effect; ``KeyError`` for a name that was not a candidate."""
        return {f.name: f for f in self.effects}[effect]

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON object of the format ``thermal-robot/diagnosis/1``."""
        gap, left = self.gap, self.unexplained
        orientation = None
        if gap.orientation_before is not None:
            orientation = {"rms_before": gap.orientation_before, "rms_after": gap.orientation_after}
        plain: dict[str, Any] = {
            "schema": SCHEMA,
            "campaign": {
                "name": self.campaign,
                "robot": self.robot,
                "tool_frame": self.tool_frame,
                "samples": self.samples,
                "measures": self.measures,
                "outliers": self.outliers,
                "warnings": self.warnings,
            },
            "gap": {
                "rms_before": gap.rms_before,
                "rms_after": gap.rms_after,
                "noise_floor": gap.noise_floor,
                "noise_source": gap.noise_source,
                "orientation": orientation,
                "held_out": asdict(gap.held_out),
                "schemes": [asdict(scheme) for scheme in gap.schemes],
            },
            "verdict": {
                "effects": self.verdict,
                "probability": self.probability,
                "unexplained": left.flagged,
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
        return dict(_jsonable(plain))

    def _samples(self) -> list[dict[str, Any]]:
        return [] if self.fit is None else self.next_samples().to_list()

    def to_json(self, path: str | Path) -> None:
        """Write :meth:`to_dict` to a file."""
        Path(path).write_text(json.dumps(self.to_dict(), indent=2, ensure_ascii=False) + "\n", encoding="utf-8")

    def __repr__(self) -> str:
        return f"Diagnosis({self.campaign!r}: {', '.join(self.verdict) or 'no effect'})"

    def __str__(self) -> str:
        from thermal_robot.report import text

        return text(self)

    def _repr_html_(self) -> str:
        from thermal_robot.report import fragment

        return str(fragment(self))


def _jsonable(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(k): _jsonable(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_jsonable(v) for v in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value
