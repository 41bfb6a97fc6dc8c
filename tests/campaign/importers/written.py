"""Files of other programs, put down in a folder beside a robot, and imported by the command line."""

from __future__ import annotations

from pathlib import Path

from campaign.files import URDF

from thermal_robot import cli
from thermal_robot.campaign import Campaign, read_campaign
from thermal_robot.kinematics import quaternion_to_rotation

JOINTS = ("turn", "lift", "slide", "roll")
COMMANDS = "turn,lift,slide,roll\n0.1,0.2,0.03,0.4\n-0.1,0.3,0.06,3.5\n0.5,-0.4,0.09,-0.4\n"


def put(folder: Path, **files: str) -> Path:
    """Write the robot and files, ``__`` in a name for the dot."""
    (folder / "robot.urdf").write_text(URDF)
    for name, text in files.items():
        (folder / name.replace("__", ".")).write_text(text)
    return folder


def tried(capsys, folder: Path, format: str, arguments: tuple[str, ...], robot: bool) -> tuple[int, str, str]:
    """Import files of the folder by name; give the exit status and what stands on both streams."""
    said = ["--robot", str(folder / "robot.urdf"), "--tool", "tool"] if robot else []
    files = [str(folder / a) if (folder / a).exists() else a for a in arguments]
    return cli.main(["import", format, *files, *said, "-o", str(folder / "made")]), *capsys.readouterr()


def imported(capsys, folder: Path, format: str, *arguments: str, robot: bool = True) -> tuple[Campaign, str]:
    """The campaign of files, as it is read again, and what was printed."""
    status, out, err = tried(capsys, folder, format, arguments, robot)
    assert (status, err) == (0, "")
    assert out.count("\n") == 1
    assert cli.main(["check", str(folder / "made")]) == 0
    capsys.readouterr()
    return read_campaign(folder / "made"), out


def complaint(capsys, folder: Path, format: str, *arguments: str, robot: bool = True) -> str:
    """What the command says of files that cannot be imported: one line, and nothing is written."""
    status, out, err = tried(capsys, folder, format, arguments, robot)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert not (folder / "made").exists()
    return err.replace(f"{folder}/", "")


def rotations(campaign: Campaign):
    """(N, 3, 3) of the measured orientations."""
    return quaternion_to_rotation(campaign.orientation)
