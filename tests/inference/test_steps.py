"""What errors of a joint follow: steps of their command, a recorded quantity, or nothing."""

import numpy as np
import pytest

from thermal_robot.inference.steps import followed, period

STEP = 1e-3  # rad


def commands(seed, rows=150, reach=1.5):
    return np.random.default_rng([seed, 1]).uniform(-reach, reach, rows)


def sawtooth(command, step=STEP):
    """Error of a command that is rounded to whole steps."""
    return np.round(command / step) * step - command


@pytest.mark.parametrize("rows", [120, 200])
@pytest.mark.parametrize("noise", [0.0, 0.1])
def test_the_period_of_a_sawtooth_is_found(rows, noise):
    for seed in range(10):
        rng, command = np.random.default_rng(seed), commands(seed, rows)
        spread = max(noise * STEP, 1e-3 * STEP)
        errors = sawtooth(command) + spread * rng.normal(size=rows)
        # the size of so few errors says the step to about 10 %
        found = period(errors, np.full(rows, 1.0 / (spread**2 + STEP**2 / 12.0)), command, 1.1 * STEP)
        assert found.p_value < 1e-3
        assert found.visible
        # over three radians a thousandth of the step is a third of a period
        assert found.step == pytest.approx(STEP, rel=1e-3)


def test_normal_errors_have_no_steps_and_are_refuted():
    chances = []
    for seed in range(100):
        rng, command = np.random.default_rng(seed), commands(seed, 200)
        errors = STEP / np.sqrt(12.0) * rng.normal(size=200)
        found = period(errors, np.full(200, 12.0 / STEP**2), command, STEP)
        assert found.visible
        assert found.step == pytest.approx(STEP)
        chances.append(found.p_value)
    assert np.mean(np.array(chances) > 0.01) > 0.98


def test_where_steps_would_not_be_seen_noise_finds_none():
    """Errors of which most are the instrument's; what a periodogram says of chance is a little too cautious."""
    chances = []
    for seed in range(200):
        rng, command = np.random.default_rng(seed), commands(seed, 40)
        found = period(STEP * rng.normal(size=40), np.full(40, 1.0 / STEP**2), command, STEP)
        assert not found.visible
        chances.append(found.p_value)
    assert np.mean(np.array(chances) < 0.05) <= 0.05 + 4.0 * np.sqrt(0.05 * 0.95 / 200)
    assert np.mean(np.array(chances) < 0.5) > 0.1


def test_a_ripple_on_errors_of_another_kind_is_no_step():
    """Normal errors of the whole size, and a sawtooth of a third of it."""
    for seed in range(10):
        rng, command = np.random.default_rng(seed), commands(seed, 600)
        errors = 1.0 / np.sqrt(12.0) * rng.normal(size=600) * STEP + 0.35 * sawtooth(command)
        found = period(errors, np.full(600, 12.0 / STEP**2 / 1.12), command, STEP)
        assert (found.visible, found.p_value) == (True, 1.0)


def test_a_step_far_from_what_the_size_says_is_not_looked_for():
    command = commands(0)
    errors, weight = sawtooth(command), np.full(150, 12.0 / STEP**2)
    assert period(errors, weight, command, STEP).p_value < 1e-6
    for other in (STEP / 1.6, 1.6 * STEP):
        assert period(errors, weight, command, other).p_value > 1e-6


def test_too_many_or_no_periods_say_nothing():
    command = commands(1)
    fine = period(sawtooth(command), np.full(150, 1.0), command, 1e-7)
    assert (fine.step, fine.p_value, fine.visible) == (1e-7, None, False)
    still = period(sawtooth(command), np.full(150, 1.0), np.full(150, 0.3), STEP)
    assert (still.p_value, still.visible) == (None, False)


def recorded(rng, rows=120):
    time = np.linspace(0.0, 3600.0, rows)
    return {
        "time": time,
        "temperature": 22.0 + rng.normal(size=rows).cumsum(),
        "payload": rng.choice([0.0, 1.0, 2.0], rows),
        "joint_2": rng.uniform(-2.0, 2.0, rows),
        "still": np.full(rows, 5.0),
    }


@pytest.mark.parametrize("name", ["time", "payload", "joint_2"])
def test_the_quantity_that_errors_follow_is_named(name):
    for seed in range(8):
        rng = np.random.default_rng(seed)
        known = recorded(rng)
        values = known[name]
        law = np.cos(2.0 * (values - values.mean()) / np.ptp(values))
        errors = 1e-4 * (law / law.std() + rng.normal(size=120))
        assert followed(errors, np.full(120, 1e8), known) == name


@pytest.mark.parametrize("rows", [25, 120])
def test_noise_follows_nothing(rows):
    """Among few errors many a law explains a sixth by chance: it is named once in a thousand campaigns."""
    names = []
    for seed in range(200):
        rng = np.random.default_rng(seed)
        names.append(followed(1e-4 * rng.normal(size=rows), np.full(rows, 1e8), recorded(rng, rows)))
    assert sum(bool(name) for name in names) <= 2


def test_what_explains_little_is_no_law_however_sure():
    rng = np.random.default_rng(1)
    known = recorded(rng, 3000)
    slope = (known["joint_2"] - known["joint_2"].mean()) / known["joint_2"].std()
    noise = rng.normal(size=3000)
    assert followed(noise + 0.2 * slope, np.ones(3000), known) == ""
    assert followed(noise + 0.6 * slope, np.ones(3000), known) == "joint_2"


def test_a_constant_error_follows_nothing_and_rows_weigh_by_their_variance():
    rng = np.random.default_rng(2)
    known = recorded(rng)
    errors = 5e-3 + 1e-4 * rng.normal(size=120)
    assert followed(errors, np.full(120, 1e8), known) == ""
    # rows that know nothing do not hide a law of the others
    spread = np.where(np.arange(120) % 2, 1e-4, 1e-1)
    slope = known["joint_2"] / known["joint_2"].std()
    assert followed(spread * rng.normal(size=120) + 2e-4 * slope, 1.0 / spread**2, known) == "joint_2"
