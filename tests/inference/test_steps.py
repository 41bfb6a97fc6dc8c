"""What errors of a joint follow: steps of their command, a recorded quantity, or nothing."""

import tracemalloc

import numpy as np
import pytest
from helpers import some

from thermal_robot.blind.score import reliability
from thermal_robot.inference.scatter import followed, period, stepped

STEP = 1e-3  # rad


def commands(seed, rows=150, reach=1.5):
    return np.random.default_rng([seed, 1]).uniform(-reach, reach, rows)


def sawtooth(command, step=STEP):
    """Error of a command that is rounded to whole steps."""
    return np.round(command / step) * step - command


def variances(sigma, rows):
    """What an error varies by beside the steps."""
    return np.full(rows, sigma**2)


@pytest.mark.parametrize(("rows", "noise"), some([(120, 0.1), (120, 0.0), (200, 0.0), (200, 0.1)], 4))
def test_the_period_of_a_sawtooth_is_found(rows, noise):
    for seed in range(3):
        rng, command = np.random.default_rng(seed), commands(seed, rows)
        spread = max(noise * STEP, 1e-3 * STEP)
        errors = sawtooth(command) + spread * rng.normal(size=rows)
        # the size of so few errors says the step to about 10 %
        found = period(errors, variances(spread, rows), command, 1.1 * STEP)
        assert found.log_factor > np.log(1e4)
        # over three radians a thousandth of the step is a third of a period
        assert found.step == pytest.approx(STEP, rel=1e-3)


@pytest.mark.slow
def test_normal_errors_have_no_steps_and_are_refuted():
    for seed in range(100):
        rng, command = np.random.default_rng(seed), commands(seed, 200, reach=0.3)
        found = period(STEP / np.sqrt(12.0) * rng.normal(size=200), variances(0.0, 200), command, STEP)
        assert found.step == pytest.approx(STEP)
        assert found.log_factor < np.log(1e-4)


@pytest.mark.slow
def test_a_bayes_factor_is_as_often_right_as_it_says():
    """Of errors that have steps or have none, as often: of those called 80 % probable to have steps, 80 % have."""
    rng, said, true = np.random.default_rng(0), [], []
    for seed in range(600):
        # from steps that can hardly be seen to plain ones
        rows, ratio = int(rng.integers(40, 90)), rng.uniform(0.8, 2.0)
        command, sigma = commands(seed, rows, reach=0.3), STEP / np.sqrt(12.0)
        errors = sawtooth(command) if seed % 2 else sigma * rng.normal(size=rows)
        noise = sigma / ratio
        factor = period(errors + noise * rng.normal(size=rows), variances(noise, rows), command, STEP).log_factor
        said.append(1.0 / (1.0 + np.exp(-factor)))
        true.append(seed % 2)
    found = reliability(np.array(said), np.array(true, dtype=bool))
    assert found["error"] < 0.07  # of perfect probabilities in ten bins of sixty: 0.03


@pytest.mark.slow
def test_where_steps_would_not_be_seen_nothing_is_said():
    """Errors of which most are the instrument's."""
    for seed in range(200):
        rng, command = np.random.default_rng(seed), commands(seed, 40, reach=0.3)
        for errors in (np.zeros(40), sawtooth(command)):
            found = period(errors + STEP * rng.normal(size=40), variances(STEP, 40), command, STEP)
            assert abs(found.log_factor) < 1.0


@pytest.mark.slow
def test_a_ripple_on_errors_of_another_kind_is_no_step():
    """Normal errors of the whole size, and a sawtooth of a third of it."""
    for seed in range(2):
        rng, command = np.random.default_rng(seed), commands(seed, 600)
        errors = 1.0 / np.sqrt(12.0) * rng.normal(size=600) * STEP + 0.35 * sawtooth(command)
        found = period(errors, variances(0.0, 600), command, STEP)
        assert found.log_factor < np.log(1e-4)


def test_a_joint_is_an_encoders_as_its_steps_say():
    """Nothing seen leaves the odds of the causes; what is seen counts, but steps may hide."""
    assert stepped([0.0]) == pytest.approx(1.0 / 3.0)  # an encoder, wear, and what nobody recorded
    assert stepped([6.0]) > 0.99
    refuted = stepped([-30.0])
    assert refuted == pytest.approx(stepped([-300.0]))
    assert 0.01 < refuted < 0.1
    # one joint whose steps are plain speaks for another whose steps are hidden
    assert stepped([30.0, -30.0]) > 0.99


HALVES = pytest.mark.xfail(reason="whole steps lie on half steps, too: with a slack they are taken for these, by e³⁸")
THIRDS = pytest.mark.xfail(reason="two thirds of a step count a little, by e³, too few for a step to be measured by")


