"""Published data sets: sums, Euler angles, stamps that are lost; the files themselves are read in test_originals."""

import numpy as np
import pytest
from campaign.importers.written import imported, put, rotations

TABLE = """step_order,x_t,y_t,z_t,x_dif,y_dif,z_dif,joint_1,joint_2,joint_3,joint_4
0,100.0,200.0,300.0,0.5,-0.5,0.25,10,20,30,40
1,110.0,200.0,300.0,0.5,-0.5,0.25,11,22,33,44
2,120.0,210.0,300.0,0.5,-0.5,0.25,12,24,36,48
"""


def test_targets_and_differences_are_added(tmp_path, capsys):
    folder = put(tmp_path, grid__csv=TABLE)
    campaign, _ = imported(capsys, folder, "jacobi", "grid.csv")
    np.testing.assert_allclose(1e3 * campaign.position[0], [100.5, 199.5, 300.25])
    np.testing.assert_allclose(np.rad2deg(campaign.q[:, 0]), [10, 11, 12])
    assert campaign.covariates["order"].tolist() == [0, 1, 2]


HEADER = "Timestamp;turn;lift;slide;roll;measurement_temperature;measurement_x;measurement_y;measurement_z;"
HEADER += "measurement_rx;measurement_ry;measurement_rz\n"
ROWS = """{};0,1;0,2;0,03;0,4;23,5;1000,5;0;500;90,0;0;90,0
{};-0,1;0,3;0,06;3,5;23,6;900;100;510;0;0;0
{};0,5;-0,4;0,09;-0,4;23,7;800;200;520;0;30,0;0
"""
STAMPS = ("20200714163904", "20200714163924", "20200715163904")


@pytest.mark.parametrize(
    ("stamps", "clock", "seen"), [(STAMPS, "time", [0, 20, 86400]), (["2,02011E+13"] * 3, "order", [0, 1, 2])]
)
def test_stamps_or_the_order(tmp_path, capsys, stamps, clock, seen):
    folder = put(tmp_path, series__csv=HEADER + ROWS.format(*stamps))
    campaign, out = imported(capsys, folder, "ipa_ur10", "series.csv")
    assert campaign.covariates[clock].tolist() == seen
    assert ("the time stamps are no instants" in out) == (clock == "order")
    np.testing.assert_allclose(1e3 * campaign.position[0], [1000.5, 0, 500])
    np.testing.assert_allclose(campaign.covariates["temperature"], [23.5, 23.6, 23.7])
    # about x by 90°, then about the new z by 90°
    np.testing.assert_allclose(rotations(campaign)[0], [[0, -1, 0], [0, 0, -1], [1, 0, 0]], atol=1e-12)
