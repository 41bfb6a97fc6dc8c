"""Planes and distances: one component a row, its derivatives, its aliases, and rows of several kinds together."""

from dataclasses import replace

import jsonschema
import numpy as np
import pytest

import thermal_robot as tr
from thermal_robot import report
from thermal_robot.diagnosis import settings as diagnosis_settings
from thermal_robot.effects import library
from thermal_robot.effects.gate import checked
from thermal_robot.inference.algebra import equations_of, orthonormal, without
from thermal_robot.inference.columns import frame_columns
from thermal_robot.inference.fit import fit_named
from thermal_robot.inference.registration import moved, register
from thermal_robot.observables import seen_components
from thermal_robot.observations import observe
from thermal_robot.report import words

ANCHORS = np.array([[1.5, 0.2, 0.1], [-0.3, 1.6, 0.2], [0.1, -0.2, 1.8], [-1.4, -0.6, 0.6]])
ZERO = 0.12


@pytest.fixture(scope="module")
def ur10():
    return tr.load_robot("example-robot-data:ur10", "tool0")


def read_as(campaign, kinds):
    """The same rows of a tracker as rows of other kinds, one after the other."""
    points, kind = campaign.position, np.resize(kinds, campaign.samples)
    number = np.arange(campaign.samples) // len(kinds) % len(ANCHORS)
    normals, plane = np.eye(3), number % 3
    height = (points * normals[plane]).sum(axis=1) - 0.1 * plane
    figures = {
        "distance": np.linalg.norm(points - ANCHORS[number], axis=1) + ZERO,
        "height": height,
        **dict(zip("xyz", points.T, strict=True)),
    }
    of = {"distance": "distance", "height": "plane", "x": "position", "y": "position", "z": "position"}
    readings = {name: np.where(kind == of[name], values, 0.0) for name, values in figures.items() if of[name] in kinds}
    labels = {"kind": kind, "anchor": number.astype(str), "plane": plane.astype(str)}
    known = "position" not in kinds
    return replace(campaign, position=None, readings=readings, labels=labels, base_known=known, noise_position=2e-5)


TRUE = np.array([0.0, 3e-3, -2e-3, 2e-3, -3e-3, 0.0])
KINDS = (("distance",), ("plane",), ("distance", "plane"), ("distance", "position"))


def measured(robot, noise=0.0, rows=120, **known):
    named = dict(zip(robot.joint_names, TRUE, strict=True))
    return tr.simulate(robot, {"joint_offset": named}, rows=rows, noise=noise, tool=[0.0, 0.0, 0.1], **known)


@pytest.mark.parametrize("kinds", KINDS)
def test_columns_are_derivatives_of_the_gap(ur10, kinds):
    campaign = read_as(measured(ur10), kinds)
    seen = observe(campaign, register(campaign))
    columns, names = frame_columns(seen)
    size = np.abs(seen.gap).max()
    assert 1e-4 < size < 0.02
    for k in range(len(names)):
        step = np.zeros(len(names))
        step[k] = 1e-6
        there, back = (observe(campaign, moved(seen.frames, s, names)).gap for s in (step, -step))
        # lines turn with what is left of a row: slopes hold to its size over the distance
        assert np.allclose((back - there) / 2e-6, columns[:, :, k], atol=8.0 * size)


@pytest.mark.parametrize("kinds", KINDS[:3])
def test_a_rigid_motion_of_all_is_an_alias(ur10, kinds):
    campaign = read_as(measured(ur10), kinds)
    seen = observe(campaign, register(campaign))
    basis = orthonormal(equations_of(frame_columns(seen)[0]))
    rigid = equations_of(seen.base_sensitivity[:, :3])
    assert np.abs(without(rigid, basis)).max() < 1e-9
    scale = seen.sight.sees(np.concatenate([seen.position, 0.0 * seen.position], axis=1)[:, :, None])
    assert np.abs(without(equations_of(scale[:, :3]), basis)).max() > 1e-3


def test_a_plane_that_is_touched_has_no_length(ur10):
    campaign = read_as(measured(ur10), ("plane",))
    touched = replace(campaign, readings={})
    seen = observe(touched)
    assert seen.sight.size is not None
    assert observe(campaign).sight.size is None


