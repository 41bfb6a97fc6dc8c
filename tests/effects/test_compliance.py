"""What yields to load or bows with heat: against hinges in MuJoCo and a URDF, energy, and what inclinometers read."""

from dataclasses import replace

import numpy as np
import pytest
from bodies import bodies, displaced, hinged, mine
from helpers import NOISE, SAMPLES, commanded, tool_at, tool_with, without_masses
from reference import tool_poses
from simulate import simulate

from thermal_robot.campaign import Campaign
from thermal_robot.effects import BaseCompliance, JointCompliance, LinkCompliance, ThermalBending, choose, gate
from thermal_robot.effects.beam import beams, cross_axes, shafts
from thermal_robot.effects.compliance import overturning
from thermal_robot.inference.fit import fit
from thermal_robot.observations import observe
from thermal_robot.robot import load_robot

on_arms = pytest.mark.parametrize("arm", ["rv_m2", "ur10", "panda"], indirect=True)
PLACE = np.array([0.02, -0.01, 0.05])
DOWN = np.array([0.3, -0.2, -9.0])


def loaded(arm, gravity=None):
    """A payload of 3 kg on a weightless arm, measured at its centre."""
    bare = without_masses(arm, gravity)
    return commanded(bare, {"payload": np.full(SAMPLES, 3.0)}, payload_com=PLACE, target=PLACE)


@on_arms
def test_a_beam_of_hinges_bends_as_the_cantilever(arm):
    campaign, world, at = bodies(arm)
    stiffness = 1e-7 * (1.0 + np.arange(2.0 * len(at)).reshape(-1, 2))
    for chosen in (*range(len(at)), slice(None)):
        values = np.zeros_like(stiffness)
        values[chosen] = stiffness[chosen]
        body = world.sound(len(campaign.q))
        body.beams[at] = values
        expected = displaced(world, campaign, body)
        found = mine(campaign, LinkCompliance(), values.ravel())
        if np.abs(expected).max() < 1e-10:
            assert np.abs(found).max() < 1e-9
            continue
        # three hinges lack a 36th of what a force on the end does
        error = np.linalg.norm(found - expected, axis=1).max() / np.linalg.norm(expected, axis=1).max()
        assert error < 0.03, f"segment {chosen}: {error:.3f}"


@on_arms
def test_a_bowed_row_of_hinges_is_a_bowed_link(arm):
    campaign, world, at = bodies(arm)
    rng, samples = np.random.default_rng(0), len(campaign.q)
    links = {segment.parent_link: 22.0 + 5.0 * rng.uniform(size=samples) for segment in arm.segments}
    recorded = {f"temperature.{link}": t for link, t in links.items()} | {"temperature": rng.uniform(20, 24, samples)}
    campaign = replace(campaign, covariates={**campaign.covariates, **recorded})
    values, body = 1e-5 * rng.normal(size=(len(at), 2)), world.sound(samples)
    for s, k in enumerate(at):
        warmer = recorded[f"temperature.{world.links[k]}"] - recorded["temperature"]
        body.bow[:, k] = warmer[:, None] * values[s]
    expected = displaced(world, campaign, body)
    found = mine(campaign, ThermalBending(), values.ravel())
    assert np.linalg.norm(found - expected, axis=1).max() < 0.01 * np.linalg.norm(expected, axis=1).max()


def test_bending_by_heat_is_of_the_difference_to_the_robot_and_is_drawn_against_it(rv_m2):
    rng = np.random.default_rng(3)
    own = {f"temperature.{s.parent_link}": 20.0 + rng.uniform(0, 9, 10) for s in rv_m2.segments}
    mean = np.mean([own[c] for c in ThermalBending().reads(observe(commanded(rv_m2, own)))], axis=0)
    stated, even = commanded(rv_m2, {**own, "temperature": mean}), commanded(rv_m2, {name: mean for name in own})
    seen = observe(stated)
    parameters = ThermalBending().parameters(seen)
    values = 1e-3 * rng.normal(size=len(parameters))
    expected = tool_with(stated, ThermalBending(), values)
    np.testing.assert_allclose(tool_with(commanded(rv_m2, own), ThermalBending(), values), expected, atol=1e-14)
    assert ThermalBending().missing(observe(even))
    np.testing.assert_allclose(tool_with(even, ThermalBending(), values), tool_at(rv_m2, even.q), atol=1e-14)
    for parameter in parameters:
        name, unit, warmer = ThermalBending().driver(seen, [parameter], np.zeros(10))
        assert (name, unit) == (f"{parameter.place} warmer than the robot by", "K")
        np.testing.assert_allclose(warmer, own[f"temperature.{parameter.place}"] - mean, atol=1e-12)
        response = np.linalg.norm(parameter.responses[0].values, axis=1) / np.abs(warmer)
        np.testing.assert_allclose(response, response[0], rtol=1e-9)  # twice as much warmer, twice the bow


