"""`thermal-robot correct`: from a model to the calibrated robot's files."""

import numpy as np
import pandas as pd
import pytest
from commanded import refused

from thermal_robot import CorrectedModel, read_campaign
from thermal_robot.observations import observe


def test_correct_reads_a_stream_and_leaves_what_it_reads(run, diagnosed, stdin, tmp_path):
    out = tmp_path / "r.urdf"
    assert run("correct", diagnosed.model, "--urdf", out) == (0, "", "")
    stdin(diagnosed.model)
    assert run("correct", "-", "--urdf", tmp_path / "again.urdf") == (0, "", "")
    assert (tmp_path / "again.urdf").read_text() == out.read_text()
    refused(run("correct", diagnosed.model, "--urdf", diagnosed.model), "is read from")
    refused(run("correct", diagnosed.model, "--urdf", out, "--dh", out), "two outputs")


@pytest.mark.parametrize("words", [[], ["--min-sigma", "2"]])
def test_nothing_to_write_is_refused(run, diagnosed, words):
    refused(run("correct", diagnosed.model, *words), "nothing to write", "--urdf")


def test_what_is_no_model_is_refused(run, folder, tmp_path):
    refused(run("correct", folder / "truth.json", "--urdf", tmp_path / "r.urdf"), "truth.json", "not a model")
    assert not (tmp_path / "r.urdf").exists()


def test_commands_take_the_place_of_joint_positions(run, folder, diagnosed, tmp_path):
    out = tmp_path / "c.csv"
    assert run("correct", diagnosed.model, folder / "fresh.csv", "-o", out) == (0, "", "")
    own, written = (pd.read_csv(file, dtype=str) for file in (folder / "fresh.csv", out))
    robot, model = read_campaign(folder).robot, CorrectedModel.load(diagnosed.model)
    joints = list(robot.joint_names)
    kept = [name for name in own.columns if name not in joints]
    assert list(written.columns) == [*own.columns, "std.x", "std.y", "std.z", "outside", "miss.direction"]
    pd.testing.assert_frame_equal(written[kept], own[kept])
    found = model.corrected_commands(folder / "fresh.csv")
    np.testing.assert_array_equal(written[joints].to_numpy(float), found.q)  # this campaign is in rad
    assert (written[["std.x", "std.y", "std.z"]].to_numpy(float) > 0.0).all()
    # what it writes can be predicted, and lies where the nominal robot would have been
    nominal = observe(model.samples(folder / "fresh.csv"), model.frames).predicted_position
    np.testing.assert_allclose(model.predict(out)[0], nominal, rtol=0, atol=1e-9)


def test_commands_and_files_of_the_robot_are_written_at_once(run, folder, diagnosed, stdin, tmp_path):
    both = ("-o", tmp_path / "c.parquet", "--urdf", tmp_path / "r.urdf")
    assert run("correct", diagnosed.model, folder / "fresh.csv", *both) == (0, "", "")
    assert len(pd.read_parquet(tmp_path / "c.parquet")) == 30
    assert (tmp_path / "r.urdf").exists()
    stdin(folder / "fresh.csv")
    status, out, err = run("correct", diagnosed.model, "-", "-o", "-")
    assert (status, err) == (0, "")
    assert len(out.splitlines()) == 31


def test_poses_that_cannot_be_used_are_refused(run, folder, diagnosed, tmp_path):
    out, poses = tmp_path / "c.csv", folder / "fresh.csv"
    refused(run("correct", diagnosed.model, poses), "go together")
    refused(run("correct", diagnosed.model, "-o", out), "go together")
    refused(run("correct", diagnosed.model, poses, "-o", poses), "is read from")
    table = pd.read_csv(poses)
    table.drop(columns="temperature").to_csv(tmp_path / "less.csv", index=False)
    refused(run("correct", diagnosed.model, tmp_path / "less.csv", "-o", out), "less.csv", "'temperature'")
    table.assign(temperature=1e4).to_csv(tmp_path / "hot.csv", index=False)
    refused(run("correct", diagnosed.model, tmp_path / "hot.csv", "-o", out), "hot.csv", "row 2", "out of reach")
    assert not out.exists()
