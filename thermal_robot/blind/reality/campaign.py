"""One case becomes a folder with a campaign, and the answers that stay outside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date, timedelta
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.blind.cases import LISTED, Case, Several
from thermal_robot.blind.reality.fault import Fault
from thermal_robot.blind.reality.faults import FAULTS
from thermal_robot.blind.reality.instrument import Instrument, measure, registered, write_folder
from thermal_robot.blind.reality.setting import Setting, draw_setting, humidity
from thermal_robot.blind.reality.sizes import (
    GROWS_ONLY,
    SIZE,
    Gauge,
    Spot,
    Unseen,
    deviation,
    draw_spot,
    place,
    sized,
    truth,
)
from thermal_robot.blind.reality.unlisted import known
from thermal_robot.blind.reality.world import World, anywhere
from thermal_robot.files import write_text

Array = NDArray[np.float64]


FRESH = 1000
"""Rows to be predicted, ten times what is given: else their own scatter would count against intervals that hold."""
_PRESENT = 0.5  # × noise per axis: what leaves less, given the others, is not present
_TRIES = 8
_DIGITS = 9  # of answers in m: a ten-thousandth of the noise
_VISITS = (2, 5)
_TAILS = (3.0, 8.0)  # degrees of freedom: from the fewest with a third moment to nearly Gauss' law


def make(case: Case, folder: Path) -> dict[str, Any]:
    """Write a case's campaign, or its several campaigns, into a folder and return the answers.

    Parameters
    ----------
    case
        What is asked; everything that is drawn follows from its seed.
    folder
        Where campaign.toml, measurements.csv, robot.urdf and fresh.csv (commands to predict, without answers) go.

    Returns
    -------
    dict
        ``withdrawn`` with the reason where what is asked cannot be seen in any draw; else ``truth`` as in
        :mod:`thermal_robot.blind.cases`, ``noise`` (m), ``samples``, ``measures``, ``fresh_position`` (M, 3)
        where the target really is, ``fresh_before`` (M, 3) where frames alone put it. Of several campaigns nothing is
        predicted: see :mod:`thermal_robot.blind.reality.campaign`.
    """
    rng = np.random.default_rng(case.seed)
    world = World(case.robot.urdf, case.robot.tool_frame)
    attempt = _attempt if case.several is None else make_several
    for _ in range(_TRIES):
        try:
            return attempt(case, world, rng, folder)
        except Unseen as unseen:  # this draw hides its own fault: draw again
            reason = unseen
    return {"withdrawn": str(reason)}


def _attempt(case: Case, world: World, rng: np.random.Generator, folder: Path) -> dict[str, Any]:
    main = [known(name, case.own) for name in (*case.effects, *([case.unlisted] if case.unlisted else ()))]
    wants = {*case.wants, *(want for fault in main for want in fault.wants)}
    samples = int(rng.integers(case.samples[0], case.samples[1] + 1))
    setting = draw_setting(
        world,
        samples,
        rng,
        fresh=FRESH,
        moving="moving" in wants,
        visits=_VISITS if "repeats" in wants else (1, 1),
        sensor=max((want.partition(":")[2] for want in wants if want.startswith("sensor:")), default=None),
        sessions="sessions" in wants or bool(rng.random() < 0.25),
    )
    _record(setting, wants, rng)
    rows = np.flatnonzero(setting.given)
    instrument = _instrument(case, wants, rng)
    gauge = Gauge(setting, rows, instrument.target, not instrument.base_known, not instrument.tool_known)
    done = [(fault, _of_size(case, gauge, fault, instrument.noise, rng)) for fault in main]
    if case.ratio[0] > 1.0:  # of what is smaller than the noise nobody asks that it be told from the rest
        _require_apart(gauge, [(fault, values) for fault, values in done if fault.name in FAULTS], instrument.noise)
    background = _background(case, gauge, main, instrument.noise, rng)
    seen, turned = place(setting, [*done, *background], instrument.target, instrument.pose)
    measured = measure(setting, seen, turned, rows, instrument, rng)
    others = np.flatnonzero(~setting.given)
    write_folder(folder, case, setting, measured, rows, others, instrument, _gears(setting, done))
    before = registered(setting, measured, rows, instrument)
    return {
        "truth": {**truth(case, gauge, done, background, instrument.noise), "outliers": list(measured.spoilt)},
        "noise": instrument.noise,
        "samples": samples,
        "measures": "pose" if instrument.turning is not None else "position",
        "fresh_position": seen[others].round(_DIGITS).tolist(),
        "fresh_before": before[others].round(_DIGITS).tolist(),
    }


def _record(setting: Setting, wants: set[str], rng: np.random.Generator) -> None:
    """Add the columns that a fault follows, and now and then the same columns where nothing does."""
    if "humidity" in wants and "humidity" not in setting.extra:
        setting.extra["humidity"] = humidity(setting.samples, rng)
    if "motor_temperature" in wants or rng.random() < 0.2:
        run = (setting.time - setting.time[0]) / setting.time[-1]
        shift = max(setting.samples // 10, 1)  # rows over which its load stays alike
        load = np.convolve(rng.normal(size=setting.samples + shift - 1), np.ones(shift) / np.sqrt(shift), "valid")
        setting.extra["motor_temperature"] = np.round(24.0 + 28.0 * -np.expm1(-run / 0.3) + 6.0 * load, 1)
    if "speed" in wants or rng.random() < 0.4:
        setting.extra["speed"] = setting.speed


def _gears(setting: Setting, done: Sequence[tuple[Fault, Array]]) -> dict[str, float]:
    """Return the ratios that the file must state for wheels that turn with the motor to be seen."""
    ratios = {float(v) for fault, values in done if fault.name == "transmission_error" for v in values[:, 4]} - {1.0}
    return {name: ratio for ratio in sorted(ratios) for name in setting.world.names}


def _instrument(case: Case, wants: set[str], rng: np.random.Generator) -> Instrument:
    base_known = "base_known" in wants or bool(rng.random() < 0.1)
    tool_known = "tool_known" in wants or bool(rng.random() < 0.1)
    pose = rng.random() < (1.0 if tool_known and "tool_known" in wants else 0.4)
    target = rng.uniform([-0.03, -0.03, 0.04], [0.03, 0.03, 0.16])
    return Instrument(
        pose=np.eye(4) if base_known else anywhere(rng, 3.0),
        target=target,
        declared=target if tool_known else target + rng.uniform(-0.01, 0.01, 3),
        base_known=base_known,
        tool_known=tool_known,
        noise=float(rng.uniform(10e-6, 30e-6)),
        turning=3e-5 if pose else None,
        stated=bool(rng.random() < 0.85),
        tails=float(rng.uniform(*_TAILS)) if case.heavy else np.inf,
        spoilt=float(rng.choice([0.0, 0.03, 0.1] if case.heavy else [0.0, 0.03])),
    )


def _of_size(case: Case, gauge: Gauge, fault: Fault, noise: float, rng: np.random.Generator) -> Array:
    """Draw a fault and make it as large as the case asks.

    Where the cause is not in the library, taken from it, or hidden, that counts which no two other effects imitate.
    """
    wanted = noise * np.exp(rng.uniform(*np.log(case.ratio)))
    values = fault.draw(gauge.setting, rng)
    if case.kind not in ("removed", "hidden") and fault.name != case.unlisted:
        return sized(gauge, fault, values, wanted, lambda moved: gauge.rms(gauge.left(moved)))
    rough = sized(gauge, fault, values, wanted, lambda moved: gauge.rms(gauge.left(moved)))
    others = [name for name in FAULTS if name not in case.effects]
    beyond = gauge.beyond(fault, gauge.moved(fault, rough), others, together=2)
    share = min(beyond.values(), default=wanted) / wanted
    if share < 0.15:
        raise Unseen(f"{fault.name} is what {min(beyond, key=lambda name: beyond[name])} can do as well")
    return fault.scaled(rough, 1.0 / share)


def _require_apart(gauge: Gauge, done: Sequence[tuple[Fault, Array]], noise: float) -> None:
    """Draw several effects again where one of them leaves nothing that another could not have done as well."""
    if len(done) < 2:
        return
    for fault, values in done:
        moved = gauge.moved(fault, values)
        beyond = gauge.beyond(fault, moved, [other.name for other, _ in done])
        if min(beyond.values(), default=np.inf) < _PRESENT * noise:
            raise Unseen(f"{fault.name} is hidden by the other effect")


def _background(
    case: Case, gauge: Gauge, main: Sequence[Fault], noise: float, rng: np.random.Generator
) -> list[tuple[Fault, Array]]:
    """All the other effects that are always there, each far below the noise."""
    if not case.background:
        return []
    named, quiet = {fault.name for fault in main}, []
    skipped = {"base_frame", "tool_frame", "tracking_lag", *case.without}
    for name, fault in FAULTS.items():
        if name in named or name in skipped:
            continue
        values = fault.draw(gauge.setting, rng)
        try:
            values = sized(gauge, fault, values, case.background * noise, lambda moved: gauge.rms(gauge.left(moved)))
        except Unseen:
            continue  # it cannot be seen here, so there is no size to give it
        quiet.append((fault, values))
    return quiet


_SENSORS = ("robot", "links")
"""What may be recorded of the links: where only the air is, their lag would be another wall's each day."""
_NOISE = (10e-6, 30e-6)  # m, one sigma per axis: as in campaigns of one day
_STATED = 0.85  # of cases: as there
_SPOILT = (0.0, 0.03)  # share of rows: as there


