"""Many campaigns: what a loop would say, for any number of workers, after any stop; failures are rows."""

import os
import shutil
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet
import pytest
from fleet.robots import ONLY, write_fleet, write_robot

import thermal_robot as tr
from thermal_robot.diagnosis.values import Misfit
from thermal_robot.errors import CampaignError, ThermalRobotError
from thermal_robot.fleet import many, settings
from thermal_robot.fleet.listed import campaigns
from thermal_robot.fleet.many import DONE, TABLE, diagnosed, fingerprint, opened
from thermal_robot.fleet.rows import failed, free, needed, rows_of, schema, write_rows

pytestmark = pytest.mark.filterwarnings("default")
BAD = "hall_1/arm_05"


def test_it_says_what_a_loop_says_exactly(fleet, fleet_folder):
    table = fleet.to_frame()
    names = list(dict.fromkeys(table["campaign"]))
    assert names == sorted(f"hall_{k % 2}/arm_{k:02d}" for k in range(6))
    labels = fleet.to_frame(["campaign", "hall", "robot"]).drop_duplicates()
    assert list(labels["hall"] + "/" + labels["robot"]) == list(labels["campaign"])
    for name in names:
        if name == BAD:
            continue
        rows = rows_of(tr.diagnose(fleet_folder / name, only=ONLY))
        own = table[table["campaign"] == name]
        assert list(own["effect"]) == [row["effect"] for row in rows]
        for (_, got), row in zip(own.iterrows(), rows, strict=True):
            for key in ("rms_before", "rms_after", "held_out", "probability", "shrinkage", "status", "summary"):
                assert got[key] == row[key], key
            for key in ("parameters", "free", "places"):
                assert [dict(value) for value in got[key]] == row[key], key


def test_a_campaign_that_cannot_be_read_is_a_row_with_its_reason(fleet, fleet_folder):
    table = fleet.to_frame()
    (row,) = table[table["campaign"] == BAD].to_dict("records")
    assert row["outcome"] == "failed"
    assert pd.isna(row["effect"])
    with pytest.raises(tr.CampaignError) as complaint:
        tr.diagnose(fleet_folder / BAD)
    assert row["reason"] == str(complaint.value).replace(f"{fleet_folder / BAD}{os.sep}", "")
    assert row["reason"].startswith("measurements.csv, row")
    assert fleet.summary.outcomes == {"diagnosed": 5, "failed": 1}
    assert repr(fleet) == "<Fleet: 6 campaigns, 6 robots, 1 failed>"
    assert str(fleet).startswith("6 campaigns of 6 robots: 5 diagnosed, 1 failed.")


@pytest.mark.slow
def test_one_worker_writes_the_same_bytes(fleet, fleet_folder, tmp_path):
    alone = tr.diagnose_many(fleet_folder, tmp_path, labels=["hall", "robot"], only=reversed(ONLY), workers=1)
    assert alone.table.read_bytes() == fleet.table.read_bytes()
    assert alone.summary == fleet.summary


def test_what_is_done_is_not_done_again(fleet, fleet_folder, tmp_path, monkeypatch):
    def nobody(*_):
        raise AssertionError("somebody works")

    monkeypatch.setattr(many, "connected", nobody)
    out, seen = fleet.table.parent, []
    again = tr.diagnose_many(
        fleet_folder, out, labels=["hall", "robot"], only=ONLY, progress=lambda *stage: seen.append(stage)
    )
    assert again.summary == fleet.summary
    assert [s for s in seen if s[0] == "campaigns"] == [("campaigns", k + 1, 6) for k in range(6)]
    shutil.copy(out / DONE, tmp_path / DONE)
    with pytest.raises(AssertionError, match="somebody works"):
        tr.diagnose_many(fleet_folder, tmp_path, only=["backlash"])


