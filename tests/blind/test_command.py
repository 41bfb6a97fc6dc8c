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
        return SimpleNamespace(to_dict=lambda: {"right": len(records)})

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


def test_a_seed_is_drawn_and_told(run, asked):
    _, out, _ = run()
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


def test_without_mujoco_one_line_says_what_to_install(run, monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    status, out, err = run()
    assert (status, out) == (2, "")
    assert err == 'thermal-robot: the blind trial needs MuJoCo: pip install "thermal-robot[blind]"\n'


def test_fleets_without_pyarrow_are_refused_before_anything_is_made(run, asked, monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None if name == "pyarrow" else name)
    assert run("--seed", 1)[0] == 0
    asked.pop("cases")
    fleets = SimpleNamespace(plan=lambda *_: (replace(case("s1"), kind="fleet"),), robots=tuple, ROBOTS=ROBOTS)
    monkeypatch.setitem(
        sys.modules, "thermal_robot.blind.plan", SimpleNamespace(**vars(fleets), SHORT=SHORT, FULL=FULL)
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
