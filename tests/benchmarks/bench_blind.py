"""The drawn trial: campaigns that nobody has seen, with floors that a program right in four cases of five fails.

usage: python tests/benchmarks/bench_blind.py [--seed N] [--workers N] [--directory DIR]

The seed is drawn where it is left out. Of n answers to a question with target t, X are right; the trial passes where
X ≥ f for every question. With X binomial, and the floor

    f(t, n) = the largest f with P(X < f | t) ≤ 0.01 / number of questions,

a program that reaches every target passes with 0.99 or more (Bonferroni), whatever depends on what. The counts are such
that P(X ≥ f | 0.8) < 0.001 for each question by itself, so that a program right in 80 % of any one kind fails: that
takes 69 cases for a target of 99 %, 168 for one of 95 % and 792 for one of 88 %. Where cases were withdrawn and too
few are left for that, the trial fails, too. The other figures (calibration, laws, harm, intervals) are printed.
"""

from __future__ import annotations

import argparse
import secrets
import sys
from pathlib import Path

from scipy.stats import binom

POOR, SLIPS = 0.8, 1e-3
"""A program that is right in this share is not to pass more often than this."""
PASSES = 0.99
"""How often one that reaches all targets is to pass."""
TARGETS = {
    ("single", "exact"): 0.99,
    ("large", "exact"): 0.97,
    ("visits", "exact"): 0.95,
    ("lags", "exact"): 0.97,
    ("pair", "exact"): 0.98,
    ("many", "exact"): 0.97,
    ("null", "exact"): 0.99,
    ("unlisted", "flagged"): 0.98,
    ("unlisted", "near_place"): 0.95,
    ("unlisted", "quantity"): 0.88,
}
"""What a program must reach, by kind and question."""
COUNTS = {
    "single": 80,
    "large": 130,
    "visits": 200,
    "lags": 135,
    "pair": 110,
    "many": 160,
    "null": 80,
    "unlisted": 900,
    "both": 50,
    "mixed": 700,
}
"""More than it takes, for what is withdrawn; the last two for calibration, laws and intervals."""


def floor(target: float, trials: int) -> int:
    """Return the fewest right answers that pass."""
    return int(binom.ppf((1.0 - PASSES) / len(TARGETS), trials, target))


def enough(target: float, trials: int) -> bool:
    """Whether so many answers keep a poor program from passing."""
    return bool(binom.sf(floor(target, trials) - 1, trials, POOR) < SLIPS)


def judged(kinds: dict[str, dict[str, dict[str, int]]]) -> list[tuple[str, bool]]:
    """Return a line for each question, and whether it passes; ``kinds`` are rates by kind and question."""
    lines = []
    for (kind, question), target in TARGETS.items():
        rate = kinds.get(kind, {}).get(question, {"successes": 0, "trials": 0})
        right, trials = rate["successes"], rate["trials"]
        passes = enough(target, trials) and right >= floor(target, trials)
        why = "" if enough(target, trials) else ", too few to tell"
        words = (
            f"{kind:10s}{question:12s}{right:5d} of {trials:4d}, floor {floor(target, trials):4d} (target {target:.0%})"
        )
        lines.append((f"{'passes' if passes else 'FAILS '}  {words}{why}", passes))
    return lines


def main() -> int:
    """Hold the trial; the exit status is 1 where a question fails."""
    from thermal_robot.blind.plan import plan, robots
    from thermal_robot.blind.report.text import text
    from thermal_robot.blind.score import score
    from thermal_robot.blind.trial import run_trial

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=secrets.randbits(32))
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--directory", type=Path)
    options = parser.parse_args()
    directory = options.directory or Path(f"blind-{options.seed}")
    records = run_trial(plan(options.seed, COUNTS, robots()), directory, workers=options.workers)
    found = score([record for record in records if "withdrawn" not in record])
    lines = judged({kind["kind"]: kind["rates"] for kind in found["kinds"]})
    print(text(found), f"\nseed {options.seed}", *(line for line, _ in lines), sep="\n")
    return int(not all(passes for _, passes in lines))


if __name__ == "__main__":
    sys.exit(main())
