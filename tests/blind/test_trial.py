"""The trial: what is told when, who can read what, what a stop, a crash or a late answer leaves behind."""

import hashlib
import json
import os
import secrets
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path

import pytest
from blind_fakes import AtOnce, Real, alive, case, light, put_examinee, rms, simulated

from thermal_robot import cli
from thermal_robot.blind import supervise, trial
from thermal_robot.blind.cases import Several
from thermal_robot.blind.trial import KEY_BYTES, canonical, open_seal, run_trial, seal
from thermal_robot.effects import library
from thermal_robot.errors import SealError, ThermalRobotError


def lines(path):
    return [json.loads(line) for line in path.read_text().splitlines()]


# ---- with the program itself

OTHERS = tuple(name for name in library() if name not in ("thermal_elongation", "drift"))
"""What nobody need wait for here."""


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A trial of true diagnoses, and what happened in which order."""
    directory = tmp_path_factory.mktemp("whole") / "trial"
    events = []

    def command(folder):
        events.append("start")
        return original(folder)

    def sealed(commitment):
        events.append(commitment)
        assert (directory / "answers.sealed").is_file()
        assert not (directory / "replies.jsonl").exists()

    cases = (
        case("c1", "thermal_elongation", without=OTHERS),
        case("c2", "thermal_elongation", seed=1, without=(*OTHERS, "drift", "unheard_of")),
        case("c3", seed=2, own="none fresh", without=OTHERS),
    )
    original = supervise.command
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(supervise, "command", command)
        records = run_trial(
            cases, directory, simulated, workers=1, progress=lambda stage, *_: events.append(stage), sealed=sealed
        )
    return directory, cases, records, events


def test_the_answers_are_sealed_before_the_first_examinee_is_started(whole):
    directory, cases, _, events = whole
    at = next(k for k, event in enumerate(events) if len(event) == 64)
    assert events[:at] == ["campaigns"] * len(cases)
    assert "start" in events[at:]
    assert events.count("diagnoses") == len(cases) + 1
    opened = json.loads((directory / "opened.json").read_text())
    assert opened["commitment"] == events[at]
    known = hashlib.sha256(bytes.fromhex(opened["key"]) + canonical(opened["answers"]))
    assert known.hexdigest() == events[at]


def test_records_hold_what_was_asked_what_is_true_and_what_was_said(whole):
    directory, cases, records, _ = whole
    assert json.loads((directory / "records.json").read_text()) == records
    assert [r["id"] for r in records] == ["c1", "c2", "c3"]
    for record, asked in zip(records, cases, strict=True):
        assert set(record) == {
            "id", "kind", "robot", "samples", "measures", "noise", "without", "hidden", "truth", "said", "fresh",
            "seconds", "error",
        }  # fmt: skip
        assert record["error"] is None
        assert record["said"]["campaign"]["samples"] == record["samples"] == 80
        assert record["truth"]["effects"] == list(asked.effects)
        assert 0.0 < record["seconds"] < 60.0
    assert records[0]["said"]["verdict"]["effects"] == ["thermal_elongation"]
    assert "drift" in {e["name"] for e in records[0]["said"]["effects"]}
    assert "drift" not in {e["name"] for e in records[1]["said"]["effects"]}
    assert records[2]["fresh"] is None


def test_a_prediction_is_held_against_where_the_target_really_is(whole):
    directory, _, records, _ = whole
    answers = json.loads((directory / "opened.json").read_text())["answers"]
    predicted = {line["id"]: line["predicted"] for line in lines(directory / "replies.jsonl")}
    for record in records[:2]:
        after = rms(predicted[record["id"]], answers[record["id"]]["fresh_position"])
        assert record["fresh"]["rms_after"] == pytest.approx(after, rel=1e-9)
        assert record["fresh"]["rms_before"] == pytest.approx(5e-3)


@pytest.mark.slow
def test_an_effect_that_is_taken_from_the_library_is_described_less_well(tmp_path):
    cases = (
        case("c1", "thermal_elongation"),
        case("c2", "thermal_elongation", seed=1, without=("thermal_elongation", "unheard_of")),
    )
    records = run_trial(cases, tmp_path / "trial", simulated, workers=2)
    assert records[0]["said"]["verdict"]["effects"] == ["thermal_elongation"]
    assert "thermal_elongation" not in {e["name"] for e in records[1]["said"]["effects"]}
    # a law in its place
    assert records[0]["fresh"]["rms_after"] < 0.7 * records[1]["fresh"]["rms_after"]


# ---- with an examinee that does what it is told


@pytest.fixture
def fake(monkeypatch, tmp_path):
    """Replace the examinee, make campaigns at once; return the trial's directory."""
    monkeypatch.setattr(trial, "ProcessPoolExecutor", AtOnce)
    return put_examinee(monkeypatch, tmp_path)


