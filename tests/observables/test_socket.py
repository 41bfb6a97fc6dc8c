"""A ball in sockets: what its rows see, what they do not, and what is found from them."""

from dataclasses import replace

import numpy as np
import pytest

import thermal_robot as tr
from thermal_robot.effects import library
from thermal_robot.effects.gate import checked
from thermal_robot.inference.algebra import equations_of, orthonormal, without
from thermal_robot.inference.columns import frame_columns
from thermal_robot.inference.fit import fit_named
from thermal_robot.inference.registration import moved, register
from thermal_robot.kinematics import tool_poses
from thermal_robot.observations import Frames, observe
from thermal_robot.simulation import brought


@pytest.fixture(scope="module")
def ur10():
    return tr.load_robot("example-robot-data:ur10", "tool0")


def offsets(robot, values):
    return {"joint_offset": dict(zip(robot.joint_names, values, strict=True))}


def sockets(robot, effects=None, rows=10, noise=0.0, tool=(0.0, 0.0, 0.0), seed=0):
    """Two sockets on each of three stands, so many rows in each; it is not known where the ball sits."""
    at = np.eye(4)
    at[:3, 3] = tool
    made = tr.simulate(robot, effects, rows=6 * rows, measures="socket", noise=noise, tool=at, seed=seed)
    return replace(made, covariates={}, target=np.zeros(3))


def test_a_sound_robot_spreads_about_no_socket(ur10):
    seen = observe(sockets(ur10, rows=6))
    assert np.abs(seen.gap).max() < 1e-9


def with_spacing(campaign, length, sigma, stand="place 0", pair=("0", "1")):
    """The same rows and one more, while the robot stays: how far two sockets of a stand are apart."""
    last, before = campaign.samples, campaign.noise_of_rows
    before = np.full(last, campaign.noise_position or 5e-5) if before is None else before
    more = campaign.take(np.append(np.arange(last), last - 1))
    told = {"kind": "spacing", "stand": stand, "socket": pair[0], "other_socket": pair[1]}
    labels = {"other_socket": np.full(last + 1, "", dtype="<U9"), **more.labels}
    labels = {name: np.append(own[:last], told.get(name, own[last])) for name, own in labels.items()}
    readings = {"distance": np.append(campaign.readings.get("distance", np.zeros(last)), length)}
    noise = np.append(before, sigma)
    return replace(more, labels=labels, readings=readings, noise_position=None, noise_of_rows=noise)


@pytest.mark.parametrize("known", [False, True])
def test_columns_are_derivatives_of_the_gap(ur10, known):
    campaign = sockets(ur10, offsets(ur10, [0, 2e-3, -1e-3, 2e-3, 1e-3, 0]), rows=5, tool=(0.0, 0.01, 0.05))
    if known:
        campaign = with_spacing(campaign, 0.0501, 1e-5)
    frames = register(campaign)
    seen = observe(campaign, frames)
    columns, names = frame_columns(seen)
    assert np.abs(seen.gap).max() > 1e-5
    for k in range(len(names)):
        step = np.zeros(len(names))
        step[k] = 1e-6
        there, back = (observe(campaign, moved(seen.frames, s, names)).gap for s in (step, -step))
        slope = (back - there) / 2e-6
        # the twist is taken about the socket: columns differ from the slope by a turn of what is left of the row
        assert np.allclose(slope, columns[:, :, k], atol=3.0 * np.abs(seen.gap).max())


def test_where_the_tool_frame_is_declared_changes_no_gap(ur10):
    """The same ball, declared 0.2 m beyond a link or on it: what is left of a row is the same."""
    at = np.eye(4)
    at[:3, 3] = (0.0, 0.05, 0.2)
    true = offsets(ur10, [0, 2e-3, -1e-3, 2e-3, 1e-3, 0])
    made = tr.simulate(ur10, true, rows=60, measures="socket", tool=at)
    frames = register(made)
    one, other = (observe(replace(made, target=own), frames).gap for own in (at[:3, 3], np.zeros(3)))
    assert np.abs(one).max() > 1e-4
    assert np.allclose(one, other, atol=1e-12)


def test_what_moves_all_stands_is_an_alias_of_them(ur10):
    campaign = sockets(ur10, offsets(ur10, [0, 3e-3, -2e-3, 1e-3, 1e-3, 0]), rows=8)
    seen = observe(campaign, register(campaign))
    basis = orthonormal(equations_of(frame_columns(seen)[0]))
    first = seen.joint_sensitivity[:, :3, :1]
    scale = np.concatenate([seen.position, 0.0 * seen.position], axis=1)[:, :, None]
    for columns in (seen.base_sensitivity[:, :3], first, seen.sight.sees(scale)[:, :3]):
        left = without(equations_of(columns), basis)
        assert np.abs(left).max() < 1e-9
    assert np.abs(without(equations_of(seen.joint_sensitivity[:, :3, 1:5]), basis)).max() > 0.01


