"""The files of the calibrated robot that the command line writes."""

import sys

import numpy as np
import pandas as pd
import pytest
import ur_arm
from commanded import refused
from readers import by_mujoco, held, model_of

from thermal_robot import CorrectedModel
from thermal_robot.campaign.ur_kinematics import with_kinematics
from thermal_robot.commands import robot_files
from thermal_robot.correction import calibrated
from thermal_robot.effects import JointOffset
from thermal_robot.kinematics import tool_poses
from thermal_robot.robot import load_robot


def test_every_file_holds_the_same_robot(run, diagnosed, tmp_path):
    every = [name for name in robot_files.OUTPUTS if name != "ur_kinematics"]  # which is of other robots
    files = {name: tmp_path / f"{name}.{'csv' if name in ('dh', 'offsets') else 'xml'}" for name in every}
    options = [word for name, file in files.items() for word in (f"--{name}", file)]
    assert run("correct", diagnosed.model, *options, "--temperature", "26") == (0, "", "")
    model = CorrectedModel.load(diagnosed.model)
    q = np.zeros((1, 5))
    poses, displaced = tool_poses(load_robot(files["urdf"], "tool0_target"), q), calibrated(model, temperature=26.0)
    expected = tool_poses(model.robot, q, displaced.displacement) @ model.frames.tool
    np.testing.assert_allclose(poses, expected, atol=1e-12)
    seen = by_mujoco(files["mjcf"].read_text(), "base_link", "tool0_target", held(model.robot, q))
    np.testing.assert_allclose(list(seen), poses, atol=1e-9)
    table = pd.read_csv(files["dh"])
    assert list(table["joint"]) == ["base_link", *model.robot.joint_names, "tool0"]
    assert set(table["convention"]) == {"standard"}
    assert "d [mm]" in table
    assert list(pd.read_csv(files["offsets"])["joint"]) == list(model.robot.joint_names)
    assert "at 26 °C" in files["urdf"].read_text(encoding="utf-8")


def test_a_robot_of_universal_robots_has_a_file_of_its_own(run, diagnosed, tmp_path):
    refused(
        run("correct", diagnosed.model, "--ur-kinematics", tmp_path / "k.yaml"), "'rv_m2' has no shoulder_pan_joint"
    )
    assert not (tmp_path / "k.yaml").exists()
    robot = load_robot(ur_arm.urdf(), "tool0")
    offsets = np.array([1e-3, -2e-3, 3e-3, 1e-3, 2e-3, 0.0])
    model_of(robot, (JointOffset(), offsets)).save(tmp_path / "m.json")
    assert run("correct", tmp_path / "m.json", "--ur-kinematics", tmp_path / "k.yaml") == (0, "", "")
    q = np.random.default_rng(1).uniform(-3, 3, (5, 6))
    read = with_kinematics(robot, tmp_path / "k.yaml")
    np.testing.assert_allclose(read.forward(q), robot.forward(q + offsets), atol=1e-9)


def test_a_file_of_a_robot_is_printed(run, diagnosed, tmp_path):
    assert run("correct", diagnosed.model, "--urdf", tmp_path / "r.urdf")[0] == 0
    assert run("correct", diagnosed.model, "--urdf", "-") == (0, (tmp_path / "r.urdf").read_text(encoding="utf-8"), "")
    status, out, _ = run("correct", diagnosed.model, "--dh", "-", "--modified")
    assert status == 0
    assert out.startswith("convention,joint,type,")
    assert "\nmodified," in out


@pytest.mark.parametrize("words", [["--temperature", "30"], ["--min-sigma", "2"], ["--modified"]])
def test_options_of_robot_files_are_refused_beside_commands_alone(run, folder, diagnosed, tmp_path, words):
    out = tmp_path / "c.csv"
    refused(run("correct", diagnosed.model, folder / "fresh.csv", "-o", out, *words), words[0], "is of use with --")
    assert not out.exists()


def test_lengths_far_from_what_was_measured_are_told_to_be_extrapolated(run, diagnosed, tmp_path):
    model, out = CorrectedModel.load(diagnosed.model), tmp_path / "r.urdf"
    low, high = model.spread.ranges["temperature"]
    said = f"lengths at 600 °C are extrapolated: it was measured at {low:.3g} to {high:.3g} °C"
    assert run("correct", diagnosed.model, "--urdf", out, "--temperature", "600") == (
        0,
        "",
        f"thermal-robot: note: {said}\n",
    )
    assert said[1:] in out.read_text(encoding="utf-8")
    for told in ([], ["--temperature", f"{(low + high) / 2.0}"]):
        assert run("correct", diagnosed.model, "--urdf", out, *told) == (0, "", "")
        assert "extrapolated" not in out.read_text(encoding="utf-8")


def test_what_is_left_out_is_listed(run, diagnosed, tmp_path):
    few, all_ = tmp_path / "few.urdf", tmp_path / "all.urdf"
    assert run("correct", diagnosed.model, "--urdf", few, "--min-sigma", "1e6", "--temperature", "25")[0] == 0
    assert run("correct", diagnosed.model, "--urdf", all_, "--temperature", "25")[0] == 0
    assert "Left out, as they are less than 1e+06 standard deviations from zero:\n" in few.read_text(encoding="utf-8")
    assert "Written here: nothing" in few.read_text(encoding="utf-8")
    assert "Left out" not in all_.read_text(encoding="utf-8")


def test_options_that_make_no_sense_are_refused(run, diagnosed, tmp_path):
    model, out = diagnosed.model, tmp_path / "r.urdf"
    refused(run("correct", model, "--urdf", out, "--min-sigma", "-1"), "min_sigma", "standard deviations")
    refused(run("correct", model, "--urdf", out, "--temperature", "-400"), "temperature", "°C")
    refused(run("correct", model, "--from-mjcf", model, "--urdf", out), "--mjcf")
    refused(run("correct", model, "--urdf", out, "--modified"), "--modified", "of use with --dh only")
    refused(run("correct", model, "--mjcf", out, "--from-mjcf", tmp_path / "no.xml"), "no.xml")
    assert not out.exists()


def test_without_mujoco_one_line_says_how_to_get_it(run, diagnosed, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    out = tmp_path / "r.xml"
    refused(run("correct", diagnosed.model, "--mjcf", out, "--urdf", tmp_path / "r.urdf"), "thermal-robot[blind]")
    assert not any(tmp_path.iterdir())