@dataclass(frozen=True)
class Habits:
    """What is alike in all campaigns of a case: the instrument's noise (m, per axis), what is recorded of the links."""

    noise: float
    stated: bool
    sensor: str


@dataclass(frozen=True, eq=False)
class Day:
    """One campaign: its day, its instrument, and the measure of displacements on its rows."""

    setting: Setting
    instrument: Instrument
    gauge: Gauge


def draw_habits(rng: np.random.Generator) -> Habits:
    """Draw what stays."""
    return Habits(float(rng.uniform(*_NOISE)), bool(rng.random() < _STATED), str(rng.choice(_SENSORS)))


def draw_day(case: Case, world: World, habits: Habits, rng: np.random.Generator) -> Day:
    """Draw a campaign of positions; where base and target are nobody knows."""
    samples = int(rng.integers(case.samples[0], case.samples[1] + 1))
    setting = draw_setting(world, samples, rng, sensor=habits.sensor)
    target = rng.uniform([-0.03, -0.03, 0.04], [0.03, 0.03, 0.16])
    instrument = Instrument(
        pose=anywhere(rng, 3.0),
        target=target,
        declared=target + rng.uniform(-0.01, 0.01, 3),
        base_known=False,
        tool_known=False,
        noise=habits.noise,
        turning=None,
        stated=habits.stated,
        tails=np.inf,
        spoilt=float(rng.choice(_SPOILT)),
    )
    return Day(setting, instrument, Gauge(setting, np.arange(samples), target, base=True, tool=True))


