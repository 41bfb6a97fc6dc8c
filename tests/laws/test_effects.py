"""Laws that every effect of the library keeps on every arm: its columns, its covariates, its arguments, its words."""

import json
from dataclasses import replace

import numpy as np
import pytest
from conftest import load_arm
from helpers import without_masses
from simulate import simulate

from thermal_robot import diagnose
from thermal_robot.effects import FRAMES, Drift, JointRipple, ThermalElongation, TransmissionError, library
from thermal_robot.effects.apply import by_place, displacement
from thermal_robot.effects.gate import checked, driver
from thermal_robot.inference.columns import block, frame_columns
from thermal_robot.kinematics import exp6, rotation_to_quaternion
from thermal_robot.observations import Frames, observe
from thermal_robot.robot import load_robot

every_effect = pytest.mark.parametrize("name", sorted(library()))


def at_work(name, robot):
    """An effect of the library that does something: ripple has no waves before some are found."""
    effect = library()[name]
    if isinstance(effect, JointRipple):
        for joint, order in ((robot.joint_names[0], 7.0), (robot.joint_names[-1], 26.5)):
            effect = effect.having(joint, order, 100.0)
    return effect


on_arms = pytest.mark.parametrize("arm", ["rv_m2", "ur10", "panda", "awkward-from-base"], indirect=True)


def campaign_of(robot, turning=None, samples=8, name=None):
    """A campaign with every covariate that an effect may read.

    A sensor on each link only for the effect that needs them: where they are, nothing lags behind a general one.
    """
    data = simulate(robot, samples=samples, turning=turning, seed=1)[0]
    rng = np.random.default_rng(2)
    recorded = dict(data.covariates)
    recorded["order"] = np.arange(samples, dtype=float)
    recorded["speed"] = rng.uniform(0.1, 1.0, samples)
    recorded["humidity"] = rng.uniform(30.0, 60.0, samples)
    for joint in robot.joint_names:
        recorded[f"velocity.{joint}"] = rng.normal(size=samples)
        recorded[f"acceleration.{joint}"] = rng.normal(size=samples)
        recorded[f"encoder.{joint}"] = data.q[:, robot.joint_names.index(joint)] + 1e-4
    if name == "thermal_bending":
        for link in dict.fromkeys(segment.parent_link for segment in robot.segments):
            recorded[f"temperature.{link}"] = 25.0 + 3.0 * rng.normal(size=samples)
    gears = {robot.joint_names[0]: 101.0, robot.joint_names[-1]: 50.0}
    return replace(data, covariates=recorded, extra=("humidity",), gears=gears)


def settings(effect, observations):
    """An effect in every setting of its nonlinear arguments."""
    return dict.fromkeys((effect, *effect.variants(observations), *effect.nearby(1.5)))


def predicted(campaign, frames, effect, values):
    """Position and orientation that the instrument would show with an effect at work."""
    change, instrument = displacement(observe(campaign, frames), [(effect, np.asarray(values))])
    seen = observe(campaign, frames, displacement=change, instrument=instrument)
    position = seen.predicted_position + (0.0 if instrument is None else instrument)
    return position, frames.base[:3, :3] @ seen.rotation


def measured_where_predicted(campaign, frames):
    """The campaign as if the nominal robot had been measured without noise."""
    nominal = observe(campaign, frames)
    orientation = None
    if campaign.orientation is not None:
        orientation = rotation_to_quaternion(frames.base[:3, :3] @ nominal.rotation)
    return replace(campaign, position=nominal.predicted_position, orientation=orientation)


def a_place(known, campaign):
    if known:
        return Frames.declared(campaign)
    rng = np.random.default_rng(3)
    return Frames(exp6(rng.normal(size=6) * 2.0), exp6(rng.normal(size=6) * [0.1, 0.1, 0.1, 1, 1, 1]))


def assert_columns_are(columns, differences, sizes, what):
    scale = np.abs(columns).max(axis=(0, 1)) + 1e-300
    for p in range(columns.shape[2]):
        if not columns[:, :, p].any():  # an expected size moves nothing by a picometre
            assert np.abs(differences[:, :, p]).max() * sizes[p] < 1e-12, f"{what}, parameter {p}"
            continue
        # what no parameter moves must not move; what is moved, to a millionth
        error = np.abs(columns[:, :, p] - differences[:, :, p]).max() / max(scale[p], 1e-6)
        assert error < 1e-6, f"{what}, parameter {p}: off by {error:.1e} of its largest entry"


