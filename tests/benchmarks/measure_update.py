"""Measure updates: how near to a fresh diagnosis they are, how long they take, how often the choice falls.

    python tests/benchmarks/measure_update.py equal --seeds 3
    python tests/benchmarks/measure_update.py time
    python tests/benchmarks/measure_update.py false --seeds 40
    python tests/benchmarks/measure_update.py change --seeds 20

Campaigns are those of ``tr.simulate``; seeds count up from 0. Not a part of the test suite: it takes minutes.
"""

import argparse
import time
from dataclasses import replace

import numpy as np

import thermal_robot as tr
from thermal_robot.effects.gate import checked
from thermal_robot.inference.columns import moved_by

UNKNOWN = {"base": np.eye(4), "tool": np.eye(4)}
NOISE = 2e-5
RV_M2 = ("builtin:rv_m2", "tool0")
WORN = {"joint_offset": {"joint_3": 5e-4, "joint_4": -4e-4}, "backlash": {"joint_2": 3e-4, "joint_3": 2e-4}}
UR10 = ("example-robot-data:ur10", "tool0")
DRIFTING = {"joint_gain": {"elbow_joint": 5e-4}, "drift": np.array([1e-4, 0.0, 2e-4, 0.0, 0.0, 0.0])}
CASES = {
    "zeros and play, RV-M2": (RV_M2, WORN, {}),
    "zeros and play, poses": (RV_M2, WORN, {"measures": "pose", "noise_orientation": 3e-5}),
    "warming links, UR5": (("example-robot-data:ur5", "tool0"), {"thermal_elongation": 1.5e-5}, {}),
    "gains and drift, UR10": (UR10, DRIFTING, {}),
    "compliance, UR10": (UR10, {"joint_compliance": 2e-6}, {}),
}
"""Robot, effects at work, and what is measured."""


def measured(case, rows, seed, noise_known=True, gross=0.0, effects=None):
    """Return a campaign of a case, its temperature and payload going up and down; some rows are gross errors."""
    robot, own, how = CASES[case]
    rng = np.random.default_rng([3, seed])
    clock = np.arange(float(rows))
    conditions = {
        "time": clock,
        "temperature": 24.0 + 4.0 * np.sin(clock / 37.0) + 0.1 * rng.normal(size=rows),
        "payload": rng.choice([0.0, 2.0, 4.0], rows),
    }
    how = {**UNKNOWN, **how, "rows": rows, "noise": NOISE, "seed": seed, "conditions": conditions}
    found = tr.simulate(robot[0], effects or own, tool_frame=robot[1], **how)
    place = found.position + (rng.uniform(size=rows) < gross)[:, None] * 1e-3 * rng.normal(size=(rows, 3))
    return replace(found, position=place, noise_position=found.noise_position if noise_known else None)


def figures(found):
    """Values, deviations, noise and remainder of a diagnosis."""
    e, names = found.fit.explanation, [effect.name for effect, _ in found.fit.effects]
    values = np.concatenate([v for _, v in found.fit.effects])
    deviations = np.concatenate([np.sqrt(np.diag(e.values[b][1])) for b in e.best.blocks])
    return names, values, deviations, float(e.whitening.noise[0] * e.best.noise), found.gap.rms_after


def alike(found, fresh):
    """Tell whether two diagnoses chose the same: effects whose parameters do the same in all rows."""
    there = fresh.fit.corrected
    own, other = ([moved_by(there, checked(e, there)) for e, _ in d.model.effects] for d in (found, fresh))
    names = [[e.name for e, _ in d.model.effects] for d in (found, fresh)]
    return names[0] == names[1] and all(
        a.shape == b.shape and np.allclose(a, b, 1e-9) for a, b in zip(own, other, strict=True)
    )


