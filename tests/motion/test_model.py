"""The servo model of a log, its fit and its evidence: derivatives, recovery, and what counts as independent."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from motion import arms
from motion.arms import COUNT

pytest.importorskip("numba", reason="the extra fast is not installed")
pytest.importorskip("mujoco", reason="worlds are simulated by MuJoCo")

from thermal_robot.blind.motions.fault import Fault
from thermal_robot.blind.motions.world import draw_world
from thermal_robot.motion.diagnose import _gate, diagnose_motion
from thermal_robot.motion.fit import Part, Point, _ahead, deflated, fit, ratios, worth
from thermal_robot.motion.following import clusters
from thermal_robot.motion.log import Channel
from thermal_robot.motion.model import SHARED, ServoModel
from thermal_robot.motion.select import Choice, searched, settled
from thermal_robot.motion.weigh import Scales, Weighed, without


def driven(true, motions=9, seconds=8.0, seed=3, joints=("joint_1", "joint_2"), noise=COUNT, command=None):
    """A log whose encoders are what the servo model does with some true values, by effect and joint, and that model."""
    log = arms.log(*arms.tables(motions, seconds, seed)).with_joints(joints)
    if command:
        log = log.with_motions(lambda one: one.with_channels(["command"], lambda u: Channel(u.time, command(u))))
    model = ServoModel(log)
    values = np.zeros(len(model.parameters))
    for (effect, joint), value in true.items():
        values[model.index(effect, joint)] = value
    for _ in range(3):
        model.refreshed(values)
    place = model.path(values).T
    parts = []
    for m, motion in enumerate(log.motions):
        grid = model.grid[model.begins[m] : model.begins[m + 1]]
        q = np.stack(
            [np.interp(motion.position.time, grid, p[model.begins[m] : model.begins[m + 1]]) for p in place], 1
        )
        parts.append(
            replace(motion, position=Channel(motion.position.time, noise * np.round(q / noise)), velocity=None)
        )
    return replace(log, motions=tuple(parts)), values


TRUE = {
    ("lag", 0): 0.06,
    ("coulomb", 0): 0.006,
    ("lag", 1): 0.05,
    ("droop", 1): 4e-4,
    ("delay", 1): 0.03,
}


@pytest.fixture(scope="module")
def known():
    log, values = driven(TRUE)
    model = ServoModel(log)
    for _ in range(2):
        model.refreshed(values)
    return log, model, values


def test_cells_that_are_empty_are_no_command_and_no_reading(known):
    """A stale row is left out: the command before it holds on, and a motion without a reading begins at its command."""
    log, whole, values = known
    first, second = log.motions[:2]
    command, position = first.command.values.copy(), second.position.values.copy()
    command[40:43, 1], position[:, 0] = np.nan, np.nan
    motions = (
        replace(first, command=Channel(first.command.time, command)),
        replace(second, position=Channel(second.position.time, position)),
        *log.motions[2:],
    )
    model = ServoModel(replace(log, motions=motions))
    model.refreshed(values)
    assert np.isfinite(model.path(values)).all()
    assert len(model.all_residuals(values)[0]) == len(whole.all_residuals(values)[0]) - len(position)
    held = model.commanded[model.begins[0] : model.begins[1], 1]
    assert set(np.unique(held)) <= set(first.command.values[:, 1])


def test_derivatives_are_those_of_a_step_a_tenth_as_long(known, monkeypatch):
    _, model, values = known
    coarse = model.rows((1,), values)[0]
    monkeypatch.setattr("thermal_robot.motion.settings.DIFFERENCE", 0.005)
    monkeypatch.setattr("thermal_robot.motion.settings.COARSE", 0.05)
    fine = model.rows((1,), values)[0]
    for k, p in enumerate(fine.columns):
        if model.parameters[p].effect in ("zero", "lag", "delay", "droop", "gain"):
            far = np.linalg.norm(coarse.derivative[:, k] - fine.derivative[:, k])
            assert far < 0.1 * np.linalg.norm(fine.derivative[:, k]), model.parameters[p]


def test_a_secant_is_what_a_whole_expected_size_changes(known):
    """A gain of one size, 1 %, moves a joint without a load by a hundredth of how it goes, whatever the step."""
    _, model, values = known
    whole, part = (model.rows((0,), values, secant=one)[0] for one in (True, False))
    for k, p in enumerate(whole.columns):
        changed = values + np.where(np.arange(len(values)) == p, model.sizes, 0.0)
        left = model.residuals((0,), np.stack([values, changed]))[0]
        np.testing.assert_allclose(model.sizes[p] * whole.derivative[:, k], left[0] - left[1], atol=1e-12)
    gain = list(whole.columns).index(model.index("gain", 0))
    far = np.linalg.norm(whole.derivative[:, gain] - part.derivative[:, gain])
    assert far < 0.02 * np.linalg.norm(part.derivative[:, gain])


def test_no_step_leaves_a_bound_by_rounding():
    """Least squares with bounds end at -1e-21 for a bound of zero, and a limit below zero is no servo at all."""
    rng = np.random.default_rng(5)
    for _ in range(500):
        columns = rng.standard_normal((40, 12)) * 10.0 ** rng.uniform(-3.0, 3.0, 12)
        columns[:, 1] = 3.0 * columns[:, 0] + 1e-6 * columns[:, 1]
        target = columns @ rng.standard_normal(12) + rng.standard_normal(40)
        least = np.where(rng.random(12) < 0.7, 0.0, -np.inf)
        most = np.where(rng.random(12) < 0.3, 1e-3, np.inf)
        bounds = np.array([least, most])
        found, _ = _ahead((columns.T @ columns, columns.T @ target, np.full(12, 1e-6), bounds), np.zeros(12), 0.0)
        assert (found >= least).all()
        assert (found <= most).all()


def test_the_fit_returns_to_the_true_values(known):
    _, model, values = known
    found = fit(model, np.where(values > 0.0, 1.5 * values, 0.0), values != 0.0)
    np.testing.assert_allclose(found[values != 0.0], values[values != 0.0], rtol=0.03)
    left = [np.sqrt(np.mean(one**2)) for one in model.all_residuals(found)]
    assert max(left) < 2.0 * COUNT / np.sqrt(12.0)


def test_a_step_that_saturates_is_dated_though_a_little_delay_changes_nothing():
    """What a little of it does not show must not run away: a joint at its limit feels no early part of a command."""
    true = {("lag", 0): 0.15, ("coulomb", 0): 0.01, ("delay", 0): 0.035, ("torque_limit", 0): 5.0}
    log, values = driven(true, 3, 6.0, joints=("joint_1",), command=lambda u: 0.6 * np.sign(u.values))
    model, delay = ServoModel(log), ServoModel(log).index("delay", 0)
    model.refreshed(values)
    active = model.of_effects(("lag", "coulomb", "delay", "torque_limit", "zero", "stribeck", "gain"))
    early = np.where(np.arange(len(values)) == delay, 0.03, values)
    assert fit(model, early, active)[delay] == pytest.approx(0.035, rel=0.01)


def test_a_limit_that_most_of_a_motion_needs_is_found_and_no_soft_servo_for_it():
    log, _ = driven({("lag", 0): 0.06, ("coulomb", 0): 0.006, ("torque_limit", 0): 20.0}, 6, 6.0, joints=("joint_1",))
    model = ServoModel(log)
    allowed = ~model.of_effects(("dead_zone",))  # at its limit a servo with a dead zone is one with friction
    found = settled(searched(model, allowed, print), allowed, print).point.values
    assert found[model.index("torque_limit", 0)] == pytest.approx(20.0, rel=0.1)
    assert np.sqrt(np.mean(model.all_residuals(found)[0] ** 2)) < COUNT


@pytest.mark.parametrize(("lag", "delay"), [(0.05, 0.045), (0.05, 0.03), (0.1, 0.03)])
def test_steps_that_saturate_tell_limit_lag_and_delay_and_nothing_else(lag, delay):
    """A longer lag in the place of a delay is a local minimum of steps that saturate; a profile is another one."""
    true = {("lag", 0): lag, ("coulomb", 0): 0.001, ("delay", 0): delay, ("torque_limit", 0): 4.2}
    log, values = driven(true, 3, 6.0, joints=("joint_1",), command=lambda u: 0.6 * np.sign(u.values))
    model = ServoModel(log)
    allowed = ~model.of_effects(("dead_zone",))
    found = settled(searched(model, allowed, print), allowed, print)
    assert (found.active == (values != 0.0)).all()
    for name, value in (("lag", lag), ("delay", delay), ("torque_limit", 4.2)):
        assert found.point.values[model.index(name, 0)] == pytest.approx(value, rel=0.02), name
    assert found.point.noise[0] < COUNT / np.sqrt(12.0) * 1.1


def test_each_parameter_keeps_its_value_and_loses_information_by_its_ratio(known):
    _, model, values = known
    point = Point.at(model, values)
    ratio = ratios(point)
    assert (ratio >= 1.0).all()
    assert ratio.max() > 1.5  # rounded readings of a slow joint err together
    readings = worth(point, ratio)
    every = np.arange(len(ratio))
    gram = deflated(point, every, ratio, readings)
    white = deflated(point, every, np.ones(len(ratio)), readings)
    np.testing.assert_allclose(np.diag(gram.matrix) * ratio, np.diag(white.matrix), rtol=1e-9)
    found = np.linalg.lstsq(white.matrix, white.vector, rcond=1e-13)[0]
    near = 1e-3 * np.abs(gram.vector).max()
    np.testing.assert_allclose(gram.matrix @ found, gram.vector, atol=near)
    assert [one.label for one in model.parameters if one.joint == SHARED] == [
        "mass", "height in the root frame", "friction", "compliance"
    ]  # fmt: skip


def test_a_plane_is_felt_in_sets_that_have_it_and_in_no_other():
    """Its loads hold for the height at which they were taken; of a set without a plane nothing of them is left."""
    log = arms.log(*arms.tables(3, 8.0)).with_joints(arms.JOINTS[:3])
    model, none = ServoModel(log), np.zeros(len(ServoModel(log).parameters))
    before = model.all_residuals(none)
    values = none.copy()
    for joint in range(1, 3):
        values[model.index("droop", joint)] = 0.02
    values[model.index("contact")] = 0.05
    values[model.keys.index(("contact", "friction"))] = 0.3
    model.refreshed(values)
    for one, other in zip(before, model.all_residuals(none), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-12)
    rubbed = model.moved(values, np.array([model.index("contact"), model.keys.index(("contact", "friction"))]))
    assert (rubbed[0] > 1e-3).all()  # a swivelling joint is dragged, though nothing presses it
    assert 0.5 * rubbed[0, 0] < rubbed[1, 0] < 1.1 * rubbed[0, 0]


@pytest.mark.parametrize("stuck", [1, 2])
def test_a_joint_that_friction_holds_leaves_the_plane_to_the_others(stuck):
    """Together they hold the tool at the plane, less what it flexes, however much of it the springs would have done."""
    log = arms.log(*arms.tables(3, 8.0)).with_joints(arms.JOINTS[:3])
    model = ServoModel(log)
    values, plane = np.zeros(len(model.parameters)), 0.03
    flex = model.keys.index(("contact", "compliance"))
    for joint in range(1, 3):
        values[model.index("droop", joint)] = 0.005
    values[model.index("load_friction", stuck)] = 0.5
    values[model.index("contact")], values[flex] = plane, 1e-9

    def below(free):
        model.refreshed(values)
        return model.lowest + plane - model.ends.heights(model.path(values, free=free))

    free, held = below(True), below(False)
    deep = free > 5e-3
    assert deep.mean() > 0.05
    assert free[deep].mean() > 0.03
    assert held[deep].max() < 0.1 * free[deep].max()  # it may stay above, where friction holds it
    values[model.index("load_friction", stuck)] = 0.0
    rigid = below(False)[deep].mean()
    values[flex] = 2e-4
    assert below(False)[deep].mean() > rigid + 2e-3


def test_few_motions_are_cut_into_as_many_pieces_for_the_fit_as_for_faults():
    whole = arms.log(*arms.tables(9, 8.0, 3)).with_joints(("joint_1",))
    for count, independent in ((1, 8), (3, 9), (7, 14), (8, 8), (9, 9)):
        log = replace(whole, motions=whole.motions[:count])
        assert len(clusters(log)) == independent
        np.testing.assert_array_equal(np.unique(ServoModel(log).motion_of(0)), np.arange(independent))


def test_repeated_motions_bring_no_more_evidence_than_their_number_by_the_ratio(known):
    """Rows of one motion that err together count as one."""
    _, model, values = known
    point = Point.at(model, values)
    draw = np.random.default_rng(1)
    apart = {}
    for name in ("white", "together"):
        parts = []
        for joint in model.joints:
            rows = model.rows((joint,), values)[0]
            each = draw.normal(size=model.clusters)[rows.motion]
            left = each if name == "together" else draw.normal(size=len(rows.residual))
            parts.append(Part.of(replace(rows, residual=left), values, model.clusters))
        apart[name] = ratios(replace(point, rows=parts))
    seen = [model.index("zero", 0), model.index("gain", 0)]
    assert apart["white"][seen].max() < 5.0
    assert apart["together"][seen].min() > 20.0


def test_what_is_needed_lowers_the_loss_of_motions_held_out(known):
    _, model, values = known
    scales = Scales.of(Point.at(model, values))
    whole = scales.fitted(values != 0.0, values)
    for one in scales.others(whole, [(without(whole.active, b), (values,)) for b in whole.own]):
        assert one.left_out.sum() > 1.1 * whole.left_out.sum()
        assert one.log_evidence < whole.log_evidence - 3.0


def test_sets_near_one_weigh_as_if_they_stood_alone(known):
    """A joint whose parameters are no others is not fitted again, and one that is asked twice is fitted once."""
    _, model, values = known
    scales = Scales.of(Point.at(model, values))
    whole = scales.fitted(values != 0.0, values)
    lag, coulomb = model.index("lag", 1), model.index("coulomb", 0)
    sets = [without(whole.active, lag), without(without(whole.active, lag), coulomb)]
    near = scales.others(whole, [(one, (values,)) for one in sets])
    for active, one in zip(sets, near, strict=True):
        alone = scales.fitted(active, values)
        np.testing.assert_array_equal(one.active, active)
        np.testing.assert_allclose(one.point.values, alone.point.values, rtol=0.02, atol=1e-5)
        assert one.log_evidence == pytest.approx(alone.log_evidence, abs=0.5)
    again = scales.others(whole, [(sets[0], (values,))])[0]
    assert again.point.rows[1] is near[0].point.rows[1]
    assert again.point.rows[0] is whole.point.rows[0]


def test_what_else_is_linearised_changes_no_evidence(known):
    """Columns of parameters that a set does not have tell nothing of it."""
    _, model, values = known
    scales = Scales.of(Point.at(model, values))
    own = scales.fitted(values != 0.0, values)
    more = scales.linearised(own, np.ones(len(values), dtype=bool))
    assert more.log_evidence == pytest.approx(own.log_evidence, abs=1e-6)
    assert more.ahead(own.active).log_evidence == pytest.approx(own.ahead(own.active).log_evidence, abs=1e-6)


def test_two_motions_that_differ_tell_their_mean_no_better_than_they_differ():
    """Of two, one degree of freedom: the ± of their mean is beyond the difference, and that of four alike far below."""
    lags = (0.05, 0.062)
    logs = [driven({("lag", 0): lag, ("coulomb", 0): 0.006}, 4, joints=("joint_1",))[0] for lag in lags]
    found = {}
    for name, motions in (("apart", (logs[0].motions[0], logs[1].motions[1])), ("alike", logs[0].motions)):
        model = ServoModel(replace(logs[0], motions=motions))
        active = np.array([one.effect in ("lag", "coulomb") for one in model.parameters])
        scales = Scales.of(Point.at(model, np.where(active, model.start(), 0.0)))
        found[name] = scales.fitted(active, model.start()).deviations[model.index("lag", 0)]
    assert lags[1] - lags[0] < found["apart"] < 10.0 * (lags[1] - lags[0])
    assert found["alike"] < 0.2 * (lags[1] - lags[0])


def test_an_end_stop_alone_has_a_standard_deviation():
    """Nothing beside it is taken as smooth, so that the jackknife has no parameters."""
    model = ServoModel(driven({("high_stop", 0): 0.1}, 4, joints=("joint_1",))[0])
    stop = model.index("high_stop", 0)
    scales = Scales.of(Point.at(model, model.start()))
    found = scales.fitted(np.arange(len(model.parameters)) == stop, model.start())
    assert 0.0 < found.deviations[stop] < 0.01
    assert np.isnan(np.delete(found.deviations, stop)).all()


def smooth(world):
    """A world without commands that jump, at which servos saturate."""
    commands = np.stack([one for one, kind in zip(world.commands, world.kinds, strict=True) if kind != "steps"])
    return replace(world, commands=commands, kinds=tuple(kind for kind in world.kinds if kind != "steps"))


@pytest.mark.parametrize("joints", [1, 4])
def test_an_arm_that_moves_fast_is_simulated_as_mujoco_does_by_runge_kutta(joints):
    """Inertial, Coriolis and gravity torques couple the joints; what remains is the encoder's count."""
    world = draw_world(np.random.default_rng(11), joints, 5)
    world = smooth(replace(world, step=2e-4, explicit=True))
    model = ServoModel(world.log(world.simulated(Fault("nothing"))))
    none = np.zeros(len(model.parameters))
    model.refreshed(none)
    moved = np.ptp(model.measured, axis=0).max()
    left = max(float(np.sqrt(np.mean(one**2))) for one in model.all_residuals(none))
    assert left < world.count < 1e-3 * moved