@pytest.mark.parametrize("tool", ["unknown", "known"])
@pytest.mark.parametrize(("kind", "scale"), [("socket", 1.0), ("socket", 5.0), ("plane", 1.0)])
def test_the_zero_of_the_last_joint_is_an_alias_of_an_unknown_tool(ur10, kind, scale, tool):
    """To turn the last joint is to move the ball about its axis: said, and no interval is given, whatever the gap."""
    true = offsets(ur10, scale * np.array([0.0, 3e-3, -2e-3, 1e-3, 2e-3, 2e-3]))
    at = {"tool": (0.05, 0.02, 0.1), "tool_known": tool == "known"}
    found = tr.diagnose(tr.simulate(ur10, true, rows=90, measures=kind, noise=5e-5, seed=3, **at))
    (told,) = (said for said in found.warnings if said.startswith("the zero of"))
    assert ("'wrist_3_joint'" in told) == (tool == "unknown")
    assert "'shoulder_pan_joint'" in told
    assert "'wrist_2_joint'" not in told
    (offset,) = (effect for effect in found.effects if effect.name == "joint_offset")
    last = [p for p in offset.parameters if p.name.endswith("wrist_3_joint")]
    assert any(p.identified for p in last) == (tool == "known")


@pytest.mark.parametrize("spacings", [{}, {"place 0": 1e-5}, {"place 0": 1e-3}, {"place 0": 1e-3, "place 2": 1e-3}])
def test_the_scale_is_known_as_well_as_the_lengths(ur10, spacings):
    """Relative variance of a length: its own, and that of two sockets from 15 rows each; lengths add information."""
    campaign = sockets(ur10, rows=15, noise=5e-5, seed=1)
    for stand, sigma in spacings.items():
        campaign = with_spacing(campaign, 0.05, sigma, stand)
    seen, white = observe(campaign, register(campaign)), 1.0
    if spacings:
        white = 1.0 / campaign.noise_of_rows[:, None, None]
    basis = orthonormal(equations_of(white * frame_columns(seen)[0]))
    places = np.concatenate([seen.position, 0.0 * seen.position], axis=1)[:, :, None]
    told = np.linalg.norm(without(equations_of(white * seen.sight.sees(places)[:, :3]), basis))
    expected = sum(0.05**2 / (sigma**2 + 2.0 * 5e-5**2 / 15.0) for sigma in spacings.values())
    assert told == pytest.approx(np.sqrt(expected), rel=0.02, abs=1e-9)


def test_a_length_sets_the_size_of_the_robot_as_far_as_it_is_known(ur10):
    """A length that is 0.4 % larger means a larger robot if it is sure, and nothing if it may be 1 mm off."""
    campaign = sockets(ur10, rows=15, noise=1e-5, seed=1)

    def size(length, sigma):
        fit = fit_named(with_spacing(campaign, length, sigma), [library()["geometric"]])
        return 1.0 / fit.corrected.sight.size.relative[0, 0]

    for sigma, larger in ((1e-6, 1.004), (1e-3, 1.0)):
        assert size(0.0502, sigma) / size(0.05, sigma) == pytest.approx(larger, abs=4e-4)


def test_sockets_in_which_the_ball_never_sat_tell_nothing(ur10, tmp_path):
    for stand, pair in (("place 0", ("0", "further")), ("place 9", ("0", "1"))):
        campaign = with_spacing(sockets(ur10, rows=4, noise=5e-5), 0.05, 1e-5, stand, pair)
        seen = observe(campaign, register(campaign))
        assert not seen.gap[-1].any()
        assert not frame_columns(seen)[0][-1].any()
        with pytest.raises(tr.CampaignError, match="no such socket"):
            tr.read_campaign(tr.write_campaign(campaign, tmp_path / stand))


def test_without_a_length_it_is_said_and_a_wrong_one_of_large_noise_does_no_harm(ur10):
    campaign = sockets(ur10, offsets(ur10, [0, 4e-3, -3e-3, 2e-3, 3e-3, 0]), rows=15, noise=5e-5, seed=1)
    alone, soft = (tr.diagnose(own) for own in (campaign, with_spacing(campaign, 0.0502, 2e-4)))
    assert alone.verdict == soft.verdict == ("joint_offset",)
    for own, length in ((alone, False), (soft, True)):
        told, (base,) = " ".join(own.warnings), [f for f in own.effects if f.name == "base_frame"]
        assert ("scale of the robot is not observable" in told) != length
        assert "direction of the base are not observable" in told
        assert "the zero of 'shoulder_pan_joint', 'wrist_3_joint' is not observable" in told
        assert base.status == "not_testable"  # and no effect that data could tell from others
    told = ([p for f in own.effects if f.name == "joint_offset" for p in f.parameters] for own in (alone, soft))
    for one, other in list(zip(*told, strict=True))[1:5]:
        assert abs(one.value - other.value) < 0.1 * one.std


