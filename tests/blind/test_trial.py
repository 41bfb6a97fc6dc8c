"""The trial: what is told when, who can read what, what a stop, a crash or a late answer leaves behind."""

import hashlib
import json
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context

import pytest
from blind_fakes import AtOnce, Real, alive, case, light, put_examinee, rms, simulated

from thermal_robot.blind import supervise, trial
from thermal_robot.blind.cases import Several
from thermal_robot.blind.trial import canonical, run_trial
from thermal_robot.errors import SealError, ThermalRobotError


def lines(path):
    return [json.loads(line) for line in path.read_text().splitlines()]


def same_files(folder, other):
    """Assert that a folder's files are in another one, too, to the byte; return their names."""
    for file in folder.iterdir():
        assert file.read_bytes() == (other / file.name).read_bytes(), file.name
    return {file.name for file in folder.iterdir()}


# ---- with the program itself


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
        case("c1", "thermal_elongation"),
        case("c2", "thermal_elongation", seed=1, without=("drift", "unheard_of")),
        case("c3", seed=2, own="none fresh"),
    )
    original = supervise.command
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(supervise, "command", command)
        records = run_trial(
            cases, directory, simulated, workers=2, progress=lambda stage, *_: events.append(stage), sealed=sealed
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


def test_a_campaign_is_made_twice_to_the_same_byte(whole, tmp_path):
    directory, cases, _, _ = whole
    for asked in cases:
        again = tmp_path / asked.id
        again.mkdir()
        simulated(asked, again)
        assert same_files(again, directory / "campaigns" / asked.id) >= {"campaign.toml", "measurements.csv"}


def test_a_campaign_of_the_trials_own_world_is_made_twice_to_the_same_byte(tmp_path):
    pytest.importorskip("mujoco", reason="the world of the trial needs MuJoCo")
    from thermal_robot.blind import reality
    from thermal_robot.blind.plan import robots

    asked = case("c1", "thermal_elongation", "joint_compliance", seed=2**61 + 1)
    asked = replace(asked, robot=robots([("rv_m2", "builtin:rv_m2", "tool0")])[0])
    for place in ("once", "twice"):
        (tmp_path / place).mkdir()
    once = reality.make(asked, tmp_path / "once")
    # in another process, where sets of words have another order
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        assert pool.submit(reality.make, asked, tmp_path / "twice").result() == once
    assert json.loads(canonical(once)) == once
    files = {"campaign.toml", "fresh.csv", "measurements.csv", "robot.urdf"}
    assert same_files(tmp_path / "once", tmp_path / "twice") == files


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


def test_the_distance_is_that_of_a_hand_calculation(fake):
    cases = (*told("", ""), Real("r1"), Real("r2", "r1"))
    records = run_trial(cases, fake, light, workers=2)
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
