"""Series of campaigns as products, made of columns that are at hand; a robot over time that nobody measured."""

from dataclasses import replace

import numpy as np

from thermal_robot.fleet.wear_moves import Series
from thermal_robot.fleet.wear_result import Crossing, Jump, Rate, Visit, Wear, Worn

ROWS = 30


def columns(campaigns, parameters, seed):
    """(K, rows, P) columns of each campaign, in units of the noise, and a generator that goes on."""
    rng = np.random.default_rng(seed)
    return 3.0 * rng.normal(size=(campaigns, ROWS, parameters)), rng


def measured(design, states, rng):
    """(K, rows) what is measured of (K, P) states with a noise of 1."""
    return np.einsum("krp,kp->kr", design, states) + rng.normal(size=design.shape[:2])


def series_of(design, values, times, followed=None):
    """The same as products."""
    followed = np.ones(design.shape[2], dtype=bool) if followed is None else np.asarray(followed)
    matrices = np.einsum("krp,krq->kpq", design, design)
    return Series(matrices, np.einsum("krp,kr->kp", design, values), np.asarray(times, dtype=float), followed)


def jumping(campaigns=8, parameters=4, which=1, after=4, size=1.0, seed=0):
    """A series of which one parameter jumps."""
    design, rng = columns(campaigns, parameters, seed)
    states = np.tile(rng.normal(size=parameters), (campaigns, 1))
    states[after + 1 :, which] += size
    return series_of(design, measured(design, states, rng), np.arange(campaigns) * 10.0)


def worn(parameter, place, **other):
    """A parameter that stays, unless it is said otherwise."""
    stays = Worn(
        effect="joint_offset", title="joint zero offsets", parameter=parameter, place=place, unit="rad",
        comparable=True, reason="", moved=0.01, kinds={"constant": 0.99, "jump": 0.01, "trend": 0.0, "walk": 0.0},
        change=0.0, change_std=0.0, values=(1e-3, 1.01e-3, 0.99e-3, 1e-3), stds=(1e-5,) * 4, fitted=(1e-3,) * 4,
    )  # fmt: skip
    return replace(stays, **other)


def by_hand(dated=True):
    """One joint jumps, play grows, one stays, one cannot be compared."""
    dates = ("2026-01-01", "2026-02-01", "2026-03-01", "2026-04-01") if dated else ("",) * 4
    times = (0.0, 31.0, 59.0, 90.0) if dated else (0.0, 1.0, 2.0, 3.0)
    visits = tuple(Visit(f"run_{k}", d, t, 80) for k, (d, t) in enumerate(zip(dates, times, strict=True)))
    jumps = worn(
        "zero offset, elbow", "elbow", alarm=True, chance=1e-6, moved=0.999, kind="jump",
        kinds={"constant": 0.001, "jump": 0.989, "trend": 0.01, "walk": 0.0},
        jump=Jump(1, 0.97, (0.01, 0.97, 0.02), 1, 2, 2e-4, 2e-5), change=2e-4, change_std=2e-5,
        values=(1e-3, 1.01e-3, 1.2e-3, 1.21e-3), fitted=(1e-3, 1e-3, 1.2e-3, 1.2e-3),
        crossing=Crossing(3e-3, "never"), confounded_with=("zero offset, wrist",),
    )  # fmt: skip
    grows = worn(
        "lost motion, wrist", "wrist", effect="backlash", title="lost motion in the joints", alarm=True, chance=1e-4,
        moved=0.99, kind="trend", kinds={"constant": 0.01, "jump": 0.04, "trend": 0.9, "walk": 0.05},
        rate=Rate(1e-6, 1e-7) if dated else None, change=9e-5, change_std=9e-6,
        values=(3e-4, 3.3e-4, None, 3.9e-4), stds=(1e-5, 1e-5, None, 1e-5),
        fitted=(3e-4, 3.31e-4, 3.59e-4, 3.9e-4),
        crossing=Crossing(5e-4, "expected", 200.0, 180.0, 230.0, ("2026-07-20", "2026-06-30", "2026-08-19"))
        if dated
        else Crossing(5e-4, "unknown"),
    )  # fmt: skip
    hidden = worn("zero offset, pan", "pan", comparable=False, reason="unknown frames hide its changes", moved=0.0)
    shown = (jumps, grows, worn("zero offset, lift", "lift"), hidden)
    return Wear("arm", visits, dated, shown, 0.01, 1.1, 1e-6, ("a <note> to know",))
