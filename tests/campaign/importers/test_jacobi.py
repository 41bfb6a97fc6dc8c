"""Jacobi's tables: measured is the sum of two columns; the files themselves are read in test_originals."""

import numpy as np
from campaign.importers.written import imported, put

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
