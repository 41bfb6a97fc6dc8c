"""New rows: tables and campaigns are the same, and what is of another robot or kind is refused in plain words."""

from dataclasses import replace

import numpy as np
import pytest
from updating_cases import measured

import thermal_robot as tr
from thermal_robot.campaign.more_rows import more_rows
from thermal_robot.errors import CampaignError


@pytest.fixture(scope="module")
def whole():
    return measured(100, seed=3)


@pytest.fixture
def new(whole):
    return whole.take(np.arange(60, 100))


def test_a_table_is_read_as_the_campaign_was(whole, new):
    rows = more_rows(whole, new.to_frame(), ())
    assert np.allclose(rows.q, new.q)
    assert np.allclose(rows.position, new.position)
    assert (rows.covariates["approach.joint_2"] == new.covariates["approach.joint_2"]).all()


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"tool_known": True}, "another tool frame"),
        ({"noise_position": 1e-4}, "another noise of positions"),
        ({"reference_temperature": 25.0}, "another reference temperature"),
        ({"orientation": np.tile([1.0, 0.0, 0.0, 0.0], (40, 1))}, "another kind of measurement"),
    ],
)
def test_another_kind_is_refused(whole, new, change, match):
    with pytest.raises(CampaignError, match=match):
        more_rows(whole, replace(new, **change), ())


def test_another_robot_is_refused(whole):
    other = tr.simulate("example-robot-data:ur5", tool_frame="tool0", rows=5, base=np.eye(4), tool=np.eye(4))
    with pytest.raises(CampaignError, match="its joints differ"):
        more_rows(whole, other, ())


def test_another_arm_with_the_same_joints_is_refused(whole, new):
    longer = tr.load_robot(whole.robot.urdf.replace('xyz="0 0 ', 'xyz="0.001 0 '), whole.robot.tool_frame)
    with pytest.raises(CampaignError, match="another nominal model"):
        more_rows(whole, replace(new, robot=longer), ())


def test_a_column_that_effects_read_is_asked_for(whole, new):
    with pytest.raises(CampaignError, match="lacks what the chosen effects read"):
        more_rows(whole, new.drop_covariate("temperature"), ("temperature",))


def test_what_is_no_table_is_refused(whole):
    with pytest.raises(CampaignError, match="pandas DataFrame"):
        more_rows(whole, [1.0, 2.0], ())
