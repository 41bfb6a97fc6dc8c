"""Data that are not what they seem: copies, repeats, aliases, another robot's table."""

from dataclasses import replace

import numpy as np
import pytest
from simulate import simulate

from thermal_robot import EstimationError, diagnose, load_robot
from thermal_robot.inference.frames import register


@pytest.fixture(scope="module")
def ur10():
    pytest.importorskip("example_robot_data", reason="needs the extra 'robots'")
    return load_robot("example-robot-data:ur10", "tool0")


@pytest.fixture(scope="module")
def clean(ur10):
    return simulate(ur10, [], samples=60, seed=11, noise=20e-6)[0]


def repeated(campaign, times, seed, noise=20e-6):
    """Each command measured several times, in turn."""
    rows = np.tile(np.arange(campaign.samples), times)
    again = replace(campaign.take(rows), rows=np.arange(2, len(rows) + 2), covariates={})
    exact = simulate_exact(campaign)
    noisy = exact[rows] + noise * np.random.default_rng(seed).normal(size=(len(rows), 3))
    return replace(again, position=noisy)


def simulate_exact(campaign):
    """Where the nominal robot has the target, with the frames of the campaign."""
    from thermal_robot.observations import observe

    return observe(campaign, register(campaign)).predicted_position


@pytest.mark.parametrize("stated", [True, False], ids=["noise stated", "noise from repeats"])
def test_repeated_commands_without_a_fault_leave_nothing_unexplained(clean, stated):
    found = [diagnose(_noise(repeated(clean, 2, seed), stated)) for seed in range(4)]
    assert sum(d.verdict == () and not d.unexplained.flagged for d in found) >= 3
    if not stated:
        floors = [d.gap.noise_floor / np.sqrt(3.0) for d in found]
        assert np.median(floors) == pytest.approx(20e-6, rel=0.15)
        assert {d.gap.noise_source for d in found} == {"repeats"}


def _noise(campaign, stated):
    return campaign if stated else replace(campaign, noise_position=None)


def test_a_table_pasted_twice_is_not_taken_for_repeats(clean):
    twice = clean.take(np.tile(np.arange(60), 2))
    found = diagnose(replace(twice, rows=np.arange(2, 122), noise_position=None))
    assert not found.unexplained.flagged
    assert any("60 rows repeat another" in warning for warning in found.warnings)


@pytest.mark.parametrize("rows", [3, 4, 6])
def test_too_few_poses_are_refused_and_the_need_is_named(clean, rows):
    with pytest.raises(EstimationError, match=f"{rows} different poses are too few: 9 unknowns .* at least 7"):
        diagnose(clean.take(np.arange(rows)))


def test_three_poses_repeated_are_three_poses(clean):
    with pytest.raises(EstimationError, match="3 different poses"):
        diagnose(repeated(clean.take(np.arange(3)), 20, 0))


def in_the_root_frame(campaign):
    """The same measurements with both frames known."""
    frames = register(campaign)
    back = np.linalg.inv(frames.base)
    position = campaign.position @ back[:3, :3].T + back[:3, 3]
    return replace(campaign, position=position, base_known=True, tool_known=True, target=frames.tool[:3, 3])


def test_an_offset_of_the_first_joint_is_an_alias_of_a_known_base(clean):
    known = in_the_root_frame(clean)
    turned = 1e-3 * np.cross([0.0, 0.0, 1.0], known.position)
    found = diagnose(replace(known, position=known.position + turned))
    offset, base = found.finding("joint_offset"), found.finding("base_frame")
    assert {offset.status, base.status} == {"confounded"}
    assert "base_frame" in offset.confounded_with
    assert "joint_offset" in base.confounded_with


def test_a_suppressed_effect_is_not_found_rather_than_confounded(clean):
    found = diagnose(replace(clean, priors={"backlash": 1e-12}))
    assert found.finding("backlash").status == "not_found"
    assert found.finding("backlash").confounded_with == ()


@pytest.mark.parametrize("spoilt", ["mirrored", "scrambled"])
def test_another_robots_table_is_said_to_be_that(clean, spoilt):
    position = clean.position * [1, -1, 1] if spoilt == "mirrored" else clean.position[::-1]
    found = diagnose(replace(clean, position=position))
    assert found.summary.startswith("Robot and table do not describe the same motion")
    assert found.unexplained.flagged


def test_noise_stated_ten_times_too_large_is_remarked(clean):
    found = diagnose(replace(clean, noise_position=200e-6))
    assert any("stated too large" in warning for warning in found.warnings)


def test_rows_in_another_sequence_leave_the_verdict(ur10):
    campaign = in_the_root_frame(simulate(ur10, ["drift"], samples=100, seed=3)[0])
    mixed = campaign.take(np.random.default_rng(0).permutation(100))
    assert diagnose(campaign).verdict == diagnose(mixed).verdict


def test_more_columns_than_the_campaign_had_change_no_prediction(ur10):
    campaign, _, (fresh, _) = simulate(ur10, ["backlash"], samples=100, seed=5, fresh=20)
    first = f"approach.{ur10.joint_names[0]}"
    kept = {name: values for name, values in campaign.covariates.items() if name != first}
    model = diagnose(replace(campaign, covariates=kept)).model
    less = {name: values for name, values in fresh.covariates.items() if name != first}
    with_more, with_less = (model.predict(f)[0] for f in (fresh, replace(fresh, covariates=less)))
    np.testing.assert_allclose(with_more, with_less, atol=0.0)


def test_encoders_that_deny_the_commands_are_a_fault_of_the_log(rv_m2):
    clean = simulate(rv_m2, ["drift"], seed=1)[0]
    read = clean.q[:, 2] + 1e-4
    spoilt = np.array(read)
    spoilt[[10, 40, 41]] += 0.2
    agreeing = diagnose(replace(clean, covariates={**clean.covariates, "encoder.joint_3": read}))
    denying = diagnose(replace(clean, covariates={**clean.covariates, "encoder.joint_3": spoilt}))
    assert not any("encoder" in warning for warning in agreeing.warnings)
    told = next(warning for warning in denying.warnings if "encoder.joint_3" in warning)
    assert "3 of 120 rows" in told
    assert f"row {int(clean.rows[10])}" in told
    assert "fault of the log" in told
    assert denying.verdict == agreeing.verdict == ("drift",)
