"""Change points, rates and alarms of one robot over time: frozen values and their JSON."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from typing import Any, ClassVar

from thermal_robot.fleet import settings
from thermal_robot.percents import percent
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
    """

    name: str
    date: str
    time: float
    rows: int


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
        span = f"{len(self.campaigns)} campaigns of {self.robot}"
        if not self.alarms:
            return f"Over {span} nothing moves that would not by chance in {_share(self.false_alarm)} of such series."
        return f"Over {span}: {'; '.join(_moves(self, worn) for worn in self.alarms)}."

    def to_dict(self) -> dict[str, Any]:
        """JSON object of the format ``thermal-robot/wear/1``: the attributes, and the schema's name."""
        plain: dict[str, Any] = json.loads(json.dumps({"schema": SCHEMA, "summary": self.summary, **asdict(self)}))
        return plain

    def __repr__(self) -> str:
        moving = ", ".join(f"{w.parameter} ({w.kind})" for w in self.alarms)
        return f"Wear({self.robot!r}, {len(self.campaigns)} campaigns: {moving or 'no alarm'})"

    def __str__(self) -> str:
        return "\n".join(_lines(self))


def _lines(wear: Wear) -> Iterator[str]:
    first, last = wear.campaigns[0], wear.campaigns[-1]
    days = f", {first.date} to {last.date}, {last.time:.0f} days" if wear.dated else ", in order; no dates, so no rates"
    yield wear.summary
    yield ""
    yield f"campaigns    {len(wear.campaigns)}{days}"
    yield f"alarms       at most {_share(wear.false_alarm)} of series without a change ring"
    yield f"scatter      {wear.scatter:.2f} of what the deviations say; nothing moved: {percent(wear.nothing)}"
    for worn in wear.alarms:
        yield ""
        yield from _of_one(wear, worn)
    quiet = [w for w in wear.parameters if w.comparable and not w.alarm]
    if any(w.moved > settings.LIKELY for w in quiet):
        yield ""
    for w in quiet:
        if w.moved > settings.LIKELY:
            yield f"perhaps      {_moves(wear, w)}: {percent(w.moved, 0)}, but no alarm"
    yield ""
    stays = [w for w in quiet if w.moved <= settings.LIKELY]
    if stays:
        yield f"stays        {'; '.join(f'{w.parameter} (moved: {percent(w.moved)})' for w in stays)}"
    yield from (f"limit        {w.parameter}: {_reaches(w.crossing, w.unit)}" for w in stays if w.crossing is not None)
    hidden = [w for w in wear.parameters if not w.comparable]
    for reason in dict.fromkeys(w.reason for w in hidden):
        yield f"not compared {', '.join(w.parameter for w in hidden if w.reason == reason)}: {reason}"
    yield from (f"note         {note}" for note in wear.notes)


def _of_one(wear: Wear, worn: Worn) -> Iterator[str]:
    yield f"ALARM        {_moves(wear, worn)}"
    kinds = ", ".join(f"{kind} {percent(p, 0)}" for kind, p in worn.kinds.items() if p >= 0.005)
    yield f"             chance of such an alarm without a change: at most {worn.chance:.1g}; {kinds}"
    if worn.jump:
        yield f"             95 %: {_between(wear, worn.jump.earliest, worn.jump.latest)}"
    if worn.confounded_with:
        yield f"             cannot be told from a change of {', '.join(worn.confounded_with)}"
    if worn.crossing:
        yield f"             {_reaches(worn.crossing, worn.unit)}"


def _moves(wear: Wear, worn: Worn) -> str:
    """Describe the change of one parameter."""
    name = f"{worn.title}, {worn.parameter}"
    if worn.jump is not None:
        size = f"{worn.jump.size:+.3g} ± {worn.jump.std:.2g} {worn.unit}"
        where = _between(wear, worn.jump.after, worn.jump.after + 1)
        return f"{name} jumped by {size} {where} ({percent(worn.jump.probability, 0)})"
    if worn.rate is not None:
        return f"{name} moves by {worn.rate.value:+.3g} ± {worn.rate.std:.2g} {worn.unit} a day"
    how = "moves steadily" if worn.kind == "trend" else "wanders"
    return f"{name} {how}, by {worn.change:+.3g} ± {worn.change_std:.2g} {worn.unit} from first to last"


def _between(wear: Wear, first: int, last: int) -> str:
    visits = (wear.campaigns[first], wear.campaigns[last])
    return "between " + " and ".join(f"{v.name} ({v.date})" if wear.dated else v.name for v in visits)


def _reaches(crossing: Crossing, unit: str) -> str:
    limit = f"limit {crossing.limit:.3g} {unit}"
    said = {
        "passed": "passed",
        "never": "never, as it does not go there",
        "unknown": "not foreseen, for lack of a rate",
    }
    if crossing.state in said:
        return f"{limit}: {said[crossing.state]}"
    expected, low, high = crossing.dates
    return f"{limit}: about {expected} (95 %: {low} to {high or 'never'})"


def _share(probability: float) -> str:
    return f"{100.0 * probability:.2g} %"