@on_arms
def test_a_shaft_twists_as_a_hinge_at_its_end_yields(arm):
    campaign = commanded(arm, {"payload": np.tile([0.0, 2.0], 5)}, payload_com=np.array([0.03, 0.02, 0.05]))
    seen, moved, count = shafts(arm), [], 2 * len(beams(arm))
    for k, s in enumerate(seen):
        values = 1e-5 * (np.arange(count + len(seen)) == count + k)
        there = hinged(arm, arm.segments[s].name, arm.segments[s].direction, moving=False)
        joint = there.joint_names.index("hinge")
        turned = replace(campaign, robot=there, q=np.insert(campaign.q, joint, 0.0, axis=1))
        springs = np.where(np.arange(there.n) == joint, 1e-5 * arm.segments[s].length, 0.0)
        expected = mine(turned, JointCompliance(), springs)
        moved.append(np.abs(expected).max())
        found = mine(campaign, LinkCompliance(twist=True), values)
        np.testing.assert_allclose(found, expected, atol=1e-3 * moved[-1] + 1e-12)
    assert max(moved) > 1e-7


@pytest.mark.parametrize(
    ("arm", "links"),
    [("ur10", ["upper_arm_link", "forearm_link"]), ("rv_m2", ["shoulder", "upper_arm", "forearm"])],
    indirect=["arm"],
)
def test_what_lies_along_a_joint_does_not_twist_beside_it(arm, links):
    assert [arm.segments[s].parent_link for s in shafts(arm)] == links
    labels = [p.label for p in LinkCompliance(twist=True).parameters(observe(commanded(arm)))]
    assert sum("twisting" in label for label in labels) == len(links)


@pytest.mark.parametrize("arm", ["rv_m2", "ur10", "awkward"], indirect=True)
def test_a_loaded_elastic_arm_sinks_and_the_loads_energy_pays_for_the_work(arm):
    """m g·Δx = Σ c τ², τ what holds the load still; whatever bends, the load's own place goes down."""
    campaign = loaded(arm, DOWN)
    compliance = 1e-8 * (1.0 + np.arange(arm.n))
    released = 3.0 * mine(campaign, JointCompliance(), compliance) @ DOWN
    torque = -np.einsum("nrj,r->nj", observe(campaign).joint_sensitivity[:, :3], 3.0 * DOWN)
    assert (released > 0.0).all()
    np.testing.assert_allclose(released, torque**2 @ compliance, rtol=1e-5)
    campaign = loaded(arm)
    count = len(LinkCompliance().parameters(observe(campaign)))
    fallen = mine(campaign, LinkCompliance(), 1e-8 * (1.0 + np.arange(count)))
    assert (fallen @ campaign.robot.gravity > 0.0).all()


@pytest.mark.parametrize("arm", ["ur10", "panda", "rv_m2", "awkward"], indirect=True)
def test_the_moment_on_the_base_is_what_a_turn_of_it_works_against(arm):
    """Virtual work: a payload turned about an axis through the origin rises by e × r."""
    seen = observe(loaded(arm))
    turns = seen.base_sensitivity[:, :3, 3:]
    expected = 3.0 * np.einsum("nik,i->nk", turns, seen.robot.gravity)
    np.testing.assert_allclose(overturning(seen), expected, atol=1e-9)


def test_a_load_or_weight_sinks(rv_m2):
    # an outstretched arm sinks under its own weight
    stretched = Campaign("stretched", rv_m2, np.zeros((1, 5)))
    for j in (1, 2, 3):
        sunk = mine(stretched, JointCompliance(), 1e-5 * np.eye(5)[j])
        assert sunk[0, 2] < -1e-6
        assert abs(sunk[0, 0]) < 1e-12
    swung = replace(commanded(rv_m2), q=np.linspace(-0.4, 0.4, SAMPLES)[:, None] * np.ones(rv_m2.n))
    for values in ([1e-6, 1e-6], [1e-6, 7e-7, 1e-6, 7e-7]):
        # all weights lie on the tool's side: it goes down
        assert (mine(swung, BaseCompliance(below=len(values) > 2), values)[:, 2] < 0.0).all()
    # A point at the depth stays where it is: each turn by ω shifts the origin, 0.7 m above, by 0.7 ω × up.
    parameters = BaseCompliance(below=True).parameters(observe(commanded(rv_m2)))
    assert [p.unit for p in parameters] == ["rad/(N·m)", "m/(N·m)"] * 2
    for spring, shift in zip(parameters[::2], parameters[1::2], strict=True):
        twist = spring.responses[0].values + 0.7 * shift.responses[0].values
        np.testing.assert_allclose(twist[:, :3] + np.cross(twist[:, 3:], [0.0, 0.0, -0.7]), 0.0, atol=1e-12)
        assert np.ptp(twist[:, 3:]) > 0.0


