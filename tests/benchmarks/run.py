"""Measure everything in one run, and write docs/performance.md with its figures.

usage: python tests/benchmarks/run.py [--peers FOLDER] [--only PART ...] [--out FOLDER] [--quick]

``peers/environments.py`` makes the environments of other programs in a folder; without it they are told as not
installed. ``--quick`` measures less, and the page says so. With ``--only`` the other parts stay as they were written
last: figures are kept in ``performance.json`` beside the page. A whole run takes about a quarter of an hour; the
machine should have nothing else to do.
"""

from __future__ import annotations

import argparse
import sys
import time
from importlib import import_module
from pathlib import Path

TESTS = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(TESTS))

from benchmarks import machine, page  # noqa: E402
from benchmarks.timing import FULL, QUICK, TINY, busy  # noqa: E402

PARTS = ("kinematics", "calibration", "mixed", "probability", "workspace", "diagnosis", "installed")


def main(arguments=None):
    """Measure the parts that are asked for, and write the page anew."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--peers", type=Path, help="folder of the environments of other programs")
    parser.add_argument("--only", nargs="+", choices=PARTS, default=PARTS)
    parser.add_argument("--out", type=Path, default=TESTS.parent / "docs")
    parser.add_argument("--quick", action="store_true", help="three turns, sizes up to a hundred thousand")
    parser.add_argument("--tiny", action="store_true", help="as little as runs all of the code; figures mean nothing")
    options = parser.parse_args(arguments)
    effort = TINY if options.tiny else QUICK if options.quick else FULL
    kept = page.read(options.out)
    for name in options.only:
        begun = time.perf_counter()
        state = machine.described(effort)
        found = import_module(f"benchmarks.parts.{name}").measured(effort, options.peers)
        spent = (
            f"{time.perf_counter() - begun:.0f} s, at most {effort.turns} turns; processes that waited: {busy():.1f}"
        )
        print(f"{name}: {spent}", flush=True)
        kept[name] = page.plain(found, state, spent)
        page.write(options.out, {part: kept[part] for part in PARTS if part in kept}, [name])
    return 0


if __name__ == "__main__":
    sys.exit(main())