@pytest.mark.parametrize("step", [1e-3, 2e-3])
def test_time_steps_of_semi_implicit_euler_are_told_by_the_error_they_make(step):
    world = smooth(replace(draw_world(np.random.default_rng(12), 3, 5), step=step, explicit=False))
    model = ServoModel(world.log(world.simulated(Fault("nothing"))))
    own = np.array([one.effect == "step" for one in model.parameters])
    model.refreshed(np.where(own, step, 0.0))
    found = fit(model, np.zeros(len(own)), own)
    assert found[own][0] == pytest.approx(step, rel=0.1)
    none = np.zeros(len(own))
    before, after = (sum((one**2).mean() for one in model.all_residuals(x)) for x in (none, found))
    rounding = 3 * world.count**2 / 12.0
    assert after - rounding < 0.1 * (before - rounding)


def test_friction_of_a_simulator_that_creeps_is_told_with_its_size():
    """MuJoCo's friction holds a joint but for a tenth of what pulls at it; a width in rad is the torque over kp."""
    world = smooth(replace(draw_world(np.random.default_rng(13), 3, 10), step=2e-4, explicit=False, sticks=False))
    kp = world.arm.servos["joint_2"].kp
    log = world.log(world.simulated(Fault("coulomb", 1, 0.004 * kp)))
    model = ServoModel(log)
    own = np.array([one.effect == "creep" or (one.effect, one.joint) == ("coulomb", 1) for one in model.parameters])
    model.refreshed(np.zeros(len(own)))
    found = fit(model, np.where(own, model.start(), 0.0), own)
    assert found[model.index("coulomb", 1)] == pytest.approx(0.004, rel=0.05)
    assert 0.05 < found[model.index("creep")] < 0.2
    stuck = fit(model, np.where(own, model.start(), 0.0), own & (np.arange(len(own)) != model.index("creep")))
    left = [float((model.all_residuals(one)[1] ** 2).sum()) for one in (stuck, found)]
    assert left[1] < 0.5 * left[0]


