"""Time of a whole diagnosis over the size of the campaign, as multiples of the smallest; start it as a script."""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

from thermal_robot import diagnose, load_robot

sys.path.insert(0, str(Path(__file__).parents[1]))
from simulate import simulate


def main():
    """Print seconds and the ratio to 100 rows."""
    robot = load_robot("example-robot-data:ur10", "tool0")
    print(f"{'UR10, rows':>12s}{'seconds':>10s}{'ratio':>8s}")
    first = np.nan
    for rows in (100, 300, 1000, 3000):
        campaign, _, _ = simulate(robot, ["thermal_elongation", "backlash"], samples=rows, seed=0)
        diagnose(campaign.take(np.arange(60)))
        begun = time.perf_counter()
        diagnose(campaign)
        spent = time.perf_counter() - begun
        first = spent if rows == 100 else first
        print(f"{rows:12d}{spent:10.2f}{spent / first:8.1f}")


if __name__ == "__main__":
    main()
