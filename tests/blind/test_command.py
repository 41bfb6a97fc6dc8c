"""The command ``thermal-robot blind``: what it asks for, what it prints when, what it refuses."""

import json
import subprocess
import sys
from dataclasses import replace
from types import SimpleNamespace

import pytest
from blind_fakes import Real, case

from thermal_robot import cli
from thermal_robot.blind import command, trial
from thermal_robot.errors import EffectError

SEAL = "5ea1" * 16
SHORT, FULL = {"single": 3, "hard": 2, "null": 1}, {"single": 30}
ROBOTS = (("rv_m2", "builtin:rv_m2", "tool0"),)


@pytest.fixture
def asked(monkeypatch):
    """Replace everything but the command; return what it asked of the others."""
    found = {}

    def plan(seed, counts, robots, only_effects=()):
        found.update(seed=seed, counts=counts, robots=robots, effects=only_effects)
        return (case("c1"), case("c2"))

    def real_cases(data, seed, count=None):
        found.update(data=data, real=count)
        return (Real("r1"),)

    def run_trial(cases, directory, *, workers, progress, sealed):
        found.update(cases=[c.id for c in cases], directory=str(directory), workers=workers)
        sealed(SEAL)
        for done in range(41):
            progress("diagnoses", done, 40)
        if found.get("stop"):
            raise KeyboardInterrupt
        reasons = found.get("withdrawn", {})
        withdrawn = {name: {"kind": "null", "withdrawn": why} for name, why in reasons.items()}
        return [{"id": c.id, **withdrawn.get(c.id, {})} for c in cases]

    def score(records):
        return {"right": len(records)}

    def fake(name, **content):
        monkeypatch.setitem(sys.modules, f"thermal_robot.{name}", SimpleNamespace(**content))

    fake("blind.plan", plan=plan, robots=tuple, ROBOTS=ROBOTS, SHORT=SHORT, FULL=FULL)
    fake("blind.real", real_cases=real_cases)
    fake("blind.score", score=score)
    fake("blind.report.text", text=lambda s: f"{s['right']} right", markdown=lambda s: f"| {s['right']} |")
    fake("blind.report.page", html=lambda s, generated: f"<p>{s['right']} right, {generated}</p>")
    monkeypatch.setattr(trial, "run_trial", run_trial)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: name)
    monkeypatch.delenv(command.DATA, raising=False)
    return found


@pytest.fixture
def run(capsys, asked):
    def run(*arguments):
        status = cli.main(["blind", *map(str, arguments)])
        return status, *capsys.readouterr()

    return run


def test_the_commitment_is_told_before_the_score(run, asked):
    status, out, err = run("--seed", 7)
    assert status == 0
    assert [line.split()[0] for line in out.splitlines()] == ["No", "Seed", "Answers", "2"]
    assert SEAL in out
    assert "2 cases in blind-7" in out
    # a line for every tenth
    assert err.splitlines() == [f"diagnoses: {4 * k} of 40" for k in range(1, 11)]
    assert asked["counts"] == SHORT
    assert asked["robots"] == ROBOTS
    assert (asked["seed"], asked["directory"], asked["effects"]) == (7, "blind-7", ())
    # without one a seed is drawn and told
    out = run()[1]
    assert f"Seed {asked['seed']}: " in out
    assert asked["directory"] == f"blind-{asked['seed']}"


def test_options_reach_those_whom_they_concern(run, asked, tmp_path):
    run("--count", "null=3", "pair=2", "--effect", "drift", "backlash", "--workers", 3, "--directory", tmp_path)
    assert asked["counts"] == {"null": 3, "pair": 2}
    assert asked["effects"] == ("drift", "backlash")
    assert (asked["workers"], asked["directory"]) == (3, str(tmp_path))
    run("--size", "full", "--robot", "my/arm.urdf", "--tool", "flange", "--robot", "builtin:rv_m2", "--tool", "tool0")
    assert asked["counts"] == FULL
    assert asked["robots"] == (("arm", "my/arm.urdf", "flange"), *ROBOTS)
    run("--effect", "drift")
    assert asked["counts"] == {"single": 3, "null": 1}