def test_what_was_wrong_is_found_wherever_the_stands_stand(ur10):
    true = np.array([0.0, 4e-3, -3e-3, 2e-3, 3e-3, 0.0])
    errors = []
    for seed in range(8):
        campaign = sockets(ur10, offsets(ur10, true), rows=15, noise=5e-5, tool=(0.02, 0.0, 0.1), seed=seed)
        fit = fit_named(campaign, [library()["joint_offset"]])
        ((effect, values),) = fit.effects
        (_, covariance) = next(iter(fit.explanation.values.values()))
        places = [parameter.place for parameter in checked(effect, fit.nominal)]
        seen = [places.index(joint) for joint in ur10.joint_names[1:5]]
        deviations = np.sqrt(np.diag(covariance)[seen])
        assert np.median(deviations) < 1e-4
        errors.append((values[seen] - true[1:5]) / deviations)
        assert fit.corrected.frames.tool[:3, 3] == pytest.approx([0.02, 0.0, 0.1], abs=1e-4)
    # 32 errors of unit variance: their rms has a standard deviation of 0.13
    assert 0.6 < np.sqrt(np.mean(np.square(errors))) < 1.4
    assert np.abs(errors).max() < 4.0


def test_labels_of_stands_are_names_and_no_numbers(ur10):
    campaign = sockets(ur10, offsets(ur10, [0, 3e-3, 0, 1e-3, 0, 0]), rows=6, noise=5e-5)
    renamed = {"place 0": "z", "place 1": "a", "place 2": "m"}
    other = np.array([renamed[label] for label in campaign.labels["stand"]])
    again = replace(campaign, labels={**campaign.labels, "stand": other})
    one, two = (observe(c, register(c)).gap for c in (campaign, again))
    assert np.allclose(one, two, atol=1e-9)


def test_a_campaign_of_sockets_is_written_and_read_again(ur10, tmp_path):
    campaign = with_spacing(sockets(ur10, rows=4), 0.05, 2e-4)
    again = tr.read_campaign(tr.write_campaign(campaign, tmp_path / "written"))
    assert again.kinds == ("socket", "spacing")
    assert again.base_known
    assert again.readings["distance"] == pytest.approx(campaign.readings["distance"], abs=1e-12)
    assert again.noise_of_rows == pytest.approx(campaign.noise_of_rows, abs=1e-12)
    assert np.array_equal(again.q, campaign.q)
    for label in ("stand", "socket", "other_socket", "kind"):
        assert (again.labels[label] == campaign.labels[label]).all()


def test_frames_hold_what_is_shared(ur10):
    campaign = sockets(ur10, rows=4)
    seen = observe(campaign, Frames.declared(campaign))
    assert sorted(seen.frames.artefacts) == ["stand place 0", "stand place 1", "stand place 2"]


@pytest.mark.parametrize(("kind", "moves"), [("socket", "unknown"), ("plane", "unknown"), ("distance", "direct")])
def test_a_hand_brings_joints_from_whatever_side(ur10, kind, moves):
    """Lost motion is not testable where a hand led the arm, though the order of the rows is known."""
    made = tr.simulate(ur10, rows=60, measures=kind, noise=5e-5, tool=[0.0, 0.0, 0.1])
    table = replace(made, covariates={"order": np.arange(60.0)}).to_frame()
    campaign = tr.campaign_from_table(ur10, table)
    assert campaign.moves == moves
    assert bool(library()["backlash"].missing(observe(campaign))) == (moves == "unknown")
    assert tr.campaign_from_table(ur10, table, moves="direct").derived


def test_whether_table_and_robot_match_is_judged_by_the_arms_reach_and_not_by_the_sockets(ur10):
    """In one stand the tool stays within centimetres: play of millimetres is no other motion, other postures are."""
    made = sockets(ur10, rows=20, noise=2e-3)
    one = made.take(np.flatnonzero(made.labels["stand"] == made.labels["stand"][0]))
    assert np.linalg.norm(np.ptp(tool_poses(ur10, one.q)[:, :3, 3], axis=0)) < 0.15
    found = tr.diagnose(one)
    assert found.misfit is None
    assert found.gap.rms_after > 2e-3
    q = np.random.default_rng(0).uniform(-1.5, 1.5, one.q.shape)
    assert tr.diagnose(replace(one, q=q)).misfit is not None


def test_each_newton_step_of_a_loop_is_looked_at(ur10, monkeypatch):
    """A quadratic step from 1e-6 rad ends at rounding: one is enough, and no row is begun anew."""
    campaign = sockets(ur10, rows=1)
    frames = observe(campaign).frames
    monkeypatch.setattr(brought, "ROUNDS", 1)
    found, reached = brought.closed(replace(campaign, q=campaign.q + 1e-6), frames, near=campaign.q)
    assert reached.all()
    assert np.abs(observe(found, frames).gap).max() < brought.CLOSED
    np.testing.assert_allclose(found.q, campaign.q, atol=1e-5)