def asked(directory):
    return [line.split()[0] for line in (directory / "asked.txt").read_text().splitlines()]


def told(*todo):
    return tuple(case(f"c{k}", "drift", own=do) for k, do in enumerate(todo))


def test_the_distance_is_that_of_a_hand_calculation_and_no_more_examinees_start_than_workers(fake):
    cases = (*told("", ""), Real("r1"), Real("r2", "r1"))
    records = run_trial(cases, fake, light, workers=2)
    processes = {line.split()[1] for line in (fake / "asked.txt").read_text().splitlines()}
    assert sorted(asked(fake)) == ["c0", "c1", "r1", "r2"]
    assert 1 <= len(processes) <= 2
    assert not [pid for pid in processes if alive(int(pid))]
    # distances 10 and 0 before, 3 and 4 after
    fresh = {"rms_before": pytest.approx(50**0.5), "rms_after": pytest.approx(12.5**0.5), "shares": {}}
    assert records[0]["fresh"] == fresh
    request = records[0]["said"]["was"]
    assert request == {"folder": str(fake.resolve() / "campaigns" / "c0"), "without": [], "only": []}
    real = records[2]
    assert (real["kind"], real["robot"], real["asked"]) == ("real", "arm", "untouched")
    assert (real["right"], real["fresh"], real["answer"], records[3]["answer"]) == (True, None, None, "r1")


def test_of_several_campaigns_the_request_says_what_is_asked_and_no_more(fake):
    asks = {"same": "comparison", "changed": "comparison", "steady": "wear", "series": "wear", "fleet": "fleet"}
    cases = [
        replace(case(f"s{k}", "backlash", own=""), kind=kind, several=Several((2, 2), "grows", "backlash"))
        for k, kind in enumerate(asks)
    ]
    records = run_trial(cases, fake, light)
    for record, asked in zip(records, cases, strict=True):
        folder = str(fake.resolve() / "campaigns" / asked.id)
        assert record["said"]["was"] == {"folder": folder, "without": [], "only": [], "asks": asks[asked.kind]}


def test_a_crash_and_a_late_answer_are_errors_of_one_case_only(fake):
    start = time.perf_counter()
    records = run_trial(told("crash", "", "hang", "", "babble", ""), fake, light, workers=1, timeout=1.0)
    assert time.perf_counter() - start < 30.0
    errors = [record["error"] for record in records]
    assert errors[1] is errors[3] is errors[5] is None
    assert errors[0] == "the diagnosis failed: the process ended with status 7: out of luck"
    assert errors[2] == "the diagnosis failed: no answer within 1 s"
    assert errors[4].startswith("the diagnosis failed: its reply cannot be read")
    for record in records[::2]:
        assert record["said"] is record["fresh"] is record["seconds"] is None
    processes = [int(line.split()[1]) for line in (fake / "asked.txt").read_text().splitlines()]
    assert len(set(processes)) == 4  # each of the three is replaced
    assert not any(map(alive, processes))


