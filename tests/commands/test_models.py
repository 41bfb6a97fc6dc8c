"""`thermal-robot predict` and `correct`: the same rows with what is predicted of them, commands, the robot's files."""

import json
import sys
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import ur_arm
from commanded import refused, table
from readers import by_mujoco, held, model_of

from thermal_robot import CorrectedModel, calibrate, read_campaign, simulate
from thermal_robot.campaign import write_campaign
from thermal_robot.commands.models import OUTPUTS
from thermal_robot.correction import calibrated
from thermal_robot.effects import JointOffset
from thermal_robot.effects.law import Discovered
from thermal_robot.kinematics import tool_poses
from thermal_robot.observations import observe
from thermal_robot.robot import load_robot

NOISE = 25e-6
PLACE, STD = ["x", "y", "z"], ["std.x", "std.y", "std.z"]


def test_predict_writes_the_same_rows_in_order_and_nothing_else(run, folder, diagnosed, tmp_path):
    model, out = diagnosed.model, tmp_path / "p.csv"
    assert run("predict", model, folder / "fresh.csv", "-o", out) == (0, "", "")
    own, written = (pd.read_csv(file, dtype=str) for file in (folder / "fresh.csv", out))
    kept = [name for name in own.columns if name not in PLACE]
    assert list(written.columns) == [*kept, *PLACE, *STD, "outside"]
    pd.testing.assert_frame_equal(written[kept], own[kept])  # as they stand, to the last digit
    predicted, std = (written[columns].to_numpy(float) for columns in (PLACE, STD))
    truth = np.loadtxt(folder / "fresh_truth_mm.txt")
    assert predicted.shape == truth.shape == (30, 3)
    assert np.sqrt(((predicted - truth) ** 2).mean()) < 0.5e3 * NOISE
    assert (np.abs(predicted - truth) < 1.96 * std).mean() > 0.85
    assert run("predict", "--noise", model, folder / "fresh.csv", "-o", out) == (0, "", "")
    assert (pd.read_csv(out)[STD].to_numpy() > std).all()
    # the campaign's own table, measured columns and all, is as good a table of samples
    assert run("predict", model, folder / "measurements.csv", "--output", out)[0] == 0
    again = pd.read_csv(out)
    assert [list(again.columns).count(name) for name in (*PLACE, *STD)] == [1] * 6
    assert len(again) == 120


def test_predict_writes_quaternions_for_poses(run, poses, diagnosed_poses, tmp_path):
    assert run("predict", diagnosed_poses.model, poses / "fresh.csv", "-o", tmp_path / "p.csv") == (0, "", "")
    predicted = pd.read_csv(tmp_path / "p.csv")
    assert len(predicted) == 30
    np.testing.assert_allclose(np.linalg.norm(predicted[["qw", "qx", "qy", "qz"]], axis=1), 1.0, atol=1e-12)


def test_predict_says_what_it_misses(run, folder, diagnosed, tmp_path):
    model, out, less = diagnosed.model, tmp_path / "p.csv", tmp_path / "less.csv"
    samples = pd.read_csv(folder / "fresh.csv")
    for rest in (samples.drop(columns="temperature"), samples[list(read_campaign(folder).robot.joint_names)]):
        rest.to_csv(less, index=False)
        refused(run("predict", model, less, "-o", out), less, "'temperature'")
    assert not out.exists()
    refused(run("predict", folder / "truth.json", folder / "fresh.csv", "-o", out), "truth.json")
    refused(run("predict", model, tmp_path / "absent.csv", "-o", out), "absent.csv")
    refused(run("predict", model, folder / "fresh.csv", "-o", tmp_path / "no" / "p.csv"), "p.csv", "cannot be written")