def test_real_campaigns_come_from_a_folder_that_is_named(run, asked, tmp_path, monkeypatch):
    assert "No real campaigns" in run("--seed", 1)[1]
    monkeypatch.setenv(command.DATA, str(tmp_path))
    assert "No real campaigns" not in run("--seed", 1)[1]
    assert asked["cases"] == ["c1", "c2", "r1"]
    assert (asked["data"], asked["real"]) == (tmp_path, None)
    run("--seed", 1, "--count", "null=2", "real=4")
    assert (asked["counts"], asked["real"]) == ({"null": 2}, 4)
    for none in ((), ("real=0",)):
        run("--seed", 1, "--count", "null=2", *none)
        assert asked["cases"] == ["c1", "c2"]


def test_the_score_is_written_as_asked(run, tmp_path):
    plain, page = tmp_path / "s.json", tmp_path / "s.html"
    _, out, _ = run("--json", plain, "--report", page)
    assert out.endswith("2 right\n")
    assert json.loads(plain.read_text()) == {"right": 2}
    assert page.read_text().startswith("<p>2 right, 20")
    # what is printed instead of the text stands alone
    _, out, err = run("--json", "-")
    assert json.loads(out) == {"right": 2}
    assert SEAL in err
    assert run("--markdown")[1] == "| 2 |\n"


def test_cases_that_were_not_asked_are_told_and_not_scored(run, asked):
    asked["withdrawn"] = {"c2": "no draw shows the fault"}
    status, out, err = run("--seed", 1)
    assert status == 0
    assert out.endswith("1 right\n")
    assert "thermal-robot: note: c2 (null) was not asked: no draw shows the fault" in err


def test_motions_are_asked_in_the_place_of_poses(run, tmp_path, monkeypatch):
    from thermal_robot.blind.motions import trial

    def answered(cases, workers, progress):
        return [trial.Answer(case, verdict=("delay",), groups=((),), places=((),)) for case in cases]

    monkeypatch.setattr(trial, "run", answered)
    status, out, err = run("--motion", 1, "--seed", 3, "--json", tmp_path / "s.json")
    assert status == 0
    assert "nothing: silent 0%" in out
    assert "unlisted: blamed on an effect 100%" in out
    assert "Seed 3: 16 arms" in err
    assert len(json.loads((tmp_path / "s.json").read_text())) == 16
    for wrong in (("--motion", 0), ("--motion", 1, "--markdown"), ("--motion", 1, "--effect", "drift")):
        status, out, err = run(*wrong)
        assert (status, out) == (2, "")
        assert "--motion: cannot be run so" in err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--count", "nul=3"], ["nul=3", "null"]),
        (["--count", "null=-3"], ["null=-3"]),
        (["--robot", "a.urdf"], ["--tool"]),
        (["--fault", "f.py:F"], ["f.py:F"]),
        (["--data", "nowhere"], ["nowhere"]),
        (["--json", "nowhere/s.json"], ["nowhere/s.json"]),
        (["--workers", "0"], ["--workers"]),
    ],
)
def test_nonsense_is_refused_in_one_line(run, asked, arguments, words):
    status, _, err = run(*arguments)
    assert status == 2
    assert err.startswith("thermal-robot: ")
    assert err.count("\n") == 1
    assert all(word in err for word in words)
    assert "cases" not in asked


def test_a_stop_says_how_to_go_on(asked, capsys):
    asked["stop"] = True
    with pytest.raises(SystemExit) as stopped:
        cli.main(["blind", "--seed", "5"])
    assert stopped.value.code == 1
    assert capsys.readouterr().err.splitlines()[-1].endswith("with --seed 5 --directory blind-5 continues")


def test_without_mujoco_or_pyarrow_for_fleets_one_line_says_what_to_install(run, asked, monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    status, out, err = run()
    assert (status, out) == (2, "")
    assert err == 'thermal-robot: the blind trial needs MuJoCo: pip install "thermal-robot[blind]"\n'
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None if name == "pyarrow" else name)
    assert run("--seed", 1)[0] == 0
    asked.pop("cases")
    monkeypatch.setattr(
        sys.modules["thermal_robot.blind.plan"], "plan", lambda *_: (replace(case("s1"), kind="fleet"),)
    )
    status, _, err = run("--seed", 1)
    assert (status, "cases" in asked) == (2, False)
    assert err == 'thermal-robot: fleets in the trial need pyarrow: pip install "thermal-robot[blind]"\n'


