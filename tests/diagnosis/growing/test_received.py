"""New rows: tables and campaigns are the same, and what is of another robot or kind is refused in plain words."""

from dataclasses import replace

import numpy as np
import pytest
from growing_cases import OLD, measured

import thermal_robot as tr
from thermal_robot.diagnosis.growing.choice import Judge
from thermal_robot.diagnosis.growing.stream import received, weighed
from thermal_robot.errors import CampaignError


@pytest.fixture
def new(whole):
    return whole.take(np.arange(OLD, OLD + 40))


def test_a_table_is_read_as_the_campaign_was(whole, new):
    rows = received(whole, new.to_frame(), ())
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
        received(whole, replace(new, **change), ())


def test_another_robot_is_refused(whole):
    other = tr.simulate("example-robot-data:ur5", tool_frame="tool0", rows=5, base=np.eye(4), tool=np.eye(4))
    with pytest.raises(CampaignError, match="its joints differ"):
        received(whole, other, ())


def test_another_arm_with_the_same_joints_is_refused(whole, new):
    longer = tr.load_robot(whole.robot.urdf.replace('xyz="0 0 ', 'xyz="0.001 0 '), whole.robot.tool_frame)
    with pytest.raises(CampaignError, match="another nominal model"):
        received(whole, replace(new, robot=longer), ())


def test_a_column_that_effects_read_is_asked_for(whole, new):
    with pytest.raises(CampaignError, match="lacks what the chosen effects read"):
        received(whole, new.drop_covariate("temperature"), ("temperature",))


def test_what_is_no_table_is_refused(whole):
    with pytest.raises(CampaignError, match="pandas DataFrame"):
        received(whole, [1.0, 2.0], ())


def test_by_the_diagnosis_rows_get_the_weight_of_their_distance(grown):
    rows = measured(200, seed=3, gross=0.1)
    judge = Judge(grown.fitted.point, np.full(3, 2e-5), 300)
    single = weighed(replace(grown.choice, judge=judge), rows)
    assert 10 < single.aside.sum() < 30
    assert (single.weights[single.aside] == 0.0).all()
    assert (single.weights[~single.aside] > 0.5).all()


def test_where_each_fit_weighs_them_they_come_in_full(grown, new):
    assert (weighed(grown.choice, new).weights == 1.0).all()