def test_what_hangs_without_weight_yields_to_nothing_but_a_measured_tilt(rv_m2):
    bare, masses = without_masses(rv_m2), "masses in the URDF"
    lacking = {BaseCompliance: ("tilt.x", "tilt.y", masses), LinkCompliance: (masses,)}
    tilted = observe(commanded(bare, {"tilt.x": np.arange(10.0) * 1e-4, "tilt.hand.y": np.arange(10.0) * 1e-4}))
    for kind, missing in lacking.items():
        assert kind().missing(observe(commanded(rv_m2))) == ()
        for columns in ({}, {"payload": np.arange(10.0)}):
            assert kind().missing(observe(commanded(bare, columns))) == missing
        assert kind().missing(tilted) == ()
        assert {effect.tilt for effect in kind().variants(tilted)} == {True}
        assert [kind(tilt=tilt).sided_by for tilt in (False, True)] == [("gravity",), ()]


def test_the_softest_segment_sags_by_a_fifth_of_a_millimetre_and_is_drawn_against_its_moment(rv_m2):
    seen = observe(commanded(rv_m2))
    parameters, loads = LinkCompliance().parameters(seen), seen.segment_load
    shifts = [p.size * np.linalg.norm(p.responses[0].values[:, :3], axis=1).max() for p in parameters]
    assert max(shifts) == pytest.approx(2e-4)
    assert len(parameters) == 2 * len(beams(rv_m2))
    for parameter in parameters:
        s = parameter.responses[0].index
        moment = loads[:, s, 3:] @ cross_axes(rv_m2, s)[int(parameter.label[-1]) - 1]
        name, unit, values = LinkCompliance().driver(seen, [parameter], 1e-6 * moment)
        assert (name, unit) == (f"bending moment on {parameter.place}", "N·m")
        if np.ptp(moment) > 1e-3:
            # its own unit is the moment's, about the axis that the error was made with
            np.testing.assert_allclose(values, moment, atol=1e-6 * np.abs(loads).max())


def inclined(arm, *links):
    """Commands of an arm whose inclinometers read at random, the turns that they read, and the pose of each link."""
    rng = np.random.default_rng(4)
    turns = [np.hstack([1e-4 * rng.normal(size=(SAMPLES, 2)), np.zeros((SAMPLES, 1))]) for _ in links]
    names = [f"tilt.{link}".rstrip(".") for link in links]
    tilts = {f"{n}.{axis}": turn[:, k] for n, turn in zip(names, turns, strict=True) for k, axis in enumerate("xy")}
    campaign, poses = commanded(without_masses(arm), tilts), []
    for link in links:
        there = load_robot(arm.urdf, link, gravity=arm.gravity) if link else None
        poses.append(tool_poses(there, campaign.q[:, : there.n]) if link else np.tile(np.eye(4), (SAMPLES, 1, 1)))
    return campaign, turns, poses


@pytest.mark.parametrize(
    ("arm", "link"), [("ur10", "forearm_link"), ("rv_m2", "upper_arm"), ("rv_m2", "")], indirect=["arm"]
)
def test_a_measured_tilt_turns_what_is_beyond_about_its_own_origin(arm, link):
    campaign, (read,), (pose,) = inclined(arm, link)
    seen, kind = observe(campaign), LinkCompliance if link else BaseCompliance
    effect = kind().variants(seen)[0]
    assert effect.tilt
    turn = np.einsum("nij,nj->ni", pose[:, :3, :3], read)
    expected = np.cross(turn, seen.position - pose[:, :3, 3])
    np.testing.assert_allclose(mine(campaign, effect, [1.0]), expected, atol=1e-3 * np.abs(expected).max())
    columns = [f"tilt.{link}.{axis}".replace("..", ".") for axis in "xy"]
    assert effect.reads(seen) == tuple(columns)
    name, unit, values = gate.driver(effect, seen, gate.checked(effect, seen), np.zeros(SAMPLES))
    most = max(columns, key=lambda column: np.ptp(campaign.covariates[column]))
    assert (name, unit) == (most, "rad")
    np.testing.assert_array_equal(values, campaign.covariates[most])


