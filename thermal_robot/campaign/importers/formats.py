"""The formats that can be imported: one registry.

A format says what it reads (``DOES``), which files (``FILES``), and has ``read(files, plan)``, which returns a
:class:`~thermal_robot.campaign.importers.mapped.Source`: a table, and what its columns are as a mapping would say it.
"""

from types import ModuleType

from thermal_robot.campaign.importers import figaroh, ipa_ur10, jacobi, points, robot_calibration, rosbag, table

FORMATS: dict[str, ModuleType] = {
    "table": table,
    "points": points,
    "figaroh": figaroh,
    "robot_calibration": robot_calibration,
    "rosbag": rosbag,
    "jacobi": jacobi,
    "ipa_ur10": ipa_ur10,
}
"""Modules by format, in the order of the help."""
