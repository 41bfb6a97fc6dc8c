"""Generation of a case: one or several campaigns, and the answers that stay outside.

Of several campaigns of one robot: it errs alike on all days, but for one number that is another from a day on, or grows
in a straight line of time. Of a fleet: a fault that all its robots share, or those of one hall, and faults of single
robots. Other poses, another hall, the instrument elsewhere and the target mounted anew each time.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from datetime import date, timedelta
from pathlib import Path
from typing import Any

import numpy as np

from thermal_robot.blind.cases import LISTED, Case, Several
from thermal_robot.blind.reality.fault import FAULTS, Fault
from thermal_robot.blind.reality.instrument import Day, Instrument, measure, registered, write_folder
from thermal_robot.blind.reality.setting import Setting, draw_setting, humidity
from thermal_robot.blind.reality.sizes import (
    GROWS_ONLY,
    SIZE,
    FaultParameter,
    Gauge,
    Unseen,
    deviation,
    draw_fault_parameter,
    sized,
    truth,
)
from thermal_robot.blind.reality.unlisted import known
from thermal_robot.blind.reality.world import Array, World, anywhere
from thermal_robot.files import write_text

AtWork = list[tuple[Fault, Array]]


FRESH = 1000
"""Rows to be predicted, ten times what is given: else their own scatter would count against intervals that hold."""
_PRESENT = 0.5  # × noise per axis: what leaves less, given the others, is not present
_TRIES = 8
_DIGITS = 9  # of answers in m: a ten-thousandth of the noise
_VISITS = (2, 5)
_NOISE = (10e-6, 30e-6)  # m, one sigma per axis
_STATED = 0.85  # of cases: the file states the noise
_SPOILT = (0.0, 0.03)  # share of rows
_TARGET = ([-0.03, -0.03, 0.04], [0.03, 0.03, 0.16])  # m: in the tool frame
_TAILS = (3.0, 8.0)  # degrees of freedom: from the fewest with a third moment to nearly Gauss' law


def make(case: Case, folder: Path) -> dict[str, Any]:
    """Generate a case's campaign, or its several campaigns, in a folder and return the answers.

    The folder gets campaign.toml, measurements.csv, robot.urdf and fresh.csv (commands to predict, without answers);
    everything that is drawn follows from the case's seed.

    Returns
    -------
    dict
        ``withdrawn`` with the reason where what is asked cannot be seen in any draw; else ``truth`` as in
        :mod:`thermal_robot.blind.cases`, ``noise`` (m), ``samples``, ``measures``, ``fresh_position`` (M, 3)
        where the target really is, ``fresh_before`` (M, 3) where frames alone put it. Of several campaigns nothing is
        predicted.
    """
    rng = np.random.default_rng(case.seed)
    world = World(case.robot.urdf, case.robot.tool_frame)
    several = case.several
    for _ in range(_TRIES):
        try:
            return make_several(case, several, world, rng, folder) if several else _attempt(case, world, rng, folder)
        except Unseen as unseen:  # this draw hides its own fault: draw again
            reason = unseen
    return {"withdrawn": str(reason)}


def _attempt(case: Case, world: World, rng: np.random.Generator, folder: Path) -> dict[str, Any]:
    main = [known(name, case.own) for name in (*case.effects, *([case.unlisted] if case.unlisted else ()))]
    wants = {*case.wants, *(want for fault in main for want in fault.wants)}
    samples = _samples(case, rng)
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
    instrument = _instrument(case, wants, rng)
    day = Day(setting, instrument)
    gauge = day.gauge
    done = [(fault, _of_size(case, gauge, fault, instrument.noise, rng)) for fault in main]
    if case.ratio[0] > 1.0:  # of what is smaller than the noise nobody asks that it be told from the rest
        _require_apart(gauge, [(fault, values) for fault, values in done if fault.name in FAULTS], instrument.noise)
    background = _background(case, gauge, main, instrument.noise, rng)
    seen, measured, spoilt = measure(day, [*done, *background], rng)
    write_folder(folder, case, day, measured, _gears(setting, done))
    before = registered(day, measured[["x", "y", "z"]].to_numpy(), spoilt)
    return {
        "truth": {**truth(case, gauge, done, background, instrument.noise), "outliers": spoilt},
        "noise": instrument.noise,
        "samples": samples,
        "measures": "pose" if instrument.turning is not None else "position",
        "fresh_position": seen[~setting.given].round(_DIGITS).tolist(),
        "fresh_before": before[~setting.given].round(_DIGITS).tolist(),
    }


def _record(setting: Setting, wants: set[str], rng: np.random.Generator) -> None:
    """Add columns of humidity, motor temperature and speed where a fault follows them; the last two at random, too."""
    if "humidity" in wants and "humidity" not in setting.extra:
        setting.extra["humidity"] = humidity(setting.samples, rng)
    if "motor_temperature" in wants or rng.random() < 0.2:
        run = (setting.time - setting.time[0]) / setting.time[-1]
        shift = max(setting.samples // 10, 1)  # rows over which its load stays alike
        load = np.convolve(rng.normal(size=setting.samples + shift - 1), np.ones(shift) / np.sqrt(shift), "valid")
        setting.extra["motor_temperature"] = np.round(24.0 + 28.0 * -np.expm1(-run / 0.3) + 6.0 * load, 1)
    if "speed" in wants or rng.random() < 0.4:
        setting.extra["speed"] = setting.speed


def _gears(setting: Setting, done: AtWork) -> dict[str, float]:
    """Gear ratios by joint that the file must state to make errors on the motor's side testable."""
    ratios = {float(v) for fault, values in done if fault.name == "transmission_error" for v in values[:, 4]} - {1.0}
    return {name: ratio for ratio in sorted(ratios) for name in setting.world.names}