def equal(seeds, old=400, more=200):
    """Compare an update with the diagnosis of all rows, where both chose the same."""
    print(
        "case | seed | same choice | values, of deviation, of size | deviations | noise | rms | prediction, nm | rest"
    )
    for case in CASES:
        for seed in range(seeds):
            whole = measured(case, old + more, seed, noise_known=seed % 2 == 0, gross=0.02 * (seed % 3 == 2))
            order = np.random.default_rng(seed).permutation(old + more)
            found = tr.diagnose(whole.take(np.sort(order[:old])))
            updated = found
            for part in np.split(np.sort(order[old:]), 4):
                updated = updated.update(whole.take(part))
            fresh = tr.diagnose(whole)
            same = alike(found, fresh)
            line = f"{case} | {seed} | {same} {updated.choice_stands} {updated.reason}"
            if same and fresh.fit.effects:
                _, values, deviations, noise, rms = figures(fresh)
                own = updated.parameters
                far = np.abs(updated.model.prediction(whole)[0] - fresh.model.prediction(whole)[0]).max()
                told = np.abs(values) > 3.0 * deviations
                apart = np.abs(own["value"].to_numpy() - values)
                wide = np.abs(own["std"].to_numpy() / deviations - 1.0).max()
                size = (apart[told] / np.abs(values[told])).max(initial=0.0)
                rest = fresh.update(whole.take([]))
                still = np.abs((own["value"] - rest.parameters["value"]).to_numpy() / deviations).max()
                line += (
                    f" | {(apart / deviations).max():.1e} {size:.1e} | {wide:.1e} | "
                    f"{updated.noise / noise - 1.0:.1e} | {updated.rms_after / rms - 1.0:.1e} | {far * 1e9:.1e} | "
                    f"{still:.1e}"
                )
            print(line, flush=True)


def times(batches=5):
    """Time an update of 100 rows after 1000 and 20 000."""
    case, middle = "zeros and play, RV-M2", {}
    for old in (1000, 20000):
        whole = measured(case, old + 100 * batches, 1)
        begin = time.perf_counter()
        updated = tr.diagnose(whole.take(np.arange(old)))
        print(f"{old} rows: diagnosed in {time.perf_counter() - begin:.1f} s")
        spent = []
        for k in range(batches):
            new = whole.take(np.arange(old + 100 * k, old + 100 * k + 100))
            begin = time.perf_counter()
            updated = updated.update(new)
            spent.append((round(time.perf_counter() - begin, 3), updated.anew))
        middle[old] = float(np.median([s for s, _ in spent]))
        print(f"{old} rows: 100 more in {middle[old] * 1e3:.0f} ms; each, and whether all rows were looked at: {spent}")
    print(f"ratio {middle[20000] / middle[1000]:.2f}")


def false(seeds, old=300, batches=20, more=50):
    """Count how often the choice falls while nothing changes."""
    fallen = {"each": 0, "stream": 0}
    reasons, updates = [], 0
    for seed in range(seeds):
        case = list(CASES)[seed % len(CASES)]
        whole = measured(case, old + batches * more, 1000 + seed)
        order = np.random.default_rng(seed).permutation(whole.samples)
        found = tr.diagnose(whole.take(np.sort(order[:old])))
        stream = found
        for part in np.split(order[old:], batches):
            new = whole.take(np.sort(part))
            each, stream = found.update(new), stream.update(new)
            updates += 1
            fallen["each"] += not each.choice_stands
            if not each.choice_stands:
                reasons.append((case, seed, "each", each.reason))
        fallen["stream"] += not stream.choice_stands
        if not stream.choice_stands:
            reasons.append((case, seed, "stream", stream.reason))
        print(case, seed, found.verdict, found.fit.explanation.discrepancy.kernel, fallen, updates, flush=True)
    print(*reasons, sep="\n")


def change(seeds, old=300, more=100):
    """Count how often the choice falls where play begins in another joint with the new rows."""
    case, found_at = "zeros and play, RV-M2", {}
    for seed in range(seeds):
        whole = measured(case, old, 2000 + seed)
        found = tr.diagnose(whole)
        for size in (0.5e-4, 1e-4, 2e-4, 3e-4):
            changed = {**WORN, "backlash": {**WORN["backlash"], "joint_4": size}}
            updated = found.update(measured(case, more, 3000 + seed, effects=changed))
            found_at.setdefault(size, []).append((not updated.choice_stands, "joint_4" in updated.reason))
        print(seed, {s: np.mean(v, axis=0).tolist() for s, v in found_at.items()}, flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=("equal", "time", "false", "change"))
    parser.add_argument("--seeds", type=int, default=3)
    given = parser.parse_args()
    {"equal": equal, "time": lambda _: times(), "false": false, "change": change}[given.what](given.seeds)
