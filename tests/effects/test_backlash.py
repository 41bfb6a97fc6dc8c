"""Lost motion: short of where the joint was going, or where the load pushes it."""

import json
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from helpers import NOISE, SAMPLES, commanded, commands, tool_at, tool_with

from thermal_robot.blind.plan import ARMS
from thermal_robot.campaign import Campaign
from thermal_robot.effects import Backlash, choose
from thermal_robot.effects.catalogue import restored
from thermal_robot.inference.fit import fit
from thermal_robot.observations import observe
from thermal_robot.robot import load_robot


def approached(arm, seed=6, **more):
    """Commands with a direction of approach of every joint, (N, n) and the campaign."""
    approach = np.random.default_rng(seed).choice([-1.0, 0.0, 1.0], (SAMPLES, arm.n))
    columns = {f"approach.{n}": a for n, a in zip(arm.joint_names, approach.T, strict=True)}
    return approach, commanded(arm, columns, **more)


def test_a_joint_without_a_recorded_approach_has_no_parameter_and_one_that_comes_one_way_no_driver(rv_m2):
    _, campaign = approached(rv_m2)
    less = observe(campaign.drop_covariate("approach.joint_2"))
    others = [n for n in rv_m2.joint_names if n != "joint_2"]
    assert [p.place for p in Backlash().parameters(less)] == others
    assert (Backlash().missing(less), Backlash().reads(less)) == ((), tuple(f"approach.{n}" for n in others))
    still = observe(replace(campaign, covariates={**campaign.covariates, "approach.joint_1": np.ones(SAMPLES)}))
    assert Backlash().driver(still, Backlash().parameters(still)[:1], np.ones(SAMPLES)) is None


def test_no_torque_no_play_that_hangs(rv_m2):
    _, campaign = approached(rv_m2)
    variants = Backlash().variants(observe(campaign))
    assert [s.held for s in variants if s.grows] == [0.0]
    shares = sorted(s.held for s in variants if not s.grows)
    assert shares[0] == 0.0 < shares[1] < 0.25
    assert 0.85 < shares[-1] < 1.0
    odds = np.array([share / (1.0 - share) for share in shares[1:]])
    assert (odds[1:] / odds[:-1] < 4.5).all()  # refinement reaches what lies between
    plain = [s.weight for s in variants if not s.held and not s.grows]
    assert sum(s.weight for s in variants if s.held) == pytest.approx(sum(plain))
    assert not any(s.carriage for s in variants)  # joints that turn have none
    floating = replace(rv_m2, gravity=np.zeros(3))
    assert Backlash().variants(observe(replace(campaign, robot=floating))) == (Backlash(),)


def test_shares_near_another_stay_shares():
    held = Backlash(held=0.9, largest=(1.0,), chain=("elbow",))
    for factor in (1.05, 1.6, 20.0):
        near = held.nearby(factor)
        assert held in near
        assert all(0.0 < s.held < 1.0 for s in near)
        assert min(s.held for s in near) < 0.9 < max(s.held for s in near)
    assert Backlash().nearby(1.6) == (Backlash(),)


def sides(effect, here):
    return [-2.0 * parameter.responses[0].values for parameter in effect.parameters(here)]


def test_each_joint_hangs_by_its_own_share(rv_m2):
    approach, campaign = approached(rv_m2, seed=8)
    here, shares = observe(campaign), tuple(np.linspace(0.2, 0.9, rv_m2.n).tolist())
    largest = Backlash().variants(here)[1].largest
    each = sides(Backlash(shares, largest), here)
    for j, share in enumerate(shares):
        np.testing.assert_array_equal(each[j], sides(Backlash(share, largest), here)[j])
    same = sides(Backlash((0.5,) * rv_m2.n, largest), here)
    np.testing.assert_array_equal(same, sides(Backlash(0.5, largest), here))
    # a joint whose share is 0 goes by its approach alone, and a model with shares must know torques
    never = Backlash((0.0,) * rv_m2.n, largest)
    np.testing.assert_array_equal(sides(never, here)[1], approach[:, 1])
    assert never.nearby(1.6) == (never,)
    assert restored("backlash", json.dumps(Backlash(shares, largest).arguments())) == Backlash(shares, largest)


CHAIN = ("shoulder", "wrist", "elbow")
HELD = Backlash(held=0.5, largest=(10.0, 0.01, 5.0), chain=CHAIN)  # the wrist is too light to hang