def _instrument(case: Case, wants: set[str], rng: np.random.Generator) -> Instrument:
    base_known = "base_known" in wants or bool(rng.random() < 0.1)
    tool_known = "tool_known" in wants or bool(rng.random() < 0.1)
    pose = rng.random() < (1.0 if tool_known and "tool_known" in wants else 0.4)
    target = rng.uniform(*_TARGET)
    return Instrument(
        pose=np.eye(4) if base_known else anywhere(rng, 3.0),
        target=target,
        declared=target if tool_known else target + rng.uniform(-0.01, 0.01, 3),
        base_known=base_known,
        tool_known=tool_known,
        noise=float(rng.uniform(*_NOISE)),
        turning=3e-5 if pose else None,
        stated=bool(rng.random() < _STATED),
        tails=float(rng.uniform(*_TAILS)) if case.heavy else np.inf,
        spoilt=float(rng.choice([*_SPOILT, 0.1] if case.heavy else _SPOILT)),
    )


def _of_size(case: Case, gauge: Gauge, fault: Fault, noise: float, rng: np.random.Generator) -> Array:
    """Draw a fault's values, scaled to a log-uniform residual rms per axis over the noise, as the case asks for.

    Where the cause is outside the library, removed from it, or hidden, that is the residual after the best imitation by
    two other effects; :class:`Unseen` if they imitate 85 % of it.
    """
    wanted = noise * np.exp(rng.uniform(*np.log(case.ratio)))
    rough = sized(gauge, fault, fault.draw(gauge.setting, rng), wanted)
    if case.kind not in ("removed", "hidden") and fault.name != case.unlisted:
        return rough
    others = [name for name in FAULTS if name not in case.effects]
    beyond = gauge.beyond(fault, gauge.moved(fault, rough), others, together=2)
    share = min(beyond.values(), default=wanted) / wanted
    if share < 0.15:
        raise Unseen(f"{fault.name} is what {min(beyond, key=lambda name: beyond[name])} can do as well")
    return fault.scaled(rough, 1.0 / share)


def _require_apart(gauge: Gauge, done: AtWork, noise: float) -> None:
    """Raise :class:`Unseen` if another of several effects imitates one to less than half the noise, rms per axis."""
    if len(done) < 2:
        return
    for fault, values in done:
        moved = gauge.moved(fault, values)
        beyond = gauge.beyond(fault, moved, [other.name for other, _ in done])
        if min(beyond.values(), default=np.inf) < _PRESENT * noise:
            raise Unseen(f"{fault.name} is hidden by the other effect")


