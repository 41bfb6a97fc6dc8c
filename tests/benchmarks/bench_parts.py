"""Time of the parts of a diagnosis, as shares of the whole in the same run; start it as a script."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
from simulate import simulate

from thermal_robot import diagnose, load_robot
from thermal_robot.diagnosis.earned import earned
from thermal_robot.diagnosis.held_out import held_out
from thermal_robot.diagnosis.next_samples import next_samples
from thermal_robot.diagnosis.schemes import worst_folds
from thermal_robot.effects import choose
from thermal_robot.inference.discover import candidates
from thermal_robot.inference.fit import fit


def seconds(work: Callable[[], object]) -> float:
    """Least of three runs."""
    took = []
    for _ in range(3):
        begun = time.perf_counter()
        work()
        took.append(time.perf_counter() - begun)
    return min(took)


def main() -> None:
    """Print seconds and the share of each part, UR10 with 100 rows and two effects."""
    robot = load_robot("example-robot-data:ur10", "tool0")
    campaign = simulate(robot, ["thermal_elongation", "backlash"], samples=100, seed=1)[0]
    found = fit(campaign, choose((), (), ()))
    whole = seconds(lambda: diagnose(campaign))
    parts: dict[str, Callable[[], object]] = {
        "choice and fit": lambda: fit(campaign, choose((), (), ())),
        "scan for laws": lambda: candidates(found, 1),
        "effects on rows held out": lambda: earned(found),
        "held-out figures": lambda: held_out(found),
        "worst ways of holding out": lambda: worst_folds(found),
        "next samples": lambda: next_samples(found),
    }
    print(f"{'part':>28s}{'seconds':>10s}{'share':>8s}")
    print(f"{'diagnosis':>28s}{whole:10.3f}{1.0:8.2f}")
    for name, work in parts.items():
        spent = seconds(work)
        print(f"{name:>28s}{spent:10.3f}{spent / whole:8.2f}")


if __name__ == "__main__":
    main()