def test_shares_move_together_and_each_alone():
    near = HELD.nearby(2.0)
    together = sorted(s.held for s in near if isinstance(s.held, float))
    assert together == pytest.approx([1 / 3, 0.5, 2 / 3])
    own = {s.held for s in near if isinstance(s.held, tuple)}
    assert {tuple(np.flatnonzero(np.array(shares) != 0.5).tolist()) for shares in own} == {(0,), (2,)}
    # or one of them never hangs
    assert {shares for shares in own if 0.0 in shares} == {(0.0, 0.5, 0.5), (0.5, 0.5, 0.0)}
    assert len(near) == 1 + 2 + 4 + 2
    # one that has moved alone still goes with the others, its odds by the same factor; or all go by one again
    apart = replace(HELD, held=(0.5, 0.5, 0.8))
    odds = {round(s.held[2] / (1 - s.held[2]), 9) for s in apart.nearby(2.0) if isinstance(s.held, tuple)}
    assert odds == {0.0, 2.0, 4.0, 8.0}
    assert {s.held for s in apart.nearby(2.0) if not isinstance(s.held, tuple)} == {0.5, 0.8}
    assert (HELD.apart, apart.apart) == (0, 1)
    # where there is but one joint, its share is the only one
    assert len(replace(HELD, places=("elbow",)).nearby(2.0)) == 3
    assert len(replace(HELD, places=CHAIN).nearby(2.0)) == len(near)
    # one joint alone may hang
    never = replace(HELD, held=0.0)
    alone = [s for s in never.nearby(2.0) if s != never]
    assert {tuple(np.flatnonzero(s.held).tolist()) for s in alone} == {(0,), (2,)}
    assert all(s.apart == 1 for s in alone)
    assert replace(never, places=("wrist",)).nearby(2.0) == (replace(never, places=("wrist",)),)


