"""FIGAROH calibrates: run by the Python of its own environment; prints seconds and the rms that is left as JSON.

usage: python figaroh_calibrates.py INPUT.json METHOD TRIES SECONDS

Time is that of ``initialize`` (it reads the table and chooses parameters) and of ``solve``; that of ``solve`` alone is
told, too. Reading robot and configuration is not in it. The cost is the distance of positions in metres.
"""

from __future__ import annotations

import contextlib
import io
import json
import logging
import sys
import tempfile
import time
from importlib.metadata import version
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pinocchio as pin
import yaml
from figaroh.calibration.base_calibration import BaseCalibration
from figaroh.calibration.calibration_tools import calc_updated_fkm


class Calibration(BaseCalibration):
    """Positions alone, weighed alike."""

    def cost_function(self, var):
        """Measured less predicted, m."""
        predicted = calc_updated_fkm(self.model, self.data, var, self.q_measured, self.calib_config)
        return self.PEE_measured - predicted


def configuration(given, method, folder):
    """Write its measurements and its configuration; return the path of the latter."""
    q, position = np.array(given["q"]), np.array(given["position"])
    columns = {name: q[:, j] for j, name in enumerate(given["joints"])}
    columns |= {f"{axis}1": position[:, k] for k, axis in enumerate("xyz")}
    pd.DataFrame(columns).to_csv(folder / "measured.csv", index=False)
    task = {
        "enabled": True,
        "type": "kinematic_calibration",
        "kinematics": {"base_frame": "universe", "tool_frame": given["tool_frame"]},
        "parameters": {"calibration_level": "full_params", "estimation": {"method": method}},
        "measurements": {"markers": [{"measurable_dof": [True] * 3 + [False] * 3}], "poses": {}},
        "data": {"source_file": str(folder / "measured.csv"), "number_of_samples": len(q)},
    }
    whole = {
        "schema_version": "2.0",
        "robot": {"name": "arm", "properties": {"joints": {"active_joints": given["joints"]}}},
        "tasks": {"calibration": task},
    }
    path = folder / "configuration.yaml"
    path.write_text(yaml.safe_dump(whole))
    return path


def calibrated(robot, path):
    """Return one calibration and its seconds."""
    with contextlib.redirect_stdout(io.StringIO()):
        found = Calibration(robot, str(path))
        found.calib_config |= {"known_baseframe": False, "known_tipframe": False}
        begun = time.perf_counter()
        found.initialize()
        chosen = time.perf_counter()
        found.solve(enable_logging=False)
    return found, (chosen - begun, time.perf_counter() - chosen)


def repeated(once, tries, seconds):
    """Run something several times while there is time; return the runs, the first left out where there are others."""
    begun, runs = time.perf_counter(), []
    while len(runs) <= tries and (not runs or time.perf_counter() - begun < seconds / 2):
        runs.append(once())
    return runs[1:] or runs


def rms(predicted, measured):
    """Return the rms distance, m, of vectors in which x, y and z stand one after another."""
    return float(np.sqrt(((predicted - measured).reshape(3, -1) ** 2).sum(axis=0).mean()))


def main(source, method, tries, seconds):
    """Calibrate several times; predict fresh poses."""
    logging.disable(logging.CRITICAL)
    given = json.loads(Path(source).read_text())
    model = pin.buildModelFromUrdf(given["urdf"])
    robot = SimpleNamespace(model=model, data=model.createData(), q0=pin.neutral(model))
    with tempfile.TemporaryDirectory() as folder:
        path = configuration(given, method, Path(folder))
        runs = repeated(lambda: calibrated(robot, path), int(tries), float(seconds))
    found, values = runs[-1][0], runs[-1][0].LM_result.x
    left = rms(found.get_pose_from_measure(values), found.PEE_measured)
    fresh = np.array(given["fresh_q"])
    config = found.calib_config | {"NbSample": len(fresh)}
    ahead = calc_updated_fkm(model, robot.data, values, fresh, config)
    answer = {
        "seconds": [sum(parts) for _, parts in runs],
        "solving": [parts[1] for _, parts in runs],
        "rms": left,
        "fresh": rms(ahead, np.array(given["fresh_position"]).T.ravel()),
        "parameters": len(values),
        "version": f"figaroh {version('figaroh')}, pin {version('pin')}, numpy {version('numpy')}",
    }
    print(json.dumps(answer))


if __name__ == "__main__":
    main(*sys.argv[1:])