@pytest.mark.slow
def test_what_has_changed_is_done_anew(rv_m2, tmp_path):
    root = write_fleet(rv_m2, tmp_path / "all", 2)
    first = tr.diagnose_many(root, tmp_path / "out", only=ONLY, workers=1).to_frame()
    write_robot(rv_m2, tmp_path / "other", {"backlash": {"joint_3": 5e-4}}, seed=9)
    shutil.copy(tmp_path / "other" / "measurements.csv", root / "hall_1" / "arm_01" / "measurements.csv")
    second = tr.diagnose_many(root, tmp_path / "out", only=ONLY, workers=1).to_frame()
    pd.testing.assert_frame_equal(first[first.campaign == "hall_0/arm_00"], second[second.campaign == "hall_0/arm_00"])
    places = second.loc[(second.campaign == "hall_1/arm_01") & (second.effect == "backlash"), "places"].item()
    assert places[0]["name"] == "joint_3"


RUN = """
import sys, time
import thermal_robot as tr

def progress(stage, done, among):
    print(stage, done, among, flush=True)
    if stage == "campaigns" and done >= 3:
        time.sleep(1.1)  # what is done is on disk with the next, once a second has passed; and all is not done at once

if __name__ == "__main__":
    tr.diagnose_many(sys.argv[1], sys.argv[2], labels=["hall", "robot"], only=sys.argv[3:], workers=2,
                     progress=progress)
"""


@pytest.mark.slow
@pytest.mark.parametrize("ending", [signal.SIGINT, signal.SIGKILL], ids=["interrupted", "killed"])
def test_a_run_that_is_stopped_continues(fleet, fleet_folder, tmp_path, ending):
    script = tmp_path / "run.py"
    script.write_text(RUN)
    command = [sys.executable, str(script), str(fleet_folder), str(tmp_path / "out"), *ONLY]
    env = {**os.environ, "PYTHONPATH": str(Path(tr.__file__).parents[1])}
    run = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env=env)
    for line in run.stdout:
        if line.startswith("campaigns 4 "):
            break
    run.send_signal(ending)
    run.stdout.close()
    assert run.wait(60) != 0
    assert not (tmp_path / "out" / TABLE).exists()
    again = tr.diagnose_many(fleet_folder, tmp_path / "out", labels=["hall", "robot"], only=ONLY, workers=2)
    assert again.table.read_bytes() == fleet.table.read_bytes()


def test_only_what_the_program_failed_at_is_tried_again(rv_m2, tmp_path, monkeypatch):
    rows, again = diagnosed(str(write_robot(rv_m2, tmp_path / "few", rows=3)), [], [])
    assert not again
    assert "too few" in rows[0]["reason"]
    folder = write_robot(rv_m2, tmp_path / "a")

    def broken(*_, **__):
        raise ZeroDivisionError(f"in {folder}{os.sep}measurements.csv")

    monkeypatch.setattr(many, "diagnose", broken)
    rows, again = diagnosed(str(folder), [], [])
    assert again
    assert rows == [{"outcome": "failed", "reason": "the program failed: ZeroDivisionError: in measurements.csv"}]


@pytest.mark.slow
def test_a_campaign_that_takes_too_long_is_a_row_that_is_tried_again(rv_m2, tmp_path):
    write_robot(rv_m2, tmp_path / "in" / "arm", seed=1)
    late = tr.diagnose_many(tmp_path / "in", tmp_path / "out", only=ONLY, workers=1, time_limit=0.01)
    ((name, *_, why),) = late.summary.failures
    assert name == "arm"
    assert "time limit" in why
    fleet = tr.diagnose_many(tmp_path / "in", tmp_path / "out", only=ONLY, workers=1)
    assert not fleet.summary.failures


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"only": ["backlsh"]}, "did you mean 'backlash'"),
        ({"only": []}, "names no effect"),
        ({"workers": 0}, "at least 1"),
        ({"workers": True}, "at least 1"),
        ({"time_limit": 0.0}, "seconds above 0"),
        ({"labels": ["a", "b", "c"]}, "fewer levels"),
    ],
)
def test_what_makes_no_sense_is_said_before_anything_is_done(fleet_folder, tmp_path, options, said):
    with pytest.raises(tr.ThermalRobotError, match=said):
        tr.diagnose_many(fleet_folder, tmp_path / "out", **options)
    assert not (tmp_path / "out" / TABLE).exists()
    (tmp_path / "file").write_text("")
    with pytest.raises(tr.CampaignError, match="cannot be made"):
        tr.diagnose_many(fleet_folder, tmp_path / "file" / "out")


