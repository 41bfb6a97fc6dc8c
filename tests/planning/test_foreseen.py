"""How well an effect would be known from rows of any kind."""

import pytest

import thermal_robot as tr
from thermal_robot.planning.plan import foreseen

ROBOT = ("example-robot-data:ur10", "tool0")


def known(kind, rows=60, noise=5e-5):
    campaign = tr.simulate(tr.load_robot(*ROBOT), rows=rows, measures=kind, noise=noise)
    (found,) = foreseen(campaign, "joint_offset")
    return {p.place: p for p in found.parameters}


@pytest.mark.parametrize("kind", ["position", "distance", "plane", "socket"])
def test_twice_the_noise_is_known_half_as_well(kind):
    fine, coarse = known(kind), known(kind, noise=1e-4)
    ratio = coarse["elbow_joint"].sigma / fine["elbow_joint"].sigma
    assert ratio == pytest.approx(2.0, rel=0.15)


def test_one_component_says_less_than_three():
    assert known("distance")["elbow_joint"].sigma > known("position")["elbow_joint"].sigma


def test_sockets_say_nothing_of_the_first_joint():
    first = known("socket")["shoulder_pan_joint"]
    assert first.sigma == pytest.approx(first.size, rel=0.01)


def test_the_noise_must_be_stated():
    with pytest.raises(tr.CampaignError, match="states no noise"):
        foreseen(tr.simulate(tr.load_robot(*ROBOT), rows=20, measures="distance"))