def short(name, joint=0, size=0.0, seed=5):
    """A short log of a world of three joints with a fault."""
    world = draw_world(np.random.default_rng(seed), 3, 9)
    world = replace(world, commands=world.commands[:, :300])
    return world.log(world.simulated(Fault(name, joint, size)))


def test_what_evidence_or_motions_held_out_make_as_likely_could_replace_a_parameter():
    """Of sets with another parameter in the place of the first: nine to one are 2.2 nats, of held-out losses by motion
    (9, 9, 8, 10) is above its standard error and (9, −9, 9, −8) is not."""

    def weighed(place, evidence, *losses):
        active = np.isin(np.arange(5), [place, 4])
        likely = evidence - np.log(9.0)
        return SimpleNamespace(active=active, log_evidence=evidence, likely_from=likely, losses=np.array(losses))

    rivals = (weighed(1, -1.0, 9, 9, 8, 10), weighed(2, -9.0, 9, -9, 9, -8), weighed(3, -9.0, 9, 9, 8, 10))
    assert Choice(weighed(0, 0.0, 0, 0, 0, 0), rivals).alternatives(0) == [1, 2]
    assert Choice(weighed(0, 0.0, 0, 0, 0, 0), rivals).alternatives(4) == []


def test_a_set_that_motions_held_out_refused_weighs_no_more_than_the_choice():
    own, refused, other = (SimpleNamespace(log_evidence=one) for one in (0.0, 7.0, -np.log(3.0)))
    assert [weight for _, weight in Choice(own, (refused, other)).weights] == pytest.approx([3 / 7, 3 / 7, 1 / 7])


