"""What a fleet shares, who stands out, what gathers in a hall, and silence elsewhere."""

import json

import numpy as np
import pytest
from fleet.robots import told_rows, write_told
from helpers import some
from scipy.integrate import quad

from thermal_robot.fleet.population import combined, population
from thermal_robot.fleet.summary import SCHEMA, summarise

NAMES = [f"joint_{k}" for k in range(6)]


def deviations(rng, robots):
    return rng.uniform(0.5, 2.0, robots)


def scattered(rng, mean, spread, own):
    """Values as they would be measured: each robot's own, and the deviation of the measurement."""
    return rng.normal(mean, spread, len(own)) + own * rng.normal(size=len(own))


def of_robots(path, seed, change=lambda values, halls: None, robots=40, campaigns=1):
    """The summary of a fleet of two halls; parameters in units of the deviation, changed."""
    rng = np.random.default_rng(seed)
    std = np.stack([deviations(rng, robots) for _ in NAMES], axis=1)
    halls = np.arange(robots) % 2
    own = np.stack([scattered(rng, 0.0, 0.5, np.zeros(robots)) for _ in NAMES], axis=1)
    change(own, halls)
    rows = []
    for k in range(robots):
        for c in range(campaigns):
            values = own[k] + std[k] * rng.normal(size=len(NAMES))
            told = {"offset": (False, "", dict(zip(NAMES, zip(values, std[k], strict=True), strict=True)))}
            rows.append(told_rows(f"r{k}/{c}", {"hall": str(halls[k]), "robot": f"r{k}"}, told))
    return summarise(write_told(path / "t.parquet", rows, ("hall", "robot")), ("hall", "robot"))


def of_halls(path, chance, gathered=None):
    """The summary of sixty robots in three halls, of which one may have lost motion more often."""
    rng, rows = np.random.default_rng(chance), []
    for k in range(60):
        found = rng.random() < (0.9 if f"hall {k % 3}" == gathered else 0.1)
        play = {"backlash": (found, f"joint_{k % 2}", {})}
        rows.append(told_rows(f"r{k}", {"hall": f"hall {k % 3}"}, play, gap=k * 1e-6))
    return summarise(write_told(path / "t.parquet", rows), ("hall",))


@pytest.mark.parametrize("at_once", [4096, 7])
def test_it_counts_names_and_is_json(tmp_path, monkeypatch, at_once):
    monkeypatch.setattr("thermal_robot.fleet.settings.ROWS_AT_ONCE", at_once)
    rng, rows = np.random.default_rng(0), []
    for k in range(30):
        values = {"play": (rng.normal() + 60.0 * (k == 4), 1.0), "shift": (5.0 + rng.normal(), 1.0)}
        rows.append(told_rows(f"r{k}", {"hall": str(k % 2)}, {"backlash": (k == 4, "joint_1", values)}, gap=1e-6 * k))
    rows.append(told_rows("bad", {"hall": "1"}, {}, outcome="failed", reason="it is empty"))
    stages = []
    found = summarise(write_told(tmp_path / "t", rows), ["hall"], lambda *stage: stages.append(stage))
    assert (found.campaigns, found.robots, found.labels) == (31, 31, ("hall", "model"))
    assert found.outcomes == {"diagnosed": 30, "failed": 1}
    assert found.failures == (("bad", "failed", "it is empty"),)
    assert [(e.effect, e.found, e.testable) for e in found.effects] == [("backlash", 1, 30)]
    assert [(s.parameter, s.label) for s in found.shared] == [("shift", "")]
    assert [(a.robot, a.parameter) for a in found.apart] == [("r4", "play")]
    assert [(c.robot, c.place) for c in found.found] == [("r4", "joint_1")]
    assert found.parameters == 2
    assert stages == [("effects compared", 1, 1)]
    plain = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert plain["schema"] == SCHEMA
    assert plain["apart"][0]["robot"] == "r4"


def test_a_table_of_failures_alone_has_a_summary(tmp_path):
    rows = [told_rows("bad", {"hall": "1"}, {}, outcome="failed", reason="it is empty")]
    found = summarise(write_told(tmp_path / "t", rows), ["hall"])
    assert (found.outcomes, found.effects, found.shared, found.apart) == ({"failed": 1}, (), (), ())


def test_counts_places_and_the_largest_gaps(tmp_path, monkeypatch):
    monkeypatch.setattr("thermal_robot.fleet.settings.MOST_LISTED", 3)
    found = of_halls(tmp_path, 1, gathered="hall 0")
    (count,) = found.effects
    assert (count.effect, count.testable, count.parameters) == ("backlash", 60, True)
    assert count.found == sum(count.places.values())
    assert [c.rms_before for c in found.found] == sorted((c.rms_before for c in found.found), reverse=True)
    assert len(found.found) == 3


@pytest.mark.slow
def test_what_gathers_in_a_hall_is_told_and_what_does_not_is_not(tmp_path):
    (found,) = of_halls(tmp_path, 1, gathered="hall 2").gathered
    assert (found.label, found.group, found.robots, found.robots_elsewhere) == ("hall", "hall 2", 20, 40)
    assert found.found > 12
    assert found.p_value < 1e-4
    assert sum(bool(of_halls(tmp_path, [2, chance]).gathered) for chance in range(60)) <= 3


