"""The formats that can be imported: one registry."""

from thermal_robot.campaign.importers import figaroh, points, programs, published, robot_calibration, rosbag, table
from thermal_robot.campaign.importers.mapped import Format

FORMATS: dict[str, Format] = {
    "table": table.FORMAT,
    "points": points.FORMAT,
    "kuka": programs.KUKA,
    "rapid": programs.RAPID,
    "figaroh": figaroh.FORMAT,
    "robot_calibration": robot_calibration.FORMAT,
    "rosbag": rosbag.FORMAT,
    "jacobi": published.JACOBI,
    "ipa_ur10": published.IPA_UR10,
}
"""Formats by name, in the order of the help."""
