"""Public rows: arms that nobody measured, by a ball in two sockets; a tracker's rows read as distances."""

import os
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import thermal_robot as tr
from thermal_robot.campaign.importers.plan import planned
from thermal_robot.campaign.importers.run import import_files

PUBLIC = Path(os.environ.get("THERMAL_ROBOT_DATA", "nowhere"))
DATA = PUBLIC / "mukca"
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not DATA.is_dir(), reason="THERMAL_ROBOT_DATA names no folder with mukca"),
]


@pytest.fixture(scope="module")
def diagnosed(tmp_path_factory):
    """The diagnosis of an arm, made once."""

    @cache
    def of(name):
        robot = {"robot": {"urdf": str(DATA / name / "robot.urdf"), "tool_frame": "ball_link"}}
        files, folder = [DATA / name / "sockets.csv"], tmp_path_factory.mktemp(name) / name
        return tr.diagnose(import_files("mukca", files, folder, planned(robot)).campaign)

    return of


def test_a_kuka_spreads_by_a_fifth_on_stands_held_out(diagnosed):
    found = diagnosed("kuka_14")
    assert found.samples == 180
    held = found.gap.held_out
    assert held.scheme == "stand"
    assert held.folds == 3
    assert held.rms_before == pytest.approx(0.75e-3, rel=0.05)
    assert held.rms_after < 0.30e-3
    assert found.verdict[0] == "geometric"
    assert "joint_compliance" in found.verdict


def test_sockets_stand_as_far_apart_as_they_were_printed(diagnosed):
    # nothing was told of their distance: lengths of the URDF carry it over
    found = diagnosed("kuka_14")
    for stand in found.model.frames.artefacts.values():
        assert np.linalg.norm(stand.points[0] - stand.points[1]) == pytest.approx(0.05, abs=2.5e-4)


def test_a_panda_is_calibrated_and_says_what_it_cannot_see(diagnosed):
    found = diagnosed("panda_1")
    assert found.gap.held_out.rms_before == pytest.approx(9.0e-3, rel=0.05)
    assert found.gap.held_out.rms_after < 0.60e-3
    assert found.gap.rms_after < 0.40e-3
    assert {"geometric", "joint_compliance"} <= set(found.verdict)
    told = " ".join(found.warnings)
    assert "'panda_joint1'" in told
    assert "scale of the robot is not observable" in told
    assert "base are not observable" in told


def as_distances(tracked):
    """Each row as the distance to the next of four anchors, a metre from the middle."""
    corners = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]]) / np.sqrt(3.0)
    anchor = np.arange(tracked.samples) % len(corners)
    drawn = np.linalg.norm(tracked.position - tracked.position.mean(axis=0) - corners[anchor], axis=1)
    labels = {"kind": np.full(tracked.samples, "distance"), "anchor": anchor.astype(str)}
    return replace(tracked, base_known=True, position=None, readings={"distance": drawn}, labels=labels)


def test_distances_of_a_ur5_tell_most_of_what_its_tracker_does():
    found = tr.diagnose(as_distances(tr.read_campaign(PUBLIC / "ur5_jacobi")))
    assert found.gap.held_out.rms_before == pytest.approx(0.37e-3, rel=0.02)
    assert found.gap.held_out.rms_after == pytest.approx(0.034e-3, rel=0.03)
    assert {"geometric", "transmission_error", "joint_ripple", "drift"} <= set(found.verdict)


def test_distances_of_a_ur10_that_never_turns_its_tool_name_its_geometry():
    # the place of the tool and those of the anchors are hardly told apart, and folds must not lose themselves there
    tracked = tr.read_campaign(PUBLIC / "ipa_ur10_d")
    found = tr.diagnose(as_distances(tracked))
    assert {"geometric", "transmission_error", "joint_ripple"} <= set(found.verdict)
    assert found.gap.held_out.rms_after == pytest.approx(0.125e-3, rel=0.03)
    assert all(scheme.rms_before < 1e-3 for scheme in found.gap.schemes)
