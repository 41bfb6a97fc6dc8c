"""`thermal-robot check`: a campaign described."""

import shutil

import pytest

from thermal_robot import read_campaign


def test_check_describes_a_campaign(run, folder):
    status, out, err = run("check", folder)
    assert (status, err) == (0, "")
    assert "120" in out
    assert all(joint in out for joint in read_campaign(folder).robot.joint_names)
    assert run("check", folder / "campaign.toml") == (0, out, "")


@pytest.mark.parametrize("text", ['<xacro:leftover name="x"/>', "<!-- lengths -- from the data sheet -->"])
def test_check_takes_a_urdf_that_pinocchio_takes(run, folder, tmp_path, text):
    copied = tmp_path / "cell"
    shutil.copytree(folder, copied)
    urdf = (folder / "robot.urdf").read_text(encoding="utf-8")
    (copied / "robot.urdf").write_text(urdf.replace("</robot>", f"{text}\n</robot>"), encoding="utf-8")
    status, out, err = run("check", copied)
    assert (status, err) == (0, "")
    assert out.splitlines()[1:] == run("check", folder)[1].splitlines()[1:]  # but for the folder's name
