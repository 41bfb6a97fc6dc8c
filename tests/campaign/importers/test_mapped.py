"""Rows and columns that become a campaign, and those that do not."""

import numpy as np
import pytest

from thermal_robot.campaign.importers.plan import Plan, Source, campaign_of, files_of, planned
from thermal_robot.campaign.table import Table
from thermal_robot.errors import CampaignError
from thermal_robot.kinematics import exp3

UNITS = {"measurements": {"angle_unit": "rad", "length_unit": "m"}}


def table(rows=4, **columns):
    q = {f"joint_{k + 1}": 0.1 * np.arange(rows) + 0.01 * k for k in range(5)}
    place = {axis: np.arange(float(rows)) for axis in "xyz"}
    return Table("t.csv", {**q, **place, **columns}, np.arange(2, rows + 2), 1)


def campaign(robot, given, **sections):
    plan = planned({**UNITS, **sections})
    return campaign_of(Source(given, Plan(), ("before",)), plan, robot, "c")


def test_columns_of_the_format_are_taken_by_their_own_names_and_others_only_when_asked(rv_m2):
    given = table(temperature=np.full(4, 21.0), order=np.arange(4.0), humidity=np.full(4, 40.0))
    found, notes = campaign(rv_m2, given)
    assert set(found.covariates) == {"temperature", "order"}
    assert notes == ("before", "4 rows read, 4 taken", "columns left out: 'humidity'")
    found, _ = campaign(rv_m2, given, columns={"humidity": "humidity"})
    assert "humidity" in found.covariates


def test_directions_of_approach_are_left_to_follow_from_the_order(rv_m2):
    found, _ = campaign(rv_m2, table(order=np.arange(4.0)))
    assert not [name for name in found.covariates if name.startswith("approach")]
    found, _ = campaign(rv_m2, table(**{"approach.joint_2": np.array([1.0, -1, 1, 1])}))
    assert "approach.joint_2" in found.covariates


def test_rows_without_a_measurement_are_left_out_and_half_a_measurement_is_refused(rv_m2):
    given = table(rows=6)
    for axis in "xyz":
        given.columns[axis][2] = np.nan
    found, notes = campaign(rv_m2, given)
    assert found.samples == 5
    assert found.rows.tolist() == [2, 3, 5, 6, 7]
    assert "1 row (4) left out, without a measured position" in notes
    given.columns["y"][3] = np.nan
    with pytest.raises(CampaignError, match=r"t\.csv, row 5, column 'y': a value is missing, for the column 'y'"):
        campaign(rv_m2, given)
    for axis in "xyz":
        given.columns[axis][:] = np.nan
    with pytest.raises(CampaignError, match="no row has a measured position"):
        campaign(rv_m2, given)


def test_a_matrix_gives_the_position_unless_columns_say_another(rv_m2):
    cells = {f"m{k}": np.full(4, value) for k, value in enumerate([1, 0, 0, 7, 0, 1, 0, 8, 0, 0, 1, 9])}
    plain = {name: values for name, values in table().columns.items() if name not in "xyz"}
    given = Table("t.csv", {**plain, **cells}, np.arange(2, 6), 1)
    matrix = {"kind": "matrix", "columns": list(cells)}
    found, _ = campaign(rv_m2, given, orientation=matrix)
    np.testing.assert_allclose(found.position, [[7, 8, 9]] * 4)
    np.testing.assert_allclose(found.orientation, [[1, 0, 0, 0]] * 4)
    found, _ = campaign(rv_m2, given, orientation=matrix, columns={"x": "joint_1"})
    np.testing.assert_allclose(found.position[:, 0], found.q[:, 0])


def test_the_noise_of_each_row_comes_from_a_column_of_another_name(rv_m2):
    given = table(uncertainty=np.array([2.0, 4.0, 2.0, 6.0]))
    found, notes = campaign(rv_m2, given, columns={"noise": {"column": "uncertainty", "scale": 0.5e-5}})
    np.testing.assert_allclose(found.noise_of_rows, [1e-5, 2e-5, 1e-5, 3e-5], rtol=1e-12)
    assert notes == ("before", "4 rows read, 4 taken")


def test_several_targets_come_from_columns_of_other_names_and_rows_without_any_are_left_out(rv_m2):
    rng, places = np.random.default_rng(0), np.array([[0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]])
    points = rng.normal(size=(6, 1, 3)) + places @ exp3(rng.normal(size=(6, 3))).transpose(0, 2, 1)
    points[2] = np.nan
    plain = {name: values for name, values in table(6).columns.items() if name not in "xyz"}
    seen = {f"T{k}{a}": points[:, k, "xyz".index(a)] for k in range(3) for a in "xyz"}
    named = {f"{a}.{k + 1}": f"T{k}{a}" for k in range(3) for a in "xyz"}
    found, notes = campaign(rv_m2, Table("t.csv", {**plain, **seen}, np.arange(2, 8), 1), columns=named)
    assert found.rows.tolist() == [2, 3, 5, 6, 7]
    assert "1 row (4) left out, without a measured position" in notes
    np.testing.assert_allclose(found.targets.points, points[[0, 1, 3, 4, 5]])


def test_another_number_of_files(tmp_path):
    files_of([tmp_path], "ONE or TWO", 1, 2)
    with pytest.raises(CampaignError, match="FILES: another number of files than this format has; found 3, expected A"):
        files_of([tmp_path] * 3, "A", 1, 2)
