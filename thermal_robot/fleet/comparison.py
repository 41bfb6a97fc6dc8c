"""Result of a comparison of campaigns as one frozen value, and its JSON."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from thermal_robot.diagnosis.values import jsonable
from thermal_robot.renderer import RenderedPage, registered_renderer

if TYPE_CHECKING:
    import pandas as pd

    from thermal_robot.diagnosis.result import Diagnosis
    from thermal_robot.fleet.compare_sums import ModelAsFit

SCHEMA = "thermal-robot/comparison/1"
Status = Literal["shared", "changed", "contradicts", "not_needed", "not_compared", "absent"]
"""Status of an effect in a comparison, in the order in which effects are listed."""


@dataclass(frozen=True)
class Parameter:
    """Estimates of one parameter by each campaign alone, jointly with all effects at work or named; SI.

    Attributes
    ----------
    name, kind, place, unit
        Name, kind and name of its place, and unit.
    values, stds
        Estimates and standard deviations per campaign; ``None`` where its data do not determine the parameter.
    between
        The two campaigns that are most standard deviations apart; empty where fewer than two determine it.
    difference, std
        Later minus earlier of these two campaigns, and its standard deviation.
    chi2, degrees, p_value
        Chi-square test of equal values in all campaigns, not corrected for other parameters.
    """

    name: str
    kind: str
    place: str
    unit: str
    values: tuple[float | None, ...]
    stds: tuple[float | None, ...]
    between: tuple[str, ...] = ()
    difference: float | None = None
    std: float | None = None
    chi2: float | None = None
    degrees: int = 0
    p_value: float | None = None


@dataclass(frozen=True)
class Effect:
    """Comparison of one effect between campaigns.

    Attributes
    ----------
    name, title
        Name and title of the effect; a discovered law has its campaign's name appended.
    status
        ``shared``: the same in all campaigns; ``changed``: at work, with places that differ; ``contradicts``: no two
        campaigns agree on its size; ``not_needed``: a diagnosis names it, but the joint fit does not need it;
        ``not_compared``: only one campaign determines it; ``absent``: neither a diagnosis nor the joint fit has it.
    reason
        Why it is contradicted, or not compared; empty otherwise.
    probability
        Posterior probability, by the joint fit, that it is at work in any campaign.
    named
        The campaigns whose own diagnosis names it.
    chi2, degrees, p_value
        Chi-square test of equal parameters in all campaigns, all others free in each.
    parameters
        Comparison of each parameter.
    """

    name: str
    title: str
    status: Status
    reason: str
    probability: float
    named: tuple[str, ...]
    chi2: float
    degrees: int
    p_value: float
    parameters: tuple[Parameter, ...]


@dataclass(frozen=True)
class Change:
    """Difference of an effect's parameters between groups of campaigns in the joint fit.

    Attributes
    ----------
    effect, title
        Name and title of the effect.
    kind, place
        Kind and name of the place; empty for all places.
    parameters
        Names of the parameters that differ.
    groups
        Campaigns that agree with each other.
    since
        The first campaign that has the new value, where the order of campaigns explains the groups; else empty.
    values, unit
        Per campaign, of a single parameter, SI; empty for several.
    chi2, degrees, p_value
        Chi-square test of no difference, given all shared parameters; the p-value is corrected for all comparisons.
    probability
        Posterior probability that this place differs.
    """

    effect: str
    title: str
    kind: str
    place: str
    parameters: tuple[str, ...]
    groups: tuple[tuple[str, ...], ...]
    since: str
    values: tuple[float, ...]
    unit: str
    chi2: float
    degrees: int
    p_value: float
    probability: float


@dataclass(frozen=True)
class Predicted:
    """Predictions of two campaigns' models at common poses and conditions, frames aligned.

    Attributes
    ----------
    campaigns
        Names of the two campaigns.
    poses
        Number of poses.
    rms, stated
        Root mean square of the difference, and of its standard deviation as the models state it, m.
    beyond
        Share of the poses at which the difference exceeds twice its stated deviation there.
    agrees
        Whether ``rms`` is at most twice ``stated``: otherwise a model is wrong, or the robot changed.
    note
        Why nothing was predicted; empty where it was.
    """

    campaigns: tuple[str, str]
    poses: int
    rms: float
    stated: float
    beyond: float
    agrees: bool
    note: str = ""


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(RenderedPage):
    """Result of a comparison: what campaigns of one robot share, and what changed between them.

    Attributes
    ----------
    campaigns, samples
        Names of the campaigns in their order, and how many measurements each has; none of a model file.
    robot, tool_frame
        Names of robot and tool frame.
    effects
        Every effect that was compared, those at work first.
    changes
        Differences, the most certain first.
    predicted
        Cross-predictions of every two campaigns.
    not_told
        Parameters that no campaign determines given the unknown frames and the others: they are not compared.
    looked_at
        Number of places compared, for which the p-values of changes are corrected.
    diagnoses
        Diagnoses of the campaigns; for a model file a stand-in.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> robot = tr.load_robot("builtin:rv_m2", "tool0")
    >>> days = [tr.simulate(robot, rows=40, noise=2e-5, seed=seed) for seed in (1, 2)]
    >>> found = tr.compare(*days)
    >>> found.changes
    ()
    """

    _kind: ClassVar[str] = "comparison_"
    _figure: ClassVar[str] = "plot_differences"

    campaigns: tuple[str, ...]
    samples: tuple[int, ...]
    robot: str
    tool_frame: str
    effects: tuple[Effect, ...]
    changes: tuple[Change, ...]
    predicted: tuple[Predicted, ...]
    not_told: tuple[str, ...] = ()
    looked_at: int = 0
    diagnoses: tuple[Diagnosis | ModelAsFit, ...] = field(default=(), compare=False)

    @property
    def verdict(self) -> tuple[str, ...]:
        """Names of the effects that the comparison confirms: shared, changed, or not compared."""
        return tuple(e.name for e in self.effects if e.status in ("shared", "changed", "not_compared"))

    @property
    def lost(self) -> tuple[str, ...]:
        """Names of the effects that a diagnosis names and the comparison contradicts or does not need."""
        return tuple(e.name for e in self.effects if e.status in ("contradicts", "not_needed") and e.named)

    @property
    def summary(self) -> str:
        """Result in one plain sentence."""
        return str(self.to_dict()["summary"])

    @property
    def parameters(self) -> pd.DataFrame:
        """Data frame of parameters by effect and name: value and deviation of each campaign, and tests, SI."""
        import pandas as pd

        rows = {}
        for effect in self.effects:
            for p in effect.parameters:
                told = zip(self.campaigns, p.values, p.stds, strict=True)
                each = {key: one for c, value, std in told for key, one in ((c, value), (f"std of {c}", std))}
                tests = {"difference": p.difference, "std": p.std, "chi2": p.chi2, "p_value": p.p_value}
                rows[effect.name, p.name] = {**each, **tests, "unit": p.unit}
        return pd.DataFrame.from_dict(rows, orient="index").rename_axis(["effect", "parameter"])

    def effect(self, name: str) -> Effect:
        """Return the comparison of one effect by its name.

        Raises
        ------
        KeyError
            If it was not compared.
        """
        for effect in self.effects:
            if effect.name == name:
                return effect
        raise KeyError(f"{name!r} was not compared; {', '.join(e.name for e in self.effects) or 'nothing'} was")

    def to_dict(self) -> dict[str, Any]:
        """JSON object of the format ``thermal-robot/comparison/1``, SI."""
        told = zip(self.campaigns, self.samples, self.diagnoses, strict=True)
        plain = dict(
            schema=SCHEMA,
            robot=self.robot,
            tool_frame=self.tool_frame,
            campaigns=[
                {"name": name, "samples": count, "diagnosis": d.summary, "about": d.model.settings.about}
                for name, count, d in told
            ],
            verdict={"effects": self.verdict, "lost": self.lost, "changed": bool(self.changes)},
            effects=[asdict(effect) for effect in self.effects],
            changes=[asdict(change) for change in self.changes],
            predicted=[asdict(predicted) for predicted in self.predicted],
            not_told=self.not_told,
            looked_at=self.looked_at,
        )
        plain = jsonable(plain)
        return {**plain, "summary": registered_renderer().comparison_headline(plain)}

    def _given(self) -> dict[str, Any]:
        return self.to_dict()

    def __repr__(self) -> str:
        changed = ", ".join(dict.fromkeys(c.effect for c in self.changes)) or "nothing"
        return f"Comparison({', '.join(self.campaigns)}: {changed} changed)"