def test_predict_reads_and_writes_streams(run, folder, diagnosed, stdin, tmp_path):
    model, samples, out = diagnosed.model, folder / "fresh.csv", tmp_path / "p.csv"
    assert run("predict", model, samples, "-o", out) == (0, "", "")
    stdin(samples)
    assert run("predict", model, "-", "-o", "-") == (0, out.read_text(), "")
    stdin(model)
    assert run("predict", "-", samples, "-o", tmp_path / "again.csv") == (0, "", "")
    assert (tmp_path / "again.csv").read_text() == out.read_text()
    refused(run("predict", "-", "-", "-o", out), "one standard input", "model", "samples")
    lines = samples.read_text().splitlines()
    stdin("\n".join([*lines[:3], "wrong," + lines[3].split(",", 1)[1]]).encode())
    refused(run("predict", model, "-", "-o", "-"), "standard input, row 4", "wrong")


@pytest.mark.slow
def test_units_of_the_campaign_are_units_of_its_prediction(run, folder, tmp_path):
    campaign = read_campaign(folder)
    write_campaign(replace(campaign, units=type(campaign.units)("deg", "um")), tmp_path / "um")
    header, degrees = table(tmp_path / "um" / "measurements.csv")
    assert np.abs(degrees[:, header.index("joint_1")]).max() > 10.0
    places = []
    for where in (folder, tmp_path / "um"):
        asked = ("diagnose", where, "--only", "thermal_elongation", "drift", "--model", tmp_path / "m.json")
        assert run(*asked)[0] == 0
        assert run("predict", tmp_path / "m.json", where / "measurements.csv", "-o", tmp_path / "p.csv")[0] == 0
        places.append(pd.read_csv(tmp_path / "p.csv")[[*PLACE, *STD]].to_numpy())
    np.testing.assert_allclose(places[1], 1e3 * places[0], rtol=0, atol=1e-2)


def test_predict_tells_a_session_that_the_model_has_not_seen(run, folder, diagnosed, tmp_path):
    model = CorrectedModel.load(diagnosed.model)
    spread = replace(model.spread, levels={"session": ("mon", "tue")}, between=np.array([1e-3, 0.0, 0.0]))
    replace(model, spread=spread).save(tmp_path / "model.json")
    rows = pd.read_csv(folder / "fresh.csv")
    for session, said in (("wed", "the model has not seen 'wed', but 'mon', 'tue'"), ("mon", "")):
        rows.assign(session=session).to_csv(tmp_path / "rows.csv", index=False)
        status, _, told = run("predict", tmp_path / "model.json", tmp_path / "rows.csv", "-o", tmp_path / "p.csv")
        assert status == 0
        assert (said in told) if said else not told
        written = pd.read_csv(tmp_path / "p.csv", keep_default_na=False)
        assert written["outside"].str.contains("session").all() == bool(said)
        assert (written["std.x"] > 1.0).all() == bool(said)  # mm


def test_predict_tells_that_a_law_of_the_campaigns_rows_ends_with_it(run, folder, diagnosed, tmp_path):
    model = CorrectedModel.load(diagnosed.model)
    step = Discovered(kind="joint", place="joint_3", quantity="order", shape="step", marks=(40.0,), span=119.0)
    rows = ["predict", tmp_path / "model.json", folder / "fresh.csv", "-o", tmp_path / "p.csv"]
    written = []
    for early in (0.0, 5e-3):  # what it was before the step is nothing to samples
        replace(model, effects=(*model.effects, (step, np.array([early, 1e-3])))).save(tmp_path / "model.json")
        status, _, told = run(*rows)
        assert (status, "a law follows the order of the campaign's rows" in told) == (0, True)
        written.append(pd.read_csv(tmp_path / "p.csv")[PLACE])
    pd.testing.assert_frame_equal(*written)
    counted = pd.read_csv(folder / "fresh.csv")
    counted.assign(order=np.arange(len(counted))).to_csv(tmp_path / "counted.csv", index=False)
    assert run(*rows[:2], tmp_path / "counted.csv", *rows[3:])[::2] == (0, "")
    model.save(tmp_path / "model.json")
    assert run(*rows)[::2] == (0, "")