def test_a_stopped_trial_goes_on_where_it_was(fake):
    cases = told("", "", "hang", "", "")
    seals = []

    def stop(stage, done, total):
        if stage == "diagnoses" and done == 2:
            raise KeyboardInterrupt

    start = time.perf_counter()
    with pytest.raises(KeyboardInterrupt):
        run_trial(cases, fake, light, workers=2, progress=stop, sealed=seals.append)
    assert time.perf_counter() - start < 30.0  # nobody waited for the one that hangs
    assert not (fake / "opened.json").exists()
    processes = {int(line.split()[1]) for line in (fake / "asked.txt").read_text().splitlines()}
    assert processes
    assert not [pid for pid in processes if alive(pid)]

    replies = fake / "replies.jsonl"
    finished = [line["id"] for line in lines(replies)]
    assert len(finished) == 2
    with replies.open("a") as file:
        file.write('{"id": "c4", "said": {"torn')
    (fake / "asked.txt").unlink()
    seen = []
    records = run_trial(
        cases, fake, light, workers=2, progress=lambda *p: seen.append(p), sealed=seals.append, timeout=1
    )
    assert sorted(asked(fake)) == sorted({c.id for c in cases} - set(finished))
    assert [p[1:] for p in seen if p[0] == "diagnoses"] == [(k, 5) for k in (2, 3, 4, 5)]
    assert sorted(line["id"] for line in lines(replies)) == [c.id for c in cases]
    assert [r["error"] is None for r in records] == [True, True, False, True, True]
    assert len(set(seals)) == 2

    # a finished one is only joined again; one whose campaign is no longer the same is diagnosed again
    (fake / "asked.txt").unlink()
    text = replies.read_text().splitlines()
    spoilt = json.loads(text[0])
    replies.write_text("\n".join([json.dumps({**spoilt, "campaign": "another"}), *text[1:]]) + "\n")
    assert run_trial(cases, fake, light, workers=1, timeout=1) == records
    assert asked(fake) == [spoilt["id"]]


def test_a_directory_of_something_else_is_refused(fake):
    cases = told("", "")
    fake.mkdir()
    (fake / "thesis.txt").write_text("")
    with pytest.raises(ThermalRobotError, match="not empty"):
        run_trial(cases, fake, light)
    (fake / "thesis.txt").unlink()
    run_trial(cases, fake, light)
    for other in (cases[:1], (replace(cases[0], seed=5), cases[1])):
        with pytest.raises(ThermalRobotError, match="another plan"):
            run_trial(other, fake, light)
    plan = json.loads((fake / "trial.json").read_text())
    assert "seed" not in plan
    (fake / "trial.json").write_text(json.dumps({**plan, "version": "0.0.9"}))
    with pytest.raises(ThermalRobotError, match="another version"):
        run_trial(cases, fake, light)
    (fake / "trial.json").write_text(json.dumps(plan))
    (fake / "replies.jsonl").write_text("[1]\n")
    with pytest.raises(ThermalRobotError, match="damaged"):
        run_trial(cases, fake, light)


def test_answers_altered_while_the_diagnoses_run_are_noticed(fake):
    def alter(stage, done, total):
        if (stage, done) == ("diagnoses", 1):
            file = fake / "answers.sealed"
            file.write_bytes(bytes(reversed(file.read_bytes())))

    with pytest.raises(SealError):
        run_trial(told(""), fake, light, progress=alter)
    assert not (fake / "records.json").exists()


def test_a_campaign_that_cannot_be_made_names_its_case(fake, monkeypatch):
    # its error has to find its way from another process
    monkeypatch.setattr(trial, "ProcessPoolExecutor", ProcessPoolExecutor)
    with pytest.raises(ThermalRobotError, match=r"case c0 cannot be made: robot.urdf: has no joints"):
        run_trial(told("nothing can be made"), fake, light)
    with pytest.raises(ThermalRobotError, match="an id of its own"):
        run_trial(told("")[:1] * 2, fake, light)


