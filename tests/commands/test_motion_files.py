"""`diagnose` of a log of motion: robot files are written from the user's own, and what they hold is said."""

from __future__ import annotations

from argparse import Namespace

import numpy as np
import pandas as pd
import pytest
from motion.test_write import JOINT, a_world, found_of, stiffness

from thermal_robot.blind.motions.fault import Fault
from thermal_robot.commands.motion_files import motion_files
from thermal_robot.errors import CampaignError
from thermal_robot.motion import read_motion

pytest.importorskip("mujoco", reason="an MJCF is written by MuJoCo")
TOML = '[robot]\n{robot}\ntool_frame = "tool"\n[motion]\nlog = "log.csv"\nangle_unit = "rad"\n'


def put(folder, world, fault, robot='mjcf = "arm.xml"'):
    """A folder with motion.toml, the arm's own MJCF and its log."""
    log = world.log(world.simulated(fault))
    frames = []
    for motion in log.motions:
        own = {"motion": motion.name, "time": motion.command.time}
        for j, joint in enumerate(log.joints):
            own[f"cmd.{joint}"], own[f"q.{joint}"] = motion.command.values[:, j], motion.position.values[:, j]
        frames.append(pd.DataFrame(own))
    pd.concat(frames).to_csv(folder / "log.csv", index=False)
    (folder / "arm.xml").write_text(world.mjcf())
    (folder / "arm.urdf").write_text(world.arm.urdf)
    (folder / "motion.toml").write_text(TOML.format(robot=robot))
    return log


def test_what_is_stated_of_a_servo_stands_beside_what_its_mjcf_says(tmp_path):
    log = put(tmp_path, a_world(), Fault("nothing"))
    with (tmp_path / "motion.toml").open("a") as file:
        file.write(f"[servo.{log.joints[JOINT]}]\ndead_band = 0.002\n")
    servo = read_motion(tmp_path).servo(log.joints[JOINT])
    assert servo.dead_band == 0.002
    assert servo.kp == pytest.approx(stiffness(log), rel=1e-5)


def asked(folder, **more):
    usual = {"mjcf": None, "urdf": None, "from_mjcf": None, "unseen": None, "loudness": 1}
    return Namespace(campaign=str(folder / "motion.toml"), **{**usual, **more})


def written(outputs):
    for target, write in outputs:
        write(target)


def test_the_logs_own_mjcf_is_written_and_its_rollout_told(tmp_path, capsys):
    world = a_world(5, 150)
    put(tmp_path, world, Fault("coulomb", JOINT, 0.2))
    log = read_motion(tmp_path)
    found = found_of(log, {"coulomb": 0.2 / stiffness(log), "dead_zone": 1e-3})
    out = tmp_path / "better.xml"
    options = asked(tmp_path, mjcf=str(out), urdf=str(tmp_path / "better.urdf"), unseen=str(tmp_path))
    written(motion_files(options, found))
    assert 'frictionloss="0.2"' in out.read_text()
    assert 'friction="0.2' in (tmp_path / "better.urdf").read_text()
    said = "".join(capsys.readouterr())
    assert f"{out} holds: frictionloss of joint_2: 0.2 N·m" in said
    assert f"{out} cannot hold: dead_zone of joint_2" in said
    assert "MuJoCo's rollout of unseen motions shrinks their gap by" in said
    assert set(read_motion(tmp_path).servos) == set(log.joints)


def test_a_urdf_is_translated_where_no_mjcf_is_named(tmp_path):
    world = a_world(5, 150)
    log = put(tmp_path, world, Fault("zero", JOINT, 0.02), 'urdf = "arm.urdf"')
    out = tmp_path / "better.xml"
    written(motion_files(asked(tmp_path, mjcf=str(out)), found_of(log, {"zero": 0.02})))
    assert "joint_2 servo" in out.read_text()
    assert np.isclose(stiffness(log) * 0.02, float(out.read_text().split('biasprm="')[1].split()[0]), rtol=1e-4)


@pytest.mark.parametrize("option", ["from_mjcf", "unseen"])
def test_options_of_an_mjcf_alone_are_refused_without(tmp_path, option):
    with pytest.raises(CampaignError, match="is of use with --mjcf only"):
        motion_files(
            asked(tmp_path, **{option: "x"}), found_of(a_world().log(a_world().simulated(Fault("nothing"))), {})
        )