@on_arms
@pytest.mark.parametrize("turning", [None, 1e-5], ids=["positions", "poses"])
@pytest.mark.parametrize("known", [False, True], ids=["unknown-frames", "known-frames"])
def test_columns_are_the_derivative_of_the_exact_model(arm, turning, known):
    campaign = replace(campaign_of(arm, turning), base_known=known, tool_known=known)
    frames = a_place(known, campaign)
    for name in library():
        effect = at_work(name, arm)
        recorded = campaign_of(arm, turning, name=name).covariates
        campaign = measured_where_predicted(replace(campaign, covariates=recorded), frames)
        nominal = observe(campaign, frames)
        assert np.abs(nominal.gap).max() < 1e-12
        for setting in settings(effect, nominal):
            item = block(nominal, setting)
            differences = np.zeros_like(item.columns)
            for p, parameter in enumerate(item.parameters):
                largest = max(np.abs(r.values).max() for r in parameter.responses)
                h = 1e-5 / max(largest, 1e-3)
                gaps = []
                for sign in (1.0, -1.0):
                    values = np.zeros(len(item.parameters))
                    values[p] = sign * h
                    change, instrument = displacement(nominal, [(setting, values)])
                    gaps.append(observe(campaign, frames, displacement=change, instrument=instrument).gap)
                differences[:, :, p] = -(gaps[0] - gaps[1]) / (2.0 * h)
            assert_columns_are(item.columns, differences, item.sizes, f"{setting}")


@on_arms
@every_effect
def test_parameters_of_zero_change_nothing(arm, name):
    campaign = campaign_of(arm, 1e-5, name=name)
    frames = a_place(False, campaign)
    nominal = observe(campaign, frames)
    for setting in settings(at_work(name, arm), nominal):
        position, rotation = predicted(campaign, frames, setting, np.zeros(len(setting.parameters(nominal))))
        np.testing.assert_array_equal(position, nominal.predicted_position)
        np.testing.assert_array_equal(rotation, frames.base[:3, :3] @ nominal.rotation)


@on_arms
@every_effect
def test_parameters_are_named_once_placed_on_the_robot_and_have_a_size(arm, name):
    nominal = observe(campaign_of(arm, name=name))
    links = {segment.parent_link for segment in arm.segments}
    places = {"joint": set(arm.joint_names), "link": links, "base": {"base"}, "tool": {"tool"}}
    places["instrument"] = {"instrument"}
    parameters = at_work(name, arm).parameters(nominal)
    assert parameters
    assert len({p.name for p in parameters}) == len(parameters)
    assert all(p.place in places[p.kind] for p in parameters)
    assert all(0.0 < p.size < 0.1 for p in parameters)
    lengths = {j for j, kind in zip(arm.joint_names, arm.joint_types, strict=True) if kind == "prismatic"}
    if name in ("joint_offset", "transmission_error", "backlash"):
        assert all(p.unit == ("m" if p.place in lengths else "rad") for p in parameters)


@pytest.mark.parametrize("arm", ["rv_m2", "ur10", "panda"], indirect=True)
@every_effect
def test_reads_names_exactly_what_changes_the_response(arm, name):
    campaign = campaign_of(arm, name=name)
    link = next(s.parent_link for s in arm.segments if s.length > 1e-9)
    own = {f"temperature.{link}": campaign.covariates["temperature"] + 1.0}
    sensed = {f"torque.{arm.joint_names[1]}": 5.0 + np.arange(8.0)}
    for more in ({}, own, sensed):
        given = replace(campaign, covariates={**campaign.covariates, **more})
        assert_reads_what_it_follows(given, at_work(name, arm))


def assert_reads_what_it_follows(campaign, effect):
    frames = a_place(False, campaign)
    nominal = observe(campaign, frames)
    for setting in effect.variants(nominal):
        if getattr(setting, "lag", 0.0):
            continue  # within the campaign's time it goes by the campaign's record
        parameters = setting.parameters(nominal)
        values = np.array([p.size for p in parameters]) * (1.0 + np.arange(len(parameters)) / 7.0)
        before = predicted(campaign, frames, setting, values)
        follows = set()
        for column, recorded in campaign.covariates.items():
            changed = -recorded if column.startswith("approach.") else 1.3 * recorded[::-1] + 0.17
            other = {**campaign.covariates, column: changed}
            after = predicted(replace(campaign, covariates=other), frames, setting, values)
            if any(not np.array_equal(b, a) for b, a in zip(before, after, strict=True)):
                follows.add(column)
        if getattr(setting, "held", 0.0):
            # a torque is read, but only one that crosses a limit changes anything
            assert set(setting.reads(nominal)) >= follows
        else:
            assert set(setting.reads(nominal)) == follows


