"""The demo: its files are there, its seed makes them, and its diagnosis names exactly what was simulated."""

import json

import numpy as np
import pytest
import simulate

from thermal_robot import read_campaign
from thermal_robot.datasets import demo_campaign, demo_directory
from thermal_robot.kinematics import gravity_torques, tool_poses


@pytest.fixture(scope="module")
def made():
    campaign, truth, _ = simulate.demo()
    return campaign, json.loads(json.dumps(truth))


@pytest.fixture(scope="module")
def truth():
    return json.loads((demo_directory() / "truth.json").read_text(encoding="utf-8"))


def same(now, then):
    """Compare plain values to nine digits."""
    if isinstance(then, dict):
        assert list(now) == list(then)
        for key in then:
            same(now[key], then[key])
    elif isinstance(then, float):
        assert now == pytest.approx(then, rel=1e-9)
    else:
        assert now == then


def test_the_campaign_is_what_its_seed_makes(made):
    shipped, campaign = demo_campaign(), made[0]
    for name in ("q", "position", "target", "payload_com", "rows"):
        np.testing.assert_allclose(getattr(shipped, name), getattr(campaign, name), rtol=1e-9, atol=1e-12)
    assert set(shipped.covariates) == set(campaign.covariates)
    for name, values in campaign.covariates.items():
        np.testing.assert_allclose(shipped.covariates[name], values, rtol=1e-9, atol=1e-12)
    assert shipped.noise_position == pytest.approx(campaign.noise_position, rel=1e-9)
    assert shipped.robot.joint_names == campaign.robot.joint_names
    for answer in (tool_poses, gravity_torques):  # drawn otherwise, perhaps, but moved and weighed the same
        np.testing.assert_allclose(answer(shipped.robot, campaign.q), answer(campaign.robot, campaign.q), atol=1e-12)
    assert shipped.warnings == ()


def test_the_truth_that_ships_is_the_simulations(made, truth):
    assert truth["seed"] == simulate.DEMO_SEED
    same(truth, made[1])


def test_its_folder_is_whole_and_stands_alone(tmp_path):
    folder = demo_directory()
    for name in ("campaign.toml", "measurements.csv", "robot.urdf", "truth.json"):
        assert (folder / name).is_file()
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    one, two = read_campaign(tmp_path), demo_campaign()
    np.testing.assert_array_equal(one.position, two.position)
    assert two is not demo_campaign()


def test_it_has_what_its_effects_need():
    campaign = demo_campaign()
    assert campaign.samples == 120
    assert np.ptp(campaign.covariates["temperature"]) > 1.0
    assert {f"approach.{joint}" for joint in campaign.robot.joint_names} <= set(campaign.covariates)
    assert campaign.extra == ()


def test_the_diagnosis_names_exactly_the_truth(truth, diagnosed_once):
    found = diagnosed_once(demo_campaign())
    assert set(found.verdict) == set(truth["effects"])
    assert not found.unexplained.flagged
    assert set(found.outliers) == set(truth["outliers"])
    assert all(found.finding(name).status == "found" for name in truth["effects"])
    known = [p for p in found.finding("backlash").parameters if p.identified]
    true = truth["parts"]["backlash"]["values"]
    assert {p.name for p in known} & set(true)
    assert all(abs(p.value - true.get(p.name, 0.0)) < 4.0 * p.std for p in known)
    strains_are_told(found.finding("thermal_elongation"), truth["parts"]["thermal_elongation"]["values"])
    assert found.gap.rms_after < 1.1 * found.gap.noise_floor < found.gap.rms_before
    faulty = {name.rsplit(", ", 1)[1] for name in truth["parts"]["backlash"]["values"]}
    assert found.finding("backlash").locations[0].name in faulty


def strains_are_told(finding, true):
    """Each link has its own; or one is about their mean, and what a link is said to deviate is what it does."""
    told = {p.name: p for p in finding.parameters if p.identified}
    assert told
    if "strain per kelvin" not in told:
        assert all(abs(p.value - true[p.name]) < 4.0 * p.std for p in told.values())
        return
    common = told.pop("strain per kelvin")
    assert abs(common.value - np.mean(list(true.values()))) < 4.0 * common.std
    assert told
    for name, deviation in told.items():
        own = true[name.replace("deviation of", "strain per kelvin of")]
        assert abs(common.value + deviation.value - own) < 4.0 * np.hypot(common.std, deviation.std)
