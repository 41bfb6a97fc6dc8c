"""What is told of each parameter: kinds, days, limits, and what is confounded."""

from datetime import datetime

import numpy as np
import pytest
from wear_cases import columns, jumping, measured, series_of

from thermal_robot.effects import Parameter
from thermal_robot.fleet.wear import Told, _comparable
from thermal_robot.fleet.wear_moves import explanations
from thermal_robot.fleet.wear_problem import Problem

SIZE = 1e-3
FIRST = datetime(2026, 1, 1)


def problem_of(series, has=None):
    count = len(series.followed)
    parameters = tuple(Parameter("zero", "rad", SIZE, "joint", f"j{k}", ()) for k in range(count))
    keys = tuple(("joint_offset", p.name) for p in parameters)
    has = np.ones((series.count, count), dtype=bool) if has is None else has
    return Problem(keys, parameters, ("joint zeros",) * count, series.matrices, series.vectors, has)


def told(series, first=FIRST, limits=None):
    found = Told(problem_of(series), explanations(series), first, limits or {}, 0.01).worn()
    return {worn.place: worn for worn in found}


def growing(rate=0.02, start=0.3, seed=5):
    design, rng = columns(8, 3, seed)
    days = np.array([0.0, 20, 41, 60, 85, 100, 120, 140])
    states = np.tile(rng.normal(size=3), (8, 1))
    states[:, 1] = start + rate * days
    return series_of(design, measured(design, states, rng), days)


def test_a_jump_is_told_with_its_day_and_size():
    worn = told(jumping(size=1.0))["j1"]
    assert worn.alarm
    assert (worn.kind, worn.jump.after, worn.jump.earliest, worn.jump.latest) == ("jump", 4, 4, 5)
    assert abs(worn.jump.size - SIZE) < 4.0 * worn.jump.std
    assert sum(worn.jump.probabilities) == pytest.approx(1.0)
    assert worn.rate is None
    assert sum(worn.kinds.values()) == pytest.approx(1.0)


def test_a_trend_is_told_with_its_rate_and_the_day_of_its_limit():
    worn = told(growing(), limits={"joint_offset": 5.0 * SIZE})["j1"]
    assert worn.kind == "trend"
    assert abs(worn.rate.value - 0.02 * SIZE) < 4.0 * worn.rate.std
    crossing = worn.crossing
    assert crossing.state == "expected"
    assert crossing.low < (5.0 - 0.3) / 0.02 < crossing.high
    assert crossing.low > 140.0
    assert crossing.dates[0] == "2026-" + crossing.dates[0][5:]


def test_without_dates_a_trend_has_no_rate_and_no_day():
    worn = told(growing(), first=None, limits={"joint_offset": 5.0 * SIZE})["j1"]
    assert (worn.kind, worn.rate, worn.crossing.state) == ("trend", None, "unknown")


def test_what_does_not_move_never_gets_there_and_what_is_beyond_has_passed():
    series = jumping(size=1.0)
    values = np.abs(told(series)["j0"].fitted[-1])
    never = told(series, limits={"joint_offset": 2.0 * values})["j0"].crossing
    passed = told(series, limits={"joint_offset": 0.5 * values})["j0"].crossing
    assert (never.state, never.day, passed.state) == ("never", None, "passed")


def test_parameters_that_do_the_same_are_confounded():
    design, rng = columns(8, 3, 1)
    design[:, :, 2] = design[:, :, 1] + 0.02 * rng.normal(size=design.shape[:2])
    states = np.zeros((8, 3))
    states[4:, 1] = 1.0
    found = told(series_of(design, measured(design, states, rng), np.arange(8.0)))
    assert found["j1"].confounded_with == ("zero, j2",)
    assert found["j0"].confounded_with == ()
    assert found["j1"].alarm or found["j2"].alarm


def test_what_is_hidden_or_rarely_seen_is_not_compared():
    design, rng = columns(6, 3, 2)
    design[:, :, 0] *= 1e-3
    has = np.ones((6, 3), dtype=bool)
    has[1:, 2] = False
    design[1:, :, 2] = 0.0
    series = series_of(design, measured(design, np.zeros((6, 3)), rng), np.arange(6.0))
    assert _comparable(problem_of(series, has), series).tolist() == [False, True, False]