def test_commands_take_the_place_of_joint_positions(run, folder, diagnosed, stdin, tmp_path):
    out = tmp_path / "c.csv"
    assert run("correct", diagnosed.model, folder / "fresh.csv", "-o", out) == (0, "", "")
    own, written = (pd.read_csv(file, dtype=str) for file in (folder / "fresh.csv", out))
    robot, model = read_campaign(folder).robot, CorrectedModel.load(diagnosed.model)
    joints = list(robot.joint_names)
    kept = [name for name in own.columns if name not in joints]
    assert list(written.columns) == [*own.columns, *STD, "outside", "miss.direction"]
    pd.testing.assert_frame_equal(written[kept], own[kept])
    found = model.corrected_commands(folder / "fresh.csv")
    np.testing.assert_array_equal(written[joints].to_numpy(float), found.q)  # this campaign is in rad
    assert (written[STD].to_numpy(float) > 0.0).all()
    # what it writes can be predicted, and lies where the nominal robot would have been
    nominal = observe(model.samples(folder / "fresh.csv"), model.frames).predicted_position
    np.testing.assert_allclose(model.prediction(out)[0], nominal, rtol=0, atol=1e-9)
    stdin(folder / "fresh.csv")
    assert run("correct", diagnosed.model, "-", "-o", "-") == (0, out.read_text(), "")
    both = ("-o", out, "--urdf", tmp_path / "r.urdf")
    status, said, _ = run("correct", diagnosed.model, folder / "fresh.csv", *both)
    assert (status, said.splitlines()[0]) == (0, f"{tmp_path / 'r.urdf'}: a URDF, holds placements")
    assert (tmp_path / "r.urdf").exists()


def test_poses_that_cannot_be_used_are_refused(run, folder, diagnosed, tmp_path):
    out, poses = tmp_path / "c.csv", folder / "fresh.csv"
    refused(run("correct", diagnosed.model, poses), "go together")
    refused(run("correct", diagnosed.model, "-o", out), "go together")
    refused(run("correct", diagnosed.model, poses, "-o", poses), "is read from")
    rows = pd.read_csv(poses)
    rows.drop(columns="temperature").to_csv(tmp_path / "less.csv", index=False)
    refused(run("correct", diagnosed.model, tmp_path / "less.csv", "-o", out), "less.csv", "'temperature'")
    rows.assign(temperature=1e4).to_csv(tmp_path / "hot.csv", index=False)
    refused(run("correct", diagnosed.model, tmp_path / "hot.csv", "-o", out), "hot.csv", "row 2", "out of reach")
    for words in (["--temperature", "30"], ["--min-sigma", "2"], ["--modified"]):
        refused(run("correct", diagnosed.model, poses, "-o", out, *words), words[0], "is of use with --")
    assert not out.exists()


ENDINGS = {"dh": "csv", "offsets": "csv", "joints": "json"}


def test_every_file_holds_the_same_robot(run, diagnosed, tmp_path):
    every = [name for name in OUTPUTS if name not in ("ur_kinematics", "pal", "lerobot")]  # which are of other robots
    files = {name: tmp_path / f"{name}.{ENDINGS.get(name, 'xml')}" for name in every}
    options = [word for name, file in files.items() for word in (f"--{name}", file)]
    status, said, noted = run("correct", diagnosed.model, *options, "--temperature", "26")
    assert (status, noted) == (0, "")
    assert all(f"{file}: " in said for file in files.values())
    assert "worth applying, 2 standard deviations from zero: " in said
    assert "Expected" not in said  # lengths at another temperature are those of no fold
    model = CorrectedModel.load(diagnosed.model)
    q = np.zeros((1, 5))
    poses = tool_poses(load_robot(files["urdf"], "tool0_target"), q)
    displaced = calibrated(model, temperature=26.0, min_sigma=2.0)
    expected = tool_poses(model.robot, q, displaced.displacement) @ displaced.target
    np.testing.assert_allclose(poses, expected, atol=1e-12)
    seen = by_mujoco(files["mjcf"].read_text(), "base_link", "tool0_target", held(model.robot, q))
    np.testing.assert_allclose(list(seen), poses, atol=1e-9)
    parameters = pd.read_csv(files["dh"])
    assert list(parameters["joint"]) == ["base_link", *model.robot.joint_names, "tool0"]
    assert set(parameters["convention"]) == {"standard"}
    assert "d [mm]" in parameters
    assert list(pd.read_csv(files["offsets"])["joint"]) == list(model.robot.joint_names)
    assert "at 26 °C" in files["urdf"].read_text(encoding="utf-8")


