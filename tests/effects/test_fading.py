"""Functions of the joints' positions beyond where they were found: all fall back together, and nothing grows."""

import numpy as np
import pytest
from helpers import commanded

from thermal_robot.effects import gate
from thermal_robot.effects.apply import displacement
from thermal_robot.effects.drift import Drift
from thermal_robot.effects.joint_gain import JointGain
from thermal_robot.effects.joint_ripple import JointRipple
from thermal_robot.effects.transmission_error import TransmissionError
from thermal_robot.observations import observe

JOINT = 1
EFFECTS = {
    "joint_gain": JointGain(places=("joint_2",)),
    "transmission_error": TransmissionError(places=("joint_2",)),
    "joint_ripple": JointRipple(joints=("joint_2",), orders=(7.3,)),
}


def at(robot, positions):
    """Rows that differ in one joint."""
    rows = commanded(robot)
    q = np.zeros((len(positions), robot.n))
    q[:, JOINT] = positions
    return observe(type(rows)(name="rows", robot=robot, q=q))


def moved(robot, effects, positions):
    return displacement(at(robot, positions), effects)[0].joint[:, JOINT]


def fitted(robot, effect, positions, scale=1.0):
    """The effect as a model holds it that was found at these positions, with some values."""
    seen = at(robot, positions)
    count = len(gate.checked(effect, seen))
    return gate.delivered(effect, seen), scale * 1e-3 * np.cos(1.0 + np.arange(count))


@pytest.mark.parametrize("name", EFFECTS)
def test_inside_its_range_a_model_does_what_was_fitted(rv_m2, name):
    positions = np.linspace(-0.3, 0.8, 30)
    effect, values = fitted(rv_m2, EFFECTS[name], positions)
    np.testing.assert_allclose(
        moved(rv_m2, [(effect, values)], positions),
        moved(rv_m2, [(EFFECTS[name], values)], positions),
        rtol=0,
        atol=1e-17,
    )
    assert gate.elsewhere(effect, at(rv_m2, positions)) == EFFECTS[name]


@pytest.mark.parametrize("name", EFFECTS)
def test_beyond_it_falls_back_to_its_mean_and_never_does_more_than_at_the_edge(rv_m2, name):
    positions = np.linspace(-0.3, 0.8, 30)
    effect, values = fitted(rv_m2, EFFECTS[name], positions)
    inside = moved(rv_m2, [(effect, values)], positions)
    for edge, way in ((-0.3, -1.0), (0.8, 1.0)):
        beyond = moved(rv_m2, [(effect, values)], edge + way * np.array([0.0, 1e-9, 0.1, 0.3, 0.6, 1.2, 2.5]))
        off = np.abs(beyond - inside.mean())
        assert off[1] == pytest.approx(off[0], rel=1e-6)
        assert (np.diff(off) <= 1e-18).all()
        assert off[0] > 0.0
        assert off[-1] < 1e-6 * off[0]


def test_what_cancels_where_it_was_found_cancels_beyond(rv_m2):
    """A gain and a slow wave that are nearly opposite over a short range: their sum stays what it was, or less."""
    positions = np.linspace(0.2, 0.6, 40)
    seen = at(rv_m2, positions)
    waves = TransmissionError(places=("joint_2",))
    columns = np.column_stack([wave(k * positions) for k in (1, 2) for wave in (np.sin, np.cos)])
    opposite = np.linalg.lstsq(columns, -positions, rcond=None)[0]
    held = [(JointGain(places=("joint_2",)), np.array([1.0])), (waves, opposite)]
    inside = moved(rv_m2, held, positions)
    assert np.abs(inside).max() < 1e-3
    delivered = [(gate.delivered(effect, seen), values) for effect, values in held]
    far = np.linspace(-1.5, 2.0, 200)
    assert np.abs(moved(rv_m2, held, far)).max() > 0.05
    assert np.abs(moved(rv_m2, delivered, far)).max() <= np.abs(inside).max() * 1.001


def test_a_wave_that_was_seen_in_all_of_a_turn_is_known_in_the_next(awkward):
    turning = next(j for j, kind in enumerate(awkward.joint_types) if kind == "continuous")
    joint, rows = awkward.joint_names[turning], np.linspace(0.0, 2.0 * np.pi, 50)

    def there(positions):
        q = np.zeros((len(positions), awkward.n))
        q[:, turning] = positions
        return observe(type(commanded(awkward))(name="rows", robot=awkward, q=q))

    for effect, known in ((TransmissionError(places=(joint,)), True), (JointRipple((joint,), (7.3,)), False)):
        values = np.full(len(gate.checked(effect, there(rows))), 1e-4)
        delivered = gate.delivered(effect, there(rows))
        beyond = there(rows + 4.0)
        same = [displacement(beyond, [(e, values)])[0].joint[:, turning] for e in (effect, delivered)]
        assert (np.abs(same[0] - same[1]).max() < 1e-15) == known


def test_a_gain_of_what_slides_goes_on(awkward):
    slide = next(j for j, kind in enumerate(awkward.joint_types) if kind == "prismatic")
    q = np.zeros((20, awkward.n))
    q[:, slide] = np.linspace(0.0, 0.1, 20)
    seen, far = (observe(type(commanded(awkward))(name="rows", robot=awkward, q=k * q)) for k in (1.0, 4.0))
    gain = JointGain(places=(awkward.joint_names[slide],))
    delivered = gate.delivered(gain, seen)
    found = displacement(far, [(delivered, np.array([1e-3]))])[0].joint[:, slide]
    np.testing.assert_allclose(found, 1e-3 * far.q[:, slide], rtol=1e-12)


def test_a_drift_stays_where_it_was_at_the_end(rv_m2):
    def clocked(time):
        rows = commanded(rv_m2)
        return observe(
            type(rows)(name="rows", robot=rv_m2, q=np.zeros((len(time), rv_m2.n)), covariates={"time": time})
        )

    drift = Drift(origin=0.0, span=100.0)
    delivered = gate.delivered(drift, clocked(np.linspace(0.0, 100.0, 20)))
    values = np.array([1e-3, 0.0, 0.0, 0.0, 0.0, 0.0])
    found = displacement(clocked(np.array([-50.0, 0.0, 50.0, 100.0, 1e5])), [(delivered, values)])[0].base[:, 0]
    np.testing.assert_allclose(found, [0.0, 0.0, 5e-4, 1e-3, 1e-3], atol=1e-15)
    on = displacement(clocked(np.array([200.0])), [(gate.unfaded(delivered), values)])[0].base[:, 0]
    np.testing.assert_allclose(on, 2e-3)