def test_an_examinee_that_does_not_start_is_no_error_of_a_case(fake, monkeypatch):
    monkeypatch.setattr(supervise, "command", lambda _: [sys.executable, "-c", "raise SystemExit('no such library')"])
    with pytest.raises(RuntimeError, match="does not start: the process ended with status 1: no such library"):
        run_trial(told(""), fake, light)


# ---- examinees


def test_who_stops_asking_has_nobody_else_started(fake, monkeypatch):
    started = []
    command = supervise.command
    monkeypatch.setattr(supervise, "command", lambda directory: started.append(directory) or command(directory))
    requests = {}
    for name, do in (("c0", ""), ("c1", "hang"), ("c2", "hang")):
        (fake / name).mkdir(parents=True)
        (fake / name / "campaign.toml").write_text(do)
        requests[name] = {"folder": str(fake / name), "without": [], "only": []}
    replies = supervise.examine(requests, fake, workers=1, timeout=100.0)
    start = time.perf_counter()
    assert next(replies)[0] == "c0"
    replies.close()
    assert time.perf_counter() - start < 20.0
    assert len(started) == 1
    assert set(asked(fake)) <= {"c0", "c1"}


def test_an_examinee_is_given_no_more_of_the_environment_than_it_needs(monkeypatch, tmp_path):
    monkeypatch.setenv("ANSWERS", "backlash")
    monkeypatch.setenv("PYTHONPATH", "elsewhere")
    given = supervise.environment()
    assert set(given) <= {"PATH", "HOME", "LD_LIBRARY_PATH", "PYTHONPATH", "PYTHONSAFEPATH", "OMP_NUM_THREADS"}
    root = Path(supervise.__file__).parents[2]
    own = [] if root.name in ("site-packages", "dist-packages") else [str(root)]
    assert given["PYTHONPATH"].split(os.pathsep) == [*own, "elsewhere"]
    # an installed package does not stand before Python's own
    installed = tmp_path / "site-packages" / "thermal_robot" / "blind" / "supervise.py"
    monkeypatch.setattr(supervise, "__file__", str(installed))
    assert supervise.environment()["PYTHONPATH"] == "elsewhere"
    assert supervise.command(tmp_path)[1:] == ["-m", "thermal_robot.blind.examinee", str(tmp_path.resolve())]


# ---- the seal

ANSWERS = {"c002": {"truth": {"effects": ["backlash"], "unlisted": None}, "noise": 2.5e-5}, "c001": {"Größe": [1, 2.5]}}


@pytest.fixture
def sealed(tmp_path):
    path, key = tmp_path / "answers.sealed", secrets.token_bytes(KEY_BYTES)
    return path, key, seal(ANSWERS, path, key)


def test_what_was_sealed_is_opened_with_the_key_and_the_file_alone_tells_only_its_length(sealed, tmp_path):
    path, key, commitment = sealed
    assert open_seal(*sealed) == ANSWERS
    assert commitment == hashlib.sha256(key + canonical(ANSWERS)).hexdigest()
    content = path.read_bytes()
    assert len(content) == len(canonical(ANSWERS))
    assert not any(word in content for word in (b"backlash", b"c001", b"truth", b"effects"))
    other = seal(ANSWERS, tmp_path / "other", secrets.token_bytes(KEY_BYTES))
    assert other != commitment
    assert (tmp_path / "other").read_bytes() != content
    # the commitment hashes key and text without a mark between them: the length of the key is the mark
    with pytest.raises(ValueError, match="32 bytes"):
        seal(ANSWERS, tmp_path / "sealed", b"short")


def test_the_text_is_canonical():
    assert canonical({"b": [1, 2.5, None], "a": "ö"}) == b'{"a":"\\u00f6","b":[1,2.5,null]}'
    assert canonical(dict(reversed(ANSWERS.items()))) == canonical(ANSWERS)
    with pytest.raises(ValueError, match="JSON compliant"):
        canonical({"a": float("nan")})