def write_day(
    folder: Path, case: Case, day: Day, faults: Sequence[tuple[Fault, Array]], rng: np.random.Generator
) -> int:
    """Measure a robot with these faults on that day, write its campaign, and return the number of rows."""
    rows = np.arange(day.setting.samples)
    seen, turned = place(day.setting, faults, day.instrument.target, day.instrument.pose)
    measured = measure(day.setting, seen, turned, rows, day.instrument, rng)
    write_folder(folder, case, day.setting, measured, rows, rows[:0], day.instrument)
    return len(rows)


_HALLS = ("hall 1", "hall 2")
_ALIKE = 0.1
"""Scatter of a shared fault among robots, of its size: what one jig, one batch or one floor does to all is alike."""
_DRAWS = 20


def draw_fleet(
    case: Case, several: Several, days: Sequence[Day], rng: np.random.Generator
) -> tuple[dict[str, list[str]], list[AtWork], dict[str, Any]]:
    """Draw which robot has what.

    Parameters
    ----------
    case, several
        What is asked.
    days
        A campaign of each robot.
    rng
        Everything follows from it.

    Returns
    -------
    tuple
        Labels by name, a value for each robot; what is at work in each; the truth.

    Raises
    ------
    Unseen
        If this draw hides a fault.
    """
    count = len(days)
    robots = [f"r{number + 1:02d}" for number in range(count)]
    # halls of equal size, but for one
    halls = [_HALLS[k % 2] for k in rng.permutation(count)]
    at_work: list[AtWork] = [[] for _ in days]
    taken: list[Spot] = []
    shared, own = [], []
    if several.moves:
        group = str(rng.choice(_HALLS)) if several.how == "hall" else None
        members = [k for k in range(count) if group in (None, halls[k])]
        spot, values = _drawn(case, days[members[0]], several.moves, taken, rng)
        for k in members:
            at_work[k].append((spot.fault, _resized(values, float(np.exp(_ALIKE * rng.normal())))))
        shared.append({**_named(spot, days[0], values), "group": group})
    # one robot each, whichever hall it stands in
    for name, k in zip(several.apart, rng.permutation(count).tolist(), strict=False):
        spot, values = _drawn(case, days[k], name, taken, rng)
        at_work[k].append((spot.fault, values))
        own.append({"robot": robots[k], **_named(spot, days[k], values)})
    told: dict[str, Any] = {
        "effects": list(dict.fromkeys((*case.effects, *several.apart))),
        "unlisted": None,
        "parts": {},
    }
    return {"robot": robots, "hall": halls}, at_work, {**told, "shared": shared, "own": own}


