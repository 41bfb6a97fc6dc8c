"""A law that is put in at a place comes first there, with its quantity and its shape."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import NOISE, with_law
from simulate import simulate

from thermal_robot.effects.law import Discovered
from thermal_robot.effects.quantities import quantities
from thermal_robot.inference.columns import block, frame_columns
from thermal_robot.inference.frames import register
from thermal_robot.inference.laws import shapes
from thermal_robot.inference.scan import scan, shaped
from thermal_robot.inference.target import Target
from thermal_robot.observations import observe

TWIST = [3e-4, 0.0, 0.0, 0.0, 4e-4, 0.0]  # m, rad
PUT_IN = {
    "joint": (Discovered(place="joint_2", quantity="temperature", shape="ramp", origin=22.0, span=5.0), [0.0, 6e-4]),
    "step": (Discovered(place="joint_3", quantity="time", shape="step", marks=(3600.0,)), [0.0, 5e-4]),
    "bend": (Discovered(place="joint_2", quantity="joint_3", shape="hinge", marks=(-1.0, 1.0), span=2.0), [0.0, 4e-3]),
    "base": (Discovered(kind="base", place="base", quantity="speed", shape="ramp"), [0.0] * 6 + TWIST),
    "tool": (Discovered(kind="tool", place="tool", quantity="payload", shape="ramp", span=3.0), [0.0] * 6 + TWIST),
}


def seen(campaign):
    """Observations with the frames fitted, and what they leave to be explained."""
    here = observe(campaign, register(campaign))
    return here, Target.of(here.gap, frame_columns(here)[0])


@pytest.fixture(scope="module")
def scanned(rv_m2):
    found = {}
    for name, (law, values) in PUT_IN.items():
        here, target = seen(with_law(rv_m2, law, values, seed=3)[0])
        found[name] = law, here, target, scan(here, [target])[0][0]
    return found


@pytest.mark.parametrize("name", PUT_IN)
def test_place_and_quantity_come_first(scanned, name):
    law, _, _, found = scanned[name]
    first = found[0].law
    assert (first.kind, first.place, first.quantity) == (law.kind, law.place, law.quantity)
    assert found[0].gain > 20.0
    gains = [item.gain for item in found]
    assert gains == sorted(gains, reverse=True)


def test_every_candidate_is_counted_and_segments_are_tried_with_what_speaks_elsewhere(scanned):
    law, here, target, found = scanned["joint"]
    assert scan(here, [target])[1] == len(found)
    links = {item.law.quantity for item in found if item.law.kind == "link"}
    assert "none" in links  # a constant of a segment: its geometry
    assert law.quantity in links
    assert len(links - {"none"}) == 6


def test_several_remainders_are_scanned_as_each_alone(scanned):
    _, here, target, alone = scanned["base"]
    other = Target.of(here.gap[:, ::-1].copy(), frame_columns(here)[0])
    both, _ = scan(here, [target, other])
    # which quantities segments are tried with is what either speaks for
    plain = [{i.law: i.gain for i in own if i.law.kind != "link"} for own in (both[0], alone)]
    assert plain[0] == plain[1]
    assert both[1][0].gain != both[0][0].gain


def test_in_noise_no_law_gains_much(rv_m2):
    gains = []
    for seed in range(6):
        here, target = seen(simulate(rv_m2, seed=seed, noise=NOISE)[0])
        found, tried = scan(here, [target])
        gains.append(found[0][0].gain - np.log(tried))
    assert max(gains) < 3.0
    assert np.median(gains) < 0.0


@pytest.mark.parametrize("name", ["step", "bend"])
def test_the_shape_is_found_and_its_mark_to_within_the_rows_beside_it(scanned, name):
    law, here, target, found = scanned[name]
    best = shaped(here, target, found[0].law)
    assert best.gain > found[0].gain
    assert best.law.shape in {"step": ("step", "slide"), "bend": ("hinge",)}[name]
    values = np.sort(law.values(here))
    place = np.searchsorted(values, law.marks[0])
    assert values[place - 3] < best.law.marks[0] < values[place + 2]
    if name == "bend":
        assert best.law.marks[1] == law.marks[1]


def test_no_shape_gains_over_a_straight_line_where_the_law_is_straight(scanned):
    """By chance one of sixty may, by a few natural logarithms."""
    for name in ("joint", "base"):
        _, here, target, found = scanned[name]
        values = quantities(here)[found[0].law.quantity]
        straight = replace(found[0].law, shape="ramp", marks=())
        gains = {law.shape: target.worth(block(here, law).columns).gain for law in shapes(found[0].law, values)}
        best = shaped(here, target, found[0].law)
        assert best.gain >= max(gains.values())
        assert best.gain < target.worth(block(here, straight).columns).gain + 3.0
        assert gains["ramp"] > gains["smooth"]
        # no step, no bump explains it as well
        assert max(gains["step"], gains["bump"]) < gains["ramp"] - 10.0


def test_a_wheel_on_the_motor_is_found_with_its_order(rv_m2):
    law = Discovered(place="joint_2", quantity="joint_2", shape="harmonic", marks=(51.0,))
    campaign = replace(with_law(rv_m2, law, [0.0, 3e-4, 2e-4], seed=7)[0], gears={"joint_2": 51.0})
    here, target = seen(campaign)
    first = scan(here, [target])[0][0][0].law
    assert (first.place, first.shape, first.marks) == ("joint_2", "harmonic", (51.0,))
    assert shaped(here, target, first).law.marks == (51.0,)
    # who was not told the ratio does not find it
    blind = observe(replace(campaign, gears={}), here.frames)
    assert scan(blind, [target])[0][0][0].gain < 15.0
    # a smooth law of that joint is told its waves where their orders are known
    smooth = replace(first, shape="smooth", marks=(-1.0, -0.5, 0.0, 0.5, 1.0))
    assert shaped(here, target, smooth).law.marks == (51.0,)


def test_a_law_of_nothing_has_one_shape(scanned):
    _, here, target, found = scanned["joint"]
    constant = next(item for item in found if item.law.shape == "constant")
    again = shaped(here, target, constant.law)
    assert again.law == constant.law
    assert again.gain == pytest.approx(constant.gain, rel=1e-9)