@pytest.mark.slow
def test_a_fleet_with_a_fault_of_all_and_one_of_a_hall_is_told_so(rv_m2, tmp_path):
    """All arms have a gain too small to be found in most of them; those of a hall a zero that is off; one has play."""
    gain, shift = 8e-5, 2.5e-4
    rng = np.random.default_rng(17)
    for k in range(24):
        effects = {"joint_gain": {"joint_3": rng.normal(gain, 1e-5)}}
        if k % 3 == 1:
            effects["joint_offset"] = {"joint_2": rng.normal(shift, 1e-5)}
        if k == 6:
            effects["backlash"] = {"joint_4": 6e-4}
        write_robot(rv_m2, tmp_path / "all" / f"hall_{k % 3}" / f"arm_{k:02d}", effects, seed=k, rows=60)
    only = ["joint_gain", "joint_offset", "backlash"]
    found = tr.diagnose_many(tmp_path / "all", tmp_path / "out", labels=["hall", "robot"], only=only, workers=2).summary
    shared = {(s.effect, s.parameter): s for s in found.shared}
    assert set(shared) == {("joint_gain", "gain error, joint_3"), ("joint_offset", "zero offset, joint_2")}
    of_all, of_hall = shared["joint_gain", "gain error, joint_3"], shared["joint_offset", "zero offset, joint_2"]
    assert of_all.mean == pytest.approx(gain, abs=3.0 * of_all.mean_std)
    assert of_all.spread == pytest.approx(1e-5, abs=3.0 * of_all.spread_std)
    assert of_all.label == ""
    assert (of_hall.label, of_hall.groups[0].group) == ("hall", "hall_1")
    assert of_hall.groups[0].mean == pytest.approx(shift, abs=3.0 * of_hall.groups[0].mean_std)
    assert [(a.robot, a.parameter) for a in found.apart] == [("arm_06", "lost motion, joint_4")]


ROWS = [{"outcome": "diagnosed", "rms_before": 0.1 + 0.2, "summary": "µm – \ud800"}, {"effect": "drift"}]


def test_what_was_put_is_there_in_the_next_run_in_the_order_of_its_list(tmp_path):
    with opened(tmp_path / "done") as done:
        done.put("a", ROWS)
        done.put("b", [{"effect": "backlash"}])
        done.put("again", ROWS, again=True)
        done.name(0, "again")
        assert list(done.in_order()) == [(0, ROWS)]
    with opened(tmp_path / "done") as done:
        assert [key in done for key in ("a", "c", "again")] == [True, False, False]
        assert list(done.in_order()) == []
        for number, key in enumerate("bab"):
            done.name(number, key)
        assert list(done.in_order()) == [(0, [{"effect": "backlash"}]), (1, ROWS), (2, [{"effect": "backlash"}])]


def test_two_runs_in_one_folder_are_one_too_many_and_a_file_of_another_kind_is_left_alone(tmp_path):
    with opened(tmp_path / "done"), pytest.raises(CampaignError, match="no other run"), opened(tmp_path / "done"):
        pass
    (tmp_path / "other").write_text("a diary, which is longer than the header of a database would be" * 20)
    with pytest.raises(CampaignError, match="is not what a fleet has written"), opened(tmp_path / "other"):
        pass
    assert (tmp_path / "other").read_text().startswith("a diary")


