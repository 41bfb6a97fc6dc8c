"""What the program answers to fixed campaigns of the trial's reality, written down: the golden answers.

usage: python tests/blind/record.py [--check]

The campaigns are made anew each time, from fixed seeds; the answers are the truth's judgement of the diagnosis,
question by question (:func:`thermal_robot.blind.judged.marks`). With ``--check`` nothing is written and what differs is
printed.
A commit that changes the file says what changed, and why.
"""

from __future__ import annotations

import json
import sys
import tempfile
from pathlib import Path

GOLDEN = Path(__file__).parent / "golden_answers.json"
SEED = 12
"""The number of the issue that asked for them."""
COUNTS = {
    "single": 2,
    "large": 1,
    "visits": 1,
    "lags": 1,
    "pair": 1,
    "many": 1,
    "null": 1,
    "mixed": 2,
    "removed": 1,
    "hidden": 1,
    "unlisted": 4,
    "both": 1,
}
"""A handful: about a minute on one core."""


def answers(directory: Path, workers: int = 1) -> dict[str, dict[str, object]]:
    """Make the campaigns, diagnose them; return by case what was asked and the marks."""
    from thermal_robot.blind.judged import failed, marks
    from thermal_robot.blind.plan import plan, robots
    from thermal_robot.blind.trial import run_trial

    cases = plan(SEED, COUNTS, robots())
    records = run_trial(cases, directory, workers=workers)
    found = {}
    for case, record in zip(cases, records, strict=True):
        asked = {"kind": case.kind, "robot": case.robot.name, "effects": list(case.effects), "unlisted": case.unlisted}
        if "withdrawn" in record:
            found[case.id] = {**asked, "withdrawn": record["withdrawn"]}
        else:
            given = {question: list(answer) for question, answer in marks(record).items()}
            found[case.id] = {**asked, "failed": failed(record), "marks": given}
    return found


def main() -> int:
    """Write or compare; the exit status is 1 where something differs."""
    with tempfile.TemporaryDirectory() as folder:
        found = answers(Path(folder) / "trial", workers=2)
    if "--check" not in sys.argv:
        lines = ",\n".join(f" {json.dumps(name)}: {json.dumps(said)}" for name, said in found.items())
        GOLDEN.write_text(f"{{\n{lines}\n}}\n", encoding="utf-8")
        return 0
    golden = json.loads(GOLDEN.read_text(encoding="utf-8"))
    apart = [name for name in sorted({*found, *golden}) if found.get(name) != golden.get(name)]
    for name in apart:
        print(f"{name}: {golden.get(name)}\n  became {found.get(name)}")
    return int(bool(apart))


if __name__ == "__main__":
    sys.exit(main())
