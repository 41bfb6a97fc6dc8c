"""How large a fault is, what another could have done as well, how well a change is told, which answers are right."""

import numpy as np
import pytest
from helpers import some

pytest.importorskip("mujoco", reason='the blind trial needs "thermal-robot[blind]"')

from thermal_robot.blind.cases import Case
from thermal_robot.blind.plan import robots
from thermal_robot.blind.reality import FAULTS, UNLISTED, make, sizes
from thermal_robot.blind.reality.fault import Fault
from thermal_robot.blind.reality.setting import draw_setting
from thermal_robot.blind.reality.sizes import (
    GROWS_ONLY,
    FaultParameter,
    Gauge,
    Unseen,
    deviation,
    draw_fault_parameter,
    near,
    place,
    shares,
    sized,
)
from thermal_robot.blind.reality.world import from_vector
from thermal_robot.campaign import read_campaign
from thermal_robot.effects import gate, library
from thermal_robot.observations import observe


@pytest.mark.parametrize("name", some([*FAULTS, *UNLISTED], 6))
def test_every_fault_moves_the_target_as_far_as_it_is_told(name, ur10):
    fault: Fault = {**FAULTS, **UNLISTED}[name]
    rng = np.random.default_rng(7)
    day = draw_setting(
        ur10,
        80,
        rng,
        moving="moving" in fault.wants,
        visits=(4, 4) if "repeats" in fault.wants else (1, 1),
        sensor="links",
        sessions="sessions" in fault.wants,
    )
    day.extra.update(humidity=45.0 + np.arange(80) / 8, motor_temperature=25.0 + np.arange(80) / 3.0)
    unknown = not {"base_known", "tool_known"} & set(fault.wants)
    gauge = Gauge(day, np.arange(80), np.array([0.02, 0.0, 0.1]), unknown, unknown)
    values = sized(gauge, fault, fault.draw(day, rng), 1e-4)
    assert gauge.rms(gauge.left(gauge.moved(fault, values))) == pytest.approx(1e-4, rel=0.05)
    # twice the size, twice the displacement: faults are small (an encoder's steps are not: they are chance)
    if name != "encoder_resolution":
        one, two = gauge.moved(fault, values), gauge.moved(fault, fault.scaled(values, 2.0))
        np.testing.assert_allclose(two, 2.0 * one, atol=0.02 * np.abs(two).max())
    np.testing.assert_allclose(gauge.moved(fault, fault.scaled(values, 0.0)), 0.0, atol=1e-14)


def test_no_single_other_effect_does_what_is_measured_beyond_it(gauge):
    """A joint's offset is geometry: nothing of it is beyond; a gain leaves little beyond harmonics, drift a lot."""
    offset, drift = np.zeros((6, 1)), np.zeros((1, 7))
    offset[2], drift[0] = 1e-3, (1e-4, 0, 0, 1e-4, 0, 0, 2400.0)
    moved = gauge.moved(FAULTS["joint_offset"], offset)
    assert gauge.beyond(FAULTS["joint_offset"], moved, ["geometric"])["geometric"] < 2e-3 * gauge.rms(moved)
    moved = gauge.moved(FAULTS["drift"], drift)
    beyond = gauge.beyond(FAULTS["drift"], moved, ["geometric", "backlash"])
    assert min(beyond.values()) > 0.5 * gauge.rms(gauge.left(moved))


def test_two_others_together_leave_no_more_than_either(gauge):
    rng = np.random.default_rng(3)
    fault = FAULTS["joint_gain"]
    moved = gauge.moved(fault, fault.draw(gauge.setting, rng))
    names = ["drift", "backlash", "thermal_elongation"]
    alone = gauge.beyond(fault, moved, names)
    pairs = gauge.beyond(fault, moved, names, together=2)
    assert len(pairs) == 3
    for pair, left in pairs.items():
        assert left <= min(alone[name] for name in pair.split(" with ")) + 1e-15
    assert max(alone.values()) <= gauge.rms(gauge.left(moved)) + 1e-15


