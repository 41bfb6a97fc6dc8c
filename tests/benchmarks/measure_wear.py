"""How often `wear` is right: false alarms, day and joint of a jump, rates of trends, one told from the other.

    python tests/benchmarks/measure_wear.py --series 100 --processes 2

Each series is 12 campaigns of one arm over a year, 60 to 100 rows each, positions with 25 µm of noise, instrument and
target elsewhere each time. Constant in all: zeros of a milliradian in every joint, expansion of the links in a hall
whose temperature is another each time, play and a gain error in one joint each. Then nothing, or a jump of one joint's
zero by four deviations of one campaign on a day drawn from all, or a trend of a zero or of the play. The effects that
are at work compete in each campaign, in all places and in single ones; which are named there is left to it. Seeds count
from 0.
"""

import argparse
import json
import os
from collections import Counter
from dataclasses import replace
from datetime import datetime, timedelta
from multiprocessing import Pool
from pathlib import Path

import numpy as np

from thermal_robot import load_robot, simulate
from thermal_robot.effects import choose
from thermal_robot.fleet.wear import of_fits
from thermal_robot.fleet.wear_problem import problem
from thermal_robot.inference.fit import fit
from thermal_robot.inference.registration import register
from thermal_robot.kinematics import quaternion_to_rotation
from thermal_robot.observations import observe

ARMS = ("example-robot-data:ur10", "builtin:rv_m2", "example-robot-data:ur5")
KINDS = ("none", "jump", "trend")
CAMPAIGNS, NOISE, JUMP = 12, 25e-6, 4.0
TREND = (4.0, 16.0)
"""Change over the whole series, in deviations of one campaign."""


REFIT = bool(os.environ.get("REFIT"))
"""Whether effects are named anew in every campaign that has changed: three times as long."""


class Series:
    """A robot with constant errors, and what of it changes."""

    def __init__(self, seed, kind, fits):
        self.seed, self.fits = seed, fits
        self.rng = rng = np.random.default_rng([seed, 17])
        self.robot = robot = load_robot(ARMS[seed % len(ARMS)], "tool0")
        joints = robot.joint_names
        self.kind, self.joint = kind, joints[int(rng.integers(1, len(joints) - 1))]
        self.worn = "backlash" if rng.uniform() < 0.5 and kind == "trend" else "joint_offset"
        self.effects = {
            "joint_offset": dict(zip(joints, 1e-3 * rng.normal(size=len(joints)), strict=True)),
            "thermal_elongation": rng.uniform(0.8e-5, 1.6e-5),
            "backlash": {self.joint: rng.uniform(2e-4, 5e-4)},
            "joint_gain": {joints[int(rng.integers(1, len(joints) - 1))]: 5e-4 * rng.normal()},
        }
        self.after = int(rng.integers(CAMPAIGNS - 1))
        sign = rng.choice([-1.0, 1.0])
        sign = 1.0 if self.worn == "backlash" else sign
        self.amount = {"none": 0.0, "jump": JUMP, "trend": rng.uniform(*TREND)}[kind] * sign
        days = 30.0 * np.arange(CAMPAIGNS) + rng.integers(-10, 11, CAMPAIGNS)
        self.days = (days - days[0]).astype(int)
        self.plans = [self._plan() for _ in range(CAMPAIGNS)]

    def _plan(self):
        rng = self.rng
        base, tool = np.eye(4), np.eye(4)
        base[:3, :3] = quaternion_to_rotation(rng.normal(size=(1, 4)))[0]
        base[:3, 3], tool[:3, 3] = rng.uniform(-2.0, 2.0, 3), [*rng.uniform(-0.08, 0.08, 2), rng.uniform(0.03, 0.12)]
        rows = int(rng.integers(60, 101))
        run = np.arange(rows) / rows
        warm = rng.uniform(17.0, 27.0) + rng.uniform(2.0, 6.0) * -np.expm1(-run / rng.uniform(0.1, 0.6))
        conditions = {"time": 60.0 * np.arange(rows), "temperature": warm}
        return dict(
            rows=rows, noise=NOISE, base=base, tool=tool, base_known=False, tool_known=False, conditions=conditions,
            seed=int(rng.integers(2**31)),
        )  # fmt: skip

    def shape(self, k):
        return float(k > self.after) if self.kind == "jump" else float(self.days[k] / self.days[-1])

    def campaign(self, k, change=0.0):
        own = {name: dict(v) if isinstance(v, dict) else v for name, v in self.effects.items()}
        if change:
            own[self.worn][self.joint] += change * self.shape(k)
        return simulate(self.robot, own, **self.plans[k])

    def fit(self, k, change=0.0):
        """Campaign ``k`` fitted by itself; without ``REFIT`` a change is put into it after effects were named there.

        Then weights, noise and names are those of the same poses and readings before the change, which is of their
        size; all that follows is made of the changed campaign.
        """
        change = change if change and self.shape(k) else 0.0
        if (k, change) not in self.fits:
            campaign = self.campaign(k, change)
            if change and not REFIT:
                before = self.fit(k)
                nominal = observe(campaign, register(campaign, ~before.explanation.outliers))
                self.fits[k, change] = replace(before, campaign=campaign, nominal=nominal)
            else:
                self.fits[k, change] = fit(campaign, choose(tuple(self.effects), (), ()))
        return self.fits[k, change]

    def deviation(self):
        """What one campaign alone knows of the parameter that moves, beside all that is at work."""
        known = problem([self.fit(0)] * 2)
        own = [k for k, (effect, name) in enumerate(known.keys) if effect == self.worn and name.endswith(self.joint)]
        if not own:  # play too small to be named in one campaign
            return 0.0
        held = known.matrices[0] + np.eye(len(known.keys))
        return float(np.sqrt(np.linalg.inv(held)[own[0], own[0]]) * known.parameters[own[0]].size)