def _background(case: Case, gauge: Gauge, main: Sequence[Fault], noise: float, rng: np.random.Generator) -> AtWork:
    if not case.background:
        return []
    named, quiet = {fault.name for fault in main}, []
    skipped = {"base_frame", "tool_frame", "tracking_lag", *case.without}
    for name, fault in FAULTS.items():
        if name in named or name in skipped:
            continue
        values = fault.draw(gauge.setting, rng)
        with suppress(Unseen):  # what cannot be seen here has no size to give it
            quiet.append((fault, sized(gauge, fault, values, case.background * noise)))
    return quiet


_SENSORS = ("robot", "links")
"""Temperature sensors that may be recorded: where only the air is, their lag would be another wall's each day."""


def draw_days(case: Case, world: World, count: int, rng: np.random.Generator) -> list[Day]:
    """Draw ``count`` days, each a campaign of positions with its own poses, instrument place, target and outliers.

    All days share the instrument's noise, whether it is stated, and the temperature sensors.
    """
    noise, stated = float(rng.uniform(*_NOISE)), bool(rng.random() < _STATED)
    sensor, days = str(rng.choice(_SENSORS)), []
    for _ in range(count):
        setting = draw_setting(world, _samples(case, rng), rng, sensor=sensor)
        target = rng.uniform(*_TARGET)
        pose, declared = anywhere(rng, 3.0), target + rng.uniform(-0.01, 0.01, 3)
        spoilt = float(rng.choice(_SPOILT))
        days.append(Day(setting, Instrument(pose, target, declared, noise, stated=stated, spoilt=spoilt)))
    return days


def _samples(case: Case, rng: np.random.Generator) -> int:
    return int(rng.integers(case.samples[0], case.samples[1] + 1))


_HALLS = ("hall 1", "hall 2")
_ALIKE = 0.1
"""Scatter of a shared fault among robots, of its size: what one jig, one batch or one floor does to all is alike."""
_DRAWS = 20


def draw_fleet(
    case: Case, several: Several, days: Sequence[Day], rng: np.random.Generator
) -> tuple[dict[str, list[str]], list[AtWork], dict[str, Any]]:
    """Draw a fleet, a robot for each day: its labels (``robot``, ``hall``), the faults of each robot, and the truth."""
    count = len(days)
    robots = [f"r{number + 1:02d}" for number in range(count)]
    # halls of equal size, but for one
    halls = [_HALLS[k % 2] for k in rng.permutation(count)]
    at_work: list[AtWork] = [[] for _ in days]
    taken: list[FaultParameter] = []
    shared, own = [], []
    if several.moves:
        group = str(rng.choice(_HALLS)) if several.how == "hall" else None
        members = [k for k in range(count) if group in (None, halls[k])]
        spot, values = _drawn(case, days[members[0]], several.moves, taken, rng)
        for k in members:
            at_work[k].append((spot.fault, spot.fault.scaled(values, float(np.exp(_ALIKE * rng.normal())))))
        shared.append({**_named(spot, days[0], values), "group": group})
    # one robot each, whichever hall it stands in
    for name, k in zip(several.apart, rng.permutation(count).tolist(), strict=False):
        spot, values = _drawn(case, days[k], name, taken, rng)
        at_work[k].append((spot.fault, values))
        own.append({"robot": robots[k], **_named(spot, days[k], values)})
    effects = list(dict.fromkeys((*case.effects, *several.apart)))
    told: dict[str, Any] = {"effects": effects, "unlisted": None, "parts": {}, "shared": shared, "own": own}
    return {"robot": robots, "hall": halls}, at_work, told


def _drawn(
    case: Case, day: Day, name: str, taken: list[FaultParameter], rng: np.random.Generator
) -> tuple[FaultParameter, Array]:
    """Draw a fault in one place not in ``taken``, add it there, and scale it to the residual rms that the case asks."""
    fault, gauge = FAULTS[name], day.gauge
    for _ in range(_DRAWS):
        values = fault.draw(gauge.setting, rng)
        spot = draw_fault_parameter(fault, np.zeros_like(values), rng)
        if all((spot.fault.name, spot.number) != (other.fault.name, other.number) for other in taken):
            break
    else:
        raise Unseen(f"{name} has no place left")
    taken.append(spot)
    size = float(np.abs(values[:, SIZE]).max()) * (np.sign(values[:, SIZE].sum()) or 1.0)
    values[:, SIZE] = 0.0
    wanted = day.instrument.noise * np.exp(rng.uniform(*np.log(case.ratio)))
    return spot, sized(gauge, fault, spot.moved(values, size), wanted)