@pytest.mark.parametrize(
    "other",
    [
        1.6,
        pytest.param(1.0 / 1.45, marks=(pytest.mark.slow, THIRDS)),
        pytest.param(1.0 / 1.6, marks=(pytest.mark.slow, HALVES)),
    ],
)
def test_a_step_far_from_what_the_size_says_is_not_looked_for(other):
    command = commands(0)
    errors, variance = sawtooth(command), variances(0.0, 150)
    assert period(errors, variance, command, other * STEP).log_factor < 0.0


@pytest.mark.slow
def test_a_step_that_the_size_says_outweighs_one_far_from_it():
    command = commands(0)
    others = (1.0, 1 / 1.6, 1 / 1.45, 1.6)
    factors = [period(sawtooth(command), variances(0.0, 150), command, k * STEP).log_factor for k in others]
    assert factors[0] > 100.0
    assert max(factors[1:]) < 0.2 * factors[0]


def test_too_many_steps_say_nothing_and_one_command_has_one_error():
    command = commands(1)
    fine = period(sawtooth(command), variances(0.0, 150), command, 1e-7)
    assert (fine.step, fine.log_factor) == (1e-7, 0.0)
    still = period(sawtooth(command), variances(0.0, 150), np.full(150, 0.3), STEP)
    assert still.log_factor < np.log(1e-4)
    # 1.6 million steps between seven commands: their frequencies would take 2.5 GB
    tracemalloc.start()
    assert period(sawtooth(command[:7] * 1e3), variances(1e-4, 7), command[:7] * 1e3, STEP).log_factor == 0.0
    assert tracemalloc.get_traced_memory()[1] < 1e8
    tracemalloc.stop()


def test_steps_do_not_depend_on_where_commands_begin_nor_on_the_unit():
    rng, command = np.random.default_rng(3), commands(3, 40)
    errors = sawtooth(command) + 0.1 * STEP * rng.normal(size=40)
    plain = period(errors, variances(0.1 * STEP, 40), command, STEP)
    moved = period(errors, variances(0.1 * STEP, 40), command + 7.0, STEP)
    scaled = period(1e3 * errors, 1e6 * variances(0.1 * STEP, 40), 1e3 * command, 1e3 * STEP)
    assert moved.log_factor == pytest.approx(plain.log_factor, abs=0.5)  # the frequencies fall between others
    assert (scaled.log_factor, scaled.step) == pytest.approx((plain.log_factor, 1e3 * plain.step))


LITTLE = pytest.mark.xfail(reason="e⁻¹·⁶ to e⁻⁴·³ since a fifth of a step may be others' errors")


@pytest.mark.parametrize("bound", [0.5, pytest.param(1e-4, marks=(pytest.mark.slow, LITTLE))])
def test_few_poses_that_are_seen_well_show_steps_plainly_and_count_against_those_of_another_command(bound):
    """Thirty poses, errors seen to a twentieth of a step: a sine of the command would explain 60 % of them."""
    for seed in range(4):
        rng, command = np.random.default_rng(seed), commands(seed, 30)
        errors, variance = sawtooth(command) + 0.05 * STEP * rng.normal(size=30), variances(0.05 * STEP, 30)
        assert period(errors, variance, command, 1.2 * STEP).log_factor > np.log(1e6)
        assert period(errors, variance, commands(seed + 50, 30), STEP).log_factor < np.log(bound)


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


@pytest.mark.parametrize("rows", some([25, 120], 2))
def test_noise_follows_nothing(rows):
    """Among few errors many a law explains a sixth by chance: it is named once in a thousand campaigns."""
    names = []
    for seed in range(200):
        rng = np.random.default_rng(seed)
        names.append(followed(1e-4 * rng.normal(size=rows), np.full(rows, 1e8), recorded(rng, rows)))
    assert sum(bool(name) for name in names) <= 2


def test_a_constant_error_and_a_small_one_follow_nothing_and_rows_weigh_by_their_variance():
    rng = np.random.default_rng(1)
    known, noise = recorded(rng, 3000), rng.normal(size=3000)
    slope = (known["joint_2"] - known["joint_2"].mean()) / known["joint_2"].std()
    assert followed(noise + 0.2 * slope, np.ones(3000), known) == ""  # it explains little, however sure it is
    assert followed(noise + 0.6 * slope, np.ones(3000), known) == "joint_2"
    rng = np.random.default_rng(2)
    known = recorded(rng)
    errors = 5e-3 + 1e-4 * rng.normal(size=120)
    assert followed(errors, np.full(120, 1e8), known) == ""
    # rows that know nothing do not hide a law of the others
    spread = np.where(np.arange(120) % 2, 1e-4, 1e-1)
    slope = known["joint_2"] / known["joint_2"].std()
    assert followed(spread * rng.normal(size=120) + 2e-4 * slope, 1.0 / spread**2, known) == "joint_2"
