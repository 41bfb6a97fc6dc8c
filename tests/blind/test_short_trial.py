"""The short blind trial: sixty robots that nobody has seen, other ones at every commit."""

import hashlib
import json
import os
import subprocess
from pathlib import Path

import pytest
from scipy.stats import binom

pytest.importorskip("mujoco", reason='the blind trial needs "thermal-robot[blind]"')

from thermal_robot import cli
from thermal_robot.blind.plan import SHORT, plan, robots
from thermal_robot.blind.real import real_cases
from thermal_robot.blind.report.text import text
from thermal_robot.blind.score import score
from thermal_robot.blind.sealed import canonical
from thermal_robot.blind.trial import run_trial

CHANCE = 1e-4
"""Share of sound commits that may fail by bad luck, a floor."""
REACHED = {
    ("single", "exact"): 0.97,
    ("null", "exact"): 0.98,
    ("pair", "exact"): 0.95,
    ("hard", "first_named"): 0.90,
    ("unlisted", "flagged"): 0.95,
    ("unlisted", "place"): 0.90,
    ("removed", "flagged"): 0.95,
}
"""Rates of the full trial (README), rounded down."""


def commit_seed():
    """A seed that no one can choose: it follows from the commit."""
    root = Path(__file__).parents[2]
    try:
        said = subprocess.run(["git", "rev-parse", "HEAD"], cwd=root, capture_output=True, text=True, check=True).stdout
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("no commit to draw the seed from")
    return int(said.strip()[:12], 16)


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


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    seed = commit_seed()
    cases = plan(seed, SHORT, robots())
    data = os.environ.get("THERMAL_ROBOT_DATA")
    real = real_cases(Path(data), seed, 8) if data else ()
    sealed = []
    records = run_trial((*cases, *real), tmp_path_factory.mktemp("trial"), workers=2, sealed=sealed.append)
    assert len(sealed) == 1
    plain = score([record for record in records if "withdrawn" not in record]).to_dict()
    print(f"\nseed {seed}\n{text(plain)}")
    return {kind["kind"]: kind for kind in plain["kinds"]}


@pytest.mark.slow
def test_the_trial_was_held(found):
    asked = sum(SHORT.values())
    held = sum(kind["cases"] for name, kind in found.items() if name != "real")
    assert held >= 0.9 * asked
    assert sum(kind["failed"] for kind in found.values()) == 0


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "rate"), REACHED)
def test_a_rate_is_not_below_what_chance_would_leave_of_it(found, kind, rate):
    measured = found[kind]["rates"][rate]
    floor = binom.ppf(CHANCE, measured["trials"], REACHED[kind, rate])
    assert measured["successes"] >= floor, f"{kind} {rate}: {measured}, floor {floor:.0f}"