def test_a_robot_of_universal_robots_has_a_file_of_its_own(run, diagnosed, tmp_path):
    out = tmp_path / "k.yaml"
    refused(run("correct", diagnosed.model, "--ur-kinematics", out), "'rv_m2' has no shoulder_pan_joint")
    assert not out.exists()
    robot = load_robot(ur_arm.urdf(), "tool0")
    model_of(robot, (JointOffset(), [1e-3, -2e-3, 3e-3, 1e-3, 2e-3, 0.0])).save(tmp_path / "m.json")
    status, said, _ = run("correct", tmp_path / "m.json", "--ur-kinematics", out)
    assert status == 0
    assert "it cannot hold frames behind the last joint, the target" in said
    assert "shoulder:" in out.read_text(encoding="utf-8")


def test_what_is_expected_of_a_file_and_worth_applying_is_told(run, tmp_path):
    zeros = {"joint_offset": {"joint_2": 1e-3, "joint_3": -8e-4}}
    campaign = simulate("builtin:rv_m2", zeros, tool_frame="tool0", rows=60, noise=3e-5, seed=1, base_known=False)
    model, out = tmp_path / "m.json", tmp_path / "r.urdf"
    calibrate(campaign, "joint_offset").model.save(model)
    status, said, _ = run("correct", model, "--urdf", out, "--offsets", tmp_path / "o.csv")
    assert status == 0
    assert said.count("Expected of this file alone, on rows held out") == 2
    assert "Expected of this file alone" in out.read_text(encoding="utf-8")
    worth, _, left = said.partition("left out as too weak")
    assert "zero offset, joint_2" in worth
    assert "zero offset, joint_1" in left  # the base takes it up
    status, alone, _ = run("correct", model, "--urdf", out, "--alone")
    assert (status, "Fitted anew" in out.read_text(encoding="utf-8")) == (0, True)
    assert "worth applying" not in alone
    assert "left out" not in run("correct", model, "--urdf", out, "--min-sigma", "0")[1]
    poses = tmp_path / "poses.csv"
    campaign.to_frame().to_csv(poses, index=False)
    beside = run("correct", model, poses, "-o", tmp_path / "c.csv", "--urdf", out)[1]
    assert beside.count("poses.csv, 0.0 % of them outside what was measured, as the model predicts it") == 1


def test_zeros_for_lerobot_come_from_the_arms_own_file(run, rv_m2, tmp_path):
    model_of(rv_m2, (JointOffset(), [0.0, 0.01, 0.0, 0.0, 0.0]), base_known=True, tool_known=True).save(
        tmp_path / "m.json"
    )
    own, out = tmp_path / "arm.json", tmp_path / "new.json"
    before = {
        f"joint_{k}": {"id": k, "drive_mode": 0, "homing_offset": 0, "range_min": 0, "range_max": 4095}
        for k in range(1, 6)
    }
    own.write_text(json.dumps(before))
    words = ("--lerobot", out, "--from-lerobot", own)
    for more, sign in ((), -1), (("--dynamixel",), 1):
        assert run("correct", tmp_path / "m.json", *words, *more)[0] == 0
        assert json.loads(out.read_text())["joint_2"]["homing_offset"] == sign * 7  # ticks of 1.53 mrad