def test_a_kind_of_fault_can_do_whatever_of_it_was_drawn(gauge):
    """To first order: springs, joints and frames lie in what their kind spans."""
    rng = np.random.default_rng(4)
    for name in ("joint_offset", "joint_gain", "geometric", "thermal_elongation", "instrument_scale"):
        fault = FAULTS[name]
        basis = gauge.basis(fault)
        np.testing.assert_allclose(basis.T @ basis, np.eye(basis.shape[1]), atol=1e-10)
        left = gauge.left(gauge.moved(fault, fault.draw(gauge.setting, rng)))
        assert gauge.rms(left - basis @ (basis.T @ left)) < 0.01 * gauge.rms(left), name


def test_alignment_takes_a_rigid_motion_and_a_shifted_target_away(setting, gauge):
    twist = 1e-5 * np.array([1.0, -2.0, 0.5, 1.0, 3.0, -1.0])
    motion = from_vector(twist[None])[0]
    target = gauge.target + 1e-5
    moved = (
        (setting.poses[:, :3, :3] @ target + setting.poses[:, :3, 3]) @ motion[:3, :3].T + motion[:3, 3] - gauge.sound
    )
    assert gauge.rms(moved.ravel()) > 1e-5
    assert gauge.rms(gauge.left(moved.ravel())) < 1e-8
    known = Gauge(setting, np.arange(setting.samples), gauge.target, False, False)
    np.testing.assert_array_equal(known.left(moved.ravel()), moved.ravel())


def test_places_come_with_what_each_does_alone_largest_first(gauge):
    values = np.zeros((6, 1))
    values[[1, 4], 0] = 1e-5, 1e-3
    found = shares(gauge, FAULTS["joint_gain"], values)
    assert [number for _, number, _ in found[:2]] == [4, 1]
    assert found[0][0] == ("joint", gauge.setting.world.names[4])
    sizes = [size for _, _, size in found]
    assert sizes == sorted(sizes, reverse=True)
    assert max(sizes[2:]) < 1e-12


@pytest.mark.parametrize(
    ("name", "day", "seen"),
    [
        ("tracking_lag", {}, False),
        ("tracking_lag", {"moving": True}, True),
        ("excess_repeatability", {}, False),
        ("excess_repeatability", {"visits": (4, 4)}, True),
        ("thermal_bending", {"sensor": "air"}, False),
        ("thermal_bending", {"sensor": "links"}, True),
        ("remounted_target", {}, False),
        ("remounted_target", {"sessions": True}, True),
        ("base_frame", {}, False),
        ("drift", {}, True),
    ],
)
def test_a_day_shows_what_it_has_the_conditions_for(name, day, seen, ur10):
    setting = draw_setting(ur10, 20, np.random.default_rng(1), **day)
    gauge = Gauge(setting, np.arange(20), np.zeros(3), True, True)
    assert sizes.testable({**FAULTS, **UNLISTED}[name], gauge) is seen


def test_faults_at_once_are_one_robot(setting, gauge):
    """Small as they are, two together move the target as far as one after the other; in any frame of the instrument."""
    rng = np.random.default_rng(9)
    pair = [(FAULTS[name], 0.1 * FAULTS[name].draw(setting, rng)) for name in ("joint_gain", "thermal_elongation")]
    alone = sum(gauge.moved(fault, values) for fault, values in pair)
    both = (place(setting, pair, gauge.target)[0] - gauge.sound).ravel()
    np.testing.assert_allclose(both, alone, atol=1e-3 * np.abs(both).max())
    pose = from_vector(np.array([[1.0, 2.0, 0.5, 0.2, -0.3, 1.0]]))[0]
    seen, turned = place(setting, pair, gauge.target, pose)
    np.testing.assert_allclose(seen, place(setting, pair, gauge.target)[0] @ pose[:3, :3].T + pose[:3, 3], atol=1e-12)
    np.testing.assert_allclose(turned.transpose(0, 2, 1) @ turned, np.tile(np.eye(3), (90, 1, 1)), atol=1e-12)