def test_what_does_the_same_beside_the_rest_has_a_partial_correlation_of_one():
    """Column 2 is half of column 0 and a share of 1, which adapts itself; column 3 is neither's."""
    rng = np.random.default_rng(11)
    columns = rng.standard_normal((200, 4))
    columns[:, 2] = 0.5 * columns[:, 0] + 3.0 * columns[:, 1]
    model = SimpleNamespace(sizes=np.full(4, 1e3))
    point = SimpleNamespace(whole=(columns.T @ columns, None), model=model, values=np.array([0.2, 1.0, 0.0, 0.0]))
    own = Weighed(None, np.array([True, True, False, False]), point)
    square, values = own.instead(0, np.array([2, 3]))
    assert square[0] == pytest.approx(1.0, abs=1e-6)
    assert values[0] == pytest.approx(0.4, rel=1e-5)
    assert square[1] < 0.1


@pytest.mark.slow
def test_what_is_asked_of_a_choice_changes_no_probability():
    """Of a short log, in which a dead zone does what friction does, and nobody asked for it."""
    model = ServoModel(short("coulomb", size=0.05))
    names = np.array([one.effect for one in model.parameters])
    allowed = names != "dead_zone"
    choice = settled(searched(model, allowed, print), allowed, print)
    told = [choice.probability(p) for p in range(len(names))]
    own = np.flatnonzero(choice.active).tolist()
    rivals = {names[k] for p in own for k in choice.alternatives(p)}
    assert "coulomb" in names[own]
    for p in own:
        assert choice.own.log_evidence > choice.fewer(p).log_evidence + np.log(9.0)
    assert [choice.probability(p) for p in range(len(names))] == told
    assert "dead_zone" not in rivals