def test_a_file_of_a_robot_is_printed_and_a_model_read_from_a_stream(run, diagnosed, stdin, tmp_path):
    out = tmp_path / "r.urdf"
    assert run("correct", diagnosed.model, "--urdf", out)[0] == 0
    assert run("-q", "correct", diagnosed.model, "--urdf", out) == (0, "", "")
    stdin(diagnosed.model)
    assert run("correct", "-", "--urdf", "-") == (0, out.read_text(encoding="utf-8"), "")
    status, printed, _ = run("correct", diagnosed.model, "--dh", "-", "--modified")
    assert status == 0
    assert printed.startswith("convention,joint,type,")
    assert "\nmodified," in printed


def test_lengths_far_from_what_was_measured_are_told_to_be_extrapolated(run, diagnosed, tmp_path):
    model, out = CorrectedModel.load(diagnosed.model), tmp_path / "r.urdf"
    low, high = model.spread.ranges["temperature"]
    said = f"lengths at 600 °C are extrapolated: it was measured at {low:.3g} to {high:.3g} °C"
    far = run("correct", diagnosed.model, "--urdf", out, "--temperature", "600")
    assert (far[0], far[2]) == (0, f"thermal-robot: note: {said}\n")
    assert said[1:] in out.read_text(encoding="utf-8")
    for told in ([], ["--temperature", f"{(low + high) / 2.0}"]):
        status, _, noted = run("correct", diagnosed.model, "--urdf", out, *told)
        assert (status, noted) == (0, "")
        assert "extrapolated" not in out.read_text(encoding="utf-8")
        assert "less than 2 standard deviations from zero:" in out.read_text(encoding="utf-8")
    few = ("--min-sigma", "1e6", "--temperature", "25")
    assert run("correct", diagnosed.model, "--urdf", out, *few)[0] == 0
    written = out.read_text(encoding="utf-8")
    assert "Left out, as they are less than 1e+06 standard deviations from zero:\n" in written
    assert "Written here: nothing" in written


def test_options_that_make_no_sense_are_refused(run, folder, diagnosed, tmp_path, monkeypatch):
    model, out = diagnosed.model, tmp_path / "robot"
    (tmp_path / "model.urdf").symlink_to(model)
    for words, *said in (
        ([], "nothing to write", "--urdf"),
        (["--min-sigma", "2"], "nothing to write", "--urdf"),
        (["--urdf", out, "--min-sigma", "-1"], "min_sigma", "standard deviations"),
        (["--urdf", out, "--temperature", "-400"], "temperature", "°C"),
        (["--from-mjcf", model, "--urdf", out], "--mjcf"),
        (["--urdf", out, "--modified"], "--modified", "of use with --dh only"),
        (["--urdf", out, "--from-pal", model], "--from-pal", "of use with --pal only"),
        (["--lerobot", out], "--from-lerobot"),
        (["--urdf", out, "--alone", "--min-sigma", "2"], "--alone"),
        (["--urdf", out, "--alone"], "alone", "does not hold a fit"),
        (["--pal", out], "'rv_m2' has no joint of an arm"),
        (["--mjcf", out, "--from-mjcf", tmp_path / "no.xml"], "no.xml"),
        (["--urdf", tmp_path / "model.urdf"], "is read from"),
        (["--urdf", out, "--dh", out], "two outputs"),
    ):
        refused(run("correct", model, *words), *said)
    refused(run("correct", folder / "truth.json", "--urdf", out), "truth.json", "not a model")
    monkeypatch.setitem(sys.modules, "mujoco", None)
    refused(run("correct", model, "--mjcf", tmp_path / "r.xml", "--urdf", out), "thermal-robot[blind]")
    assert [file.name for file in tmp_path.iterdir()] == ["model.urdf"]