@pytest.mark.parametrize("temperatures", [("temperature",), ()], ids=["robot-and-links", "links-only"])
def test_thermal_elongation_reads_no_general_temperature_where_every_link_has_its_own(rv_m2, temperatures):
    campaign = campaign_of(rv_m2)
    links = dict.fromkeys(s.parent_link for s in rv_m2.segments if s.length > 1e-9)
    own = {f"temperature.{link}": 20.0 + k + np.arange(8.0) for k, link in enumerate(links)}
    general = {t: campaign.covariates[t] for t in temperatures}
    given = replace(campaign, covariates={**general, **own})
    assert_reads_what_it_follows(given, ThermalElongation())
    assert set(ThermalElongation().reads(observe(given))) == set(own)


def test_compliance_reads_no_payload_where_every_joint_reports_its_torque(rv_m2):
    campaign = campaign_of(rv_m2)
    sensed = {f"torque.{joint}": 5.0 + k + np.arange(8.0) for k, joint in enumerate(rv_m2.joint_names)}
    given = replace(campaign, covariates={**campaign.covariates, **sensed})
    assert_reads_what_it_follows(given, library()["joint_compliance"])


def test_drift_follows_order_where_there_is_no_time(rv_m2):
    campaign = campaign_of(rv_m2).drop_covariate("time")
    assert Drift().reads(observe(campaign)) == ("order",)
    assert_reads_what_it_follows(campaign, Drift())


# what is read where it is there, and not asked for
OPTIONAL = {"tracking_lag": {"acceleration"}, "link_compliance": {"payload"}, "base_compliance": {"payload"}}


@every_effect
@pytest.mark.parametrize("spoil", ["absent", "constant"])
def test_an_effect_without_its_covariates_names_them(rv_m2, name, spoil):
    campaign = campaign_of(without_masses(rv_m2), name=name)
    # without gravity no weight is missed
    campaign = replace(campaign, robot=without_masses(rv_m2, gravity=np.zeros(3)))
    effect = at_work(name, rv_m2)
    columns = effect.reads(observe(campaign))
    covariates = {k: v for k, v in campaign.covariates.items() if not k.startswith("order")}
    if spoil == "absent":
        less = {k: v for k, v in covariates.items() if k not in columns}
    else:
        # a payload of zero puts no torque on any joint, however the arm moves
        less = {k: (0.0 if k == "payload" else 1.0) * np.ones(8) if k in columns else v for k, v in covariates.items()}
    missing = effect.missing(observe(replace(campaign, covariates=less)))
    if columns:
        named = {m.split(".")[0] for m in missing} | OPTIONAL.get(name, set())
        assert named >= {c.split(".")[0] for c in columns}
    else:
        assert all(m.startswith("frames.") for m in missing)


def test_a_diagnosis_says_what_would_make_an_effect_testable(rv_m2):
    # the shapes of gravity's torques need no masses, but they need gravity
    robot = without_masses(rv_m2, gravity=np.zeros(3))
    data = simulate(robot, samples=60, seed=4)[0]
    constant = {k: np.zeros(60) for k in data.covariates}
    expected = {
        "base_frame": ('frames.base = "known"',),
        "tool_frame": ('frames.tool = "known"',),
        "backlash": tuple(f"approach.{joint}" for joint in robot.joint_names),
        "joint_compliance": ("torque.<joint>", "payload", "masses in the URDF"),
        "tracking_lag": tuple(f"velocity.{joint}" for joint in robot.joint_names),
        "link_compliance": ("masses in the URDF",),
        "base_compliance": ("tilt.x", "tilt.y", "masses in the URDF"),
        "thermal_bending": tuple(
            dict.fromkeys(f"temperature.{s.parent_link}" for s in robot.segments if s.length > 1e-6)
        ),
        "thermal_elongation": ("temperature",),
        "drift": ("time",),
    }
    for covariates in ({}, constant):
        found = diagnose(replace(data, covariates=covariates))
        untestable = {f.name: f.needs for f in found.effects if f.status == "not_testable"}
        assert {k: untestable.get(k) for k in expected} == expected
        for finding in found.effects:
            if finding.status == "not_testable":
                assert (finding.probability, finding.shrinkage, finding.parameters) == (None, None, ())
            else:
                assert finding.needs == ()