def test_several_campaigns_of_a_robot_count_once_and_laws_by_what_they_follow(tmp_path):
    rows = [told_rows(f"d{k}", {"robot": "a"}, {f"discovered.{k}": (True, "joint_3", {})}) for k in (1, 2)]
    for row in (row for told in rows for row in told):
        row["quantity"] = "time"
    rows.append(told_rows("alone", {"robot": ""}, {"backlash": (False, "", {})}))
    found = summarise(write_told(tmp_path / "t.parquet", rows, ("robot",)), ("robot",))
    law, play = found.effects
    assert (law.effect, law.found, law.testable, law.places) == ("a law of time", 1, 1, {"joint_3": 1})
    assert (law.parameters, play.parameters, found.robots) == (False, True, 2)
    assert found.gathered == ()
    assert [(c.campaign, c.robot) for c in found.found] == [("d1", "a"), ("d2", "a")]


def test_every_robot_with_a_gap_is_listed_what_is_in_doubt_or_unexplained_too(tmp_path):
    gaps = {"sure": 6e-5, "doubtful": 3e-4, "strange": 2e-4, "sound": 1e-5}
    rows = {
        name: told_rows(name, {}, {e: (name == "sure", "joint_2", {}) for e in ("backlash", "drift")}, gap=gap)
        for name, gap in gaps.items()
    }
    backlash, drift = rows["doubtful"]
    backlash |= {"status": "confounded", "confounded_with": ["drift"], "places": rows["sure"][0]["places"]}
    drift |= {"status": "confounded", "confounded_with": ["backlash"]}
    for row in rows["strange"]:
        row["unexplained"] = True
    found = summarise(write_told(tmp_path / "t.parquet", rows.values(), ()))
    told = [(case.robot, case.effect, case.confounded_with) for case in found.found]
    assert told == [
        ("doubtful", "backlash", ("drift",)),
        ("strange", "", ()),
        ("sure", "backlash", ()),
        ("sure", "drift", ()),
    ]
    assert {c.effect: (c.found, c.confounded) for c in found.effects} == {"backlash": (2, 1), "drift": (1, 0)}


@pytest.mark.parametrize("seed", range(3))
def test_a_fault_of_all_is_found_with_its_mean_and_spread(tmp_path, seed):
    def change(values, halls):
        values[:, 2] = np.random.default_rng([1, seed]).normal(3.0, 1.0, 40)

    summary = of_robots(tmp_path, seed, change)
    assert (summary.parameters, summary.apart) == (6, ())
    (found,) = summary.shared
    assert (found.parameter, found.label, found.robots) == ("joint_2", "", 40)
    assert found.mean == pytest.approx(3.0, abs=3.0 * found.mean_std)
    assert found.spread == pytest.approx(1.0, abs=3.0 * found.spread_std)


def test_a_fault_of_one_hall_is_told_by_hall(tmp_path):
    def change(values, halls):
        values[:, 4] += 5.0 * halls

    summary = of_robots(tmp_path, 3, change)
    found = summary.shared[0]
    assert (found.parameter, found.label, summary.apart) == ("joint_4", "hall", ())
    assert found.p_label < 1e-6
    for group in found.groups:
        assert group.mean == pytest.approx(5.0 * int(group.group), abs=3.0 * group.mean_std)
    assert [g.robots for g in found.groups] == [20, 20]
    assert found.spread == pytest.approx(0.5, abs=3.0 * found.spread_std)


def test_a_robot_that_stands_out_is_named_against_its_own_hall(tmp_path):
    def change(values, halls):
        values[:, 4] += 8.0 * halls
        values[7, 4], values[12, 1] = 40.0, -25.0

    apart = of_robots(tmp_path, 5, change).apart
    assert [(a.robot, a.parameter) for a in apart] == [("r7", "joint_4"), ("r12", "joint_1")]
    assert all(a.probability > 0.99 for a in apart)
    # a hall's mean is known to 0.3: seven times that
    assert [a.usual for a in apart] == pytest.approx([8.0, 0.0], abs=2.0)


@pytest.mark.slow
def test_where_nothing_is_shared_little_is_said(tmp_path):
    summaries = [of_robots(tmp_path, [7, seed]) for seed in range(60)]
    assert sum(len(s.shared) for s in summaries) <= 3  # of 360 parameters
    assert sum(len(s.apart) for s in summaries) <= 5  # of 14 400 values


def test_several_campaigns_of_a_robot_tell_it_better_and_few_robots_nothing(tmp_path):
    def change(values, halls):
        values[:, 0] = 1.5

    once, often = (of_robots(tmp_path, 9, change, campaigns=count).shared for count in (1, 4))
    once, often = (next(s for s in some if s.parameter == "joint_0") for some in (once, often))
    assert (once.robots, often.robots) == (40, 40)
    assert often.mean_std < 0.7 * once.mean_std
    few = of_robots(tmp_path, 0, lambda values, halls: values.fill(30.0), robots=4)
    assert (few.shared, few.apart, few.parameters) == ((), (), 0)


