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
    """Step change of a parameter between two campaigns.

    Attributes
    ----------
    after
        Number of the last campaign before it, from 0.
    probability
        Probability of this date, given that the parameter jumped.
    probabilities
        (K − 1,) the same after each campaign.
    earliest, latest
        Numbers of the campaigns between which it happened with 95 %: the last before it and the first after it.
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
    """Time at which a parameter's absolute value reaches a limit.

    Attributes
    ----------
    limit
        Limit in the unit of the parameter.
    state
        ``passed`` (it is beyond in the last campaign), ``expected`` (a trend leads there), ``never`` (it does not move,
        or has jumped and stays), ``unknown`` (it wanders, or there are no dates for a rate).
    day
        Expected, in days since the first campaign; ``None`` unless ``expected``.
    low, high
        95 % interval of it; ``high`` is ``None`` where the trend may be none.
    dates
        The three as dates; empty where there is none.
    """

    limit: float
    state: str
    day: float | None = None
    low: float | None = None
    high: float | None = None
    dates: tuple[str, str, str] = ("", "", "")


@dataclass(frozen=True, kw_only=True)
class Worn:
    """Change of one parameter over time; SI.

    Attributes
    ----------
    effect, title
        Its effect's name, and in plain words.
    parameter, place, unit
        Name of the parameter, its joint or link, and its unit.
    comparable
        Whether campaigns can be compared in it; ``reason`` says why not.
    alarm
        Whether there is an alarm: its p-value is at most the false-alarm rate.
    chance
        Bound on the probability that a series without any change shows one as clear, in whatever parameter, on whatever
        day.
    moved
        Posterior probability that it moves, in whatever way.
    kind
        ``constant``, ``jump``, ``trend`` or ``walk``: the most probable, of those in which it moves where it rings.
    kinds
        Probability of each.
    jump, rate
        Step or rate of the change, if it is one; a rate needs dates.
    change, change_std
        Change from the first campaign to the last under this kind of change; 0 where it is constant.
    values, stds
        (K,) as each campaign has it, all others as they are over time, and their standard deviations; ``None`` in a
        campaign that says nothing of it.
    fitted
        (K,) as its kind has it.
    crossing
        Crossing of the limit of its effect; ``None`` without one.
    confounded_with
        Parameters of whose changes the data cannot tell this one's.
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
        """Whether it probably moves without an alarm."""
        return self.comparable and not self.alarm and self.moved > settings.LIKELY


@dataclass(frozen=True, repr=False)
class Wear(RenderedPage):
    """Change of one robot over time.

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
        Stated: at most so many series without any change ring at all.
    scatter
        Overdispersion of the campaigns: their scatter over their standard deviations, at least 1.
    nothing
        Probability that nothing moved.
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