def test_the_gate_refuses_the_worst_kind_alone_and_leaves_more_than_so_many_motions():
    """Of what a fit leaves in five kinds, by motion: 0.9 to 1.1 are usual, 5 and 9 are not."""
    left = {"slow": 1.0, "fast": 1.1, "wide": 0.9, "chirp": 5.0, "steps": 9.0}
    motions = [SimpleNamespace(name=f"{kind} {k}", kind=kind) for kind in left for k in range(3)]
    index = np.repeat(np.arange(len(motions)), 50)
    one = SimpleNamespace(residual=np.repeat(list(left.values()), 150), motion=index)
    model = SimpleNamespace(log=SimpleNamespace(motions=motions))
    point = SimpleNamespace(model=model, rows=[one], noise=np.array([2.0]))
    refused = _gate(point, 11)
    assert list(refused) == ["steps"]
    assert refused["steps"] > 3.0
    assert _gate(point, 12) == {}


def test_a_joint_that_one_kind_alone_moves_gets_no_motion_refused():
    """In a gripper that other motions hardly move it leaves four times as much, and in five joints what they leave."""
    motions = [SimpleNamespace(name=f"{kind} {k}", kind=kind) for kind in "abcd" for k in range(3)]
    index = np.repeat(np.arange(12), 50)
    arm = [SimpleNamespace(residual=np.ones(600), motion=index) for _ in range(5)]
    gripper = SimpleNamespace(residual=np.repeat([1.0, 1.0, 1.0, 4.0], 150), motion=index)
    model = SimpleNamespace(log=SimpleNamespace(motions=motions))
    point = SimpleNamespace(model=model, rows=[*arm, gripper], noise=np.ones(6))
    assert _gate(point, 1) == {}
    assert list(_gate(SimpleNamespace(model=model, rows=[gripper], noise=np.ones(1)), 1)) == ["d"]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "joint", "size"), [("nothing", -1, 0.0), ("delay", -1, 0.04), ("zero", 1, 0.02),
                                                     ("coulomb", 0, 0.05)])  # fmt: skip