# ---- deviations of a change

OFFSET, GAIN, PLAY = FAULTS["joint_offset"], FAULTS["joint_gain"], FAULTS["backlash"]
NOISE = 2e-5


def zeros(setting, fault):
    return np.zeros_like(fault.draw(setting, np.random.default_rng(0)))


def test_the_deviation_is_how_far_fits_to_noise_scatter(setting, gauge):
    """Displacements by the whole reality instead of slopes, least squares instead of projections, drawn noise."""
    gains = zeros(setting, GAIN)
    gains[2] = 1e-3
    sizes = np.diag(np.full(setting.world.n, 1e-5))
    columns = [gauge.moved(OFFSET, row[:, None]) / 1e-5 for row in sizes]
    columns.append(gauge.moved(GAIN, 1e-2 * gains) / 1e-5)
    design = np.column_stack([gauge.frames, *columns])
    chance = np.random.default_rng(5).normal(size=(len(design), 4000))
    # the first and the last zero are the frames': the shortest solution leaves the others as they are
    fitted = np.linalg.lstsq(design, NOISE * chance, rcond=1e-8)[0]
    number = gauge.frames.shape[1] + 3
    std, _ = deviation(gauge, FaultParameter(OFFSET, 3), zeros(setting, OFFSET), [(GAIN, gains)], NOISE)
    assert np.std(fitted[number]) == pytest.approx(std, rel=0.05)


def test_what_else_is_at_work_makes_a_number_harder_to_tell_and_what_is_not_does_not(setting, gauge):
    def told(gain, noise=NOISE):
        beside = zeros(setting, GAIN)
        beside[3] = gain
        return deviation(gauge, FaultParameter(OFFSET, 3), zeros(setting, OFFSET), [(GAIN, beside)], noise)[0]

    alone, _ = deviation(gauge, FaultParameter(OFFSET, 3), zeros(setting, OFFSET), [], NOISE)
    assert (told(0.0), told(0.0, 2 * NOISE)) == pytest.approx((alone, 2 * alone))
    assert told(1e-3) > 1.001 * alone


def test_what_frames_take_up_is_not_asked_for(setting, gauge):
    with pytest.raises(Unseen, match="joint_offset"):
        deviation(gauge, FaultParameter(OFFSET, 0), zeros(setting, OFFSET), [], NOISE)
    drawn = {draw_fault_parameter(OFFSET, zeros(setting, OFFSET), np.random.default_rng(k)).number for k in range(60)}
    assert drawn == set(range(1, setting.world.n - 1))


def test_a_place_is_one_where_the_fault_is_at_work(setting):
    values = zeros(setting, PLAY)
    values[[0, 4], 0] = 2e-4
    drawn = {draw_fault_parameter(PLAY, values, np.random.default_rng(k)).number for k in range(40)}
    assert drawn == {0, 4}


@pytest.mark.parametrize("name", ["joint_offset", "joint_gain", "backlash", "joint_compliance"])
def test_a_change_has_the_name_and_the_size_of_what_formats_md_says(name, setting, gauge):
    fault = FAULTS[name]
    values, spot = fault.draw(setting, np.random.default_rng(1)), FaultParameter(fault, 2)
    by = 1e-4 * (1.0 if name in GROWS_ONLY else -1.0)
    told, amount = spot.change(setting, values, by)
    joint = setting.world.names[2]
    assert told["parameter"].endswith(f", {joint}")
    assert told["place"] == {"kind": "joint", "name": joint}
    # the displacement that the amount stands for, in the convention of formats.md
    body = setting.world.sound(setting.samples)
    fault.act(body, setting, spot.moved(values, by))
    before = setting.world.sound(setting.samples)
    fault.act(before, setting, values)
    moved = body.joints[:, 2] - before.joints[:, 2] - (body.springs - before.springs)[2] * setting.torque[:, 2]
    held = np.abs(setting.torque[:, 2]) < 0.2 * values[2, 1] if name == "backlash" else np.ones(setting.samples, bool)
    unit = {
        "joint_offset": np.ones(setting.samples),
        "joint_gain": setting.q[:, 2],
        "backlash": -0.5 * setting.approach[:, 2],
        "joint_compliance": -setting.torque[:, 2],
    }[name]
    np.testing.assert_allclose(moved[held], amount * unit[held], rtol=1e-6, atol=1e-12)


