"""robotkinecal calibrates: run by the Python of its own environment; prints seconds and the rms that is left as JSON.

usage: python robotkinecal_calibrates.py INPUT.json METHOD TRIES SECONDS

It fits joint axes and the place of the target on the tool, and no frame of the instrument: measurements are handed to
it in the root frame, as our registration of the nominal robot puts them, and the target starts where that puts it.
Neither is in its time. Its robot is a product of exponentials of the nominal screw axes.
"""

from __future__ import annotations

import contextlib
import io
import json
import sys
import time
from importlib.metadata import version
from pathlib import Path

import numpy as np
import roboticstoolbox as rtb
from robotkinecal import SerialRobotKineCal
from spatialmath import SE3, Twist3


def calibrated(given):
    """Return one calibration and its seconds."""
    links = [rtb.PoERevolute(axis[3:], np.cross(axis[3:], axis[:3])) for axis in np.array(given["screws"])]
    start = SE3(np.array(given["tool_at_zero"]), check=False)
    q, seen = list(np.array(given["q"])), list(np.array(given["in_root"]))
    with contextlib.redirect_stdout(io.StringIO()):
        begun = time.perf_counter()
        found = SerialRobotKineCal(rtb.PoERobot(links, start))
        # the toolbox puts base and tool among the links, and robotkinecal takes each link for a joint
        found.joints, found.joint_screw_axis = found.joints[1:-1], list(np.array(given["screws"]))
        found.N_JOINTS = len(found.joint_screw_axis)
        found.set_observations(q, seen)
        found.solve()
        spent = time.perf_counter() - begun
    return found, spent


def predicted(found, q):
    """Return the (N, 3) positions that it predicts, m."""
    screws, start = [Twist3(axis) for axis in found.joint_screw_axis], found.zero_conf_EE_pose
    places = []
    for row in q:
        pose = SE3()
        for screw, angle in zip(screws, row, strict=True):
            pose = pose * screw.exp(angle)
        places.append((pose * start).t)
    return np.array(places)


def rms(found, q, position):
    """Return the rms distance, m."""
    return float(np.sqrt(((predicted(found, np.array(q)) - position) ** 2).sum(axis=1).mean()))


def main(source, _method, tries, seconds):
    """Calibrate several times; predict fresh poses."""
    given = json.loads(Path(source).read_text())
    begun, runs = time.perf_counter(), []
    while len(runs) <= int(tries) and (not runs or time.perf_counter() - begun < float(seconds) / 2):
        runs.append(calibrated(given))
    runs = runs[1:] or runs
    found = runs[-1][0]
    answer = {
        "seconds": [spent for _, spent in runs],
        "solving": [spent for _, spent in runs],
        "rms": rms(found, given["q"], np.array(given["in_root"])),
        "fresh": rms(found, given["fresh_q"], np.array(given["fresh_in_root"])),
        "parameters": int(found.N_PARAMS),
        "version": f"robotkinecal {version('robotkinecal')}, numpy {version('numpy')}",
    }
    print(json.dumps(answer))


if __name__ == "__main__":
    main(*sys.argv[1:])
