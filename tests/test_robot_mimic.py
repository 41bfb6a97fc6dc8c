"""A campaign of an arm whose hand mimics its forearm, from the table to the diagnosis."""

from dataclasses import replace

import numpy as np
import pytest
from coupled import DRIVEN, by_hand, coupled, explicit
from simulate import simulate

import thermal_robot
from thermal_robot import kinematics as kin
from thermal_robot.campaign import read_campaign, write_campaign
from thermal_robot.errors import CampaignError
from thermal_robot.robot import load_robot

NOISE = 25e-6  # m
OFFSET = 4e-4  # rad


def measured(offsets, turns=0.0):
    """A hundred rows as the arm without mimic tags shows them, driven by hand; ``turns``: of the hand alone."""
    campaign = simulate(coupled("parallelogram"), [], samples=100, seed=1, noise=NOISE)[0]
    whole = by_hand("parallelogram", campaign.q + offsets)
    whole[:, 3] += turns
    poses = kin.tool_poses(explicit("parallelogram"), whole)
    noise = NOISE * np.random.default_rng(2).normal(size=(100, 3))
    return replace(campaign, position=poses[:, :3, 3] + poses[:, :3, :3] @ campaign.target + noise)


@pytest.fixture(scope="module")
def campaign():
    """The zero of the forearm's drive is off, and the hand goes along."""
    return measured(np.array([0.0, 0.0, OFFSET, 0.0]))


def test_the_table_has_no_column_for_what_follows(campaign, tmp_path):
    write_campaign(campaign, tmp_path)
    header = (tmp_path / "measurements.csv").read_text(encoding="utf-8").splitlines()[0].split(",")
    assert "reach" in header
    assert "upright" not in header
    again = read_campaign(tmp_path / "campaign.toml")
    np.testing.assert_allclose(again.q, campaign.q, rtol=0.0, atol=1e-12)
    assert again.robot.joint_names == DRIVEN["parallelogram"]


@pytest.mark.slow
def test_a_zero_of_the_driving_joint_is_found(campaign):
    found = thermal_robot.diagnose(campaign)
    assert found.verdict == ("joint_offset",)
    assert not found.unexplained.flagged
    finding = found.finding("joint_offset")
    assert finding.probability > 0.95
    off = {p.name: p for p in finding.parameters}["zero offset, reach"]
    assert abs(off.value - OFFSET) < 3.0 * off.std
    assert off.std < 0.1 * OFFSET
    predicted = found.model.prediction(campaign)[0]
    assert np.sqrt(((predicted - campaign.position) ** 2).mean()) < 1.1 * NOISE


@pytest.mark.slow
def test_a_hand_whose_own_zero_is_off_is_no_zero_of_a_drive():
    found = thermal_robot.diagnose(measured(np.zeros(4), turns=10 * OFFSET))
    assert "joint_offset" not in found.verdict
    assert "geometric" in found.verdict


BESIDE = (
    coupled("parallelogram")
    .urdf.replace('joint="reach" multiplier="-1"', 'joint="lever" multiplier="-0.5"')
    .replace(
        "</robot>",
        '<link name="side"/><joint name="lever" type="revolute"><parent link="column"/><child link="side"/>'
        '<axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint></robot>',
    )
)
"""The hand follows a lever beside the chain."""


def test_a_joint_beside_the_chain_is_read_diagnosed_and_corrected(tmp_path):
    robot = load_robot(BESIDE, "tool")
    assert robot.joint_names == ("turn", "lift", "reach", "lever", "spin")
    plain = simulate(robot, [], samples=100, seed=1, noise=NOISE)[0]
    whole = np.column_stack([plain.q[:, :3], 0.3 - 0.5 * (plain.q[:, 3] + 10 * OFFSET), plain.q[:, 4]])
    poses = kin.tool_poses(explicit("parallelogram"), whole)
    noise = NOISE * np.random.default_rng(2).normal(size=(100, 3))
    place = poses[:, :3, 3] + poses[:, :3, :3] @ plain.target + noise
    file = write_campaign(replace(plain, position=place, name="lever"), tmp_path)
    campaign = read_campaign(file)
    (said,) = (w for w in campaign.warnings if "mimic" in w)
    assert said == "joint 'upright' of the chain mimics 'lever', which is outside the chain: its column is read"
    found = thermal_robot.diagnose(campaign)
    assert found.verdict == ("joint_offset",)
    off = {p.name: p for p in found.finding("joint_offset").parameters}["zero offset, lever"]
    assert abs(off.value - 10 * OFFSET) < 3.0 * off.std
    commands = found.model.corrected_commands(campaign)
    reached = found.model.prediction(replace(campaign, q=commands.q))[0]
    frames = found.model.frames
    wanted = frames.base @ kin.tool_poses(robot, campaign.q) @ frames.tool
    np.testing.assert_allclose(reached, wanted[:, :3, 3], atol=1e-6)
    table = (tmp_path / "measurements.csv").read_text(encoding="utf-8")
    (tmp_path / "measurements.csv").write_text(table.replace("lever", "level", 1), encoding="utf-8")
    with pytest.raises(CampaignError, match="and so does 'lever', which moves it by joints that mimic"):
        read_campaign(file)
