"""From files to a campaign and to samples: SI units, names, and whose errors they are."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from campaign.files import full, put
from campaign.spoilt import TOML, read

from thermal_robot.campaign import Settings, Units, read_campaign, read_samples
from thermal_robot.errors import CampaignError, RobotError
from thermal_robot.robot import load_robot


def test_units_become_si_once(tmp_path: Path) -> None:
    campaign = full(tmp_path / "hall_3")
    degree = math.pi / 180
    np.testing.assert_allclose(campaign.q[0], [10 * degree, 20 * degree, 0.030, 40 * degree], rtol=1e-15)
    np.testing.assert_allclose(campaign.position[1], [0.9, 0.1, 0.51])
    np.testing.assert_allclose(campaign.simulated_position[2], [0.8, 0.2, 0.52])
    np.testing.assert_allclose(campaign.target, [1e-3, 2e-3, 80e-3])
    np.testing.assert_allclose(campaign.payload_com, [0, 0, 0.05])
    assert campaign.noise_position == pytest.approx(2e-5)
    assert campaign.noise_orientation == 3e-5
    expected = {
        "time": [0, 1.5, 3],
        "temperature": [20.1, 20.7, 21.3],
        "temperature.beam": [20, 21, 22],
        "payload": [0, 5, 5],
        "approach.lift": [1, -1, 0],
        "approach.slide": [1, 1, -1],
        "velocity.lift": [10 * degree, 20 * degree, 30 * degree],
        "velocity.slide": [0.01, 0.02, 0.03],
        "acceleration.roll": [degree, 2 * degree, 3 * degree],
        "torque.lift": [1.5, 2.5, 3.5],
        "encoder.lift": [20.1 * degree, 15.1 * degree, -44.9 * degree],
        "encoder.slide": [0.0301, 0.0601, 0.0901],
        "speed": [0.1, 0.5, 1],
        "order": [3, 1, 2],
        "humidity": [40, 41, 43],
    }
    assert set(campaign.covariates) == set(expected)
    for name, values in expected.items():
        np.testing.assert_allclose(campaign.covariates[name], values, err_msg=name)


def test_everything_else(tmp_path: Path) -> None:
    campaign = full(tmp_path / "hall_3")
    assert campaign.name == "hall_3"
    assert (campaign.samples, campaign.measures) == (3, "pose")
    assert (campaign.base_known, campaign.tool_known) == (False, True)
    assert campaign.reference_temperature == 22.5
    assert campaign.priors == {"joint_offset": 1e-3}
    assert campaign.gears == {"lift": 101.0}
    assert campaign.extra == ("humidity",)
    assert campaign.labels["session"].tolist() == ["a", "a", "b"]
    assert campaign.labels["pose"].tolist() == ["1", "2", "3"]
    assert campaign.rows.tolist() == [2, 3, 4]
    assert campaign.units == Units("deg", "mm")
    assert campaign.urdf == "robot.urdf"
    np.testing.assert_allclose(campaign.orientation[2], [0.6, 0, 0.8, 0])
    np.testing.assert_allclose(campaign.simulated_orientation, [[1, 0, 0, 0]] * 3)
    assert campaign.warnings == ()


def test_path_of_file_or_directory_gives_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = put(tmp_path / "cell")
    by_file, by_folder = read_campaign(folder / "campaign.toml"), read_campaign(str(folder))
    monkeypatch.chdir(folder)
    here = read_campaign(".")
    assert by_file.name == by_folder.name == here.name == "cell"
    np.testing.assert_array_equal(by_file.q, here.q)


def test_a_file_of_another_name_names_the_campaign(tmp_path: Path) -> None:
    folder = put(tmp_path / "cell")
    (folder / "campaign.toml").rename(folder / "monday.toml")
    assert read_campaign(folder / "monday.toml").name == "monday"


def test_a_builtin_robot_is_not_a_path(tmp_path: Path) -> None:
    builtin = load_robot("builtin:rv_m2", _last_link("builtin:rv_m2"))
    table = pd.DataFrame(np.random.default_rng(0).uniform(-0.5, 0.5, (9, builtin.n)), columns=builtin.joint_names)
    table[["x", "y", "z"]] = np.random.default_rng(1).uniform(-0.5, 0.5, (9, 3))
    table.to_csv(tmp_path / "t.csv", index=False)
    (tmp_path / "campaign.toml").write_text(
        f'[robot]\nurdf = "builtin:rv_m2"\ntool_frame = "{builtin.tool_frame}"\n'
        '[measurements]\nfile = "t.csv"\nangle_unit = "rad"\nlength_unit = "m"\n'
    )
    assert read_campaign(tmp_path).robot.joint_names == builtin.joint_names


def _last_link(urdf: str) -> str:
    from thermal_robot.errors import RobotError

    with pytest.raises(RobotError) as caught:
        load_robot(urdf, "")
    return caught.value.candidates[-1]


def test_pandas_is_not_loaded_for_csv(tmp_path: Path) -> None:
    folder = put(tmp_path / "c")
    code = (
        "import sys; from thermal_robot.campaign import read_campaign; "
        "read_campaign(sys.argv[1]); print('pandas' in sys.modules)"
    )
    command = [sys.executable, "-c", code, str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


def test_the_example_is_good(tmp_path: Path) -> None:
    assert read(tmp_path).warnings == ()


def test_robot_errors_name_the_campaign(tmp_path: Path) -> None:
    with pytest.raises(RobotError, match=r"campaign\.toml, \[robot\]: .*'tol'") as caught:
        read(tmp_path, toml=TOML.replace('"tool"', '"tol"'))
    assert "tool" in caught.value.candidates
    with pytest.raises(RobotError, match=r"campaign\.toml, \[robot\]: .*arm\.urdf"):
        read(tmp_path, toml=TOML.replace("robot.urdf", "arm.urdf"))


def test_measured_columns_need_not_be_there(tmp_path: Path) -> None:
    campaign = full(tmp_path / "c")
    (tmp_path / "fresh.csv").write_text("lift,turn,roll,slide,temperature\n20,10,40,30,25\n")
    samples = read_samples(tmp_path / "fresh.csv", campaign)
    assert samples.name == "fresh"
    assert samples.position is None
    assert samples.orientation is None
    np.testing.assert_allclose(samples.q, campaign.q[:1])
    assert samples.covariates["temperature"].tolist() == [25.0]
    assert samples.target.tolist() == campaign.target.tolist()


def test_measured_columns_are_ignored(tmp_path: Path) -> None:
    campaign = full(tmp_path / "c")
    (tmp_path / "fresh.csv").write_text("lift,turn,roll,slide,x,qw\n20,10,40,30,far away,0\n")
    assert read_samples(tmp_path / "fresh.csv", campaign).position is None


def test_settings_do_as_well(tmp_path: Path) -> None:
    campaign = full(tmp_path / "c")
    stored = json.loads(json.dumps(campaign.settings.to_dict()))
    settings = Settings.from_dict(stored)
    assert settings == campaign.settings
    samples = read_samples(tmp_path / "c" / "measurements.csv", settings, campaign.robot)
    np.testing.assert_array_equal(samples.q, campaign.q)
    with pytest.raises(TypeError, match="robot"):
        read_samples(tmp_path / "c" / "measurements.csv", settings)


def test_a_joint_is_still_needed(tmp_path: Path) -> None:
    (tmp_path / "fresh.csv").write_text("turn,roll,slide\n10,40,30\n")
    with pytest.raises(CampaignError) as caught:
        read_samples(tmp_path / "fresh.csv", full(tmp_path / "c"))
    assert (caught.value.row, caught.value.column) == (1, "lift")
