"""The benchmark's own code runs and writes what it is said to; figures mean nothing here, and no time is asserted."""

import json
import re

import numpy as np
import pytest
from benchmarks import page, run
from benchmarks.parts import calibration, kinematics, mixed
from benchmarks.peers import environments
from benchmarks.timing import Effort, by_turns, exponent, medians

import thermal_robot as tr


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("performance")
    assert run.main(["--tiny", "--out", str(folder)]) == 0
    return folder


@pytest.mark.slow
def test_every_part_is_on_the_page(folder):
    text = (folder / "performance.md").read_text(encoding="utf-8")
    kept = json.loads((folder / "performance.json").read_text(encoding="utf-8"))
    assert list(kept) == list(run.PARTS)
    for part in kept.values():
        assert f"## {part['title']}\n" in text
        assert part["tables"]
        for table in part["tables"]:
            assert {len(row) for row in table} == {len(table[0])}
    for picture in re.findall(r"\]\((\S+\.svg)\)", text):
        assert (folder / picture).stat().st_size < 100_000


@pytest.mark.slow
def test_a_peer_that_is_not_there_is_told(folder):
    table = json.loads((folder / "performance.json").read_text(encoding="utf-8"))["calibration"]["tables"][0]
    names = [row[0] for row in table]
    for peer in environments.PEERS:
        rows = [row for row in table if row[0].startswith(peer.name)]
        assert len(rows) == len(peer.methods)
        assert all(row[1] == "not installed" for row in rows)
    assert "`tr.calibrate`" in names


@pytest.mark.slow
def test_parts_that_are_not_asked_for_stay(folder, tmp_path):
    kept = page.read(folder)
    page.write(tmp_path, kept)
    before = (tmp_path / "performance.md").read_text(encoding="utf-8")
    run.main(["--tiny", "--out", str(tmp_path), "--only", "kinematics"])
    after = page.read(tmp_path)
    assert list(after) == list(run.PARTS)
    assert after["mixed"] == kept["mixed"]
    assert before.split("## Calibration")[1].split("## ")[0] in (tmp_path / "performance.md").read_text("utf-8")


def test_turns_are_counted_and_ratios_are_against_the_first():
    calls = []
    effort = Effort(0.0, 5, 10.0, 1)
    found = by_turns(effort, lambda: calls.append("a"), lambda: calls.append("b"))
    assert found.shape == (5, 2)
    assert calls == ["a", "b"] * 5
    times, faster = medians(np.array([[2.0, 1.0], [4.0, 1.0], [9.0, 3.0]]))
    assert times.tolist() == [4.0, 1.0]
    assert faster.tolist() == [1.0, 3.0]
    assert exponent([10, 100, 1000], [0.5, 5.0, 50.0]) == pytest.approx(1.0)
    assert exponent([10, 100], [0.5, 5.0]) is None


def test_the_loop_and_the_batch_do_the_same():
    robot = tr.load_robot("builtin:rv_m2", "tool0")
    q = np.random.default_rng(0).uniform(-1.0, 1.0, (7, robot.n))
    for name, loop in kinematics.loops(robot).items():
        batch = kinematics.BATCHES[name](robot, q)
        if name != "placement sensitivities":  # Pinocchio's are of every joint, ours of every segment with a length
            np.testing.assert_allclose(loop(q).reshape(batch.shape), batch, rtol=0.0, atol=1e-9)
        assert kinematics.bare(robot)[name](q).size == loop(q[:1]).size


def test_peers_are_given_what_was_measured(tmp_path):
    campaign, fresh = calibration.campaigns(20)
    given = json.loads(calibration.written(tmp_path, campaign, fresh).read_text())
    nominal = np.array([_place(given, np.array(q)) for q in given["q"]])
    away = np.linalg.norm(nominal - np.array(given["in_root"]), axis=1)
    registered = tr.calibrate(campaign).rms_before
    assert np.sqrt((away**2).mean()) == pytest.approx(registered, rel=0.2)
    assert "mesh" not in (tmp_path / "robot.urdf").read_text()


def _place(given, q):
    """Where a product of exponentials of the screws puts the target, by the series of the exponential."""
    pose = np.eye(4)
    for (vx, vy, vz, wx, wy, wz), angle in zip(given["screws"], q, strict=True):
        screw = angle * np.array([[0, -wz, wy, vx], [wz, 0, -wx, vy], [-wy, wx, 0, vz], [0, 0, 0, 0]])
        term, motion = np.eye(4), np.eye(4)
        for k in range(1, 30):
            term = term @ screw / k
            motion = motion + term
        pose = pose @ motion
    return (pose @ np.array(given["tool_at_zero"]))[:3, 3]


def test_chains_have_as_many_joints_as_are_asked_for():
    for joints in (2, 5):
        assert mixed.chain(joints).n == joints