@pytest.mark.parametrize("kinds", KINDS)
def test_what_was_wrong_is_found(ur10, kinds):
    campaign = read_as(measured(ur10, noise=2e-5, rows=200), kinds)
    fit = fit_named(campaign, [library()["joint_offset"]])
    ((effect, values),) = fit.effects
    found = {p.place: v for p, v in zip(checked(effect, fit.nominal), values, strict=True)}
    for joint, value in zip(ur10.joint_names[1:5], TRUE[1:5], strict=True):
        assert found[joint] == pytest.approx(value, abs=1e-4)


def test_rows_count_by_what_they_see(ur10):
    campaign = read_as(measured(ur10), ("distance", "position"))
    assert set(seen_components(campaign).ravel().tolist()) == {1, 3}
    assert seen_components(measured(ur10)) is None


def test_kinds_are_read_from_files(ur10, tmp_path):
    campaign = read_as(measured(ur10, rows=12), ("distance", "position"))
    again = tr.read_campaign(tr.write_campaign(campaign, tmp_path / "mixed"))
    assert again.kinds == ("distance", "position")
    assert not again.base_known
    for name, values in campaign.readings.items():
        assert np.allclose(again.readings[name], values, atol=1e-12)


def test_an_unknown_kind_and_an_empty_cell_are_refused(ur10, tmp_path):
    file = tr.write_campaign(read_as(measured(ur10, rows=12), ("distance", "position")), tmp_path / "mixed")
    table = file.parent / "measurements.csv"
    text = table.read_text()
    table.write_text(text.replace(",distance,", ",distanse,", 2))
    with pytest.raises(tr.CampaignError, match="unknown kind of measurement"):
        tr.read_campaign(file)


@pytest.mark.parametrize(("kind", "seen"), [("distance", 1), ("plane", 1), ("pixel", 2), ("socket", 3)])
def test_the_noise_floor_is_that_of_the_components_that_a_row_sees(ur10, kind, seen):
    """A sound robot leaves the noise, 50 µm in each component that its rows see."""
    campaign = tr.simulate(ur10, rows=120, measures=kind, noise=5e-5, tool=[0.05, 0.0, 0.1], seed=2)
    gap = tr.diagnose(campaign, only=["backlash", "joint_gain"]).gap
    assert gap.noise_floor == pytest.approx(5e-5 * np.sqrt(seen), rel=1e-9)
    assert 0.8 < gap.rms_after / gap.noise_floor < 1.3


def test_a_series_of_distances_shows_the_zero_that_moved(ur10):
    """A draw wire's rows alone: the elbow's zero moves by 1 mrad before the third of four campaigns."""
    elbow, series = np.arange(ur10.n) == 2, []
    for number in range(4):
        rows = read_as(measured(ur10, noise=2e-5, rows=60, seed=number), ["distance"])
        series.append(replace(rows, name=f"number {number}", q=rows.q - (number >= 2) * 1e-3 * elbow))
    (alarm,) = tr.wear(series, effects=["joint_offset"]).alarms
    assert (alarm.place, alarm.kind) == ("elbow_joint", "jump")
    assert alarm.change == pytest.approx(1e-3, abs=4.0 * alarm.change_std)


@pytest.mark.parametrize("kinds", [("distance",), ("plane", "distance")])
def test_rows_that_share_unknown_places_are_diagnosed_and_not_summed(ur10, kinds, monkeypatch):
    """Sums over a part of the rows lacked the artefacts of others: more than a thousand rows ended in a ValueError."""
    monkeypatch.setattr(diagnosis_settings, "KEPT", 20)
    old, new = (read_as(measured(ur10, noise=2e-5, rows=rows, seed=rows), kinds) for rows in (120, 12))
    known = tr.diagnose(old, only=["joint_offset"])
    assert known.verdict == ("joint_offset",)
    with pytest.raises(tr.EstimationError, match="diagnose old and new rows together"):
        known.update(new)


@pytest.mark.parametrize(
    ("kind", "what", "fewest"), [("distance", "anchor", 5), ("plane", "plane", 3), ("pixel", "camera", 6)]
)
@pytest.mark.parametrize("seed", range(3))
def test_an_artefact_with_few_rows_is_placed_or_named(ur10, kind, what, fewest, seed):
    """With too few rows it could stand anywhere, and registration left millimetres, metres or nothing finite."""
    made = tr.simulate(ur10, rows=60, noise=5e-5, measures=kind, tool=[0.0, 0.0, 0.1], tool_known=False, seed=seed)
    label = made.labels[what]
    last, before = np.flatnonzero(label == label[-1]), np.flatnonzero(label != label[-1])
    for count in (1, fewest - 1, fewest, fewest + 1):
        campaign = made.take(np.sort(np.append(before, last[:count])))
        if count < fewest:
            with pytest.raises(tr.EstimationError, match=f"{what} {label[-1]} has {count} row"):
                tr.diagnose(campaign)
        else:
            assert np.abs(observe(campaign, register(campaign)).gap).max() < 2e-3