def test_a_link_that_is_carried_by_one_before_does_not_turn_itself(rv_m2):
    campaign, (read, _), poses = inclined(rv_m2, "upper_arm", "forearm")
    near, far = (pose[:, :3, :3] for pose in poses)
    carried = np.einsum("nji,njk,nk->ni", far, near, read)
    both = {**campaign.covariates, "tilt.forearm.x": carried[:, 0], "tilt.forearm.y": carried[:, 1]}
    first, second = LinkCompliance(tilt=True).parameters(observe(replace(campaign, covariates=both)))
    assert np.abs(second.responses[0].values).max() < 1e-9 < np.abs(first.responses[0].values).max()


def test_a_link_that_turns_as_it_was_read_is_named(rv_m2):
    plain, rng = simulate(rv_m2, seed=3, noise=NOISE)[0], np.random.default_rng(3)
    columns = {f"tilt.forearm.{axis}": 5e-4 * rng.normal(size=plain.samples) for axis in "xy"}
    campaign = replace(plain, covariates={**plain.covariates, **columns}, priors={})
    there = tool_with(campaign, LinkCompliance(tilt=True), [1.0])
    known = fit(replace(campaign, position=there + NOISE * rng.normal(size=there.shape)), choose())
    ((effect, values),) = known.effects
    assert effect == LinkCompliance(tilt=True, places=effect.places)
    assert values == pytest.approx([1.0], abs=0.05)


def test_a_soft_base_is_named_and_its_springs_are_measured(rv_m2):
    campaign, truth, _ = simulate(rv_m2, ["base_compliance"], seed=4, ratio=(6.0, 6.0))
    known = fit(campaign, choose())
    ((effect, values),) = known.effects
    assert effect.name == "base_compliance"
    spread = np.sqrt(np.diag(known.explanation.values[known.explanation.best.blocks[0]][1]))
    true = list(truth["parts"]["base_compliance"]["values"].values())
    assert (np.abs(values - true) < 3.0 * spread).all()


@on_arms
def test_a_torque_sensor_replaces_the_computed_torque_with_the_same_sign(arm):
    plain, values = commanded(arm), 1e-5 * (1.0 + np.arange(arm.n))
    computed = observe(plain).torque
    for times in (1.0, 2.0):
        columns = {f"torque.{n}": times * t for n, t in zip(arm.joint_names, computed.T, strict=True)}
        found = tool_with(replace(plain, covariates=columns), JointCompliance(), values)
        np.testing.assert_allclose(found, tool_at(arm, plain.q - times * values * computed), atol=1e-14)
    np.testing.assert_allclose(
        tool_with(plain, JointCompliance(), values), tool_at(arm, plain.q - values * computed), atol=1e-14
    )


@on_arms
def test_free_shapes_hold_the_true_torques_whatever_the_masses(arm):
    """The torque of each joint is a sum of its shapes: to within those that were left out."""
    bare, whole = observe(commanded(without_masses(arm))), observe(commanded(arm))
    (free,) = JointCompliance().variants(bare)
    parameters, largest = free.parameters(bare), np.abs(whole.torque).max()
    assert {p.unit for p in parameters} == {"rad"}
    assert len(free.joints) == len(parameters) > 1
    for j, joint in enumerate(arm.joint_names):
        own, torque = [p.responses[0].values for p in parameters if p.place == joint], whole.torque[:, j]
        assert own or np.ptp(torque) < 0.05 * largest
        basis = np.column_stack([np.ones(SAMPLES), *own])[:, 1 if own else 0 :]
        left = torque - basis @ np.linalg.lstsq(basis, torque, rcond=None)[0]
        assert np.abs(left).max() < 0.05 * largest
    name, unit, values = free.driver(bare, parameters[:1], 3e-4 * parameters[0].responses[0].values)
    assert (name, unit) == (f"fitted torque of {parameters[0].place}", "relative")
    assert np.abs(values).max() == pytest.approx(1.0)


def test_torques_that_are_known_leave_no_weight_free(rv_m2):
    bare = without_masses(rv_m2)
    for campaign in (commanded(rv_m2), commanded(bare, {"torque.joint_2": np.linspace(1.0, 9.0, 10)})):
        assert JointCompliance().variants(observe(campaign)) == (JointCompliance(),)
    (free,) = JointCompliance().variants(observe(commanded(bare)))
    assert "joint_1" not in {p.place for p in free.parameters(observe(commanded(bare)))}
