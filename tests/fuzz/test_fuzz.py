"""Each reader answers what it is given: a campaign, or one sentence; `run.py` beside this tries it for hours."""

import json
from random import Random

import pytest
from fuzz import corpus, harmless
from fuzz.run import OUTCOMES, SOUND, Tally, Worker, fuzz
from fuzz.targets import ITSELF, TARGETS

from thermal_robot.campaign import read_campaign

TRIALS = {"arguments": 12, "diagnose": 8, "drawn": 6, "same": 100, "model": 150, "parquet": 150}
"""Of a target; 250 of the others: about a minute in all."""


@pytest.mark.slow
@pytest.mark.parametrize("name", list(TARGETS))
def test_nothing_that_is_given_breaks_a_reader(name, tmp_path):
    tally = fuzz([name], seed=2026, into=tmp_path, trials=TRIALS.get(name, 250))
    assert set(tally.counts[name]) <= set(SOUND), f"{tally.told()}\n{tally.markdown()}"


@pytest.mark.parametrize("name", list(TARGETS))
def test_a_trial_is_known_by_its_number(name):
    assert TARGETS[name].trial(1, 5) == TARGETS[name].trial(1, 5)
    assert len({json.dumps(sorted(map(repr, TARGETS[name].trial(1, n).items()))) for n in range(8)}) > 4


@pytest.mark.parametrize(
    "files", corpus.campaigns(), ids=["demo", "awkward", "coupled", "parallelogram", "every-column", "several-targets"]
)
def test_what_is_spoilt_was_sound(files, tmp_path):
    corpus.put(files, tmp_path)
    assert read_campaign(tmp_path).samples >= 3


@pytest.mark.parametrize("change", harmless.CHANGES, ids=lambda change: change.__name__)
def test_a_harmless_change_changes_the_files(change):
    files = corpus.campaigns()[0]
    assert change(Random(0), files) != files


# What a worker must survive, as checks that stand in for a reader.
BROKEN = {
    "traceback": "raise KeyError('x')",
    "hang": "while True: pass",
    "memory": "bytearray(2**33)",
    "crash": "import os; os.abort()",
    "wrong": "assert 1 == 2",
    "warning": "import warnings; warnings.warn('x', RuntimeWarning)",
    "unclear": "from thermal_robot.errors import RobotError\n"
    "class Two(RobotError):\n    def __str__(self): return 'two\\nlines'\n"
    "raise Two('')",
    "refused": "from thermal_robot.errors import RobotError; raise RobotError('one line')",
    "right": "pass",
}


@pytest.mark.slow
def test_every_outcome_is_told_from_the_others(tmp_path):
    assert set(BROKEN) == set(OUTCOMES)
    worker = Worker(tmp_path / "scratch")
    tally = Tally(tmp_path / "findings", seed=0)
    for number, (outcome, code) in enumerate(BROKEN.items()):
        answer = worker.judge(ITSELF, {"code.py": code.encode()})
        assert answer[0] == outcome, answer
        tally.add("itself", number, {"code.py": code.encode()}, answer)
    worker.close()
    saved = sorted(path.name for path in (tmp_path / "findings" / "itself").iterdir())
    assert saved == sorted(f"{outcome}-{n}" for n, outcome in enumerate(BROKEN) if outcome not in SOUND)
    assert "| itself | 9 | 1 | 1 | 1 | 1 | 1 | 1 | 1 | 1 | 1 |" in tally.markdown()