def _named(spot: FaultParameter, day: Day, values: Array) -> dict[str, Any]:
    return spot.change(day.setting, np.where(np.arange(values.shape[1]) == SIZE, 0.0, values), 1.0)[0]


_FIRST = date(2026, 1, 5)
_EVERY, _LATE = 30, 10  # days from one campaign to the next, and by how much one is early or late
_LARGEST = 10.0  # × noise: a change that must leave more to be told is not asked for


def make_several(case: Case, several: Several, world: World, rng: np.random.Generator, folder: Path) -> dict[str, Any]:
    """Simulate several campaigns of one robot or of a fleet, write them with their list, and return the answers."""
    count = int(rng.integers(several.campaigns[0], several.campaigns[1] + 1))
    days = draw_days(case, world, count, rng)
    if case.kind == "fleet":
        labels, at_work, told = draw_fleet(case, several, days, rng)
    else:
        labels, at_work, told = _followed(case, several, days, rng)
    names = [f"{number + 1:02d}" for number in range(count)]
    for name, day, faults in zip(names, days, at_work, strict=True):
        write_folder(folder / name, case, day, measure(day, faults, rng)[1])
    rows = [("campaign", *labels), *zip(names, *labels.values(), strict=True)]
    write_text(folder / LISTED, "".join(",".join(row) + "\n" for row in rows))
    whole, samples = {**told, "campaigns": count, "outliers": []}, sum(day.setting.samples for day in days)
    return {"truth": whole, "noise": days[0].instrument.noise, "samples": samples, "measures": "position"}


def _followed(
    case: Case, several: Several, days: Sequence[Day], rng: np.random.Generator
) -> tuple[dict[str, list[str]], list[AtWork], dict[str, Any]]:
    first, noise = days[0].gauge, days[0].instrument.noise
    done: AtWork = []
    for name in case.effects:
        fault = FAULTS[name]
        values = fault.draw(first.setting, rng)
        if several.how == "begins" and name == several.moves:
            values[:, 0] = 0.0
        else:
            wanted = noise * np.exp(rng.uniform(*np.log(case.ratio)))
            values = sized(first, fault, values, wanted)
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
    """Change one size of a fault from a day on, or linearly in time; return each day's faults, and the true change."""
    own = next(k for k, (fault, _) in enumerate(done) if fault.name == several.moves)
    fault, values = done[own]
    others = [item for k, item in enumerate(done) if k != own]
    spot = draw_fault_parameter(fault, values, rng)
    after = None if several.how == "grows" else int(rng.integers(len(days) - 1))
    shape = time if after is None else (np.arange(len(days)) > after).astype(float)
    times = float(np.exp(rng.uniform(*np.log(several.change))))
    by = times * _tells(several, days, spot, values, others)
    by *= 1.0 if fault.name in GROWS_ONLY else float(rng.choice([-1.0, 1.0]))
    at_work = [[*done[:own], (fault, spot.moved(values, by * share)), *done[own + 1 :]] for share in shape.tolist()]
    told, amount = spot.change(days[0].setting, values, by)
    return at_work, {**told, "how": several.how, "after": after, "amount": amount, "deviations": times}


def _tells(several: Several, days: Sequence[Day], spot: FaultParameter, values: Array, others: AtWork) -> float:
    """Return the standard deviation of a fault's size by one campaign; for ``changes``, of the difference of two.

    :class:`Unseen` if the largest change asked for would leave more than ten times the noise.
    """
    noise = days[0].instrument.noise
    told = days[:2] if several.how == "changes" else days[:1]
    found = [deviation(day.gauge, spot, values, others, noise) for day in told]
    one = float(np.sqrt(sum(std**2 for std, _ in found)))
    if several.change[1] * one * max(leaves for _, leaves in found) > _LARGEST * noise:
        raise Unseen(f"a change of {spot.fault.name} would have to be large to be told from what else is at work")
    return one
