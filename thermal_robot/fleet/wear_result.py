"""Change points, rates and alarms of one robot over time: frozen values and their JSON."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, ClassVar

from thermal_robot.diagnosis.values import jsonable
from thermal_robot.fleet import settings
from thermal_robot.renderer import RenderedPage

SCHEMA = "thermal-robot/wear/1"


@dataclass(frozen=True)
class Visit:
    """One campaign in a time series.

    Attributes
    ----------
    name
        Name of the campaign.
    date
        ISO 8601; empty where none was given.
    time
        Days since the first campaign; its number, from 0, where no dates were given.
    rows
        Number of rows used.
    about
        What the campaign says of itself: serial numbers, operator.
    """

    name: str
    date: str
    time: float
    rows: int
    about: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Jump:
    """Step change of a parameter between two campaigns, with the posterior of its date.

    Attributes
    ----------
    after
        Number of the last campaign before the step, from 0.
    probability
        Posterior probability of this date, given that the parameter jumped.
    probabilities
        (K − 1,) the same for a step after each campaign but the last.
    earliest, latest
        Numbers of the campaigns between which the step is with at least 95 %: the last before and the first after it.
    size, std
        Size of the step, and its standard deviation; unit of the parameter.
    """

    after: int
    probability: float
    probabilities: tuple[float, ...]
    earliest: int
    latest: int
    size: float
    std: float


@dataclass(frozen=True)
class Rate:
    """Rate of change of a parameter, its unit per day."""

    value: float
    std: float


@dataclass(frozen=True)
class Crossing:
    """Forecast of the time at which a parameter's absolute value reaches a limit, by its trend.

    Attributes
    ----------
    limit
        Limit in the unit of the parameter.
    state
        ``passed`` (the limit is reached in the last campaign), ``expected`` (a trend leads there), ``never`` (the
        parameter is constant, or has jumped and stays), ``unknown`` (a random walk, or no dates for a rate).
    day
        Expected time, in days since the first campaign; ``None`` unless ``expected``.
    low, high
        95 % confidence interval of ``day``; ``high`` is ``None`` where the rate may be zero.
    dates
        ``day``, ``low`` and ``high`` as ISO dates; empty where there is none.
    """

    limit: float
    state: str
    day: float | None = None
    low: float | None = None
    high: float | None = None
    dates: tuple[str, str, str] = ("", "", "")


@dataclass(frozen=True, kw_only=True)
class Worn:
    """Change of one parameter over a series of K campaigns: its kind, size, alarm and forecast; SI.

    Attributes
    ----------
    effect, title
        Name and title of its effect.
    parameter, place, unit
        Name of the parameter, its joint or link, and its unit.
    comparable
        Whether campaigns can be compared in it; ``reason`` says why not.
    alarm
        Whether there is an alarm: its p-value is at most the false-alarm rate.
    chance
        Bound on the false-alarm probability: that a series without any change shows one as significant, in any
        parameter on any day.
    moved
        Posterior probability that it is not constant.
    kind
        ``constant``, ``jump``, ``trend`` or ``walk``: the most probable one, not ``constant`` with an alarm.
    kinds
        Posterior probability of each kind.
    jump, rate
        The jump, or the rate of the trend, if its kind is that; a rate needs dates.
    change, change_std
        Change from the first campaign to the last under its kind, and its standard deviation; 0 where constant.
    values, stds
        (K,) estimates with a free value in each campaign, the other parameters following their kinds, and standard
        deviations; ``None`` in a campaign that has no information on it.
    fitted
        (K,) values under its kind of change.
    crossing
        Forecast of reaching the limit of its effect; ``None`` without a limit.
    confounded_with
        Names of parameters whose changes the data cannot tell apart from its own.
    """

    effect: str
    title: str
    parameter: str
    place: str
    unit: str
    comparable: bool
    reason: str
    alarm: bool = False
    chance: float = 1.0
    moved: float = 0.0
    kind: str = "constant"
    kinds: dict[str, float] = field(default_factory=dict)
    jump: Jump | None = None
    rate: Rate | None = None
    change: float
    change_std: float
    values: tuple[float | None, ...]
    stds: tuple[float | None, ...]
    fitted: tuple[float, ...]
    crossing: Crossing | None = None
    confounded_with: tuple[str, ...] = ()

    @property
    def perhaps(self) -> bool:
        """Whether it moves with a posterior probability above 0.5, but without an alarm."""
        return self.comparable and not self.alarm and self.moved > settings.LIKELY


@dataclass(frozen=True, repr=False)
class Wear(RenderedPage):
    """Result of a change-point analysis: changes of one robot's parameters over several campaigns.

    Attributes
    ----------
    robot
        Name of the robot.
    campaigns
        Campaigns in the order of time.
    dated
        Whether dates were given.
    parameters
        Parameters, alarms first, then by the probability of a change.
    false_alarm
        False-alarm rate: probability at most that a series without any change has any alarm.
    scatter
        Overdispersion of the campaigns: their scatter over their standard deviations, at least 1.
    nothing
        Posterior probability that no parameter moved.
    notes
        Remarks, one sentence each.
    """

    _kind: ClassVar[str] = "wear_"
    _figure: ClassVar[str] = "plot_wear"

    robot: str
    campaigns: tuple[Visit, ...]
    dated: bool
    parameters: tuple[Worn, ...]
    false_alarm: float
    scatter: float
    nothing: float
    notes: tuple[str, ...]

    @property
    def alarms(self) -> tuple[Worn, ...]:
        """Parameters with an alarm."""
        return tuple(worn for worn in self.parameters if worn.alarm)

    @property
    def summary(self) -> str:
        """Result in one sentence: what moved, how and when."""
        return str(self._rendered("wear_headline"))

    def to_dict(self) -> dict[str, Any]:
        """JSON object of the format ``thermal-robot/wear/1``: the attributes, and the schema's name."""
        return dict(jsonable({"schema": SCHEMA, "summary": self.summary, **asdict(self)}))

    def __repr__(self) -> str:
        moving = ", ".join(f"{w.parameter} ({w.kind})" for w in self.alarms)
        return f"Wear({self.robot!r}, {len(self.campaigns)} campaigns: {moving or 'no alarm'})"
