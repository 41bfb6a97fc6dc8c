"""What a program hands over that is of a wrong kind is told in a sentence, never by a traceback from within."""

from pathlib import Path

import numpy as np
import pytest

from thermal_robot import demo_campaign, describe, diagnose, observe, write_campaign
from thermal_robot.campaign import Units
from thermal_robot.errors import CampaignError
from thermal_robot.observations import Frames

CALLS = {
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


@pytest.mark.parametrize("name", CALLS)
def test_a_wrong_argument_is_told_in_a_sentence(name):
    call, said = CALLS[name]
    with pytest.raises(CampaignError) as refused:
        call(demo_campaign())
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)