KILLED = """
import os, signal, sys, time
from pathlib import Path
from thermal_robot.fleet import many
from thermal_robot.fleet import settings
settings.WRITTEN_EVERY = 0.0
with many.opened(Path(sys.argv[1])) as known:
    for k in range(5):
        known.put(str(k), [{"effect": str(k)}])
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_process_that_is_killed_leaves_what_it_had_put(tmp_path):
    root = Path(__file__).parents[2]
    run = [sys.executable, "-c", KILLED, str(tmp_path / "done")]
    ended = subprocess.run(run, env={**os.environ, "PYTHONPATH": str(root)}, check=False)
    assert ended.returncode == -signal.SIGKILL
    with opened(tmp_path / "done") as done:
        assert all(str(k) in done for k in range(5))


def test_a_fingerprint_follows_content_version_and_options_and_nothing_else(rv_m2, tmp_path, monkeypatch):
    def of(folder, only=("drift",), without=()):
        return fingerprint(str(folder), [list(only), list(without)])

    folder, moved = write_robot(rv_m2, tmp_path / "a"), tmp_path / "elsewhere" / "a"
    known = of(folder)
    assert of(folder / "campaign.toml") == known
    assert of(folder, (), ("drift",)) != known
    moved.parent.mkdir()
    folder.rename(moved)
    os.utime(moved / "measurements.csv", (1e9, 1e9))
    assert of(moved) == known
    for file in ("campaign.toml", "measurements.csv", "robot.urdf"):
        before = (moved / file).read_bytes()
        (moved / file).write_bytes(before + b"\n")
        assert of(moved) != known, file
        (moved / file).write_bytes(before)
    assert of(moved) == known
    declared = (moved / "campaign.toml").read_text()
    (moved / "campaign.toml").write_text(declared.replace("[robot]\n", '[robot]\nkinematics = "k.yaml"\n'))
    told = set()
    for figure in ("0.1", "0.2"):
        (moved / "k.yaml").write_text(figure)
        told.add(of(moved))
    assert len(told) == 2
    (moved / "campaign.toml").write_text(declared)
    monkeypatch.setattr("importlib.metadata.version", lambda _: "99.0")  # another program may say something else
    assert of(moved) != known


# ---- which campaigns a fleet has


@pytest.fixture
def root(tmp_path):
    for name in ("hall_2/b/monday", "hall_1/a/monday", "hall_1/a/friday", "hall_1/c"):
        (tmp_path / "all" / name).mkdir(parents=True)
        (tmp_path / "all" / name / "campaign.toml").write_text("")
    (tmp_path / "all" / "notes").mkdir()
    return tmp_path / "all"


def test_a_folder_holds_every_campaign_below_it_labelled_by_its_folders(root):
    found = campaigns(root, ["hall", "robot"])
    assert found.names == ("hall", "robot", "level_3")
    assert found.campaigns == (
        ("hall_1/a/friday", ("hall_1", "a", "friday")),
        ("hall_1/a/monday", ("hall_1", "a", "monday")),
        ("hall_1/c", ("hall_1", "c", "")),
        ("hall_2/b/monday", ("hall_2", "b", "monday")),
    )
    assert found.folder("hall_1/c") == str(root / "hall_1" / "c")
    assert campaigns(root).names == ("level_1", "level_2", "level_3")
    assert campaigns(root / "hall_1" / "c").campaigns == ((".", ()),)  # a folder that is a campaign
    # one whose file is a broken link is not passed over
    (root / "hall_1" / "d").mkdir()
    (root / "hall_1" / "d" / "campaign.toml").symlink_to(root / "gone")
    assert [name for name, _ in campaigns(root / "hall_1").campaigns] == ["a/friday", "a/monday", "c", "d"]


CSV = "campaign,hall,robot\nhall_1/a/monday,one,a\nhall_2/b/monday,two,\n"
TOML = '[[campaigns]]\ncampaign = "hall_1/a/monday"\nhall = "one"\nrobot = "a"\n'
TOML += '[[campaigns]]\ncampaign = "hall_2/b/monday"\nhall = "two"\n'


@pytest.mark.parametrize(("name", "text"), [("list.csv", CSV), ("list.toml", TOML)])
def test_a_list_keeps_its_order_and_its_columns_are_labels(root, name, text):
    (root / name).write_text(text)
    found = campaigns(root / name)
    assert found.names == ("hall", "robot")
    assert found.campaigns == (("hall_1/a/monday", ("one", "a")), ("hall_2/b/monday", ("two", "")))
    assert found.folder("hall_1/a/monday") == str(root / "hall_1" / "a" / "monday")
    with pytest.raises(CampaignError, match="its columns"):
        campaigns(root / name, ["hall"])
    (root / name).write_text('[[campaigns]]\ncampaign = "a"\n' if name.endswith("toml") else "campaign\na\n")
    assert campaigns(root / name).campaigns == (("a", ()),)


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("list.csv", "campain,hall\na,one\n", r"no column 'campaign'.*did you mean 'campain'"),
        ("list.csv", "campaign,effect\na,one\n", r"column 'effect'.*another name"),
        ("list.csv", "campaign,hall\na,one\nb,two\n./a,three\n", r"row 4, column 'campaign'.*stands in row 2"),
        ("list.csv", "campaign,hall\na,one\n,two\n", r"row 3, column 'campaign': no campaign is named"),
        ("list.toml", "[[campaigns]]\ncampaign = 3\n", r"campaigns\[0\].campaign"),
        ("list.toml", "[[campaigns]]\ncampaign = 'a'\n' ' = 'b'\n", "a label has no name"),
        ("list.toml", "[[campaigns]\n", r"row 1: not valid TOML"),
        ("list.toml", "[[campaign]]\n", r"found campaign, expected \[\[campaigns\]\]"),
        ("list.toml", "campaigns = []\n", "lists no campaign"),
        ("list.toml", "campaigns = [3]\n", "no list of campaigns"),
        ("list.toml", "", "found nothing"),
        ("list.txt", "campaign\na\n", r"no list of campaigns.*\.csv or \.toml"),
        ("campaign.toml", "", "no list of campaigns"),
    ],
)
def test_a_list_that_is_none_says_where(tmp_path, name, text, said):
    (tmp_path / name).write_text(text)
    with pytest.raises(CampaignError, match=said):
        campaigns(tmp_path / name)


@pytest.mark.parametrize(
    ("below", "labels", "said"),
    [
        ("nowhere", [], "no such folder or list"),
        ("notes", [], r"no campaign\.toml lies below"),
        ("", ["a", "b", "c", "d"], "fewer levels"),
        ("", ["hall", "hall"], "stands twice"),
    ],
)
def test_what_is_not_there_or_empty_says_so(root, below, labels, said):
    with pytest.raises(CampaignError, match=said):
        campaigns(root / below, labels)


# ---- rows of the table


@pytest.fixture(scope="module")
def found():
    return tr.diagnose(tr.demo_campaign(), only=[*ONLY, "thermal_elongation", "link_compliance"])


def of_robot(robot, effects, seed, **options):
    campaign = tr.simulate(robot, effects, rows=40, noise=20e-6, seed=seed, base_known=False, tool_known=False)
    return tr.diagnose(campaign, **{"only": ONLY, **options})


def test_a_row_is_what_the_diagnosis_tells_of_an_effect(found):
    told = found.to_dict()
    rows = rows_of(found)
    assert [row["effect"] for row in rows] == [effect["name"] for effect in told["effects"]]
    for row, effect in zip(rows, told["effects"], strict=True):
        assert row["rms_before"] == told["gap"]["rms_before"]
        assert row["held_out"] == told["gap"]["held_out"]["shrinkage"]
        assert row["unexplained"] == told["verdict"]["unexplained"]
        for name in ("status", "probability", "shrinkage", "needs", "confounded_with", "quantity", "shape"):
            assert row[name] == effect[name]
        assert row["places"] == effect["locations"]
        known = [p for p in effect["parameters"] if p.pop("identified")]
        assert row["parameters"] == known


def test_a_table_that_does_not_fit_its_robot_is_one_row_with_the_reason(found):
    (row,) = rows_of(replace(found, misfit=Misfit(away=0.3), summary="Nothing fits.", advice="Look."))
    assert (row["outcome"], row["reason"]) == ("unusable", "Nothing fits. Look.")
    assert "effect" not in row


def test_what_is_written_is_read_again_a_few_rows_at_a_time(found, tmp_path, monkeypatch):
    monkeypatch.setattr(settings, "ROWS_AT_ONCE", 2)
    rows = [{"campaign": "a", "hall": "1", **row} for row in rows_of(found)]
    rows += [{"campaign": "b", "hall": "2", **row} for row in failed("it is empty")]
    for name in ("one", "two"):
        write_rows(tmp_path / name, ["hall"], iter(rows))
    assert (tmp_path / "one").read_bytes() == (tmp_path / "two").read_bytes()
    with pa.parquet.ParquetFile(tmp_path / "one") as file:
        assert file.num_row_groups == (len(rows) + 1) // 2
        table = file.read()
    assert table.schema.equals(schema(["hall"]))
    for read, given in zip(table.to_pylist(), rows, strict=True):
        assert {k: v for k, v in read.items() if v is not None} == {k: v for k, v in given.items() if v is not None}


def test_a_module_that_is_missing_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ThermalRobotError, match=r"needs distributed.*pip install 'thermal-robot\[fleet\]'"):
        needed("distributed")


@pytest.mark.parametrize("effects", [{}, {"backlash": {"joint_2": 4e-4}}], ids=["nothing found", "one found"])
def test_free_values_are_least_squares_beside_what_was_found(rv_m2, effects):
    """Against a dense solution with a row for each prior; the frames and the effect in question have none."""
    fit = of_robot(rv_m2, effects, 3, only=["backlash", "joint_gain"]).fit
    e, name = fit.explanation, "joint_gain"
    own, others = fit.blocks_of(name)[0], [b for b in e.best.blocks if fit.families[b] != name]
    assert [fit.families[b] for b in others] == list(effects)
    assert fit.probability("backlash") < settings.MAY_BE or effects
    blocks = [e.linear.blocks[b] for b in (own, *others)]
    root = np.sqrt(e.whitening.weights)[:, None, None] / (e.whitening.sigma()[:, :, None] * e.best.noise)
    columns = np.concatenate([e.linear.frames, *(b.columns for b in blocks)], axis=2) * root
    columns = columns.reshape(-1, columns.shape[2])
    gap = (e.linear.gap[:, :, None] * root).ravel()
    flat, width = e.linear.frames.shape[2], len(blocks[0].sizes)
    prior = np.concatenate([np.full(flat + width, np.inf), *(e.held(b) for b in others)])
    size = np.concatenate([1e-3 * np.ones(flat), *(b.sizes for b in blocks)])
    # the last joint turns about the target: next to nothing is seen of its gain
    inverse = np.linalg.pinv(np.vstack([columns, np.diag(1.0 / prior)]) * size, rcond=1e-5)
    answer = size * (inverse @ np.append(gap, np.zeros(len(prior))))
    spread = size * np.sqrt((inverse**2).sum(axis=1))
    names = [p.name for p in blocks[0].parameters]
    found = free(fit)[name]
    assert found
    for parameter in found:
        k = flat + names.index(parameter["name"])
        assert parameter["value"] == pytest.approx(answer[k], abs=1e-4 * spread[k])
        assert parameter["std"] == pytest.approx(spread[k], rel=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("size", [0.0, 6e-5], ids=["absent", "found in some"])
def test_free_values_scatter_about_the_truth_by_their_deviation(rv_m2, size):
    off, found = [], []
    for seed in range(24):
        diagnosis = of_robot(rv_m2, {"backlash": {"joint_2": size}}, seed)
        found.append("backlash" in diagnosis.verdict)
        for parameter in free(diagnosis.fit, ["backlash"])["backlash"]:
            true = size if parameter["name"] == "lost motion, joint_2" else 0.0
            off.append((parameter["value"] - true) / parameter["std"])
    assert any(found) == (size > 0.0)
    assert not all(found)
    assert len(off) >= 48
    assert np.mean(off) == pytest.approx(0.0, abs=4.0 / np.sqrt(len(off)))
    # of 48 values the root mean square is known to 10 %: twice that
    assert np.sqrt(np.mean(np.square(off))) == pytest.approx(1.0, abs=0.2)


def test_free_values_are_told_in_all_joints_and_of_nothing_that_the_data_do_not_see(rv_m2):
    """Else no robot could stand out by a fault of its own; the zero of joint 1 is the direction of the base."""
    found = of_robot(rv_m2, {"backlash": {"joint_2": 6e-4}}, 4)
    assert {place.name for place in found.finding("backlash").locations if place.share > 0.0} == {"joint_2"}
    told = free(found.fit, ["joint_gain"])
    zeros = [parameter["name"] for parameter in told["joint_offset"]]
    assert zeros
    assert "zero offset, joint_1" not in zeros
    assert len(told["backlash"]) >= 4
    for p in told["backlash"]:
        assert abs(p["value"] - 6e-4 * (p["name"] == "lost motion, joint_2")) < 4.0 * p["std"]
    assert len(told["joint_gain"]) >= 2  # which the diagnosis was not asked for
    assert all(abs(p["value"]) < 4.0 * p["std"] for p in told["joint_gain"])
