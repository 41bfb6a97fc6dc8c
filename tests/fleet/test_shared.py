"""Parameters over a fleet: what all share, what halls differ by, who stands out, and silence elsewhere."""

import numpy as np
import pytest
from fleet.robots import deviations, scattered, told_rows, write_told

from thermal_robot.fleet.rows import overview
from thermal_robot.fleet.summary import _shared

NAMES = [f"joint_{k}" for k in range(6)]


def fleet(path, seed, change=lambda values, halls: None, robots=40, campaigns=1):
    """(robots, 6) values of a fleet of two halls, changed, as a table; in units of the deviation."""
    rng = np.random.default_rng(seed)
    std = np.stack([deviations(rng, robots) for _ in NAMES], axis=1)
    halls = np.arange(robots) % 2
    own = np.stack([scattered(rng, robots, 0.0, 0.5, np.zeros(robots)) for _ in NAMES], axis=1)
    change(own, halls)
    rows = []
    for k in range(robots):
        for c in range(campaigns):
            values = own[k] + std[k] * rng.normal(size=len(NAMES))
            told = {"offset": (False, "", dict(zip(NAMES, zip(values, std[k], strict=True), strict=True)))}
            rows.append(told_rows(f"r{k}/{c}", {"hall": str(halls[k]), "robot": f"r{k}"}, told))
    return write_told(path / "t.parquet", rows, ("hall", "robot"))


def compared(file):
    return _shared(file, overview(file, ("hall", "robot")), ["offset"])


def test_a_fault_of_all_is_found_with_its_mean_and_spread(tmp_path):
    off = []
    for seed in range(30):
        shared_by_all = np.random.default_rng([1, seed]).normal(3.0, 1.0, 40)

        def change(values, halls, own=shared_by_all):
            values[:, 2] = own

        together, apart, parameters = compared(fleet(tmp_path, seed, change))
        assert parameters == 6
        assert apart == ()
        (found,) = together
        assert (found.parameter, found.label, found.robots) == ("joint_2", "", 40)
        off.append([(found.mean - 3.0) / found.mean_std, (found.spread - 1.0) / found.spread_std])
    assert np.sqrt(np.mean(np.square(off), axis=0)) == pytest.approx([1.0, 1.0], abs=0.4)


def test_a_fault_of_one_hall_is_told_by_hall(tmp_path):
    def change(values, halls):
        values[:, 4] += 5.0 * halls

    together, apart, _ = compared(fleet(tmp_path, 3, change))
    assert together[0].parameter == "joint_4"
    assert together[0].label == "hall"
    assert together[0].p_label < 1e-6
    means = {g.group: (g.mean, g.mean_std, g.robots) for g in together[0].groups}
    assert means["1"][0] == pytest.approx(5.0, abs=3.0 * means["1"][1])
    assert means["0"][0] == pytest.approx(0.0, abs=3.0 * means["0"][1])
    assert {n for *_, n in means.values()} == {20}
    assert together[0].spread == pytest.approx(0.5, abs=3.0 * together[0].spread_std)
    assert apart == ()


def test_a_robot_that_stands_out_is_named_against_its_own_hall(tmp_path):
    def change(values, halls):
        values[:, 4] += 8.0 * halls
        values[7, 4], values[12, 1] = 40.0, -25.0

    _, apart, _ = compared(fleet(tmp_path, 5, change))
    assert [(a.robot, a.parameter) for a in apart] == [("r7", "joint_4"), ("r12", "joint_1")]
    assert all(a.probability > 0.99 for a in apart)
    assert apart[0].usual == pytest.approx(8.0, abs=2.0)
    assert apart[1].usual == pytest.approx(0.0, abs=2.0)


def test_where_nothing_is_shared_little_is_said(tmp_path):
    said, named = 0, 0
    for seed in range(60):
        together, apart, _ = compared(fleet(tmp_path, [7, seed]))
        said, named = said + len(together), named + len(apart)
    assert said <= 3  # of 360 parameters
    assert named <= 5  # of 14 400 values


def test_several_campaigns_of_a_robot_tell_it_better(tmp_path):
    def change(values, halls):
        values[:, 0] = 1.5

    (once,) = [s for s in compared(fleet(tmp_path, 9, change))[0] if s.parameter == "joint_0"]
    (often,) = [s for s in compared(fleet(tmp_path, 9, change, campaigns=4))[0] if s.parameter == "joint_0"]
    assert (once.robots, often.robots) == (40, 40)
    assert often.mean_std < 0.7 * once.mean_std


def test_of_few_robots_nothing_is_said(tmp_path):
    def change(values, halls):
        values[:] = 30.0

    assert compared(fleet(tmp_path, 0, change, robots=4)) == ((), (), 0)