def test_what_is_told_is_as_probable_as_anything_that_was_weighed(name, joint, size):
    """Rivals of a fit that were weighed on a line through it had all the probability, and what was told none."""
    found = diagnose_motion(short(name, joint, size))
    assert found.probability > 0.05
    for one in found.effects:
        if one.status == "confounded":
            assert one.probability < 0.9
            assert one.confounded_with


@pytest.mark.slow
def test_diagnosis_names_what_was_put_in_and_little_else():
    log, _ = driven(TRUE)
    found = diagnose_motion(log)
    assert found.held_out.shrinkage > 0.99
    told = {}
    for one in (found.finding(name) for name in found.verdict):
        for row in one.parameters:
            for effect in (one.name, *one.confounded_with):  # without inertia a dead zone is Coulomb friction
                told[effect, row.name.rpartition(", ")[2]] = row
    assert len(found.values) == len(TRUE)
    for (effect, joint), value in TRUE.items():
        row = told[effect, log.joints[joint]]
        assert abs(row.value - value) < 4.0 * row.std + 0.05 * value, (effect, joint)


@pytest.mark.slow
def test_a_plane_that_saturates_servos_is_told_at_its_height_in_the_root_frame():
    """A plane presses no harder than servos push; from the lowest command it would be told 0.1 m lower."""
    world = draw_world(np.random.default_rng(5), 2, 9)
    height = float(np.quantile(world.simulated(Fault("nothing")).height, 0.1))
    log = world.log(world.simulated(Fault("table", -1, height)))
    found = diagnose_motion(replace(log, motions=log.motions[1::2]), only=("contact",))
    (told,) = found.finding("contact").parameters
    assert told.value == pytest.approx(height, abs=5e-3)
    assert max(gap.after for gap in found.joints.values()) < 0.1
