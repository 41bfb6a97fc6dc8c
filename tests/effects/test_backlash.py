"""Lost motion: short of where the joint was going, or where the load pushes it."""

import json
from dataclasses import replace

import numpy as np
import pytest
from bodies import hinged
from conftest import load_arm
from helpers import NOISE, SAMPLES, commanded, commands, some, tool_at, tool_with

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


def hanging(settings):
    """Which joints hang otherwise than the middle, by setting."""
    return {tuple(np.flatnonzero(np.array(s.held) != 0.5).tolist()) for s in settings if isinstance(s.held, tuple)}


def test_refinement_moves_shares_together_and_each_alone_and_the_film_within_dry_friction():
    near = HELD.nearby(2.0)
    assert sorted(s.held for s in near if isinstance(s.held, float)) == pytest.approx([1 / 3, 0.5, 2 / 3])
    assert hanging(near) == {(0,), (2,)}
    # or one of them never hangs
    assert {s.held for s in near if isinstance(s.held, tuple) and 0.0 in s.held} == {(0.0, 0.5, 0.5), (0.5, 0.5, 0.0)}
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
    for single in (replace(never, places=("wrist",)), Backlash()):
        assert single.nearby(2.0) == (single,)
    # shares stay shares, and a film stays dry friction, however large the step
    for factor in (1.05, 20.0, 100.0):
        soft = replace(HELD, soft=0.05).nearby(factor)
        assert all(0.0 <= min(np.atleast_1d(s.held)) <= max(np.atleast_1d(s.held)) < 1.0 for s in soft)
        assert all(0.0 < s.soft < 0.5 for s in soft)
    assert {round(s.soft, 9) for s in replace(HELD, soft=0.05).nearby(2.0)} == {0.05, 0.1, 0.025}
    assert {s.soft for s in near} == {0.0}


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


@pytest.mark.parametrize("seed", some(range(2), 2))
@pytest.mark.parametrize(("name", "label", "size"), [("rv_m2", "torque", 3e-5), ("rail", "turn about z", 4e-4)])
def test_play_that_grows_and_a_carriage_that_turns_are_told_with_their_size(name, label, size, seed):
    """Among lost motion, gains and joints that yield; poses are reached from either side."""
    arm = load_arm(name) if name == "rv_m2" else load_robot((ARMS / "rail.urdf").read_text(), "tool0")
    rng, rows = np.random.default_rng(seed), 150
    approach = rng.choice([-1.0, 1.0], (rows, arm.n))
    columns = {f"approach.{n}": a for n, a in zip(arm.joint_names, approach.T, strict=True)}
    campaign = Campaign(
        "moved", arm, commands(arm, rows, rng), covariates={**columns, "payload": 2.0 * (rng.random(rows) < 0.5)}
    )
    if name == "rv_m2":
        place = tool_at(arm, campaign.q - 0.5 * (2e-4 + size * np.abs(observe(campaign).torque)) * approach)
    else:
        there = hinged(arm, "rail", (0, 0, 1), moving=True)
        turn = -0.5 * size * approach[:, arm.joint_names.index("rail")]
        place = tool_at(there, np.insert(campaign.q, there.joint_names.index("hinge"), turn, axis=1))
    known = fit(
        replace(campaign, position=place + NOISE * rng.normal(size=place.shape)),
        choose(("backlash", "joint_compliance", "joint_gain")),
    )
    ((effect, values),) = known.effects
    assert (effect.name, effect.grows, effect.carriage) == (
        "backlash",
        name == "rv_m2",
        "" if name == "rv_m2" else "moving",
    )
    best = known.explanation.best.blocks[0]
    deviations = np.sqrt(np.diag(known.explanation.values[best][1]))
    told = zip(known.explanation.linear.blocks[best].parameters, values, deviations, strict=True)
    off = [(v - size) / s for p, v, s in told if label in p.label and s < size / 3.0]
    assert len(off) >= (2 if name == "rv_m2" else 1)
    assert np.abs(off).max() < 4.0