@pytest.mark.parametrize("stated", [True, False])
def test_the_noise_floor_of_several_kinds_is_that_of_each(ur10, stated):
    """A wire three times as noisy as the tracker beside it: what each kind leaves is its own noise, stated or not."""
    sigmas = {"position": 2e-5, "plane": 2e-5, "distance": 6e-5}
    campaign = read_as(measured(ur10, noise=2e-5, rows=240), tuple(sigmas))
    kind, reading = campaign.labels["kind"], campaign.readings["distance"]
    jitter = np.sqrt(6e-5**2 - 2e-5**2) * np.random.default_rng(0).normal(size=campaign.samples)
    readings = {**campaign.readings, "distance": reading + (kind == "distance") * jitter}
    noise = np.array([sigmas[own] for own in kind])
    found = tr.diagnose(
        replace(campaign, readings=readings, noise_of_rows=noise if stated else None, noise_position=None)
    )
    told = {own.kind: own for own in found.gap.kinds}
    for own, expected in {"position": np.sqrt(3.0) * 2e-5, "plane": 2e-5, "distance": 6e-5}.items():
        assert told[own].noise_floor == pytest.approx(expected, rel=1e-9 if stated else 0.3)
        assert told[own].rms_after == pytest.approx(expected, rel=0.3)
        assert told[own].unit == "m"
    jsonschema.validate(found.to_dict(), report.schema())
    assert sum(own.rows for own in told.values()) == found.samples - len(found.outliers)
    assert [said.split()[0] for said in words.noise(found).split("; ")[:3]] == list(told)


def test_a_camera_leaves_pixels(ur10):
    """Noise of 50 µm across the line of sight, at its distance, told in pixels."""
    campaign = tr.simulate(ur10, rows=120, measures="pixel", noise=5e-5, tool=[0.05, 0.0, 0.1], seed=2)
    (own,) = tr.diagnose(campaign).gap.kinds
    camera = next(iter(observe(campaign, register(campaign)).frames.artefacts.values()))
    assert own.unit == "px"
    assert own.noise_floor == pytest.approx(np.sqrt(2.0) * 5e-5 * 1000.0 / camera.far, rel=0.05)


@pytest.mark.parametrize("seed", [3, 10, 14, 19])
def test_gross_errors_do_not_carry_an_anchor_off(ur10, seed):
    """Three of 20 rows of a wire are 20 mm wrong: its linear start is off, and the other rows bring it back."""
    campaign = tr.simulate(
        ur10, rows=80, noise=5e-5, measures="distance", tool=(0.05, 0.02, 0.1), tool_known=False, seed=seed
    )
    own = np.flatnonzero(campaign.labels["anchor"] == "0")
    lengths, wrong = campaign.readings["distance"].copy(), own[[2, 9, 15]]
    lengths[wrong] += 0.02
    campaign = replace(campaign, readings={"distance": lengths})
    left = np.abs(observe(campaign, register(campaign)).gap).max(axis=1)
    assert np.median(left[np.setdiff1d(own, wrong)]) < 2e-4
    assert left[wrong].min() > 0.01


def test_rows_set_aside_leave_an_anchor_where_it_is(ur10):
    """With one row kept of a wire nothing says where it leaves its box: it stays where all rows put it."""
    campaign = tr.simulate(ur10, rows=80, noise=5e-5, measures="distance", tool=(0.05, 0.02, 0.1), seed=1)
    keep = np.ones(80, dtype=bool)
    keep[np.flatnonzero(campaign.labels["anchor"] == "0")[1:]] = False
    before, after = register(campaign), register(campaign, keep)
    assert np.abs(after.artefacts["anchor 0"].place - before.artefacts["anchor 0"].place).max() < 1e-3
    assert np.abs(observe(campaign.take(np.flatnonzero(keep)), after).gap).max() < 1e-3
