"""Campaigns in files, and what `diagnose` writes of them, for the tests of commands."""

import io
import json
import sys

import numpy as np
import pytest
from commanded import diagnosed_files
from simulate import simulate

import thermal_robot.diagnosing
from thermal_robot import cli
from thermal_robot.campaign import write_campaign
from thermal_robot.campaign.write import write_table

NOISE = 25e-6


@pytest.fixture(scope="module", autouse=True)
def one_diagnosis_of_a_campaign(diagnosed_once):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(thermal_robot.diagnosing, "diagnose", diagnosed_once)
        yield


@pytest.fixture(scope="session")
def folder(rv_m2, tmp_path_factory):
    """A campaign in files, with further samples and their true places in millimetres."""
    directory = tmp_path_factory.mktemp("cell")
    campaign, truth, (fresh, place) = simulate(rv_m2, ["thermal_elongation"], seed=0, outliers=0.03, fresh=30)
    write_campaign(campaign, directory)
    write_table(fresh, directory / "fresh.csv")
    np.savetxt(directory / "fresh_truth_mm.txt", 1e3 * place)
    (directory / "truth.json").write_text(json.dumps(truth))
    return directory


@pytest.fixture(scope="session")
def poses(rv_m2, tmp_path_factory):
    """The same with orientations."""
    directory = tmp_path_factory.mktemp("poses")
    campaign, _, (fresh, _) = simulate(rv_m2, ["joint_offset"], seed=1, samples=60, turning=3e-5, fresh=30)
    write_campaign(campaign, directory)
    write_table(fresh, directory / "fresh.csv")
    return directory


@pytest.fixture(scope="session")
def diagnosed(folder, tmp_path_factory, diagnosed_once):
    return diagnosed_files(folder, tmp_path_factory.mktemp("diagnosed"), diagnosed_once)


@pytest.fixture(scope="session")
def diagnosed_poses(poses, tmp_path_factory, diagnosed_once):
    return diagnosed_files(poses, tmp_path_factory.mktemp("diagnosed"), diagnosed_once)


@pytest.fixture
def run(capsys):
    """Run a command; give its status, what it printed, and its complaint."""

    def run(*arguments):
        status = cli.main([str(a) for a in arguments])
        return status, *capsys.readouterr()

    return run


@pytest.fixture
def stdin(monkeypatch):
    def stdin(file):
        content = file.read_bytes() if hasattr(file, "read_bytes") else file
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(content)))

    return stdin
