"""What the program raises on purpose: one root, a sentence with the place, and data that survive a journey."""

import copy
import pickle
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import thermal_robot as tr
from thermal_robot import describe, diagnose, errors, observe, write_campaign
from thermal_robot.campaign import Units
from thermal_robot.errors import CampaignError, RobotError, ThermalRobotError
from thermal_robot.observations import Frames

CLASSES = [kind for kind in vars(errors).values() if isinstance(kind, type)]
KINDS = [kind for kind in CLASSES if issubclass(kind, Exception) and not issubclass(kind, Warning)]
RAISED = [
    RobotError("no link 'tol'", name="tol", candidates=["tool", "tool0"]),
    CampaignError("t.csv", "a value is missing", row=3, column="x", found="''", expected="a number"),
    CampaignError("t.csv", "is empty"),
    errors.EffectError("no effect 'drif'"),
    errors.OwnEffectError("effect 'drift': reads() raised KeyError('time')"),
    errors.UnknownEffectError("no effect named 'drif' was considered"),
    errors.EstimationError("too few rows"),
    errors.SealError("these answers were changed"),
]


def test_there_is_one_root():
    assert len(KINDS) == 8
    assert all(issubclass(kind, ThermalRobotError) for kind in KINDS)
    assert not issubclass(ThermalRobotError, (ValueError, OSError))  # caught by nobody who means something else


def test_every_kind_is_tried_here():
    assert {type(error) for error in RAISED} == set(KINDS) - {ThermalRobotError}


@pytest.mark.parametrize("again", [lambda e: pickle.loads(pickle.dumps(e)), copy.copy, copy.deepcopy])
@pytest.mark.parametrize("error", RAISED, ids=lambda e: type(e).__name__)
def test_an_error_crosses_processes_with_all_that_it_carries(error, again):
    other = again(error)
    assert type(other) is type(error)
    assert str(other) == str(error)
    assert vars(other) == vars(error)


def test_a_users_own_error_crosses_too():
    error = pickle.loads(pickle.dumps(OwnError(1.5)))
    assert (str(error), error.size) == ("of size 1.5", 1.5)


class OwnError(ThermalRobotError):
    """A constructor that the message alone would not satisfy."""

    def __init__(self, size):
        super().__init__(f"of size {size}")
        self.size = size


@pytest.mark.parametrize(
    ("place", "sentence"),
    [
        ({}, "t.csv: is odd"),
        ({"row": 3}, "t.csv, row 3: is odd"),
        ({"column": "x"}, "t.csv, column 'x': is odd"),
        ({"row": 0, "column": "x"}, "t.csv, row 0, column 'x': is odd"),
        ({"key": "effects[2].values[3]"}, "t.csv, effects[2].values[3]: is odd"),
        ({"found": "7"}, "t.csv: is odd; found 7"),
        ({"expected": "8"}, "t.csv: is odd, expected 8"),
        ({"row": 2, "found": "", "expected": "8"}, "t.csv, row 2: is odd; found , expected 8"),
    ],
)
def test_the_sentence_names_what_is_known_and_no_more(place, sentence):
    error = CampaignError("t.csv", "is odd", **place)
    assert str(error) == sentence
    for name in ("row", "column", "key", "found", "expected"):
        assert getattr(error, name) == place.get(name)


def test_a_robots_error_names_what_offends_and_what_would_do():
    error = RobotError("no such link", name="tol", candidates=iter(["tool"]))
    assert (str(error), error.name, error.candidates) == ("no such link", "tol", ("tool",))
    assert (RobotError("odd").name, RobotError("odd").candidates) == ("", ())


@pytest.fixture(scope="module")
def demo():
    return tr.demo_campaign()


TABLE = pd.DataFrame({"joint_1": [0.0]})
WRONG = {
    "diagnose nothing": (lambda demo: tr.diagnose(None), "found NoneType, expected a campaign, or the path of one"),
    "diagnose a table": (lambda demo: tr.diagnose(TABLE), "found DataFrame, expected … campaign_from_table makes one"),
    "diagnose only a number": (lambda demo: tr.diagnose(demo, only=3), "only: … found int, expected names of effects"),
    "diagnose only numbers": (lambda demo: tr.diagnose(demo, only=[3]), "only: … found int, expected names of effects"),
    "diagnose only nothing": (lambda demo: tr.diagnose(demo, only=[]), "only: names no effect, expected at least one"),
    "diagnose with a name": (lambda demo: tr.diagnose(demo, effects="drift"), "found str, expected a list of your own"),
    "read a number": (lambda demo: tr.read_campaign(3), "found int, expected the path of a campaign.toml"),
    "a table of no robot": (
        lambda demo: tr.campaign_from_table(None, TABLE),
        "robot: … found NoneType, expected a",
    ),
    "no table": (lambda demo: tr.campaign_from_table(demo.robot, [1, 2]), "table: … found list, expected a pandas"),
    "samples of an array": (lambda demo: tr.read_samples(np.zeros((3, 5)), demo), "found ndarray, expected a table"),
    "load a dict": (lambda demo: tr.CorrectedModel.load({}), "found dict, expected the path of a file that save"),
    "a frame that is no name": (lambda demo: tr.load_robot("builtin:rv_m2", 3), "the name of a link, not int"),
    "describe": (lambda _: describe("a campaign"), "found str, expected a campaign"),
    "write nothing": (lambda _: write_campaign(None, "folder"), "expected a campaign"),
    "write nowhere": (lambda c: write_campaign(c, 7), "expected the path of a folder"),
    "write to NUL": (lambda c: write_campaign(c, Path("a\0b")), "cannot be written"),
    "observe": (lambda _: observe("a campaign"), "expected a campaign"),
    "frames": (lambda c: observe(c, np.eye(4)), "expected Frames"),
    "a frame of three": (lambda _: Frames(np.eye(3), np.eye(4)), "column 'base': no pose"),
    "a frame of lists": (lambda _: Frames(np.eye(4), np.eye(4).tolist()), "column 'tool': no pose"),
    "a frame of nothing": (lambda _: Frames(np.full((4, 4), np.nan), np.eye(4)), "expected a (4, 4) array, finite"),
    "a row too far": (lambda c: c.take([0, 120]), "row numbers from 0 to 119"),
    "half a row": (lambda c: c.take([0.5]), "has no such rows"),
    "too few booleans": (lambda c: c.take([True, False]), "or 120 booleans"),
    "rows by name": (lambda c: c.take(["first"]), "has no such rows"),
    "a list of units": (lambda _: Units(["deg"], "mm"), "unknown unit"),
    "progress": (lambda c: diagnose(c, progress=None), "expected a function"),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_argument_is_told_in_a_sentence_with_what_is_wanted(demo, name):
    call, said = WRONG[name]
    with pytest.raises(ThermalRobotError) as refused:
        call(demo)
    assert all(part.strip() in str(refused.value) for part in said.split("…"))
    assert "\n" not in str(refused.value)