def test_other_commands_load_nothing_of_the_trial():
    heavy = ["mujoco", "thermal_robot.blind.trial", "thermal_robot.blind.reality", "concurrent.futures.process", "rich"]
    code = (
        f"import sys; from thermal_robot import cli; cli._parser(); print([m for m in {heavy!r} if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


# ---- a fault of the user's own

FAULT = """
import numpy as np
from thermal_robot.blind.reality import Fault
from thermal_robot.blind.reality.fault import joints

def draw(setting, rng):
    values = np.zeros((setting.world.n, 1))
    values[2] = 1e-3
    return values

def act(body, setting, values):
    body.joints += values[:, 0] * np.sign(setting.q - setting.q.mean(axis=0))

MINE = Fault("two_positions", draw, act, joints, few=True)
IDLE = Fault("idle", lambda s, rng: np.ones((s.world.n, 1)), lambda *_: None, joints)
NUMBER = 3

def made():
    return MINE

def broken():
    raise RuntimeError("no such gear")
"""


@pytest.fixture
def file(tmp_path):
    pytest.importorskip("mujoco", reason='the blind trial needs "thermal-robot[blind]"')
    (tmp_path / "mine.py").write_text(FAULT)
    return tmp_path / "mine.py"


@pytest.mark.slow
def test_a_fault_of_ones_own_is_put_into_campaigns(file, tmp_path):
    from thermal_robot.blind.plan import ROBOTS, plan, robots
    from thermal_robot.blind.reality import make

    arms = robots(ROBOTS[:2])
    cases = command._with_faults(plan(1, {"null": 2}, arms), [f"{file}:MINE"], 1, arms)
    mine = cases[2:]
    assert len(mine) == command.OWN_CASES
    assert {case.robot.name for case in mine} == {arm.name for arm in arms}
    assert all(case.kind == "unlisted" and case.unlisted == "two_positions" for case in mine)
    truth = make(mine[0], tmp_path / "campaign")["truth"]
    assert truth["unlisted"] == "two_positions"
    assert truth["places"] == [{"kind": "joint", "name": "joint_3"}]
    assert truth["parts"]["two_positions"]["ratio"] > 2.0
    # a case that no draw can show is withdrawn and says why
    idle = replace(mine[0], own=f"{file}:IDLE", unlisted="idle", samples=(30, 32))
    assert make(idle, tmp_path / "idle") == {"withdrawn": "idle cannot be seen in this campaign"}
    assert not (tmp_path / "idle").exists()


def test_a_name_means_the_trials_own_fault_unless_a_file_is_given(file):
    from thermal_robot.blind.reality import FAULTS, UNLISTED
    from thermal_robot.blind.reality.unlisted import known

    assert known("drift") is FAULTS["drift"]
    assert known("slip") is UNLISTED["slip"]
    for name in ("MINE", "made"):
        assert known("drift", f"{file}:{name}").name == "two_positions"


@pytest.mark.parametrize(
    ("where", "words"),
    [
        ("{}/mine.py:NUMBER", "is a int, not a Fault"),
        ("{}/mine.py:ABSENT", "AttributeError.*ABSENT"),
        ("{}/mine.py:broken", "RuntimeError: no such gear"),
        ("{}/bad.py:MINE", "ModuleNotFoundError"),
        ("{}/bad.txt:MINE", "not a Python file"),
        ("nowhere.py:MINE", "there is no file 'nowhere.py'; expected file.py:NAME"),
        ("MINE", "there is no file ''"),
    ],
)
def test_what_is_no_fault_is_refused_with_its_name_and_reason(file, where, words):
    from thermal_robot.blind.reality.unlisted import load

    (file.parent / "bad.py").write_text("import nothing_of_this_name\n")
    (file.parent / "bad.txt").write_text("MINE = 1")
    with pytest.raises(EffectError, match=words):
        load(where.format(file.parent))
