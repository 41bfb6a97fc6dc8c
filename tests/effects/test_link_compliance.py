"""Links that bend and twist under the weight on their end: against hinges in MuJoCo and in a URDF, and energy."""

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from bodies import bodies, displaced, mine
from helpers import NOISE, SAMPLES, commanded, tool_with, without_masses
from reference import tool_poses
from simulate import simulate

from thermal_robot.campaign import Campaign
from thermal_robot.effects import JointCompliance, LinkCompliance, choose
from thermal_robot.effects.beam import beams, cross_axes, shafts
from thermal_robot.inference.fit import fit
from thermal_robot.observations import observe
from thermal_robot.robot import load_robot


@pytest.mark.parametrize("arm", ["ur10", "panda", "rv_m2"], indirect=True)
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


def hinged(arm, s):
    """The same arm with a joint at the end of a segment, which turns about the segment."""
    segment = arm.segments[s]
    root = ElementTree.fromstring(arm.urdf)
    (joint,) = (j for j in root.findall("joint") if j.get("name") == segment.name)
    along = arm.chain.rotations[segment.index] @ segment.direction
    added = ElementTree.SubElement(root, "joint", name="hinge", type="revolute")
    ElementTree.SubElement(added, "origin", xyz=joint.find("origin").get("xyz"), rpy="0 0 0")
    ElementTree.SubElement(added, "parent", link=segment.parent_link)
    ElementTree.SubElement(added, "child", link="between")
    ElementTree.SubElement(added, "axis", xyz=" ".join(f"{x:.17g}" for x in along))
    ElementTree.SubElement(added, "limit", lower="-1", upper="1", effort="1", velocity="1")
    ElementTree.SubElement(root, "link", name="between")
    joint.find("origin").set("xyz", "0 0 0")
    joint.find("parent").set("link", "between")
    return load_robot(ElementTree.tostring(root, encoding="unicode"), arm.tool_frame, gravity=arm.gravity)


@pytest.mark.parametrize("arm", ["ur10", "panda", "rv_m2"], indirect=True)
def test_a_shaft_twists_as_a_hinge_at_its_end_yields(arm):
    campaign = commanded(arm, {"payload": np.tile([0.0, 2.0], 5)}, payload_com=np.array([0.03, 0.02, 0.05]))
    seen, moved = shafts(arm), []
    count = 2 * len(beams(arm))
    for k, s in enumerate(seen):
        values = np.zeros(count + len(seen))
        values[count + k] = 1e-5
        there = hinged(arm, s)
        joint = there.joint_names.index("hinge")
        q = np.insert(campaign.q, joint, 0.0, axis=1)
        springs = np.where(np.arange(there.n) == joint, 1e-5 * arm.segments[s].length, 0.0)
        expected = mine(
            Campaign("hinged", there, q, covariates=campaign.covariates, payload_com=campaign.payload_com),
            JointCompliance(),
            springs,
        )
        moved.append(np.abs(expected).max())
        np.testing.assert_allclose(
            mine(campaign, LinkCompliance(twist=True), values), expected, atol=1e-3 * moved[-1] + 1e-12
        )
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


@pytest.mark.parametrize("arm", ["ur10", "rv_m2", "awkward"], indirect=True)
def test_a_loaded_elastic_link_sinks(arm):
    """Whatever bends, the load's own place goes down: it pays for the work that bends the links."""
    bare = without_masses(arm)
    place = np.array([0.02, -0.01, 0.05])
    campaign = commanded(bare, {"payload": np.full(10, 3.0)}, payload_com=place, target=place)
    count = len(LinkCompliance().parameters(observe(campaign)))
    fallen = mine(campaign, LinkCompliance(), 1e-8 * (1.0 + np.arange(count)))
    assert (fallen @ bare.gravity > 0.0).all()


def test_what_hangs_without_weight_does_not_bend(rv_m2):
    assert LinkCompliance().missing(observe(commanded(rv_m2))) == ()
    bare = without_masses(rv_m2)
    assert LinkCompliance().missing(observe(commanded(bare))) == ("masses in the URDF",)
    loaded = commanded(bare, {"payload": np.full(10, 2.0)})
    assert LinkCompliance().missing(observe(loaded)) == ("masses in the URDF",)


def test_the_softest_segment_sags_by_a_fifth_of_a_millimetre_at_its_expected_size(rv_m2):
    observations = observe(Campaign("commands", rv_m2, commanded(rv_m2).q))
    parameters = LinkCompliance().parameters(observations)
    shifts = [p.size * np.linalg.norm(p.responses[0].values[:, :3], axis=1).max() for p in parameters]
    assert max(shifts) == pytest.approx(2e-4)
    assert len(parameters) == 2 * len(beams(rv_m2))


def test_it_is_drawn_against_the_moment_that_bends_it(rv_m2):
    observations = observe(commanded(rv_m2))
    loads = observations.segment_load
    for parameter in LinkCompliance().parameters(observations):
        s = parameter.responses[0].index
        axis = cross_axes(rv_m2, s)[int(parameter.label[-1]) - 1]
        error = 1e-6 * loads[:, s, 3:] @ axis
        name, unit, values = LinkCompliance().driver(observations, [parameter], error)
        assert (name, unit) == (f"bending moment on {parameter.place}", "N·m")
        if np.ptp(error) > 1e-9:
            # its own unit is the moment's, about the axis that the error was made with
            np.testing.assert_allclose(values, loads[:, s, 3:] @ axis, atol=1e-6 * np.abs(loads).max())


def inclined(arm, *links):
    """Commands of an arm whose inclinometers read at random, and the pose of each of these links."""
    rng = np.random.default_rng(4)
    tilts = {f"tilt.{link}.{axis}": 1e-4 * rng.normal(size=SAMPLES) for link in links for axis in "xy"}
    campaign = commanded(without_masses(arm), tilts)
    poses = []
    for link in links:
        there = load_robot(arm.urdf, link, gravity=arm.gravity)
        poses.append(tool_poses(there, campaign.q[:, : there.n]))
    return campaign, poses


@pytest.mark.parametrize(("arm", "link"), [("ur10", "forearm_link"), ("rv_m2", "upper_arm")], indirect=["arm"])
def test_a_measured_tilt_turns_what_is_beyond_about_the_links_origin(arm, link):
    campaign, (pose,) = inclined(arm, link)
    (effect,) = LinkCompliance().variants(observe(campaign))
    assert effect.tilt
    assert LinkCompliance().missing(observe(campaign)) == ()
    read = np.column_stack([*(campaign.covariates[f"tilt.{link}.{axis}"] for axis in "xy"), np.zeros(SAMPLES)])
    turn = np.einsum("nij,nj->ni", pose[:, :3, :3], read)
    expected = np.cross(turn, observe(campaign).position - pose[:, :3, 3])
    np.testing.assert_allclose(mine(campaign, effect, [1.0]), expected, atol=1e-3 * np.abs(expected).max())


def test_a_link_that_is_carried_by_one_before_does_not_turn_itself(rv_m2):
    campaign, poses = inclined(rv_m2, "upper_arm", "forearm")
    near, far = (pose[:, :3, :3] for pose in poses)
    read = np.column_stack([*(campaign.covariates[f"tilt.upper_arm.{axis}"] for axis in "xy"), np.zeros(SAMPLES)])
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
