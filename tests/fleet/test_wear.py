"""Campaigns go in, what moved comes out: in any order of pairs, on any dates, from diagnoses as well."""

from datetime import date, timedelta

import pytest

from thermal_robot import CampaignError, EffectError, diagnose, simulate, wear

ZEROS = (1e-3, 1e-3, 1.3e-3, 1.3e-3)
DATES = [date(2026, 1, 1) + timedelta(days=30 * k) for k in range(4)]


@pytest.fixture(scope="module")
def campaigns(rv_m2):
    known = dict(rows=40, noise=2e-5, base_known=False, tool_known=False)
    return [simulate(rv_m2, {"joint_offset": {"joint_3": z}}, seed=k, **known) for k, z in enumerate(ZEROS)]


@pytest.fixture(scope="module")
def found(campaigns):
    return wear(campaigns, dates=DATES, effects=["joint_offset"], limits={"joint_offset": 2e-3})


def test_the_jump_is_found(found):
    (rings,) = found.alarms
    assert (rings.place, rings.kind, rings.jump.after) == ("joint_3", "jump", 1)
    assert abs(rings.jump.size - 3e-4) < 4.0 * rings.jump.std
    assert {w.place for w in found.parameters if not w.comparable} == {"joint_1", "joint_5"}


def test_pairs_may_come_in_any_order(campaigns, found):
    pairs = [(DATES[k].isoformat(), campaigns[k]) for k in (2, 0, 3, 1)]
    assert wear(pairs, effects="joint_offset", limits={"joint_offset": 2e-3}).to_dict() == found.to_dict()


def test_a_shift_of_all_dates_does_not_matter(campaigns, found):
    later = wear(campaigns, dates=[d + timedelta(days=1000) for d in DATES], effects=["joint_offset"])
    for one, other in zip(found.parameters, later.parameters, strict=True):
        assert one.kinds == other.kinds
        assert one.values == other.values


def test_diagnoses_do_as_well(campaigns):
    diagnoses = [diagnose(campaign, only=["joint_offset"]) for campaign in campaigns]
    undated = wear(diagnoses)
    (rings,) = undated.alarms
    assert (rings.place, rings.kind, undated.dated) == ("joint_3", "jump", False)


def test_wrong_arguments_are_told(campaigns):
    with pytest.raises(CampaignError, match="too few campaigns"):
        wear(campaigns[:2])
    with pytest.raises(CampaignError, match="3 dates for 4 campaigns"):
        wear(campaigns, dates=DATES[:3])
    with pytest.raises(CampaignError, match="some campaigns have dates"):
        wear([(DATES[0], campaigns[0]), *campaigns[1:]])
    with pytest.raises(CampaignError, match="is no date"):
        wear(campaigns, dates=["soon"] * 4)
    with pytest.raises(EffectError, match="did you mean 'backlash'"):
        wear(campaigns, limits={"backlsh": 1e-3})
    with pytest.raises(CampaignError, match="is no limit"):
        wear(campaigns, limits={"backlash": -1.0})
    with pytest.raises(EffectError, match="joint_ofset"):
        wear(campaigns, effects=["joint_ofset"])
    with pytest.raises(CampaignError, match="no rate of false alarms"):
        wear(campaigns, false_alarm=1.0)
    with pytest.raises(CampaignError, match="found int"):
        wear([1, 2, 3])
    with pytest.raises(CampaignError, match="cannot take this"):
        wear(3)