@pytest.mark.parametrize("spread", some([1.5, 0.7, 4.0], 3))
def test_mean_and_spread_lie_within_their_deviations(spread):
    off = []
    for seed in range(300):
        rng = np.random.default_rng([1, seed])
        own = deviations(rng, 40)
        found = population(scattered(rng, 3.0, spread, own), own)
        off.append(((found.means[0] - 3.0) / found.deviations[0], (found.spread - spread) / found.spread_std))
    assert np.std(off, axis=0) == pytest.approx(1.0, abs=0.15)
    # a spread smaller than the deviations is told too small by a fifth of its own; all else within 0.06
    assert np.mean(off, axis=0) == pytest.approx(0.0, abs=0.25)


def test_units_do_not_matter():
    rng = np.random.default_rng(2)
    own = deviations(rng, 30)
    values = scattered(rng, 1.0, 2.0, own)
    small, large = population(1e-6 * values, 1e-6 * own), population(1e3 * values, 1e3 * own)
    assert large.means == pytest.approx(1e9 * small.means, rel=1e-9)
    assert large.spread == pytest.approx(1e9 * small.spread, rel=1e-9)
    assert large.apart == pytest.approx(small.apart, rel=1e-6, abs=1e-12)


def test_without_robots_that_stand_out_it_is_the_normal_hierarchy():
    """Against quadrature over the spread, with the mean integrated out exactly."""
    rng = np.random.default_rng(3)
    own = deviations(rng, 50)
    values = scattered(rng, 0.0, 1.5, own)

    def mean(tau):
        return np.average(values, weights=1.0 / (own**2 + tau**2))

    def log(tau):
        weight = 1.0 / (own**2 + tau**2)
        return 0.5 * (np.log(weight) - weight * (values - mean(tau)) ** 2).sum() - 0.5 * np.log(weight.sum())

    best = max(log(tau) for tau in np.linspace(0.5, 3.0, 26))
    whole, first, second = (
        quad(lambda t, of=of: of(t) * np.exp(log(t) - best), 0.0, 6.0)[0] for of in (lambda t: 1.0, lambda t: t, mean)
    )
    found = population(values, own)
    # robots that stand out have a share of their own, which widens the law by a third of a deviation at most
    assert found.spread == pytest.approx(first / whole, abs=0.3 * found.spread_std)
    assert found.means[0] == pytest.approx(second / whole, abs=0.3 * found.deviations[0])


def test_few_are_named_where_none_stands_out_and_all_where_they_do():
    false, missed = 0, 0
    for seed in range(100):
        rng, own = np.random.default_rng([4, seed]), np.ones(100)
        values = scattered(rng, 0.0, 0.5, own)
        false += int((population(values, own).apart > 0.9).sum())
        values[:3] += rng.choice([-1.0, 1.0], 3) * 9.0
        missed += int((population(values, own).apart[:3] <= 0.9).sum())
    assert false <= 5  # of 10 000 robots
    assert missed <= 3  # of 300


def test_three_that_stand_out_do_not_move_the_others():
    rng, own = np.random.default_rng(5), np.ones(60)
    values = scattered(rng, 2.0, 0.5, own)
    clean = population(values[3:], own[3:])
    values[:3] = 300.0
    found = population(values, own)
    # three of sixty are a twentieth of all that is known, and leave a doubt about their share
    assert found.means[0] == pytest.approx(clean.means[0], abs=0.3 * clean.deviations[0])
    assert found.spread == pytest.approx(clean.spread, abs=0.5 * clean.spread_std)


def test_groups_that_are_alike_are_said_to_be_apart_as_often_as_stated():
    p_values = []
    for seed in range(300):
        rng = np.random.default_rng([6, seed])
        own = deviations(rng, 60)
        p_values.append(population(scattered(rng, 1.0, 1.0, own), own, rng.permutation(60) % 4).p_equal_means)
    assert np.mean(np.array(p_values) < 0.05) <= 0.1
    assert np.mean(np.array(p_values) < 0.5) == pytest.approx(0.5, abs=0.12)


def test_several_values_of_a_robot_are_one():
    who, values, std = combined(np.array([1.0, 3.0, 7.0]), np.array([1.0, 1.0, 2.0]), np.array([4, 4, 1]))
    assert who.tolist() == [1, 4]
    assert values == pytest.approx([7.0, 2.0])
    # two that differ by two deviations of one: χ² is 2 at one degree of freedom
    assert std == pytest.approx([2.0, np.sqrt(2.0) * np.sqrt(0.5)])


def test_a_group_in_which_all_differ_has_a_mean_and_no_end():
    found = population(np.array([-1e3, 1e3, 0.0, 0.1, 0.2, -0.1]), np.ones(6), np.array([0, 0, 1, 1, 1, 1]))
    assert np.isfinite([*found.means, *found.deviations, found.spread, *found.apart]).all()