def _drawn(case: Case, day: Day, name: str, taken: list[Spot], rng: np.random.Generator) -> tuple[Spot, Array]:
    """Draw a fault at one place where no fault of its kind is yet, as large as the case asks."""
    fault, gauge = FAULTS[name], day.gauge
    for _ in range(_DRAWS):
        values = fault.draw(gauge.setting, rng)
        spot = draw_spot(fault, np.zeros_like(values), rng)
        if all((spot.fault.name, spot.number) != (other.fault.name, other.number) for other in taken):
            break
    else:
        raise Unseen(f"{name} has no place left")
    taken.append(spot)
    size = float(np.abs(values[:, SIZE]).max()) * (np.sign(values[:, SIZE].sum()) or 1.0)
    values[:, SIZE] = 0.0
    wanted = day.instrument.noise * np.exp(rng.uniform(*np.log(case.ratio)))
    return spot, sized(gauge, fault, spot.moved(values, size), wanted, lambda moved: gauge.rms(gauge.left(moved)))


def _resized(values: Array, factor: float) -> Array:
    result = values.copy()
    result[:, SIZE] *= factor
    return result


def _named(spot: Spot, day: Day, values: Array) -> dict[str, Any]:
    kind, where = spot.place(day.setting)
    name, _ = spot.told(day.setting, np.where(np.arange(values.shape[1]) == SIZE, 0.0, values), 1.0)
    return {"effect": spot.fault.name, "place": {"kind": kind, "name": where}, "parameter": name}


AtWork = list[tuple[Fault, Array]]

_FIRST = date(2026, 1, 5)
_EVERY, _LATE = 30, 10  # days from one campaign to the next, and by how much one is early or late
_LARGEST = 10.0  # × noise: a change that must leave more to be told is not asked for


def make_several(case: Case, world: World, rng: np.random.Generator, folder: Path) -> dict[str, Any]:
    """Write the campaigns of a case into a folder, and return its answers.

    Raises
    ------
    Unseen
        If this draw hides what is asked.
    """
    several = _asked(case)
    count = int(rng.integers(several.campaigns[0], several.campaigns[1] + 1))
    habits = draw_habits(rng)
    days = [draw_day(case, world, habits, rng) for _ in range(count)]
    if case.kind == "fleet":
        labels, at_work, told = draw_fleet(case, several, days, rng)
    else:
        labels, at_work, told = _followed(case, several, days, rng)
    names = [f"{number + 1:02d}" for number in range(count)]
    samples = 0
    for name, day, faults in zip(names, days, at_work, strict=True):
        samples += write_day(folder / name, case, day, faults, rng)
    write_text(folder / LISTED, _list(names, labels))
    whole = {**told, "campaigns": count, "outliers": []}
    return {"truth": whole, "noise": habits.noise, "samples": samples, "measures": "position"}


