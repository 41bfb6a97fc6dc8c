"""Laws of the joints: where each effect puts a joint, and how functions of a joint's position end."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import commanded, tool_at, tool_with

from thermal_robot.effects import (
    Backlash,
    Drift,
    JointCompliance,
    JointGain,
    JointOffset,
    JointRipple,
    TrackingLag,
    TransmissionError,
    gate,
)
from thermal_robot.effects.apply import displacement
from thermal_robot.effects.arguments import with_arguments
from thermal_robot.observations import observe
from thermal_robot.schema import MisfitError


def moving(arm):
    """Commands with all that is recorded of joints; the third never moves, of the first no acceleration is read."""
    rng = np.random.default_rng(1)
    columns = {}
    for name in ("approach", "velocity", "acceleration", "torque"):
        drawn = rng.choice([-1.0, 0.0, 1.0], (10, arm.n)) if name == "approach" else rng.normal(size=(10, arm.n))
        columns |= {f"{name}.{joint}": values for joint, values in zip(arm.joint_names, drawn.T, strict=True)}
    columns[f"velocity.{arm.joint_names[2]}"] = np.zeros(10)
    del columns[f"acceleration.{arm.joint_names[0]}"]
    return commanded(arm, columns, gears={arm.joint_names[1]: 101.0})


EFFECTS = {
    "joint_offset": JointOffset(),
    "joint_gain": JointGain(),
    "transmission_error": TransmissionError(),
    "joint_ripple": JointRipple().having("{0}", 12.0, 1.0).having("{1}", 26.5, 1.0),
    "backlash": Backlash(),
    "joint_compliance": JointCompliance(),
    "tracking_lag": TrackingLag(),
}


def shift(label, q, read):
    """(N,) by how much one unit of a parameter moves a joint."""
    wave, _, order = label.partition(", order ")
    if order:
        return (np.sin if wave == "sine" else np.cos)(float(order.split()[0]) * q)
    return {
        "zero offset": lambda: np.ones_like(q),
        "gain error": lambda: q,
        "lost motion": lambda: -0.5 * read("approach"),
        "compliance": lambda: -read("torque"),
        "delay": lambda: -read("velocity"),
        "friction": lambda: -np.sign(read("velocity")),
        "effect of acceleration": lambda: read("acceleration"),
    }[label]()


@pytest.mark.parametrize("arm", ["rv_m2", "ur10", "panda", "awkward"], indirect=True)
@pytest.mark.parametrize("name", EFFECTS)
def test_a_joint_stands_where_its_law_puts_it_and_is_drawn_against_what_drives_it(arm, name):
    campaign = moving(arm)
    names, kinds, seen = arm.joint_names, dict(zip(arm.joint_names, arm.joint_types, strict=True)), observe(campaign)
    effect = gate.variants(EFFECTS[name], seen)[0]
    if name == "joint_ripple":
        effect = replace(effect, joints=names[:2])
    parameters = gate.checked(effect, seen)
    values = np.array([p.size for p in parameters]) * (1.0 + np.arange(len(parameters)) / 7.0)
    q = campaign.q.copy()
    for parameter, value in zip(parameters, values, strict=True):
        place, j = parameter.place, names.index(parameter.place)
        moved = shift(
            parameter.label, campaign.q[:, j], lambda column, j=j: campaign.covariates[f"{column}.{names[j]}"]
        )
        q[:, j] += value * moved
        length = kinds[place] == "prismatic"
        own = "m" if length else "rad"
        drawn = {
            "backlash": (f"approach.{place}", "", lambda place=place: campaign.covariates[f"approach.{place}"]),
            "tracking_lag": (
                f"velocity.{place}",
                f"{own}/s",
                lambda place=place: campaign.covariates[f"velocity.{place}"],
            ),
            "joint_compliance": (f"torque of {place}", "N" if length else "N·m", lambda moved=moved: -moved),
        }.get(name, (f"position of {place}", own, lambda j=j: campaign.q[:, j]))
        told = gate.driver(effect, seen, [parameter], moved)
        assert told[:2] == drawn[:2]
        np.testing.assert_array_equal(told[2], drawn[2]())
        units = {"gain error": "1", "delay": "s", "effect of acceleration": "s²"}
        units["compliance"] = "m/N" if length else "rad/(N·m)"
        assert parameter.unit == units.get(parameter.label, own)
        assert parameter.size == {"zero offset": 5e-4 if length else 1e-3}.get(parameter.label, parameter.size)
    np.testing.assert_allclose(tool_with(campaign, effect, values), tool_at(arm, q), atol=1e-14)


def test_joints_that_stood_still_have_no_lag_and_a_model_does_not_forget_the_others(rv_m2):
    campaign = moving(rv_m2)
    effect = TrackingLag().variants(observe(campaign))[0]
    parameters = effect.parameters(observe(campaign))
    assert {p.place for p in parameters} == set(rv_m2.joint_names) - {"joint_3"}
    assert [p.label for p in parameters if p.place == "joint_1"] == ["delay", "friction"]
    still = replace(campaign, covariates={name: 0.0 * v for name, v in campaign.covariates.items()})
    values = np.ones(len(parameters))
    np.testing.assert_allclose(tool_with(still, effect, values), tool_at(rv_m2, campaign.q), atol=1e-14)


def orders(effect, here, joint="joint_3"):
    found = {p.label.split()[-1] for p in gate.checked(effect, here) if p.place == joint}
    return tuple(sorted(int(order) for order in found))


def test_wheels_of_either_side_and_single_orders_are_settings(rv_m2, awkward):
    """Without a stated ratio there is one side; each setting has just the orders of its wheels."""
    plain, geared = (observe(commanded(rv_m2, gears=gears)) for gears in ({}, {"joint_3": 50.0}))
    assert {orders(e, plain) for e in TransmissionError().variants(plain)} == {(1, 2), (1,), (2,)}
    both = [(1, 2, 50, 100), (1, 2), (50, 100), (1,), (2,), (50,), (100,)]
    assert [orders(e, geared) for e in TransmissionError().variants(geared)] == both
    whole, one = (gate.checked(e, geared) for e in (TransmissionError(), TransmissionError(places=("joint_3",))))
    assert [p.name for p in one] == [p.name for p in whole if p.place == "joint_3"]
    slide = next(n for n, kind in zip(awkward.joint_names, awkward.joint_types, strict=True) if kind == "prismatic")
    found = [orders(TransmissionError(), observe(commanded(awkward, gears=g)), slide) for g in ({}, {slide: 400.0})]
    assert found == [(), (400, 800)]  # a slide has a period only behind a gear


def test_a_ripple_begins_without_waves_gains_one_at_a_time_and_names_the_motors(rv_m2):
    # a ripple begins without waves and gains one at a time
    seen, none = observe(commanded(rv_m2)), JointRipple()
    assert gate.checked(none, seen) == ()
    assert none.share < 1e-100  # nothing that could be at work
    two = none.having("joint_2", 26.5, 1000.0).having("joint_3", 17.2, 500.0)
    assert [p.place for p in gate.checked(two, seen)] == ["joint_2", "joint_2", "joint_3", "joint_3"]
    # either wave was one of so many, and both are chosen for themselves
    assert two.share == pytest.approx(1.0 / 500_000.0)
    assert gate.alone(two, seen) == ()
    for order in range(20, 45):
        none = none.having("joint_2", float(order), 150.0)
    assert none.tried > 1e50
    assert with_arguments(JointRipple, {**vars(none), "joints": list(none.joints)}, "") == none
    with pytest.raises(MisfitError, match="from 1 on"):
        with_arguments(JointRipple, {"tried": np.inf}, "")
    # an order of the motor is called so
    seen = observe(commanded(rv_m2, gears={"joint_2": 50.0, "joint_3": 80.0}))
    ripple = JointRipple().having("joint_2", 100.08, 1.0).having("joint_2", 24.9, 1.0).having("joint_3", 100.0, 1.0)
    assert [p.label for p in gate.checked(ripple, seen)][::2] == [
        "sine, order 100.08 (2 a turn of the motor)",
        "sine, order 24.9 (1/2 a turn of the motor)",
        "sine, order 100",
    ]


RANGE = np.linspace(-0.3, 0.8, 30)
ENDING = {
    "joint_gain": JointGain(places=("joint_2",)),
    "transmission_error": TransmissionError(places=("joint_2",)),
    "joint_ripple": JointRipple(joints=("joint_2",), orders=(7.3,)),
}


def at(robot, joint, positions):
    """Rows that differ in one joint."""
    q = np.zeros((len(positions), robot.n))
    q[:, joint] = positions
    return observe(type(commanded(robot))(name="rows", robot=robot, q=q))


def moved(robot, joint, effects, positions):
    return displacement(at(robot, joint, positions), effects)[0].joint[:, joint]


@pytest.mark.parametrize("name", ENDING)
def test_a_function_of_position_falls_back_to_its_mean_beyond_its_range(rv_m2, name):
    plain, seen = ENDING[name], at(rv_m2, 1, RANGE)
    effect = gate.delivered(plain, seen)
    values = 1e-3 * np.cos(1.0 + np.arange(len(gate.checked(plain, seen))))
    inside = moved(rv_m2, 1, [(effect, values)], RANGE)
    np.testing.assert_allclose(inside, moved(rv_m2, 1, [(plain, values)], RANGE), rtol=0, atol=1e-17)
    assert gate.elsewhere(effect, seen) == plain
    for edge, way in ((-0.3, -1.0), (0.8, 1.0)):
        beyond = edge + way * np.array([0.0, 1e-9, 0.1, 0.3, 0.6, 1.2, 2.5])
        off = np.abs(moved(rv_m2, 1, [(effect, values)], beyond) - inside.mean())
        assert off[1] == pytest.approx(off[0], rel=1e-6)
        assert (np.diff(off) <= 1e-18).all()
        assert off[-1] < 1e-6 * off[0] != 0.0


def test_what_cancels_where_it_was_found_cancels_beyond(rv_m2):
    """A gain and a slow wave that are nearly opposite over a short range: their sum stays what it was, or less."""
    positions, far = np.linspace(0.2, 0.6, 40), np.linspace(-1.5, 2.0, 200)
    columns = np.column_stack([wave(k * positions) for k in (1, 2) for wave in (np.sin, np.cos)])
    opposite = np.linalg.lstsq(columns, -positions, rcond=None)[0]
    held = [(ENDING["joint_gain"], np.array([1.0])), (ENDING["transmission_error"], opposite)]
    inside = np.abs(moved(rv_m2, 1, held, positions)).max()
    delivered = [(gate.delivered(effect, at(rv_m2, 1, positions)), values) for effect, values in held]
    assert inside < 1e-3
    assert np.abs(moved(rv_m2, 1, held, far)).max() > 0.05
    assert np.abs(moved(rv_m2, 1, delivered, far)).max() <= inside * 1.001


@pytest.mark.parametrize(
    ("kind", "effect", "reach", "known"),
    [
        ("continuous", lambda joint: TransmissionError(places=(joint,)), 2.0 * np.pi, True),
        ("continuous", lambda joint: JointRipple((joint,), (7.3,)), 2.0 * np.pi, False),
        ("prismatic", lambda joint: JointGain(places=(joint,)), 0.1, True),
    ],
)
def test_what_a_whole_turn_or_a_slide_has_shown_goes_on(awkward, kind, effect, reach, known):
    joint = awkward.joint_types.index(kind)
    effect, rows = effect(awkward.joint_names[joint]), np.linspace(0.0, reach, 50)
    delivered = gate.delivered(effect, at(awkward, joint, rows))
    values = np.full(len(gate.checked(effect, at(awkward, joint, rows))), 1e-4)
    same = [moved(awkward, joint, [(e, values)], rows + 4.0) for e in (effect, delivered)]
    assert (np.abs(same[0] - same[1]).max() < 1e-15) == known


@pytest.mark.parametrize("clock", ["time", "order"])
@pytest.mark.parametrize("share", [0.0, 0.1, 0.6])
def test_drift_begins_at_zero_and_reaches_its_parameters_at_the_end(rv_m2, clock, share):
    values = np.sort(np.random.default_rng(7).uniform(100.0, 900.0, 10))
    seen = observe(commanded(rv_m2, {clock: values}))
    settings = {s.time_constant: s for s in Drift().variants(seen)}
    effect = replace(settings[0.1], time_constant=share)
    whole = np.array([2e-4, -1e-4, 3e-4, 1e-4, 2e-4, -3e-4])

    def grown(clock):
        elapsed = (clock - values[0]) / (values[-1] - values[0])
        grown = elapsed if share == 0 else (1 - np.exp(-elapsed / share)) / (1 - np.exp(-1 / share))
        return grown[:, None] * whole

    base = displacement(seen, [(effect, whole)])[0].base
    np.testing.assert_allclose(base, grown(values), atol=1e-17)
    assert (base[0] == 0.0).all()
    assert gate.driver(effect, seen, gate.checked(effect, seen), np.zeros(10))[:2] == (clock, "s" * (clock == "time"))
    # in another campaign it begins with that one, at the same rate; a model holds it at what it was in the end
    later = observe(commanded(rv_m2, {clock: values + 9e4}))
    np.testing.assert_allclose(displacement(later, [(gate.elsewhere(effect, later), whole)])[0].base, base, atol=1e-13)
    held = gate.delivered(effect, seen)
    beyond = np.linspace(values[0] - 1e2, 2e3, 10)
    ending = observe(commanded(rv_m2, {clock: beyond}))
    bound = displacement(ending, [(held, whole)])[0].base[[0, -1]]
    np.testing.assert_allclose(bound, [np.zeros(6), whole], atol=1e-17)
    on = displacement(ending, [(gate.unfaded(held), whole)])[0].base
    np.testing.assert_allclose(on, grown(beyond), rtol=1e-12)


def test_drift_turns_the_whole_robot_about_its_base(rv_m2):
    campaign = commanded(rv_m2, {"time": np.arange(10.0)})
    turned = tool_with(campaign, Drift().variants(observe(campaign))[0], [0, 0, 0, 0, 0, 0.1])
    angle = 0.1 * np.linspace(0, 1, 10)
    x, y, z = tool_at(rv_m2, campaign.q).T
    expected = np.stack([x * np.cos(angle) - y * np.sin(angle), x * np.sin(angle) + y * np.cos(angle), z], axis=1)
    np.testing.assert_allclose(turned, expected, atol=1e-14)


def test_near_a_straight_drift_lie_slow_exponentials_and_near_one_of_these_others():
    assert [s.time_constant for s in Drift().nearby(1.6)] == [0.0, 1.0, 2.0]
    assert [s.time_constant for s in Drift(time_constant=0.25).nearby(2.0)] == [0.25, 0.5, 0.125]
