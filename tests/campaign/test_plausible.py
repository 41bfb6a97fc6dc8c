"""What is accepted but doubtful is told in one sentence, and nothing is said of an ordinary campaign."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from campaign.files import PLAIN, PLAIN_TOML, read, says, with_column
from conftest import load_arm
from other_robots import base_moved, lengthened, measured, read_with
from simulate import simulate

from thermal_robot import campaign_from_table, demo_campaign
from thermal_robot.campaign import Campaign, read_campaign
from thermal_robot.campaign.plausible import another_unit, copies, doubled, doubts, marks
from thermal_robot.kinematics import tool_poses
from thermal_robot.robot import Robot

DEGREES = {"toml": PLAIN_TOML.replace('"rad"', '"deg"')}
FREE = '<limit lower="-3" upper="3" effort="1" velocity="1"/>'
TURNED = -2 * math.pi * 2.01  # rad, of a joint without limits
# table, other files, what is said
DOUBTFUL = [
    (PLAIN.replace("0.5,-0.4", "0.5,-2.1"), {}, "'lift' … 1 row … row 4 … -2.1 rad … limit -2 rad"),
    (PLAIN.replace(",60,", ",600,"), {}, "'slide' … 1 row … row 3 … 600 mm … limit 500 mm"),
    (PLAIN.replace("0.1,0.2,", "45,0.2,"), {}, "'turn' … 45 rad … row 2 … two turns … angle_unit = \"deg\""),
    (PLAIN.replace("3.5", f"{TURNED:.6f}"), {}, "'roll' … two turns"),
    (PLAIN.replace(",2,8", ",0.5,8"), {}, "'time' runs backwards 1 time … row 3 … 0.5 s after 1 s"),
    (with_column("speed", "0.5", "50", "100"), {}, "'speed' is outside 0..1 in 2 rows … row 3 … 50 … fraction"),
    (with_column("temperature", "293", "294", "295"), {}, "'temperature' … 294 °C … kelvin"),
    (with_column("temperature.beam", *["151"] * 3), {}, "'temperature.beam' … kelvin"),
    (with_column("temperature.beam", *["149"] * 3), {}, "'temperature.beam' … degrees Fahrenheit"),
    (with_column("pose", "a", "b", "a"), {}, "same pose label … different joint commands … 'a'"),
    (PLAIN.replace("1000,0", "90000000,0"), {}, 'extend over … m and the arm reaches 1.9 m … length_unit = "mm"'),
    (PLAIN, DEGREES, 'no joint leaves ±3.5 degrees: is angle_unit = "rad" meant?'),
    (PLAIN.replace("3.5", "6.2"), DEGREES, 'angle_unit = "rad" meant'),
    (PLAIN, {"toml": PLAIN_TOML.replace("80.0]", "80000.0]")}, 'target lies 80 m … is length_unit = "mm" right?'),
    (PLAIN, {"toml": PLAIN_TOML.replace("0.02", "20")}, 'noise … is length_unit = "mm" right?'),
]


@pytest.mark.parametrize(("table", "other", "said"), DOUBTFUL)
def test_what_is_doubtful_is_told_once(tmp_path, table, other, said):
    warnings = read(tmp_path, table=table, **other).warnings
    assert len([warning for warning in warnings if says(warning, said)]) == 1, warnings
    assert not any("\n" in warning for warning in warnings)


@pytest.mark.parametrize(
    ("table", "other"),
    [
        (PLAIN, {}),
        (PLAIN.replace("0.5,-0.4", "0.5,-2.0000005"), {}),  # the last digit is no violation
        (PLAIN.replace("3.5", f"{TURNED * 1.99 / 2.01:.6f}"), {}),
        (PLAIN.replace("3.5", "6.4"), DEGREES),
    ],
)
def test_what_is_within_its_bounds_is_not_told(tmp_path, table, other):
    assert read(tmp_path, table=table, **other).warnings == ()


def test_joints_without_limits_are_told(tmp_path: Path) -> None:
    read(tmp_path)
    file = tmp_path / "robot.urdf"
    file.write_text(file.read_text().replace(FREE, ""))
    told = [warning for warning in read_campaign(tmp_path).warnings if "limits" in warning]
    assert told == ["the URDF gives no limits for 'turn': no command is checked against any there"]


def test_labels_of_one_pose_may_differ_by_what_a_controller_repeats(tmp_path: Path) -> None:
    same = PLAIN.replace("-0.1,0.3,60,3.5", "0.1005,0.2,30,0.4").replace("0.5,-0.4,90,-0.4", "0.4,-0.4,90,-0.4")
    table = "\n".join(f"{line},{label}" for line, label in zip(same.split(), ("pose", "a", "a", "b"), strict=True))
    rows = table + "\n0.9,-0.4,90,-0.4,800,250,520,4,9,c\n"
    assert read(tmp_path, table=rows).warnings == ()
    assert any("'a'" in w for w in read(tmp_path, table=rows.replace("0.1005", "0.102")).warnings)


def commands(robot: Robot) -> np.ndarray:
    return np.random.default_rng(2).uniform(robot.lower, robot.upper, (30, robot.n))


@pytest.mark.parametrize(("scale", "doubted"), [(1.0, False), (1e-3, True), (1e3, True)])
def test_measurements_that_are_far_too_small_or_large(rv_m2: Robot, scale: float, doubted: bool) -> None:
    q = commands(rv_m2)
    campaign = Campaign("c", rv_m2, q, scale * tool_poses(rv_m2, q)[:, :3, 3])
    assert any("the measured positions extend over" in sentence for sentence in doubts(campaign)) == doubted
    # a target on the axes of the wrist may stay in place
    q = np.tile([0.1, 0.5, -1.0, 0.0, 0.0], (30, 1))
    q[:, 2:] += np.random.default_rng(2).uniform(-1, 0, (30, 3))
    assert doubts(Campaign("c", rv_m2, q, np.full((30, 3), 0.3))) == []


@pytest.mark.parametrize(
    ("scale", "said"),
    [
        (1000.0, "the URDF stands in mm: its links are a thousand times too long"),
        (100.0, "the URDF stands in cm: its links are a hundred times too long"),
        (1 / 0.0254, "the URDF stands in inch: its links are 39 times too long"),
        (1e-3, "a thousand times too short"),
    ],
)
def test_a_urdf_in_another_unit_is_told(rv_m2: Robot, scale: float, said: str) -> None:
    scaled, q = lengthened(rv_m2, dict.fromkeys((s.name for s in rv_m2.segments), scale)), commands(rv_m2)
    (told,) = doubts(Campaign("c", scaled, q, tool_poses(rv_m2, q)[:, :3, 3]))
    assert said in told
    assert another_unit(Campaign("c", rv_m2, q, None)) is None


def test_points_farther_apart_than_commands_lead_are_told_unless_the_base_moved(rv_m2: Robot) -> None:
    def told(campaign: Campaign) -> bool:
        return any("no place of base and target mends that, unless one was moved" in each for each in doubts(campaign))

    for factor in (1.0, 3.0):
        sister = lengthened(rv_m2, dict.fromkeys((s.name for s in rv_m2.segments), factor))
        assert told(read_with(measured(sister, 1, lever=0.3, joint_offset=0.05), rv_m2)) == (factor > 1.0)
    campaign = base_moved(measured(rv_m2, 2), 30, seed=1)
    assert told(campaign)
    assert not told(replace(campaign, labels={"session": np.repeat(["a", "b"], 30)}))


@pytest.fixture(scope="module")
def demo() -> Campaign:
    return replace(demo_campaign(), units=replace(demo_campaign().units, angle="deg"))


def covariate(campaign, name, values):
    return replace(campaign, covariates={**campaign.covariates, name: values})


def simulated(campaign, scale):
    """What a simulator of the robot says, its lengths scaled, in a frame of its own."""
    poses = tool_poses(campaign.robot, campaign.q)
    place = scale * poses[:, :3, 3] + poses[:, :3, :3] @ campaign.target
    turned = place @ np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]) + [1.0, 2.0, 3.0]
    return replace(campaign, simulated_position=turned)


def rounded(values, step):
    return np.round(values / step) * step


def warmer(campaign, change):
    return covariate(campaign, "temperature", change(campaign.covariates["temperature"]))


MISTAKES = {
    "temperature … Fahrenheit": lambda c: warmer(c, lambda t: 32.0 + 1.8 * t),
    "temperature … kelvin": lambda c: warmer(c, lambda t: 273.15 + t),
    "reference temperature … kelvin": lambda c: replace(c, reference_temperature=293.15),
    "reference temperature … Fahrenheit": lambda c: replace(c, reference_temperature=68.0),
    "payload … 1500 kg … grams": lambda c: covariate(c, "payload", np.full(c.samples, 1500.0)),
    "multiples of 0.1 deg … rounded": lambda c: replace(c, q=rounded(c.q, np.radians(0.1))),
    "rounded to 1 mm … 0.29 mm": lambda c: replace(c, position=rounded(c.position, 1e-3)),
    "1.7 rad … is it in rad?": lambda c: replace(c, noise_orientation=1.7),
    "0.02 µm … length_unit": lambda c: replace(c, noise_position=2e-8),
    "sim.x … another robot": lambda c: simulated(c, 1.3),
}


@pytest.mark.parametrize("said", MISTAKES)
def test_a_mistake_is_told_in_one_sentence(demo, said):
    (told,) = doubts(MISTAKES[said](demo))
    assert says(told, said)
    assert "\n" not in told


@pytest.mark.parametrize(
    "change",
    [
        lambda c: c,
        lambda c: simulated(c, 1.0),  # wherever it stands
        lambda c: simulated(c, 1.002),
        lambda c: replace(c, position=rounded(c.position, 1e-5)),  # finer than the noise
        lambda c: replace(c, noise_position=None, position=rounded(c.position, 1e-4)),
    ],
)
def test_what_is_no_mistake_is_not_told(demo, change):
    assert doubts(change(demo)) == []


def test_slides_in_another_unit_are_told_and_typed_commands_are_not(demo):
    sliding = simulate(load_arm("awkward"), seed=2, samples=40)[0]
    slides = np.array(sliding.robot.joint_types) == "prismatic"
    told = [t for t in doubts(replace(sliding, q=np.where(slides, 1e3 * sliding.q, sliding.q))) if "length_unit" in t]
    names = np.array(sliding.robot.joint_names)[slides]
    assert doubts(sliding) == []
    assert any(repr(str(name)) in sentence for name in names for sentence in told)
    assert not any("reaches" in sentence for sentence in told)
    typed = np.radians(np.random.default_rng(3).choice([-30.0, 0.0, 15.0, 40.0], demo.q.shape))
    assert not any("multiples" in told for told in doubts(replace(demo, q=typed)))


NAMES = ("rv_m2", "ur5", "panda")
NO_CLOCK = {"covariates": {}}
arm = cache(load_arm)


@cache
def placed(name, seed, samples=60, repeats=1, step=0.0):
    """A campaign whose instrument stands somewhere, its figures rounded to ``step`` m."""
    rng, noise = np.random.default_rng(seed), 2e-5
    found = simulate(arm(name), [], samples=samples, seed=seed, noise=noise)[0]
    pose = np.repeat(np.arange(samples // repeats), repeats)
    place = found.position[pose] + rng.uniform(-2, 2, 3) + (repeats > 1) * rng.normal(0.0, noise, (len(pose), 3))
    place = place.round(6) if not step else step * np.round(place / step)
    return replace(found.take(np.arange(len(pose))), q=found.q[pose], position=place)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("unit", ["m", "mm", "inch"])
@pytest.mark.parametrize(
    ("figures", "said"),
    [
        ((-9999.0, None, None), "x is −9999 in 7 rows ({} …): a mark of a missing value?"),
        ((None, None, 99999.5), "z is 99999.5 in 7 rows ({} …): a mark of a missing value?"),
        ((0.0, 0.0, 0.0), "x = y = z = 0 in 7 rows ({} …): was the beam lost?"),
        ((-999.0, -999.0, -999.0), "x = y = z = −999 in 7 rows ({} …): was the beam lost?"),
    ],
)
def test_a_figure_that_does_not_follow_the_robot_is_told(name, unit, figures, said):
    sound = placed(name, len(name) + len(unit))
    sound = replace(sound, units=replace(sound.units, length=unit))
    struck = np.sort(np.random.default_rng(len(name) + len(unit)).choice(60, 7, replace=False))
    place = np.array(sound.position)
    for k, value in enumerate(figures):
        if value is not None:
            place[struck, k] = value * sound.units.length_scale
    spoilt = replace(sound, position=place)
    rows, sentences = marks(spoilt)
    assert np.flatnonzero(rows).tolist() == struck.tolist()
    assert sentences == [said.format(", ".join(str(row) for row in sound.rows[struck][:5]))]
    # what else is said is said of the other rows: the extent of the figures is no other unit
    assert doubts(spoilt) == [*sentences, *doubts(sound)]


def test_an_old_reading_and_two_marks_are_told_apart():
    place = np.array(placed("rv_m2", 3).position)
    place[11:15] = place[10]
    rows, (said,) = marks(replace(placed("rv_m2", 3), position=place))
    assert np.flatnonzero(rows).tolist() == [10, 11, 12, 13, 14]
    assert said.startswith("(x, y, z) = (")
    assert said.endswith("in 5 rows (12, 13, 14, 15, 16): was the beam lost?")
    place = np.array(placed("rv_m2", 4).position)
    place[5:9, 1], place[20:29, 1] = 9.999, -9.999
    rows, sentences = marks(replace(placed("rv_m2", 4), position=place))
    assert rows.sum() == 13
    assert [said[:11] for said in sentences] == ["y is −9999 ", "y is 9999 i"]


@pytest.mark.parametrize("step", [0.0, 1e-6, 1e-4, 1e-3])
@pytest.mark.parametrize("name", NAMES)
def test_nothing_is_said_of_sound_rounded_tables(name, step):
    for seed, (samples, repeats) in enumerate([(15, 1), (60, 1), (300, 1), (240, 30), (60, 4)]):
        sound = placed(name, seed, samples, repeats=repeats, step=step)
        assert marks(sound)[1] == []
        assert list(doubled(sound)) == []
        assert list(doubled(replace(sound, **NO_CLOCK))) == []


@pytest.mark.parametrize("sockets", [1, 2, 3])
def test_what_stays_by_design_is_no_mark(rv_m2, sockets):
    places = np.random.default_rng(1).uniform(-0.5, 0.5, (sockets, 3))
    assert marks(replace(placed("rv_m2", 5), position=places[np.arange(60) % sockets]))[1] == []
    # a row of poses in the plane y = 0, and in one height, exact as a simulator writes them
    sound = simulate(rv_m2, [], samples=60, seed=2, noise=0.0)[0]
    q = np.array(sound.q)
    q[::3, [0, 3, 4]] = 0.0
    place = rv_m2.forward(q)[:, :3, 3]
    place[::3, 1] = 0.0
    assert marks(replace(sound, q=q, position=place))[1] == []
    assert marks(demo_campaign())[1] == []
    assert not copies(demo_campaign()).any()


def test_a_mark_of_one_of_several_targets_is_told_by_its_columns():
    sound = simulate(arm("rv_m2"), [], samples=40, seed=6, turning=1e-5)[0]
    frame = sound.to_frame().drop(columns=["x", "y", "z", "qw", "qx", "qy", "qz"])
    pose = arm("rv_m2").forward(sound.q)
    for k, offset in enumerate([[0.0, 0.0, 0.1], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.1, 0.1, 0.1]], start=1):
        place = pose[:, :3, 3] + pose[:, :3, :3] @ np.array(offset)
        if k == 2:
            place[[4, 9, 30]] = 0.0
        frame[[f"x.{k}", f"y.{k}", f"z.{k}"]] = place
    found = campaign_from_table(arm("rv_m2"), frame, length_unit="m", angle_unit="rad")
    assert any(w.startswith("x.2 = y.2 = z.2 = 0 in 3 rows (6, 11, 32): was") for w in found.warnings)


def test_a_copy_is_told_with_the_row_that_it_copies():
    once = placed("rv_m2", 7)
    one = replace(once.take(np.array([*range(60), 10])), rows=np.arange(2, 63))
    assert list(doubled(one)) == ["rows 12 and 62 are the same in every column: a copy, no repeat"]
    assert np.flatnonzero(copies(one)).tolist() == [60]
    three = replace(once.take(np.array([*range(60), 10, 10, 5])), rows=np.arange(2, 65))
    (said,) = doubled(three)
    assert said == "3 rows (62, 63, 64) are the same in every column as 2 rows (7, 12): copies, no repeats"
    # another second, another session: no copy
    assert not copies(covariate(one, "time", np.arange(61.0))).any()
    assert not copies(replace(one, labels={"session": np.array(["a"] * 60 + ["b"])})).any()


def test_repeats_that_coarse_figures_cannot_tell_are_no_copies():
    coarse = replace(placed("rv_m2", 8, 60, repeats=30, step=1e-4), **NO_CLOCK)
    assert len(np.unique(coarse.position, axis=0)) < 60
    assert not copies(coarse).any()
    fine = replace(placed("rv_m2", 8, 60, repeats=30), **NO_CLOCK)
    twice = replace(fine.take(np.repeat(np.arange(60), 2)), rows=np.arange(2, 122))
    assert copies(twice).sum() == 60