# ---- which answers about a case are right


@pytest.fixture(scope="module")
def arm():
    return robots([("ur10", "example-robot-data:ur10", "tool0")])[0]


def test_near_is_what_stands_beside_along_the_chain(ur10):
    beside = near(ur10, [("joint", "elbow_joint")])
    assert {name for kind, name in beside if kind == "joint"} == {
        "shoulder_lift_joint", "elbow_joint", "wrist_1_joint",
    }  # fmt: skip
    assert {name for kind, name in beside if kind == "link"} == {"upper_arm_link", "forearm_link"}
    assert ("base", "base") not in beside
    assert ("base", "base") in near(ur10, [("joint", "shoulder_pan_joint")])
    assert ("tool", "tool") in near(ur10, [("joint", "wrist_3_joint")])
    # beside a link are the joints at its ends and the links beyond
    beside = set(near(ur10, [("link", "forearm_link")]))
    assert beside >= {("joint", "elbow_joint"), ("joint", "wrist_1_joint"), ("link", "upper_arm_link")}
    assert ("joint", "shoulder_lift_joint") not in beside
    # beside base and tool is what they carry or hang on
    first, last = near(ur10, [("base", "base")]), near(ur10, [("tool", "tool")])
    assert [name for _, name in first if name in ur10.names] == ["shoulder_pan_joint"]
    assert [name for _, name in last if name in ur10.names] == ["wrist_3_joint"]
    assert near(ur10, []) == []


def test_true_parameters_have_the_names_that_the_diagnosis_has_for_them(arm, ur10, tmp_path):
    asked = {"samples": (30, 30), "wants": ("moving", "sensor:links", "repeats", "base_known")}
    make(Case("c1", 5, "null", arm, **asked), tmp_path)
    observed = observe(read_campaign(tmp_path))
    setting = draw_setting(ur10, 30, np.random.default_rng(1), moving=True, sensor="links")
    for name, effect in library().items():
        fault: Fault = FAULTS[name]
        true = fault.known_as(setting, fault.draw(setting, np.random.default_rng(2)))
        known = {p.name for v in gate.variants(effect, observed) for p in gate.checked(v, observed)}
        if not effect.random and not any("order 6" in p for p in true):
            assert {p for p in true if "order" not in p or known & {p}} <= known, name
            assert not true or known & set(true), name


def test_a_true_parameter_is_the_size_that_it_had(arm, tmp_path):
    """A scale of 1 part in 10⁴ leaves, over rows that lie a metre from the middle, a tenth of a millimetre."""
    truth = make(Case("c1", 3, "single", arm, effects=("instrument_scale",), samples=(60, 60)), tmp_path)
    scale = truth["truth"]["parameters"]["instrument_scale"]["scale error, instrument"]
    position = np.array(truth["fresh_position"])
    spread = np.sqrt(((position - position.mean(axis=0)) ** 2).mean())
    left = truth["truth"]["parts"]["instrument_scale"]["ratio"] * truth["noise"]
    assert abs(scale) * spread == pytest.approx(left, rel=0.4)  # frames take some of it


def test_a_cause_that_follows_nothing_says_so_and_an_effect_beside_it_is_asked_for(arm, tmp_path):
    asked = Case("c1", 4, "both", arm, effects=("joint_gain",), unlisted="coolant", samples=(60, 60))
    truth = make(asked, tmp_path)["truth"]
    assert truth["effects"] == ["joint_gain"]
    assert truth["quantities"] == ["none"]
    assert len(truth["places"]) == 1
    assert truth["places"][0] in truth["near"]
    assert set(truth["parts"]) == {"joint_gain", "coolant"}
    assert set(truth["parameters"]) == {"joint_gain"}
