"""How much memory a diagnosis takes: less than 2 GB for 29 000 rows of poses."""

import subprocess
import sys
from pathlib import Path

import pytest

ROWS = 8000
SCRIPT = f"""
import resource, sys
from simulate import simulate
from thermal_robot import diagnose, load_robot

def peak():
    # kilobytes, on macOS bytes
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)

robot = load_robot("builtin:rv_m2", tool_frame="tool0")
campaign = simulate(robot, ("joint_offset", "backlash"), samples={ROWS}, turning=2e-5, seed=5)[0]
before = peak()
found = diagnose(campaign)
print(*found.verdict, before, peak())
"""


@pytest.mark.slow
def test_memory_grows_slowly_with_the_rows():
    """Above 5000 rows the same stages run; what does not depend on the rows is counted as if it did."""
    pytest.importorskip("resource")
    run = [sys.executable, "-c", SCRIPT]
    done = subprocess.run(run, cwd=Path(__file__).parent, capture_output=True, text=True, check=True)
    *verdict, before, after = done.stdout.split()
    assert verdict == ["joint_offset", "backlash"]
    # 29 000 rows of a robot with as many effects would then take 1.9 GB
    assert int(after) - int(before) < 60e3 * ROWS
