"""A campaign as a data frame: read again it gives the same arrays."""

import numpy as np
import pytest

import thermal_robot as tr

pytest.importorskip("pandas")


@pytest.fixture(scope="module")
def campaign():
    return tr.demo_campaign()


def test_the_frame_read_again_gives_the_same_arrays(campaign):
    table = campaign.to_frame()
    units = campaign.units
    again = tr.campaign_from_table(campaign.robot, table, angle_unit=units.angle, length_unit=units.length)
    np.testing.assert_allclose(again.q, campaign.q, atol=1e-15)
    np.testing.assert_allclose(again.position, campaign.position, atol=1e-15)
    assert set(again.covariates) == set(campaign.covariates)
    for name, values in campaign.covariates.items():
        np.testing.assert_allclose(again.covariates[name], values, rtol=1e-15, err_msg=name)


def test_the_index_counts_as_the_file_does(campaign):
    table = campaign.take([5, 2]).to_frame()
    assert table.index.name == "row"
    assert table.index.tolist() == [7, 4]


def test_labels_stand_in_it(campaign):
    labelled = tr.campaign_from_table(
        campaign.robot, campaign.to_frame().assign(session=["a"] * 60 + ["b"] * 60), angle_unit="deg", length_unit="mm"
    )
    assert labelled.to_frame()["session"].tolist() == ["a"] * 60 + ["b"] * 60


def test_a_notebook_shows_joints_and_warnings(campaign):
    shown = campaign._repr_html_()
    assert all(joint in shown for joint in campaign.robot.joint_names)
    assert campaign.name in shown
    assert shown.count("<table>") == shown.count("</table>") >= 3


def test_a_frame_carries_its_units(campaign):
    table = campaign.to_frame()
    again = tr.campaign_from_table(campaign.robot, table)
    np.testing.assert_allclose(again.position, campaign.position, atol=1e-15)
    # who says otherwise has changed the table
    table[["x", "y", "z"]] *= 1e-3
    again = tr.campaign_from_table(campaign.robot, table, length_unit="m")
    np.testing.assert_allclose(again.position, campaign.position, atol=1e-12)