@pytest.mark.parametrize("arm", ["ur10", "rv_m2"], indirect=True)
def test_play_that_hangs_lies_where_the_load_pushes_it(arm):
    """A joint on a very soft spring goes with gravity; one that hangs in its play goes the same way."""
    pytest.importorskip("mujoco")
    from thermal_robot.blind.reality.world import World

    com, payload = (0.0, 0.0, 0.05), np.tile([0.0, 2.0], SAMPLES // 2)
    approach = {f"approach.{joint}": np.tile([1.0, -1.0], SAMPLES // 2) for joint in arm.joint_names}
    campaign = commanded(arm, {"payload": payload, **approach}, payload_com=np.array(com))
    (effect,) = (e for e in Backlash().variants(observe(campaign)) if e.held == 0.5)
    world = World(arm.urdf, arm.tool_frame, com)
    torque = world.poses(campaign.q, payload, world.sound(SAMPLES))[1]
    for j, parameter in enumerate(effect.parameters(observe(campaign))):
        shift = parameter.responses[0].values
        largest = float(np.abs(torque[:, j]).max())
        if effect.steady[j] > 0.5 * largest:  # on one side in nearly all rows: an offset
            np.testing.assert_array_equal(shift, 0.0)
            continue
        hangs = largest > 0.02 * np.abs(torque).max()
        share = np.abs(torque[:, j]) / largest if hangs else np.zeros(SAMPLES)
        heavy, light = share > 0.6, share < 0.4  # between them teeth are changing sides
        np.testing.assert_array_equal(np.sign(shift[heavy]), -np.sign(torque[heavy, j]))
        came = approach[f"approach.{arm.joint_names[j]}"]
        np.testing.assert_allclose(shift[light], -0.5 * came[light], atol=1e-6)


def test_teeth_change_sides_over_a_share_of_friction(rv_m2):
    """At friction a tooth lies in the middle; a film's width to either side it lies nearly at one, however it came."""
    approach, campaign = approached(rv_m2, seed=8)
    here, j, between = observe(campaign), 1, []
    load, largest = here.torque[:, j], np.abs(here.torque).max(axis=0)
    # friction is the torque of one row in the middle, which thus stands just where its teeth change sides
    middle = np.argsort(np.abs(load))[len(load) // 2]
    friction = np.abs(load[middle])
    heavy = np.where(np.abs(load) > friction, np.sign(load), approach[:, j])
    for soft in (0.0, 0.05, 0.2):
        side = sides(Backlash(float(friction / largest[j]), tuple(largest.tolist()), soft=soft), here)[j]
        far = (np.abs(np.abs(load) - friction) > 2.0 * soft * friction) & (np.arange(len(load)) != middle)
        np.testing.assert_allclose(side[far], heavy[far], atol=0.01)
        assert approach[middle, j] * load[middle] >= 0.0 or side[middle] == pytest.approx(0.0, abs=1e-9)
        assert (np.abs(side) <= 1.0).all()
        between.append(int((np.abs(side) < 0.99).sum()))
    # the thicker the film, the more rows lie between
    assert between == sorted(between)
    assert between[-1] > between[0]


def test_the_film_is_refined_within_what_is_dry_friction():
    held = replace(HELD, soft=0.05)
    assert {round(s.soft, 9) for s in held.nearby(2.0)} == {0.05, 0.1, 0.025}
    assert all(0.0 < s.soft < 0.5 for s in held.nearby(100.0))
    assert all(s.soft == 0.0 for s in HELD.nearby(2.0))


def test_play_that_always_lies_on_one_side_is_left_to_the_offset(rv_m2):
    """With friction below what the joint always carries its lost motion would be a constant; with more it is none."""
    _, campaign = approached(rv_m2, seed=8)
    here = observe(campaign)
    load = np.abs(here.torque)
    effect = replace(Backlash().variants(here)[1], soft=0.0)
    changes = np.ptp(np.sign(here.torque), axis=0) > 0.0
    assert all(steady == 0.0 for steady, both in zip(effect.steady, changes, strict=True) if both)
    j = int(np.argmax(load.max(axis=0)))
    one_sided = replace(effect, steady=tuple(np.where(np.arange(rv_m2.n) == j, 0.5 * load.max(axis=0), 0.0).tolist()))
    for share, still in ((0.4, True), (0.6, False)):
        values = sides(replace(one_sided, held=share), here)[j]
        assert bool(np.ptp(values) == 0.0) is still
        assert not still or (values == 0.0).all()


@pytest.mark.parametrize("arm", ["ur10", "rv_m2"], indirect=True)
def test_lost_motion_may_grow_with_torque(arm):
    approach, campaign = approached(arm)
    campaign = replace(campaign, covariates={**campaign.covariates, "payload": np.linspace(0.0, 3.0, SAMPLES)})
    here = observe(campaign)
    (grows,) = (s for s in Backlash().variants(here) if s.grows)
    assert set(grows.reads(here)) == {"payload", *(f"approach.{joint}" for joint in arm.joint_names)}
    parameters = grows.parameters(here)
    wound = [p for p in parameters if "torque" in p.label]
    largest = np.abs(here.torque).max(axis=0)
    loaded = largest > 0.02 * largest.max()
    assert [p.place for p in wound] == [n for n, heavy in zip(arm.joint_names, loaded, strict=True) if heavy]
    assert all(p.positive and p.unit == "rad/(N·m)" for p in wound)
    values = np.array([2e-5 if p in wound else 1e-3 for p in parameters])
    width = 1e-3 + 2e-5 * np.abs(here.torque) * loaded
    expected = tool_at(arm, campaign.q - 0.5 * width * approach)
    np.testing.assert_allclose(tool_with(campaign, grows, values), expected, atol=1e-14)
    assert restored("backlash", json.dumps(grows.arguments())) == grows


def hinged(arm, slide, axis, moving):
    """The same arm with a hinge on the carriage of a slide, behind its stroke or before it."""
    root = ElementTree.fromstring(arm.urdf)
    (joint,) = (j for j in root.findall("joint") if j.get("name") == slide)
    origin, child = joint.find("origin"), joint.find("child")
    ElementTree.SubElement(root, "link", name="between")
    hinge = ElementTree.SubElement(root, "joint", name="hinge", type="revolute")
    ElementTree.SubElement(hinge, "axis", xyz=" ".join(map(str, axis)))
    ElementTree.SubElement(hinge, "limit", lower="-1", upper="1", effort="1", velocity="1")
    ends = ("between", child.get("link")) if moving else (joint.find("parent").get("link"), "between")
    ElementTree.SubElement(hinge, "parent", link=ends[0])
    ElementTree.SubElement(hinge, "child", link=ends[1])
    if moving:
        child.set("link", "between")
    else:
        ElementTree.SubElement(hinge, "origin", dict(origin.attrib))
        joint.find("parent").set("link", "between")
        origin.set("xyz", "0 0 0")
        origin.set("rpy", "0 0 0")
    return load_robot(ElementTree.tostring(root, encoding="unicode"), arm.tool_frame)


@pytest.mark.parametrize("moving", [True, False])
@pytest.mark.parametrize("arm", ["rail", "gantry", "scara"])
def test_a_carriage_with_play_turns_about_where_it_sits(arm, moving):
    arm = load_robot((ARMS / f"{arm}.urdf").read_text(), "tool0")
    approach, campaign = approached(arm)
    effect = Backlash(carriage="moving" if moving else "staying")
    assert effect in Backlash().variants(observe(campaign))
    parameters = effect.parameters(observe(campaign))
    turning = [k for k, p in enumerate(parameters) if "turn about" in p.label]
    slides = [n for n, kind in zip(arm.joint_names, arm.joint_types, strict=True) if kind == "prismatic"]
    assert [parameters[k].place for k in turning] == [n for n in slides for _ in range(3)]
    for k in turning:
        slide, axis = parameters[k].place, np.eye(3)["xyz".index(parameters[k].label.split()[2])]
        there = hinged(arm, slide, axis, moving)
        hinge = there.joint_names.index("hinge")
        came = approach[:, arm.joint_names.index(slide)]
        values = np.zeros(len(parameters))
        values[k] = 1e-4
        expected = tool_at(there, np.insert(campaign.q, hinge, -0.5e-4 * came, axis=1))
        np.testing.assert_allclose(tool_with(campaign, effect, values), expected, atol=1e-12)
    assert restored("backlash", json.dumps(effect.arguments())) == effect


def measured(arm, true, seed, samples=150):
    """A campaign of poses reached from either side, whose robot errs by ``true(approach, observations)``; m, noisy."""
    rng = np.random.default_rng(seed)
    approach = rng.choice([-1.0, 1.0], (samples, arm.n))
    columns = {f"approach.{n}": a for n, a in zip(arm.joint_names, approach.T, strict=True)}
    columns["payload"] = rng.choice([0.0, 2.0], samples)
    plain = Campaign("moved", arm, commands(arm, samples, rng), covariates=columns)
    return replace(plain, position=true(approach, plain) + NOISE * rng.normal(size=(samples, 3)))


def found(campaign):
    """The effect that is found in a campaign, and its parameters, values and standard deviations."""
    known = fit(campaign, choose(("backlash", "joint_compliance", "joint_gain")))
    ((effect, values),) = known.effects
    assert effect.name == "backlash"
    best = known.explanation.best.blocks[0]
    deviations = np.sqrt(np.diag(known.explanation.values[best][1]))
    return effect, list(zip(known.explanation.linear.blocks[best].parameters, values, deviations, strict=True))


@pytest.mark.parametrize("seed", range(2))
def test_lost_motion_that_grows_is_told_from_one_that_does_not(rv_m2, seed):
    def grown(approach, plain):
        return tool_at(rv_m2, plain.q - 0.5 * (2e-4 + 3e-5 * np.abs(observe(plain).torque)) * approach)

    effect, rows = found(measured(rv_m2, grown, seed))
    assert effect.grows
    off = [(v - 3e-5) / s for p, v, s in rows if "torque" in p.label and s < 1e-5]
    assert len(off) >= 2
    assert np.abs(off).max() < 4.0


@pytest.mark.parametrize("seed", range(2))
def test_a_carriage_that_turns_is_found_with_its_slide(seed):
    arm = load_robot((ARMS / "rail.urdf").read_text(), "tool0")
    there = hinged(arm, "rail", (0, 0, 1), moving=True)

    def turned(approach, plain):
        turn = -0.5 * 4e-4 * approach[:, arm.joint_names.index("rail")]
        return tool_at(there, np.insert(plain.q, there.joint_names.index("hinge"), turn, axis=1))

    effect, rows = found(measured(arm, turned, seed))
    assert effect.carriage == "moving"
    ((value, deviation),) = [(v, s) for p, v, s in rows if (p.place, p.label) == ("rail", "turn about z at reversal")]
    assert abs(value - 4e-4) < 4.0 * deviation
    assert deviation < 4e-5
