"""Where the gap lies: shares of axes, joints, links and quantities."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import with_law
from simulate import simulate

from thermal_robot.diagnosis.attribution import locate, without_laws
from thermal_robot.diagnosis.values import Unexplained, Where
from thermal_robot.effects import choose
from thermal_robot.effects.law import Discovered
from thermal_robot.inference.fit import fit, refit


def located(robot, name, share=1.0, **how):
    campaign, truth, _ = simulate(robot, [name], samples=80, seed=2, ratio=(5.0, 6.0), **how)
    fitted = fit(campaign, choose(name))
    return (*locate(fitted, {name: share}), truth["parts"][name]["values"], fitted)


def test_an_effect_sits_in_its_place_and_rows_set_aside_count_nowhere(rv_m2):
    # an effect in one joint sits there
    where, locations, _, _ = located(rv_m2, "backlash", places=["joint_3"])
    assert locations["backlash"][0].name == "joint_3"
    assert locations["backlash"][0].share > 0.95
    assert max(where.joints, key=where.joints.get) == "joint_3"
    assert where.links == {}
    # rows that were set aside count nowhere
    campaign, _, _ = simulate(rv_m2, ["backlash"], samples=80, seed=2, ratio=(5.0, 6.0), places=["joint_3"])
    spoilt = campaign.position.copy()
    spoilt[11] += [0.0, 0.0, 0.05]
    plain, dirty = (fit(replace(campaign, position=p), choose("backlash")) for p in (campaign.position, spoilt))
    assert dirty.explanation.outliers[11]
    clean, seen = (locate(f, {"backlash": 1.0})[0].axes for f in (plain, dirty))
    for axis in "xyz":
        assert seen[axis] == pytest.approx(clean[axis], abs=0.05)


def test_places_divide_an_effects_share_among_them(rv_m2):
    for share in (1.0, 0.4):
        where, locations, _, _ = located(rv_m2, "joint_gain", share)
        shares = [place.share for place in locations["joint_gain"]]
        assert sum(shares) == pytest.approx(share)
        assert shares == sorted(shares, reverse=True)
        assert where.joints == {
            place.name: place.share for place in sorted(locations["joint_gain"], key=lambda p: p.name)
        }
    where, locations, _, fitted = located(rv_m2, "joint_gain", -0.2)
    assert {place.share for place in locations["joint_gain"]} == {0.0}
    # axes are shares of the gap's mean square
    rows = fitted.nominal.gap[~fitted.explanation.outliers, :3]
    assert sum(where.axes.values()) == pytest.approx(1.0)
    largest = max(where.axes, key=where.axes.get)
    assert "xyz"[int(np.sqrt((rows**2).mean(axis=0)).argmax())] == largest


def test_one_coefficient_for_all_links_sits_in_all_of_them(rv_m2):
    where, locations, _, fitted = located(rv_m2, "thermal_elongation", variant=1)
    assert fitted.effects[0][0].common
    long = {s.parent_link for s in rv_m2.segments if s.length > 1e-9}
    assert {(p.kind, p.name) for p in locations["thermal_elongation"]} == {("link", name) for name in long}
    assert sum(where.links.values()) == pytest.approx(1.0)
    assert list(where.links) == [n for n in dict.fromkeys(s.parent_link for s in rv_m2.segments) if n in long]


@pytest.mark.parametrize(("name", "kind"), [("drift", "base"), ("instrument_scale", "instrument")])
def test_what_errs_beyond_joints_and_links_has_its_share(rv_m2, name, kind):
    where, locations, _, fitted = located(rv_m2, name, 0.8)
    assert where.beyond == {kind: pytest.approx(0.8)}
    assert where.joints == where.links == {}
    assert where.places == {(kind, kind): pytest.approx(0.8)}
    assert {(p.kind, p.name) for p in locations[name]} == {(kind, kind)}
    # the quantity that an effect follows explains most of the gap
    assert name != "drift" or next(iter(where.covariates)) == "time"
    shares = list(where.covariates.values())
    assert shares == sorted(shares, reverse=True)
    assert all(0.0 <= share <= 1.0 for share in shares)
    # without laws the known effects leave what the fit leaves
    left = Unexplained(True, 1e-4, 1e-9)
    assert without_laws(fitted, left) is left


def test_places_are_all_there_are_largest_first():
    where = Where({}, {"a": 0.1}, {"b": 0.5}, {}, {"base": 0.2, "tool": 0.05})
    shares = {("link", "b"): 0.5, ("base", "base"): 0.2, ("joint", "a"): 0.1, ("tool", "tool"): 0.05}
    assert list(where.places.items()) == list(shares.items())


def test_what_the_known_effects_leave_has_what_the_laws_take_in_it(rv_m2):
    """Noise apart, it is what is left once the law's effect is taken out of the model again."""
    law = Discovered("discovered.1", "joint", "joint_3", "temperature", "step", (22.0,), 1.0)
    data = with_law(rv_m2, law, [-4e-4, 4e-4], seed=3)[0]
    known = fit(data, ())
    with_it = refit(known, {law.name: (law,)}, [[law]])
    left = Unexplained(False, 0.0, 0.6)
    said = without_laws(with_it, left)
    whole = float(np.sqrt((known.nominal.gap**2).sum(axis=1).mean()))
    assert np.hypot(said.rms, np.sqrt(3.0) * 25e-6) == pytest.approx(whole, rel=0.05)
    assert 0.0 <= said.p_value < 1e-6
    # what the law leaves is added in quadrature, and tests that say more are kept
    more = without_laws(with_it, Unexplained(True, said.rms, 1e-300, ("it is large",)))
    assert more.rms == pytest.approx(np.sqrt(2.0) * said.rms)
    assert more.p_value == min(1e-300, said.p_value)
    share = 1.0 - 3.0 * 25e-6**2 / whole**2
    for reasons, rest in ((said.reasons, ()), (more.reasons, ("it is large",))):
        assert reasons[1:] == rest
        assert reasons[0].startswith("a law explains ")
        assert float(reasons[0].split()[3].rstrip("%")) == pytest.approx(100.0 * share, abs=1.0)
