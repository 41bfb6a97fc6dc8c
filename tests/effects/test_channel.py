"""The one map from a channel to the target, against finite differences of the displaced chain."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import SAMPLES, commanded

from thermal_robot.effects import Parameter, at_base, at_instrument, at_joint, at_segment, at_tool
from thermal_robot.effects.apply import by_place, column, sensitivity
from thermal_robot.kinematics import Displacement, exp6, log3
from thermal_robot.observations import Frames, observe

FRAMES = Frames(exp6([1.0, -2.0, 0.5, 0.4, 1.0, -0.3]), exp6([0.1, 0.02, 0.05, 0.3, 0.1, 0]))
STEP = 1e-5


def moved(observations, displacement):
    """Twist of the target over the step, root frame axes."""
    ahead, behind = (
        observe(observations.campaign, FRAMES, displacement=Displacement(**{displacement[0]: s * displacement[1]}))
        for s in (STEP, -STEP)
    )
    turn = log3(ahead.rotation @ behind.rotation.transpose(0, 2, 1))
    return np.hstack([ahead.position - behind.position, turn]) / (2.0 * STEP)


def unit_of(observations, channel, index, k):
    """What is displaced by one unit of a component."""
    arm = observations.robot
    if channel == "joint":
        return channel, np.eye(arm.n)[index]
    twist = np.eye(6)[k]
    if channel == "segment":
        whole = np.zeros((len(arm.segments), 6))
        whole[index] = twist
        return channel, whole
    return channel, twist


@pytest.mark.parametrize("arm", ["rv_m2", "ur10", "awkward"], indirect=True)
def test_a_channel_moves_the_target_as_the_displaced_chain_does(arm):
    observations = observe(commanded(arm), FRAMES)
    places = [("joint", j, 1) for j in range(arm.n)]
    places += [("segment", s, 6) for s in range(len(arm.segments))]
    places += [("base", 0, 6), ("tool", 0, 6)]
    for channel, index, components in places:
        found = sensitivity(observations, channel, index)
        assert found.shape == (SAMPLES, 6, components)
        for k in range(components):
            expected = moved(observations, unit_of(observations, channel, index, k))
            np.testing.assert_allclose(found[:, :, k], expected, atol=1e-8, err_msg=f"{channel} {index}, {k}")


def test_what_the_instrument_adds_points_in_the_measurement_frame_and_turns_nothing(rv_m2):
    campaign = replace(commanded(rv_m2), position=np.zeros((SAMPLES, 3)))
    shift = np.array([1e-3, -2e-3, 5e-4])
    found = sensitivity(observe(campaign, FRAMES), "instrument", 0) @ shift
    gap, more = (observe(campaign, FRAMES, instrument=i).gap for i in (None, np.tile(shift, (SAMPLES, 1))))
    np.testing.assert_allclose(found[:, :3], gap - more, atol=1e-15)
    np.testing.assert_array_equal(found[:, 3:], 0.0)


def test_a_column_is_the_sum_of_its_components(awkward):
    observations = observe(commanded(awkward), FRAMES)
    rng = np.random.default_rng(1)
    samples, segment = rng.normal(size=(SAMPLES, 6)), len(awkward.segments) - 1
    responses = [
        at_joint(1, rng.normal(size=SAMPLES)),
        at_joint(2, 0.7),
        at_segment(segment, samples),
        at_segment(0, np.array([0.0, 2.0, 0.0, 0.0, -1.0, 0.0])),
        at_base(samples),
        at_tool(samples[0]),
        at_instrument(samples[:, :3]),
    ]
    for response in responses:
        whole = sensitivity(observations, response.channel, response.index)
        values = response.values[..., None] if response.channel == "joint" else response.values
        each = np.broadcast_to(values, (SAMPLES, whole.shape[2]))
        expected = sum(whole[:, :, k] * each[:, k, None] for k in range(whole.shape[2]))
        for measures in (3, 6):
            np.testing.assert_allclose(column(observations, response, measures), expected[:, :measures], atol=1e-14)


def test_a_parameter_of_all_links_is_shared_out_and_one_with_a_place_is_not(rv_m2):
    own = Parameter("bent", "rad", 1e-3, "link", "hand", (at_segment(1, np.ones(6)),))
    assert by_place(rv_m2, own) == (own,)
    responses = tuple(at_segment(s, np.eye(6)[0] * (s + 1)) for s in range(len(rv_m2.segments)))
    parts = by_place(rv_m2, Parameter("strain", "1/K", 1e-5, "link", "", responses))
    assert [p.place for p in parts] == list(dict.fromkeys(s.parent_link for s in rv_m2.segments))
    assert [r for p in parts for r in p.responses] == sorted(responses, key=lambda r: r.index)
    for part in parts:
        assert {rv_m2.segments[r.index].parent_link for r in part.responses} == {part.place}
    both = by_place(rv_m2, Parameter("sag", "rad", 1e-3, "joint", "", (at_joint(1, 1.0), at_base(np.ones(6)))))
    assert [(p.kind, p.place) for p in both] == [("joint", "joint_2"), ("joint", "base")]
