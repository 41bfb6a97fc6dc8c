"""The README's table of measured figures: runs the command line on every public campaign and prints what it reached.

Start it as a script with ``THERMAL_ROBOT_DATA`` set to the folder of the campaigns.
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

COMMAND = [sys.executable, "-m", "thermal_robot.cli"]
AXES = ["x", "y", "z"]


def diagnose(campaign, folder):
    """Diagnose through the command line; return the JSON, seconds with start-up, and the model's path."""
    found, model = folder / "diagnosis.json", folder / "model.json"
    begun = time.perf_counter()
    call = [*COMMAND, "diagnose", str(campaign), "--json", str(found), "--model", str(model)]
    subprocess.run(call, check=True, stdout=subprocess.DEVNULL)
    return json.loads(found.read_text()), time.perf_counter() - begun, model


def predict(model, samples, folder):
    """Predict through the command line; (N, 3) in the campaign's unit of length."""
    target = folder / "predicted.csv"
    subprocess.run([*COMMAND, "predict", str(model), str(samples), "-o", str(target)], check=True)
    return pd.read_csv(target)[AXES].to_numpy()


def rms(difference):
    """Rms distance."""
    return float(np.sqrt((difference**2).sum(axis=1).mean()))


def main():
    """Print one line a figure."""
    data = Path(os.environ["THERMAL_ROBOT_DATA"])
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        for name in ("ur5_jacobi", "wam_jacobi"):
            found, seconds, model = diagnose(data / name, folder)
            measured = pd.read_csv(data / name / "test.csv")[AXES].to_numpy()
            error = rms(measured - predict(model, data / name / "test.csv", folder))
            report(name, found, seconds)
            print(f"    rms on its 20 test poses: {error:.4f} mm")
        truth = {case["case"]: case for case in json.loads((data / "open_cases" / "truth.json").read_text())}
        exact, total, slowest, ratios = 0, 0, 0.0, []
        first = hard = 0
        for name, case in truth.items():
            found, seconds, model = diagnose(data / "open_cases" / name, folder)
            real = np.loadtxt(data / "open_cases" / name / "fresh_truth_mm.txt")
            error = rms(real - predict(model, data / "open_cases" / name / "fresh.csv", folder))
            named = [e["name"] for e in found["effects"] if e["status"] == "found"]
            aside = [e["name"] for e in found["effects"] if e["status"] == "confounded"]
            if case["level"] == "hard":
                hard += 1
                first += found["verdict"]["effects"][:1] != [] and found["verdict"]["effects"][0] in case["effects"]
                continue
            total += 1
            right = set(named) == set(case["effects"]) and not found["verdict"]["unexplained"] and not aside
            exact, slowest = exact + right, max(slowest, seconds)
            ratios.append(error / np.sqrt(3.0) / case["noise_mm"])
            if not right:
                print(f"    {name}: truth {case['effects']}, found {named}, confounded {aside}")
        print(f"open_cases plain and null: {exact} of {total} exact, slowest {slowest:.2f} s with start-up")
        print(f"    fresh samples, in noise per axis: median {np.median(ratios):.2f}, worst {max(ratios):.2f}")
        print(f"open_cases hard: {first} of {hard} with a main effect named first")
        for name in ("ipa_ur10_b", "ipa_ur10_a"):
            found, seconds, _ = diagnose(data / name, folder)
            report(name, found, seconds)
        peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1e6
        print(f"largest memory of any of these: {peak:.2f} GB")


def report(name, found, seconds):
    """Print the outcome of one campaign."""
    gap, verdict, left = found["gap"], found["verdict"], found["unexplained"]
    print(f"{name}: {', '.join(verdict['effects'])}; {seconds:.1f} s")
    held = gap["held_out"]
    before, after, out = (1e3 * v for v in (gap["rms_before"], gap["rms_after"], held["rms_after"]))
    print(f"    gap {before:.3f} -> {after:.3f} mm, held out {out:.3f} mm")
    print(f"    unexplained: {verdict['unexplained']}, {left['rms'] * 1e3:.3f} mm; {left['reasons']}")


if __name__ == "__main__":
    main()
