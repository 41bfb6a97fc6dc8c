"""Fixed robots with hidden faults are answered as they were when the golden answers were recorded."""

import hashlib
import json

import pytest

pytest.importorskip("mujoco", reason='the blind trial needs "thermal-robot[blind]"')

from blind.record import COUNTS, GOLDEN, SEED, answers

from thermal_robot import cli
from thermal_robot.blind.plan import plan, robots
from thermal_robot.blind.trial import canonical


def test_two_robots_that_nobody_has_seen_are_examined(tmp_path, capsys):
    options = ["--seed", "1", "--count", "single=1", "null=1", "real=0", "--effect", "drift", "--workers", "1"]
    robot = ["--robot", "builtin:rv_m2", "--tool", "tool0"]
    files = ["--directory", str(tmp_path / "trial"), "--json", str(tmp_path / "s.json")]
    assert cli.main(["blind", *options, *robot, *files]) == 0
    out = capsys.readouterr().out
    opened = json.loads((tmp_path / "trial" / "opened.json").read_text())
    # what was told before the first diagnosis is the hash of what was opened after the last
    sealed = hashlib.sha256(bytes.fromhex(opened["key"]) + canonical(opened["answers"])).hexdigest()
    assert f"sealed before the first diagnosis: sha256 {sealed}" in out
    plain = json.loads((tmp_path / "s.json").read_text())
    assert (plain["cases"], plain["failed"], plain["misses"]) == (2, 0, [])
    assert {k["kind"]: k["rates"]["exact"]["successes"] for k in plain["kinds"]} == {"single": 1, "null": 1}
    single = next(a for a in opened["answers"].values() if a["truth"]["effects"])
    assert single["truth"]["effects"] == ["drift"]
    assert plain["shrinkage"]["pairs"][0]["real"] > 0.9


def test_the_golden_answers_are_to_the_cases_that_the_seed_draws():
    golden = json.loads(GOLDEN.read_text(encoding="utf-8"))
    cases = {case.id: case for case in plan(SEED, COUNTS, robots())}
    assert set(golden) == set(cases)
    for name, said in golden.items():
        asked = cases[name]
        assert (said["kind"], said["robot"], said["effects"], said["unlisted"]) == (
            asked.kind, asked.robot.name, list(asked.effects), asked.unlisted,
        )  # fmt: skip
    assert not any(said.get("failed") for said in golden.values())


@pytest.mark.slow
def test_fixed_robots_are_answered_as_they_were(tmp_path):
    golden = json.loads(GOLDEN.read_text(encoding="utf-8"))
    found = answers(tmp_path / "trial", workers=2)
    apart = {name: (golden[name], found[name]) for name in golden if found[name] != golden[name]}
    assert not apart
