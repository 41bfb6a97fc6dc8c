"""One case becomes a folder with a campaign, and the answers that stay outside it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.blind.cases import Case
from thermal_robot.blind.reality.fault import Fault
from thermal_robot.blind.reality.faults import FAULTS
from thermal_robot.blind.reality.instrument import Instrument, measure, registered
from thermal_robot.blind.reality.lots import make_several
from thermal_robot.blind.reality.own import known
from thermal_robot.blind.reality.rigid import anywhere
from thermal_robot.blind.reality.setting import Setting, draw_setting, humidity
from thermal_robot.blind.reality.sizes import Gauge, Unseen, place, sized
from thermal_robot.blind.reality.tables import write_folder
from thermal_robot.blind.reality.truth import truth
from thermal_robot.blind.reality.world import World

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
        predicted: see :mod:`thermal_robot.blind.reality.lots`.
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
