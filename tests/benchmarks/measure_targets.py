"""The README's table of measured figures: runs the command line on every public campaign and prints what it reached.

Start it as a script with ``THERMAL_ROBOT_DATA`` set to the folder of the campaigns. Arguments choose some of the
parts: ``ur5``, ``wam``, ``open_cases``, ``ipa``; without any all are measured. Times are by the clock; where the
machine has other work to do, go by the seconds of the processor.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pandas as pd

import thermal_robot as tr

COMMAND = [sys.executable, "-m", "thermal_robot.cli"]
AXES = ["x", "y", "z"]


def diagnose(campaign, folder):
    """Diagnose through the command line; return the JSON, (seconds with start-up, of the processor), and the model."""
    found, model = folder / "diagnosis.json", folder / "model.json"
    begun, used = time.perf_counter(), processor()
    call = [*COMMAND, "diagnose", str(campaign), "--json", str(found), "--model", str(model)]
    subprocess.run(call, check=True, stdout=subprocess.DEVNULL)
    return json.loads(found.read_text()), (time.perf_counter() - begun, processor() - used), model


def processor():
    """Seconds of the processor that commands have taken so far."""
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    return spent.ru_utime + spent.ru_stime


def predict(model, samples, folder):
    """Predict through the command line; (N, 3) in the campaign's unit of length."""
    target = folder / "predicted.csv"
    subprocess.run([*COMMAND, "predict", str(model), str(samples), "-o", str(target)], check=True)
    return pd.read_csv(target)[AXES].to_numpy()


def rms(difference):
    """Rms distance."""
    return float(np.sqrt((difference**2).sum(axis=1).mean()))


def ur5(data, folder):
    """Print what the UR5 reaches on its 20 test poses, and on the 300 rows of its README's split."""
    on_test_poses(data / "ur5_jacobi", folder)
    campaign = tr.read_campaign(data / "ur5_jacobi" / "campaign.toml")
    mixed = np.random.default_rng(0).permutation(1000)
    begun = time.perf_counter()
    diagnosis = tr.diagnose(campaign.take(np.sort(mixed[:700])))
    seconds = time.perf_counter() - begun
    held_out = campaign.take(np.sort(mixed[700:]))
    error = 1e3 * rms(held_out.position - diagnosis.model.prediction(held_out)[0])
    print(f"ur5_jacobi, 700 of its rows: {', '.join(diagnosis.verdict)}; {seconds:.1f} s")
    print(f"    rms on the other 300: {error:.4f} mm")


def wam(data, folder):
    """Print what the WAM reaches."""
    on_test_poses(data / "wam_jacobi", folder)


def on_test_poses(campaign, folder):
    """Print the outcome of one campaign and the error on its test file."""
    found, seconds, model = diagnose(campaign, folder)
    measured = pd.read_csv(campaign / "test.csv")[AXES].to_numpy()
    error = rms(measured - predict(model, campaign / "test.csv", folder))
    report(campaign.name, found, seconds)
    print(f"    rms on its 20 test poses: {error:.4f} mm")


def open_cases(data, folder):
    """Print how many of the simulated campaigns are answered exactly."""
    truth = {case["case"]: case for case in json.loads((data / "open_cases" / "truth.json").read_text())}
    exact, total, slowest, ratios = 0, 0, (0.0, 0.0), []
    first = hard = 0
    for name, case in truth.items():
        found, seconds, model = diagnose(data / "open_cases" / name, folder)
        real = np.loadtxt(data / "open_cases" / name / "fresh_truth_mm.txt")
        error = rms(real - predict(model, data / "open_cases" / name / "fresh.csv", folder))
        named = [e["name"] for e in found["effects"] if e["status"] == "found"]
        aside = [e["name"] for e in found["effects"] if e["status"] == "confounded"]
        if case["level"] == "hard":
            hard += 1
            right = found["verdict"]["effects"][:1] != [] and found["verdict"]["effects"][0] in case["effects"]
            first += right
        else:
            total += 1
            right = set(named) == set(case["effects"]) and not found["verdict"]["unexplained"] and not aside
            exact, slowest = exact + right, max(slowest, seconds)
            ratios.append(error / np.sqrt(3.0) / case["noise_mm"])
        if not right:
            print(f"    {name} ({case['level']}): truth {case['effects']}, found {named}, confounded {aside}")
    print(f"open_cases plain and null: {exact} of {total} exact")
    print(f"    slowest {slowest[0]:.2f} s with start-up ({slowest[1]:.2f} s cpu)")
    print(f"    fresh samples, in noise per axis: median {np.median(ratios):.2f}, worst {max(ratios):.2f}")
    print(f"open_cases hard: {first} of {hard} with a main effect named first")


def ipa(data, folder):
    """Print what the two long campaigns of the UR10 take and leave."""
    for name in ("ipa_ur10_b", "ipa_ur10_a"):
        found, seconds, _ = diagnose(data / name, folder)
        report(name, found, seconds)
        peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1e6
        print(f"    largest memory of any command so far: {peak:.2f} GB")


PARTS = {"ur5": ur5, "wam": wam, "open_cases": open_cases, "ipa": ipa}


def main():
    """Print one line a figure."""
    data = Path(os.environ["THERMAL_ROBOT_DATA"])
    with tempfile.TemporaryDirectory() as scratch:
        for part in sys.argv[1:] or PARTS:
            PARTS[part](data, Path(scratch))


def report(name, found, seconds):
    """Print the outcome of one campaign."""
    gap, verdict, left = found["gap"], found["verdict"], found["unexplained"]
    print(f"{name}: {', '.join(verdict['effects'])}; {seconds[0]:.1f} s ({seconds[1]:.1f} s cpu)")
    held = gap["held_out"]
    before, after, out = (1e3 * v for v in (gap["rms_before"], gap["rms_after"], held["rms_after"]))
    print(f"    gap {before:.3f} -> {after:.3f} mm, held out {out:.3f} mm")
    print(f"    unexplained: {verdict['unexplained']}, {left['rms'] * 1e3:.3f} mm; {left['reasons']}")
    print(f"    places {[(p['name'], round(p['probability'], 3)) for p in left['locations']]}")
    print(f"    follows {[d['covariate'] for d in left['depends_on']]}")
    print(f"    {verdict['summary']}")


if __name__ == "__main__":
    main()
