"""Effects that stand in for something else, and how far the others are believed beside an unlisted cause."""

import pytest

from thermal_robot.diagnosis.stand_in import StandIn, trust


def test_an_effect_is_believed_by_its_size_beside_what_is_not_listed():
    shares = {"geometric": 0.9, "drift": 0.05, "discovered.1": 0.1}
    believed = trust(shares, {}, unlisted=0.0)
    assert believed == {"geometric": pytest.approx(0.9), "drift": 0.85}
    assert trust(shares, {}, unlisted=0.04)["geometric"] == pytest.approx(0.9 / 1.04)
    assert trust({"geometric": 0.6}, {}, unlisted=0.0) == {"geometric": 1.0}
    changing = trust({"geometric": 0.6}, {"geometric": StandIn(0.0, "time")}, unlisted=0.0)
    assert changing == {"geometric": 0.85}
    assert trust({"geometric": -0.1}, {}, unlisted=0.0) == {"geometric": 1.0}
