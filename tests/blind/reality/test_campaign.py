"""A case becomes a folder that can be read, with answers that stay outside it."""

import json
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mujoco", reason='the blind trial needs "thermal-robot[blind]"')

from thermal_robot.blind.cases import Case
from thermal_robot.blind.plan import ROBOTS, robots
from thermal_robot.blind.reality import make
from thermal_robot.campaign import read_campaign


@pytest.fixture(scope="module")
def arms():
    return {arm.name: arm for arm in robots([robot for robot in ROBOTS if robot[0] in ("ur10", "rv_m2")])}


@pytest.fixture
def case(arms):
    def of(arm="ur10", kind="single", **asked):
        return Case("c0001", 42, kind, arms[arm], **asked)

    return of


def test_a_campaign_can_be_read_and_holds_what_was_asked(case, tmp_path):
    answers = make(case(effects=("drift", "backlash"), kind="pair"), tmp_path)
    campaign = read_campaign(tmp_path)
    assert campaign.samples == answers["samples"]
    assert set(answers["truth"]["effects"]) == {"drift", "backlash"}
    for part in answers["truth"]["parts"].values():
        assert 2.0 <= part["ratio"] <= 6.0
    assert np.shape(answers["fresh_position"]) == (1000, 3)
    text = "".join(path.read_text() for path in sorted(tmp_path.iterdir()))
    assert "drift" not in text
    assert "backlash" not in text


def test_the_same_seed_makes_the_same_files(case, tmp_path):
    asked = case("rv_m2", effects=("joint_gain",))
    first, second = (make(asked, tmp_path / name) for name in "ab")
    assert json.dumps(first) == json.dumps(second)
    for path in sorted((tmp_path / "a").iterdir()):
        assert path.read_bytes() == (tmp_path / "b" / path.name).read_bytes()
    other = make(replace(asked, seed=43), tmp_path / "c")
    assert json.dumps(other) != json.dumps(first)


def test_without_a_fault_only_noise_is_left(case, tmp_path):
    answers = make(case(kind="null"), tmp_path)
    left = np.array(answers["fresh_position"]) - np.array(answers["fresh_before"])
    per_axis = np.sqrt((left**2).mean())
    # nine parameters of the frames from some hundred rows: sqrt(9 / 3N)
    assert per_axis < 3.0 * np.sqrt(9.0 / (3 * answers["samples"])) * answers["noise"]
    measured = np.asarray(read_campaign(tmp_path).position)
    assert np.isfinite(measured).all()
    assert answers["truth"]["parts"] == {}


def test_a_hidden_column_is_in_neither_table(case, tmp_path):
    asked = case("rv_m2", kind="hidden", effects=("thermal_elongation",), hidden=("temperature",), samples=(40, 50))
    answers = make(asked, tmp_path)
    for name in ("measurements.csv", "fresh.csv"):
        head = (tmp_path / name).read_text().splitlines()[0]
        assert "temperature" not in [column.split(".")[0] for column in head.split(",")]
        assert "time" in head
    assert answers["truth"]["needs"] == ["temperature"]


def test_the_background_is_there_and_far_below_the_noise(case, tmp_path):
    asked = {"ratio": (0.7, 1.5), "samples": (30, 60), "background": 0.15, "heavy": True}
    truth = make(case("rv_m2", kind="hard", effects=("geometric",), **asked), tmp_path)["truth"]
    quiet = {name: part["ratio"] for name, part in truth["parts"].items() if not part["main"]}
    assert {"joint_offset", "drift", "backlash", "transmission_error"} <= set(quiet)
    assert all(0.1 < ratio < 0.2 for ratio in quiet.values())
    assert 0.7 <= truth["parts"]["geometric"]["ratio"] <= 1.5


def test_an_unlisted_cause_comes_with_its_places_and_quantities(case, tmp_path):
    truth = make(case("rv_m2", kind="unlisted", unlisted="slip", samples=(40, 50)), tmp_path)["truth"]
    assert truth["unlisted"] == "slip"
    assert truth["quantities"] == ["time", "order"]
    [place] = truth["places"]
    assert place["kind"] == "joint"
    assert truth["parts"]["slip"]["main"]
    assert truth["parts"]["slip"]["places"] == [place]


def test_motors_wheels_come_with_the_ratio_that_shows_them(case, tmp_path):
    """A draw with a disc on the motor's side states its ratio; one on the joint's side states none."""
    stated = set()
    for seed in range(40):  # one draw in five is on the motor's side: 1e-4 that none of forty is
        asked = replace(case("rv_m2", effects=("transmission_error",), samples=(30, 32)), seed=seed)
        make(asked, tmp_path / str(seed))
        stated.add(tuple(set(read_campaign(tmp_path / str(seed)).gears.values())))
        if len(stated) > 1:
            break
    assert () in stated
    [(ratio,)] = stated - {()}
    assert 30.0 <= ratio <= 160.0


def test_a_case_that_no_draw_can_show_is_withdrawn_and_says_why(case, tmp_path):
    (tmp_path / "idle.py").write_text(
        "import numpy as np\n"
        "from thermal_robot.blind.reality import Fault\n"
        "from thermal_robot.blind.reality.fault import joints\n"
        "IDLE = Fault('idle', lambda s, rng: np.ones((s.world.n, 1)), lambda *_: None, joints)\n"
    )
    asked = case("rv_m2", effects=("idle",), own=f"{tmp_path / 'idle.py'}:IDLE", samples=(30, 32))
    assert make(asked, tmp_path / "campaign") == {"withdrawn": "idle cannot be seen in this campaign"}
    assert not (tmp_path / "campaign").exists()