def one(seed):
    """Follow one robot thrice: nothing changes, a jump, a trend."""
    fits = {}
    return [told(Series(seed, kind, fits)) for kind in KINDS]


def told(series):
    """What came out of one series, as plain values."""
    sigma = 1.0 if series.kind == "none" else series.deviation()
    change = float(sigma * series.amount)
    dates = [datetime(2026, 1, 5) + timedelta(days=int(d)) for d in series.days]
    found = of_fits([series.fit(k, change) for k in range(CAMPAIGNS)], dates)
    own = next((w for w in found.parameters if (w.effect, w.place) == (series.worn, series.joint)), None)
    rate = [own.rate.value, own.rate.std, change / float(series.days[-1])] if own and own.rate and own.alarm else None
    return {
        "seed": series.seed, "kind": series.kind, "worn": series.worn, "joint": series.joint, "after": series.after,
        "amount": float(series.amount), "sigma": sigma, "rate": rate, "scatter": found.scatter,
        "rings": [[w.effect, w.place, w.kind, w.jump.after if w.jump else None, w.chance] for w in found.alarms],
        "told": own.kind if own and own.alarm else "constant", "least": min(w.chance for w in found.parameters),
        "jumped": [own.jump.earliest, own.jump.latest] if own and own.jump and own.alarm else None,
    }  # fmt: skip


def table(results):
    """Print what was measured."""
    by = {kind: [r for r in results if r["kind"] == kind] for kind in KINDS}
    rung = sum(bool(r["rings"]) for r in by["none"])
    print(f"false alarms, stated at most 1 %: {rung} of {len(by['none'])} series without a change")
    jumps = by["jump"]
    right = [[[*x[:4]] for x in r["rings"] if x[1] == r["joint"]] == [at(r)] for r in jumps]
    alone = sum([[*x[:4]] for x in r["rings"]] == [at(r)] for r in jumps)
    inside = [r["jumped"][0] <= r["after"] < r["jumped"][1] for r in jumps if r["jumped"]]
    print(f"jump of {JUMP:g} sigma: day and joint right {sum(right)} of {len(jumps)}, and nothing else rings {alone}")
    print(f"    day in its 95 % interval {sum(inside)} of {len(inside)}")
    rates = [r["rate"] for r in by["trend"] if r["rate"]]
    hit = sum(abs(value - true) < 1.96 * std for value, std, true in rates)
    print(f"trend of {TREND[0]:g} to {TREND[1]:g} sigma: rate in its 95 % interval {hit} of {len(rates)} told so")
    extra = sum(any([*x[:2]] != [r["worn"], r["joint"]] for x in r["rings"]) for r in by["trend"])
    print(f"    something else rings, too: {extra} of {len(by['trend'])}")
    displayed_status = ("constant", "jump", "trend", "walk")
    print(f"{'what the parameter does':26}" + "".join(f"{'told ' + t:>15}" for t in displayed_status))
    for kind in ("jump", "trend"):
        count = Counter(r["told"] for r in by[kind])
        print(f"{kind:26}" + "".join(f"{count[t]:15d}" for t in displayed_status))


def at(result):
    """How a jump is told that is told right."""
    return [result["worn"], result["joint"], "jump", result["after"]]


def main():
    """Follow so many series of each kind; results are kept line by line, so that a stopped run goes on."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--series", type=int, default=100)
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--keep", type=Path, help="file of results, one JSON object a line")
    options = parser.parse_args()
    text = options.keep.read_text() if options.keep and options.keep.exists() else ""
    results = [json.loads(line) for line in text.splitlines()]
    done = {r["seed"] for r in results}
    tasks = [seed for seed in range(options.series) if seed not in done]
    with Pool(options.processes) as pool:
        for three in pool.imap_unordered(one, tasks):
            results += three
            if options.keep:
                with options.keep.open("a") as file:
                    file.write("".join(json.dumps(result) + "\n" for result in three))
    table(results)


if __name__ == "__main__":
    main()
