"""Spoil what the readers are given, and count what comes out.

usage: python tests/fuzz/run.py [--hours H | --minutes M | --trials N] [--target NAME ...] [--seed S] [--jobs J]
       python tests/fuzz/run.py --replay FOLDER ...

Each target has its share of the time. A finding is printed as it comes, and saved in a folder with the files that
bring it back and a ``finding.json`` that says what happened, in ``--into``; up to three for one cause. The table that
is printed last is that of docs/reliability.md.
"""

from __future__ import annotations

import argparse
import json
import os
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent))

from fuzz.corpus import put  # noqa: E402
from fuzz.targets import TARGETS, Target  # noqa: E402

SOUND = ("right", "refused")
OUTCOMES = (*SOUND, "unclear", "warning", "traceback", "wrong", "hang", "memory", "crash")
"""Right, refused in one sentence; a sentence that is none; a warning from within; and what must never be."""
WAIT = 6
"""Times the CPU limit that a trial may take on the clock: another program may have the processor."""
KEPT = 3
"""Findings of one cause that are saved."""


class Worker:
    """A process that judges trials, begun anew when it dies."""

    def __init__(self, scratch: Path) -> None:
        self.folder, self.errors = scratch / "trial", scratch / "errors"
        self.process: subprocess.Popen[str] | None = None

    def judge(self, target: Target, files: dict[str, bytes]) -> tuple[str, str, str]:
        """Return outcome, what was said, and where."""
        shutil.rmtree(self.folder, ignore_errors=True)
        self.folder.mkdir(parents=True)
        put(files, self.folder)
        process = self.process or self._begin()
        asked = json.dumps({"target": target.name, "folder": str(self.folder)})
        process.stdin.write(asked + "\n")
        process.stdin.flush()
        readable, _, _ = select.select([process.stdout], [], [], WAIT * target.seconds)
        line = process.stdout.readline() if readable else ""
        outcome, said, place = json.loads(line) if line else self._dead(process, late=not readable)
        return outcome, said.replace(f"{self.folder}/", ""), place

    def _begin(self) -> subprocess.Popen[str]:
        alone = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "MPLBACKEND": "Agg"}
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True, "env": alone}
        with self.errors.open("w") as errors:
            self.process = subprocess.Popen([sys.executable, str(HERE / "worker.py")], stderr=errors, **pipes)
        self.process.stdout.readline()  # it is ready: what it imports is not the trial's time
        return self.process

    def _dead(self, process: subprocess.Popen[str], late: bool) -> tuple[str, str, str]:
        self.close()
        said = self.errors.read_text(errors="replace")
        own = [line.strip() for line in said.splitlines() if "thermal_robot" in line and "File" in line]
        place = own[0] if own else said.strip()[-200:]
        code = -process.returncode if process.returncode else 0
        if late or code == signal.SIGPROF:
            return "hang", "no answer" if late else "too much CPU", place
        return "crash", signal.Signals(code).name if code > 0 else f"exit status {process.returncode}", place

    def close(self) -> None:
        """End the process."""
        if self.process is not None:
            self.process.kill()
            self.process.communicate()
            self.process = None


@dataclass
class Tally:
    """What came out, by target and outcome; causes of what should not have come out."""

    into: Path
    seed: int
    counts: dict[str, Counter[str]] = field(default_factory=dict)
    causes: Counter[tuple[str, str, str, str]] = field(default_factory=Counter)
    lock: threading.Lock = field(default_factory=threading.Lock)

    def add(self, target: str, number: int, files: dict[str, bytes], answer: Sequence[str]) -> None:
        """Count a trial; save it if it is a finding of a new cause."""
        outcome, said, place = answer
        with self.lock:
            self.counts.setdefault(target, Counter())[outcome] += 1
            if outcome in SOUND:
                return
            kind = said.split(":")[0] if outcome == "traceback" else ""
            cause = (target, outcome, kind, place)
            self.causes[cause] += 1
            print(f"{target} {number}: {outcome} at {place}: {said}", file=sys.stderr, flush=True)
            if self.causes[cause] > KEPT:
                return
            folder = self.into / target / f"{outcome}-{number}"
            folder.mkdir(parents=True, exist_ok=True)
            put(files, folder)
            told = {"target": target, "seed": self.seed, "number": number}
            told |= {"outcome": outcome, "said": said, "place": place}
            (folder / "finding.json").write_text(json.dumps(told, indent=1) + "\n")

    def markdown(self) -> str:
        """The table of docs/reliability.md."""
        rows = [["target", "trials", *OUTCOMES], ["---", *["--:"] * (len(OUTCOMES) + 1)]]
        rows += [[name, count.total(), *(count[o] for o in OUTCOMES)] for name, count in self.counts.items()]
        return "\n".join(f"| {' | '.join(map(str, row))} |" for row in rows)

    def told(self) -> str:
        """The causes, the commonest first."""
        return "\n".join(f"{n:6d}  {'  '.join(cause)}" for cause, n in self.causes.most_common())


def fuzz(
    targets: Sequence[str], seed: int, into: Path, *, jobs: int = 1, trials: int = 0, seconds: float = 0.0
) -> Tally:
    """Run trials of each target: a number of each, or for a time that they share.

    A trial's number and the seed alone say what it is.
    """
    tally = Tally(into, seed)

    def work(job: int) -> None:
        with tempfile.TemporaryDirectory(prefix="fuzz-") as scratch:
            worker = Worker(Path(scratch))
            for name in targets:
                target, until = TARGETS[name], time.monotonic() + seconds / len(targets)
                number = job
                while number < trials if trials else time.monotonic() < until:
                    files = target.trial(seed, number)
                    tally.add(name, number, files, worker.judge(target, files))
                    number += jobs
            worker.close()

    with ThreadPoolExecutor(jobs) as pool:
        list(pool.map(work, range(jobs)))
    return tally


def replay(folders: Sequence[Path]) -> None:
    """Judge saved findings again."""
    with tempfile.TemporaryDirectory(prefix="fuzz-") as scratch:
        worker = Worker(Path(scratch))
        for folder in folders:
            told = json.loads((folder / "finding.json").read_bytes())
            files = {path.name: path.read_bytes() for path in folder.iterdir()}
            print(folder, *worker.judge(TARGETS[told["target"]], files), sep="  ")
        worker.close()


def main() -> None:
    """Read the arguments, run, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hours", type=float, default=0.0)
    parser.add_argument("--minutes", type=float, default=0.0)
    parser.add_argument("--trials", type=int, default=0, help="of each target, instead of a time")
    parser.add_argument("--target", nargs="+", choices=list(TARGETS), default=list(TARGETS))
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--into", type=Path, default=Path(tempfile.gettempdir()) / "thermal_robot_findings")
    parser.add_argument("--replay", type=Path, nargs="+")
    options = parser.parse_args()
    if options.replay:
        return replay(options.replay)
    seconds = 3600 * options.hours + 60 * options.minutes or 60.0
    begun = time.monotonic()
    tally = fuzz(options.target, options.seed, options.into, jobs=options.jobs, trials=options.trials, seconds=seconds)
    print(tally.told())
    lasted = (time.monotonic() - begun) / 60
    print(f"\nseed {options.seed}, {lasted:.0f} min with {options.jobs} job(s), findings in {options.into}\n")
    print(tally.markdown())


if __name__ == "__main__":
    main()
