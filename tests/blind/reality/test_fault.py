"""What a fault is drawn like: which joints err, how many, and what its size does not touch."""

import numpy as np
import pytest

pytest.importorskip("mujoco", reason='the blind trial needs "thermal-robot[blind]"')

from thermal_robot.blind.reality import World
from thermal_robot.blind.reality.fault import FAULTS, Fault, clock, joints, own_position, segments, some
from thermal_robot.blind.reality.setting import draw_setting

SCARA = """<robot name="scara">
  <link name="ground"/><link name="inner"/><link name="outer"/><link name="quill"/><link name="flange"/>
  <joint name="shoulder" type="revolute"><parent link="ground"/><child link="inner"/><origin xyz="0 0 0.3"/>
    <axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
  <joint name="elbow" type="revolute"><parent link="inner"/><child link="outer"/><origin xyz="0.3 0 0"/>
    <axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
  <joint name="lift" type="prismatic"><parent link="outer"/><child link="quill"/><origin xyz="0.25 0 0"/>
    <axis xyz="0 0 -1"/><limit lower="0" upper="0.2" effort="1" velocity="1"/></joint>
  <joint name="turn" type="revolute"><parent link="quill"/><child link="flange"/><origin xyz="0 0 -0.1"/>
    <axis xyz="0 0 -1"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
</robot>"""


@pytest.fixture(scope="module")
def scara():
    """Four joints, the third of which slides."""
    return draw_setting(World(SCARA, "flange"), 10, np.random.default_rng(1))


@pytest.fixture(scope="module")
def draws(scara):
    def many(count=200, **asked):
        rng = np.random.default_rng(6)
        return np.array([some(1e-3, 2, **asked)(scara, rng) for _ in range(count)])

    return many


def test_one_to_three_joints_err(draws):
    erring = (draws() != 0).all(axis=2)
    assert set(erring.sum(axis=1)) == {1, 2, 3}
    assert erring.any(axis=0).all()


def test_joints_that_frames_would_hide_are_left_out_even_of_few(draws):
    """Of four joints two are left: three cannot err."""
    erring = (draws(first=False, last=False) != 0).any(axis=2)
    assert not erring[:, [0, 3]].any()
    assert set(erring.sum(axis=1)) == {1, 2}


def test_what_turns_is_not_put_on_a_joint_that_slides(draws):
    erring = (draws(turning=True) != 0).any(axis=2)
    assert not erring[:, 2].any()
    assert erring[:, [0, 1, 3]].any(axis=0).all()


def test_one_of_them_is_no_draw_near_zero(draws):
    assert np.abs(draws()).max(axis=1).min() >= 1e-3
    assert draws(positive=True).min() == 0.0
    assert draws().min() < 0.0


@pytest.mark.parametrize("name", FAULTS)
@pytest.mark.parametrize("seed", range(8))
def test_every_effect_can_be_drawn_for_an_arm_of_four_joints(name, seed, scara):
    values = FAULTS[name].draw(scara, np.random.default_rng(seed))
    assert np.isfinite(values).all()
    assert len(values) == max(len(FAULTS[name].places(scara)), 1)


def test_a_disc_turns_with_no_joint_that_slides(scara):
    rng = np.random.default_rng(3)
    drawn = np.array([FAULTS["transmission_error"].draw(scara, rng) for _ in range(60)])
    on_the_joint = drawn[(drawn[:, :, 4] == 1.0).all(axis=1)]
    assert len(on_the_joint) > 20
    assert not on_the_joint[:, 2, :3].any()


def test_size_scales_all_but_what_is_no_size():
    fault = Fault("x", lambda s, rng: np.ones((2, 3)), lambda *_: None, joints, fixed=((1, (0.0,)),))
    values = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
    np.testing.assert_array_equal(fault.scaled(values, 3.0), [[3.0, 2.0, 9.0], [12.0, 5.0, 18.0]])
    np.testing.assert_array_equal(values[0], [1.0, 2.0, 3.0])


def test_places_and_their_quantities_are_named_by_the_robot(scara):
    assert joints(scara) == [("joint", name) for name in ("shoulder", "elbow", "lift", "turn")]
    assert segments(scara) == [("link", link) for link in ("ground", "inner", "outer", "quill")]
    assert own_position(scara, [("joint", "lift")]) == ["lift"]
    assert list(clock(scara, [])) == ["time", "order"]