def _asked(case: Case) -> Several:
    if case.several is None:
        raise ValueError(f"case {case.id} is one of a single campaign")
    return case.several


def _list(names: Sequence[str], labels: Mapping[str, Sequence[str]]) -> str:
    rows = zip(names, *labels.values(), strict=True)
    return "".join(",".join(row) + "\n" for row in (("campaign", *labels), *rows))


def _followed(
    case: Case, several: Several, days: Sequence[Day], rng: np.random.Generator
) -> tuple[dict[str, list[str]], list[AtWork], dict[str, Any]]:
    """Return dates, what is at work on each day, and the truth."""
    first, noise = days[0].gauge, days[0].instrument.noise
    done: AtWork = []
    for name in case.effects:
        fault = FAULTS[name]
        values = fault.draw(first.setting, rng)
        if several.how == "begins" and name == several.moves:
            values[:, 0] = 0.0
        else:
            wanted = noise * np.exp(rng.uniform(*np.log(case.ratio)))
            values = sized(first, fault, values, wanted, lambda moved: first.rms(first.left(moved)))
        done.append((fault, values))
    passed = np.cumsum([0, *rng.integers(_EVERY - _LATE, _EVERY + _LATE + 1, len(days) - 1)])
    dates = [(_FIRST + timedelta(days=int(day))).isoformat() for day in passed]
    at_work, changes = [done] * len(days), []
    if several.moves:
        at_work, change = _moving(several, days, done, passed / passed[-1], rng)
        changes.append(change)
    last = truth(case, days[-1].gauge, at_work[-1], [], noise)
    return {"date": dates}, at_work, {**last, "changes": changes}


def _moving(
    several: Several, days: Sequence[Day], done: AtWork, time: Array, rng: np.random.Generator
) -> tuple[list[AtWork], dict[str, Any]]:
    """Let one number of a fault change; return what is at work on each day, and what changed."""
    own = next(k for k, (fault, _) in enumerate(done) if fault.name == several.moves)
    fault, values = done[own]
    others = [item for k, item in enumerate(done) if k != own]
    spot, setting = draw_spot(fault, values, rng), days[0].setting
    after = None if several.how == "grows" else int(rng.integers(len(days) - 1))
    shape = time if after is None else (np.arange(len(days)) > after).astype(float)
    times = float(np.exp(rng.uniform(*np.log(several.change))))
    by = times * _tells(several, days, spot, values, others)
    by *= 1.0 if fault.name in GROWS_ONLY else float(rng.choice([-1.0, 1.0]))
    at_work = [[*done[:own], (fault, spot.moved(values, by * share)), *done[own + 1 :]] for share in shape.tolist()]
    name, amount = spot.told(setting, values, by)
    kind, where = spot.place(setting)
    return at_work, {
        "effect": fault.name,
        "place": {"kind": kind, "name": where},
        "parameter": name,
        "how": several.how,
        "after": after,
        "amount": amount,
        "deviations": times,
    }


def _tells(several: Several, days: Sequence[Day], spot: Spot, values: Array, others: AtWork) -> float:
    """Return the deviation in which a change is counted: of a difference, or of the first campaign."""
    noise = days[0].instrument.noise
    told = days[:2] if several.how == "changes" else days[:1]
    found = [deviation(day.gauge, spot, values, others, noise) for day in told]
    one = float(np.sqrt(sum(std**2 for std, _ in found)))
    if several.change[1] * one * max(leaves for _, leaves in found) > _LARGEST * noise:
        raise Unseen(f"a change of {spot.fault.name} would have to be large to be told from what else is at work")
    return one
