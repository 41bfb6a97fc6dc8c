"""One thing is asked for: what would help most, and nothing where all is determined."""

from dataclasses import replace

import pytest
from simulate import simulate

from thermal_robot.diagnosis.parts import Dependence, Finding, Location, Unexplained
from thermal_robot.diagnosis.wanted import wanted
from thermal_robot.effects import choose
from thermal_robot.inference.fit import fit

CLEAN = Unexplained(False, 0.0, 0.5)
FOUND = (
    Finding("joint_offset", "found", 0.99),
    Finding("backlash", "not_testable", needs=("approach.joint_2", "approach.joint_3")),
    Finding("base_frame", "not_testable", needs=('frames.base = "known"',)),
    Finding("excess_repeatability", "not_testable", needs=("pose",)),
    Finding("encoder_resolution", "confounded", 0.6, confounded_with=("excess_repeatability",)),
)


@pytest.fixture(scope="module")
def settled(rv_m2):
    """Offsets, plainly seen; neither loads nor directions of approach were recorded."""
    campaign = simulate(rv_m2, ["joint_offset"], seed=2, ratio=(4.0, 6.0))[0]
    kept = {n: v for n, v in campaign.covariates.items() if n == "time"}
    return fit(replace(campaign, covariates=kept), choose(("joint_offset", "drift"), (), ()))


def left(kind, name, *follows):
    return Unexplained(
        True, 1e-4, 1e-9, (), (Location(kind, name, 0.9),), tuple(Dependence(name, 1e-9) for name in follows)
    )


def test_nothing_where_nothing_is_needed(settled):
    assert wanted(settled, FOUND, (), CLEAN, CLEAN, 0.99) is None


@pytest.mark.parametrize(
    ("remainder", "column", "whether"),
    [
        (left("base", "base", "time"), "temperature", "warmth"),
        (left("joint", "joint_3", "joint_3"), "approach.joint_3", "lost motion"),
        (left("joint", "joint_3", "joint_2"), "torque.joint_3", "load"),
        (left("base", "base", "reach.x"), "torque", "load"),
        (left("joint", "joint_2"), "approach.joint_2", "lost motion"),
    ],
)
def test_the_column_that_tells_of_the_place_and_the_quantity_is_asked_for(settled, remainder, column, whether):
    found = wanted(settled, FOUND, (), remainder, remainder, 0.99)
    assert (found.kind, found.name, found.whether) == ("column", column, whether)


def test_the_load_is_asked_for_where_the_torque_is_known(settled, rv_m2):
    campaign = settled.campaign
    torque = {f"torque.{name}": campaign.q[:, j] for j, name in enumerate(rv_m2.joint_names)}
    told = replace(campaign, covariates={**campaign.covariates, **torque})
    known = fit(told, choose(("joint_offset",), (), ()))
    remainder = left("joint", "joint_3", "gravity.x")
    assert wanted(known, FOUND, (), remainder, remainder, 0.99).name == "payload"


def test_repeats_where_there_is_no_column_to_record(settled):
    remainder = left("base", "base", "humidity")
    assert wanted(settled, FOUND[:1], (), remainder, remainder, 0.99).kind == "repeats"


def test_scatter_that_only_repeats_tell_apart_asks_for_repeats(settled):
    found = wanted(settled, FOUND, (("encoder_resolution", "excess_repeatability"),), CLEAN, CLEAN, 0.99)
    assert (found.kind, found.name) == ("repeats", "pose")


def test_a_law_that_says_it_all_asks_for_what_would_tell_its_cause_alone(settled):
    followed = left("joint", "joint_3", "humidity")
    assert wanted(settled, FOUND, (), CLEAN, followed, 0.99) is None
    assert wanted(settled, FOUND, (), followed, followed, 0.99).name.startswith("approach")


def test_a_law_of_a_joints_own_position_leaves_nothing_to_ask(settled):
    assert wanted(settled, FOUND, (), CLEAN, left("joint", "joint_3", "joint_3"), 0.99) is None
    assert wanted(settled, FOUND, (), CLEAN, left("joint", "joint_3", "time"), 0.99).name == "temperature"


def test_a_frame_is_asked_for_where_one_is_confounded(settled):
    found = wanted(settled, FOUND, (("base_frame", "joint_offset"),), CLEAN, CLEAN, 0.99)
    assert (found.kind, found.name, found.apart) == ("frame", 'frames.base = "known"', ("base_frame", "joint_offset"))


def test_what_no_pose_tells_apart_asks_for_the_whole_range(settled):
    found = wanted(settled, FOUND, (("backlash", "joint_offset"),), CLEAN, CLEAN, 0.99)
    assert (found.kind, found.apart) == ("range", ("backlash", "joint_offset"))


def test_a_load_is_asked_for_where_it_tells_what_yields(rv_m2):
    """Joints and links yield to the same weight; with another load the two differ more."""
    group, asked = ("joint_compliance", "link_compliance"), []
    for seed in range(6):
        campaign = simulate(rv_m2, ["joint_compliance"], seed=seed, ratio=(2.0, 3.0))[0]
        bare = fit(replace(campaign, covariates={"time": campaign.covariates["time"]}), choose(group, (), ()))
        if 0.05 < bare.probability("link_compliance") < 0.95:
            asked.append(wanted(bare, tuple(Finding(n, "confounded") for n in group), (group,), CLEAN, CLEAN, 0.6))
    assert len(asked) >= 3
    # a third of them; the others are told apart as well by poses over the whole range
    assert sum((w.kind, w.name) == ("column", "payload") for w in asked) >= len(asked) / 3
    assert {w.kind for w in asked} <= {"column", "range", "pose"}
    assert all(w.apart and set(w.apart) <= set(group) for w in asked)
