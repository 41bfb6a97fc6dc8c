"""The public data sets in their original files become the campaigns that were made of them by hand."""

import os
from pathlib import Path

import numpy as np
import pytest

from thermal_robot.campaign import read_campaign
from thermal_robot.campaign.importers.plan import planned
from thermal_robot.campaign.importers.run import import_files
from thermal_robot.campaign.read import read_samples

DATA = os.environ.get("THERMAL_ROBOT_DATA")
pytestmark = pytest.mark.skipif(
    not DATA or not (Path(DATA) / "original").is_dir(),
    reason="THERMAL_ROBOT_DATA names no folder that has the original files",
)
FOLDER = Path(DATA or ".")
JACOBI = {"ur5_jacobi": "UR5/3D_UR5_uncalibrated", "wam_jacobi": "WAM/3D_WAM_uncalibrated"}
IPA = {"ipa_ur10_a": "Series_A/measurements_grid", "ipa_ur10_b": "Series_B/measurements_joint_configurations"}


def taken(format, file, known, directory):
    """Import a file with the robot of a campaign that is known; give both, as they are read."""
    robot = {"urdf": str(FOLDER / known / "robot.urdf"), "tool_frame": read_campaign(FOLDER / known).robot.tool_frame}
    import_files(format, [FOLDER / "original" / file], directory, planned({"robot": robot}))
    return read_campaign(directory), read_campaign(FOLDER / known)


@pytest.mark.parametrize("name", JACOBI)
def test_jacobi(name, tmp_path):
    ours, known = taken("jacobi", f"jacobi/{JACOBI[name]}_grid_cleaned.csv", name, tmp_path / "c")
    np.testing.assert_allclose(ours.q, known.q, atol=6e-10)  # written with nine decimals there
    np.testing.assert_allclose(ours.position, known.position, atol=6e-10)
    np.testing.assert_array_equal(ours.covariates["order"], known.covariates["order"])
    ours, _ = taken("jacobi", f"jacobi/{JACOBI[name]}_random_cleaned.csv", name, tmp_path / "t")
    test = read_samples(FOLDER / name / "test.csv", known)
    np.testing.assert_allclose(ours.q, test.q, atol=6e-10)


@pytest.mark.parametrize("name", IPA)
def test_ipa(name, tmp_path):
    ours, known = taken("ipa_ur10", f"ipa_ur10/{IPA[name]}.csv", name, tmp_path / "c")
    np.testing.assert_allclose(ours.q, known.q, atol=6e-10)
    np.testing.assert_allclose(ours.position, known.position, atol=6e-10)
    sign = np.sign(np.sum(ours.orientation * known.orientation, axis=1))[:, None]
    np.testing.assert_allclose(sign * ours.orientation, known.orientation, atol=2e-9)
    np.testing.assert_allclose(ours.covariates["temperature"], known.covariates["temperature"], atol=6e-4)
    clock = "time" if name == "ipa_ur10_a" else "order"
    np.testing.assert_array_equal(ours.covariates[clock], known.covariates[clock])
    np.testing.assert_allclose(ours.target, known.target)
