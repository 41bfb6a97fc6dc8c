"""The laws of the fixed arms hold for arms drawn at random, and so do the ways of their campaigns through files."""

import inspect
import tempfile
from pathlib import Path
from random import Random

import pytest
from arms import MOST, arms, urdfs
from fuzz import checks, corpus, harmless
from hypothesis import find, given, settings
from hypothesis import strategies as st
from kinematics import test_engines as engines
from kinematics import test_gravity as gravity
from kinematics import test_links as links
from kinematics import test_model as model

from thermal_robot.campaign import Units, campaign_from_table, read_campaign
from thermal_robot.robot import load_robot

LAWS = (
    engines.test_all_is_pinocchios,
    engines.test_frames_are_pinocchios_displaced_or_not,
    links.test_joint_and_segment_channels_are_jacobian_and_placement_sensitivity,
    links.test_pinocchios_jacobian_is_the_placement_sensitivity_along_each_segment,
    links.test_elongated_it_is_the_elongated_robot,
    gravity.test_torque_is_the_gradient_of_the_potential_energy,
    gravity.test_what_a_segment_carries_is_what_pinocchio_says,
    gravity.test_the_static_regressor_gives_the_torques,
    model.test_masses_and_their_centres_are_pinocchios,
    model.test_names_and_what_hangs_are_those_of_the_whole_tree,
    model.test_a_joints_unit_motion_is_how_it_moves,
)
"""Each takes an arm, and draws configurations of it."""


by_number = pytest.mark.parametrize("examples", [5, pytest.param(100, marks=pytest.mark.slow)])
"""A few in each commit, many at night."""


@by_number
@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.__name__.removeprefix("test_"))
def test_a_law_of_the_fixed_arms(law, examples, configurations):
    asked = inspect.signature(law).parameters

    @settings(max_examples=examples)
    @given(arm=arms())
    def holds(arm):
        known = {"arm": arm, "configurations": configurations, "engine": None}
        if "oracle" in asked:
            known["oracle"] = engines.oracle_of(arm, configurations)
        law(**{name: known[name] for name in asked})

    holds()


SEEDS = st.integers(0, 2**32 - 1)
UNITS = st.builds(Units, st.sampled_from(["rad", "deg"]), st.sampled_from(sorted(harmless.LENGTHS)))


@by_number
def test_a_campaign_survives_its_files(examples):
    settings(max_examples=examples)(given(urdf=urdfs(), units=UNITS, seed=SEEDS)(survives_its_files))()


def survives_its_files(urdf, units, seed):
    """Written and read, written in another way and read, as a data frame: the same observations."""
    campaign = corpus.made(urdf, "tip", units=units, seed=seed)
    files = corpus.files_of(campaign)
    with tempfile.TemporaryDirectory() as name:
        corpus.put(files, Path(name))
        checks.alike(read_campaign(name), campaign)
    with tempfile.TemporaryDirectory() as name:
        changed = harmless.changed(Random(seed), files)
        corpus.put(changed, Path(name))
        checks.alike(read_campaign(name), campaign, corpus.rows_of(changed), ("air_pressure",))
    s = units.length_scale
    framed = campaign_from_table(
        campaign.robot,
        corpus.as_frame(files),
        angle_unit=units.angle,
        length_unit=units.length,
        target=campaign.target / s,
        noise_position=campaign.noise_position / s,
        noise_orientation=campaign.noise_orientation,
        payload_com=campaign.payload_com / s,
    )
    checks.alike(framed, campaign)


@by_number
def test_a_model_survives_its_file(examples):
    @settings(max_examples=examples)
    @given(urdf=urdfs(), seed=SEEDS)
    def survives(urdf, seed):
        with tempfile.TemporaryDirectory() as name:
            corpus.put(corpus.model_of(corpus.files_of(corpus.made(urdf, "tip", seed=seed))), Path(name))
            checks.model(Path(name))

    survives()


@pytest.mark.slow
def test_arms_of_every_kind_are_drawn():
    seen, sizes = set(), set()

    @given(urdf=urdfs())
    def look(urdf):
        seen.update(word for word in ("revolute", "continuous", "prismatic", "fixed", "mimic", "<mass") if word in urdf)
        sizes.add(load_robot(urdf, "tip").n)

    look()
    assert seen == {"revolute", "continuous", "prismatic", "fixed", "mimic", "<mass"}
    assert max(sizes) > MOST / 2
    assert load_robot(find(urdfs(), lambda urdf: load_robot(urdf, "tip").n == 1), "tip").n == 1
