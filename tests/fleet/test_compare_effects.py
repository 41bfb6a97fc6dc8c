"""Which effects are compared, and as what."""

import numpy as np
from compared import diagnosed, lagging_days

from thermal_robot.fleet.compare_sums import candidates


def test_zeros_are_always_compared_and_come_first():
    days = [diagnosed(1), diagnosed(4, gains=2e-3)]
    listed = candidates(days, [d.fit for d in days], ["a", "b"])
    assert listed[0].effect.told_inside
    own = {item.name: item for item in listed}
    assert own["joint_gain"].named == ("joint_gain" in days[0].verdict, True)
    # in all places, whichever a diagnosis named it in
    assert len(own["joint_offset"].told) == 5
    assert all(len(parameters) == 5 for parameters in own["joint_offset"].parameters)
    np.testing.assert_array_equal(own["joint_offset"].sizes, np.full(5, 1e-3))
    assert not any(p.responses for p in own["joint_offset"].told)
    assert not any(item.law for item in listed)


def test_what_one_campaign_cannot_tell_has_no_parameters_there():
    import thermal_robot as tr

    robot = tr.load_robot("builtin:rv_m2", "tool0")
    warm = tr.simulate(robot, {"thermal_elongation": 2e-5}, rows=50, noise=2e-5, seed=1)
    cold = tr.simulate(robot, rows=50, noise=2e-5, seed=2, conditions={"temperature": None})
    days = [tr.diagnose(c, only="thermal_elongation") for c in (warm, cold)]
    listed = candidates(days, [d.fit for d in days], ["warm", "cold"])
    own = next(item for item in listed if item.name == "thermal_elongation")
    assert own.parameters[0]
    assert own.parameters[1] == ()
    found = tr.compare(*days, names=["warm", "cold"])
    assert found.effect("thermal_elongation").status == "not_compared"
    assert found.effect("thermal_elongation").reason == "warm alone can tell it"


def test_links_that_lag_are_compared_with_the_record_of_each_campaign():
    """The setting of one campaign would read a clock that another does not have, or follow the wrong day's air."""
    import thermal_robot as tr

    days = [tr.diagnose(day, only="thermal_elongation") for day in lagging_days()]
    assert [bool(d.fit.effects[0][0].lag) for d in days] == [True, True, False]
    found = tr.compare(*days, names=["jump", "fall", "no clock"])
    assert found.effect("thermal_elongation").status == "shared"
    assert found.changes == ()