@every_effect
def test_frames_are_effects_only_where_they_are_declared_known(rv_m2, name):
    campaign = campaign_of(rv_m2, name=name)
    for base in (False, True):
        for tool in (False, True):
            missing = at_work(name, rv_m2).missing(observe(replace(campaign, base_known=base, tool_known=tool)))
            assert bool(missing) == {"base_frame": not base, "tool_frame": not tool}.get(name, False)


@every_effect
def test_arguments_make_the_same_effect_again(rv_m2, name):
    effect = at_work(name, rv_m2)
    special = {"transmission_error": TransmissionError((1, 3)), "drift": Drift(5.0, 60.0, 0.25)}
    campaign = campaign_of(rv_m2, name=name)
    bare = replace(campaign, robot=without_masses(rv_m2))
    every = {**settings(effect, observe(campaign)), **settings(effect, observe(bare))}
    for setting in (*every, special.get(name, effect)):
        plain = json.loads(json.dumps(setting.arguments()))
        again = type(setting)(**{k: tuple(v) if isinstance(v, list) else v for k, v in plain.items()})
        assert again == setting


@on_arms
@every_effect
def test_every_setting_passes_the_gate_and_is_drawn_against_something(arm, name):
    observations, effect = observe(campaign_of(arm, 1e-5, name=name)), at_work(name, arm)
    for setting in settings(effect, observations):
        parts = [part for parameter in checked(setting, observations) for part in by_place(arm, parameter)]
        found = [driver(setting, observations, [part], np.linspace(-1e-3, 1e-3, 8)) for part in parts]
        # a frame that is off is off everywhere: nothing drives it
        assert any(found) == (name not in FRAMES)
        assert all(what[0] for what in found if what)


def outside(observations, name, container):
    """Share of an effect's columns that neither the unknown frames nor a larger effect can do, the worst column's."""

    def flat(columns):
        flat = columns.reshape(columns.shape[0] * columns.shape[1], columns.shape[2])
        return flat / (np.linalg.norm(flat, axis=0) + 1e-300)

    effects = library()
    larger = [flat(frame_columns(observations)[0]), flat(block(observations, effects[container]).columns)]
    left, strength, _ = np.linalg.svd(np.hstack(larger), full_matrices=False)
    basis = left[:, strength > 1e-10 * strength[0]]
    own = flat(block(observations, effects[name]).columns)
    return float(np.linalg.norm(own - basis @ (basis.T @ own), axis=0).max())


CONTAINED = [(name, larger) for name, effect in library().items() for larger in effect.contained_in]


@pytest.mark.parametrize("arm", ["rv_m2", "ur10", "panda", "awkward-from-base"], indirect=True)
@pytest.mark.parametrize("turning", [None, 1e-5], ids=["positions", "poses"])
@pytest.mark.parametrize(("name", "larger"), CONTAINED)
def test_what_a_larger_effect_contains_it_can_do_exactly(arm, turning, name, larger):
    data = simulate(arm, samples=60, turning=turning, seed=1)[0]
    scales = name == "instrument_scale" and "prismatic" in arm.joint_types
    for known in (False, True):
        left = outside(observe(replace(data, base_known=known, tool_known=known)), name, larger)
        # a slide's stroke is no link length: no geometry scales it
        assert (left > 0.01) if scales else (left < 1e-10)


def test_those_that_contain_are_there_and_are_not_contained_themselves():
    assert set(CONTAINED) == {(n, "geometric") for n in ("joint_offset", "base_frame", "instrument_scale")}
    data = simulate(load_arm("rv_m2"), samples=60, seed=1)[0]
    for name in ("joint_gain", "transmission_error", "thermal_elongation", "drift"):
        assert outside(observe(data), name, "geometric") > 0.01
    # a target on a link that turns is no part of that link's joint
    on_the_wrist = load_robot("example-robot-data:ur10", "wrist_3_link")
    known = replace(simulate(on_the_wrist, samples=60, seed=1)[0], base_known=True, tool_known=True)
    assert outside(observe(known), "tool_frame", "geometric") > 0.01


def test_titles_are_words_of_their_own():
    titles = [effect.title for effect in library().values()]
    assert all(titles)
    assert len(set(titles)) == len(titles)
    assert not any("_" in title or title.endswith(".") for title in titles)