def test_bytes_of_the_file_are_spread_like_noise(tmp_path):
    seal({"a": "0" * 100_000}, tmp_path / "sealed", bytes(range(KEY_BYTES)))
    content = (tmp_path / "sealed").read_bytes()
    expected = len(content) / 256
    # chi square with 255 degrees of freedom: mean 255, standard deviation 22.6
    assert abs(sum((content.count(bytes([k])) - expected) ** 2 / expected for k in range(256)) - 255) < 5 * 22.6


def test_an_altered_file_is_refused(sealed):
    path, _, commitment = sealed
    content = path.read_bytes()
    flipped = [content[:at] + bytes([content[at] ^ 1]) + content[at + 1 :] for at in (0, 40, len(content) - 1)]
    for other in (*flipped, content[:-1], content + b"0", b""):
        path.write_bytes(other)
        with pytest.raises(SealError, match="not the answers that were sealed"):
            open_seal(*sealed)
    # answers cannot be exchanged together with the key
    key = secrets.token_bytes(KEY_BYTES)
    seal({"c001": {}}, path, key)
    with pytest.raises(SealError):
        open_seal(path, key, commitment)
    path.unlink()
    with pytest.raises(SealError, match="cannot be read"):
        open_seal(*sealed)
    assert issubclass(SealError, ThermalRobotError)


# ---- the whole command, and the golden answers


@pytest.mark.slow
def test_two_robots_that_nobody_has_seen_are_examined(tmp_path, capsys):
    pytest.importorskip("mujoco", reason="the world of the trial needs MuJoCo")
    options = ["--seed", "1", "--count", "single=1", "null=1", "real=0", "--effect", "drift", "--workers", "1"]
    robot = ["--robot", "builtin:rv_m2", "--tool", "tool0"]
    files = ["--directory", str(tmp_path / "trial"), "--json", str(tmp_path / "s.json")]
    assert cli.main(["blind", *options, *robot, *files]) == 0
    out = capsys.readouterr().out
    opened = json.loads((tmp_path / "trial" / "opened.json").read_text())
    # what was told before the first diagnosis is the hash of what was opened after the last
    commitment = hashlib.sha256(bytes.fromhex(opened["key"]) + canonical(opened["answers"])).hexdigest()
    assert f"sealed before the first diagnosis: sha256 {commitment}" in out
    plain = json.loads((tmp_path / "s.json").read_text())
    assert (plain["cases"], plain["failed"], plain["misses"]) == (2, 0, [])
    assert {k["kind"]: k["rates"]["exact"]["successes"] for k in plain["kinds"]} == {"single": 1, "null": 1}
    single = next(a for a in opened["answers"].values() if a["truth"]["effects"])
    assert single["truth"]["effects"] == ["drift"]
    assert plain["shrinkage"]["pairs"][0]["real"] > 0.9


@pytest.fixture
def golden():
    return json.loads((Path(__file__).parent / "golden_answers.json").read_text(encoding="utf-8"))


def test_the_golden_answers_are_to_the_cases_that_the_seed_draws(golden):
    pytest.importorskip("mujoco", reason="the world of the trial needs MuJoCo")
    from blind.record import COUNTS, SEED

    from thermal_robot.blind.plan import plan, robots

    cases = {case.id: case for case in plan(SEED, COUNTS, robots())}
    assert set(golden) == set(cases)
    for name, said in golden.items():
        case = cases[name]
        drawn = (case.kind, case.robot.name, list(case.effects), case.unlisted)
        assert (said["kind"], said["robot"], said["effects"], said["unlisted"]) == drawn
    assert not any(said.get("failed") for said in golden.values())


@pytest.mark.slow
def test_fixed_robots_are_answered_as_they_were(golden, tmp_path):
    from blind.record import answers

    found = answers(tmp_path / "trial", workers=2)
    assert not {name: (golden[name], found[name]) for name in golden if found[name] != golden[name]}
