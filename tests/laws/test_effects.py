"""Laws that every effect of the library keeps on every arm: its columns, its covariates, its arguments, its words."""

import json
from dataclasses import replace
from functools import cache
from itertools import product

import numpy as np
import pytest
from conftest import load_arm
from helpers import some, without_masses
from simulate import simulate

from thermal_robot import diagnose
from thermal_robot.effects import FRAMES, Drift, JointRipple, ThermalElongation, TransmissionError, gate, library
from thermal_robot.effects.apply import by_place, displacement
from thermal_robot.inference.columns import block, frame_columns
from thermal_robot.kinematics import exp6, rotation_to_quaternion
from thermal_robot.observations import Frames, observe
from thermal_robot.robot import load_robot

every_effect = pytest.mark.parametrize("name", sorted(library()))
ARMS = ["rv_m2", "ur10", "panda", "awkward-from-base"]
ROWS = 8


def at_work(name, robot):
    """An effect of the library that does something: ripple has no waves before some are found."""
    effect = library()[name]
    if isinstance(effect, JointRipple):
        effect = effect.having(robot.joint_names[0], 7.0, 100.0).having(robot.joint_names[-1], 26.5, 100.0)
    return effect


@cache
def measured(arm, turning, samples):
    return simulate(load_arm(arm), samples=samples, turning=turning, seed=1)[0]


def campaign_of(arm, turning=None, name=None, **changed):
    """A campaign with every covariate that an effect may read.

    A sensor on each link only for the effect that needs them: where they are, nothing lags behind a general one.
    """
    data = measured(arm, turning, ROWS)
    robot, rng, recorded = data.robot, np.random.default_rng(2), dict(data.covariates)
    recorded["order"] = np.arange(float(ROWS))
    recorded["speed"] = rng.uniform(0.1, 1.0, ROWS)
    recorded["humidity"] = rng.uniform(30.0, 60.0, ROWS)
    for j, joint in enumerate(robot.joint_names):
        recorded[f"velocity.{joint}"] = rng.normal(size=ROWS)
        recorded[f"acceleration.{joint}"] = rng.normal(size=ROWS)
        recorded[f"encoder.{joint}"] = data.q[:, j] + 1e-4
    if name == "thermal_bending":
        for link in dict.fromkeys(segment.parent_link for segment in robot.segments):
            recorded[f"temperature.{link}"] = 25.0 + 3.0 * rng.normal(size=ROWS)
    gears = {robot.joint_names[0]: 101.0, robot.joint_names[-1]: 50.0}
    return replace(data, covariates=recorded, extra=("humidity",), gears=gears, **changed)


def settings(effect, observations):
    """An effect in every setting of its nonlinear arguments."""
    return dict.fromkeys((effect, *effect.variants(observations), *effect.nearby(1.5)))


def predicted(campaign, frames, effect, values):
    """Position and orientation that the instrument would show with an effect at work."""
    change, instrument = displacement(observe(campaign, frames), [(effect, np.asarray(values))])
    seen = observe(campaign, frames, displacement=change, instrument=instrument)
    position = seen.predicted_position + (0.0 if instrument is None else instrument)
    return position, frames.base[:3, :3] @ seen.rotation


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


@pytest.mark.parametrize(
    ("arm", "turning", "known"),
    [
        ("awkward-from-base", 1e-5, False),
        ("rv_m2", None, True),
        *(pytest.param(*own, marks=pytest.mark.slow) for own in product(ARMS, (None, 1e-5), (False, True))),
    ],
)
def test_columns_are_the_derivative_of_the_exact_model(arm, turning, known):
    for name in library():
        campaign = campaign_of(arm, turning, name, base_known=known, tool_known=known)
        frames = a_place(known, campaign)
        seen = observe(campaign, frames)  # measured where the nominal robot is
        turned = None if turning is None else rotation_to_quaternion(frames.base[:3, :3] @ seen.rotation)
        campaign = replace(campaign, position=seen.predicted_position, orientation=turned)
        nominal = observe(campaign, frames)
        assert np.abs(nominal.gap).max() < 1e-12
        for setting in settings(at_work(name, campaign.robot), nominal):
            item = block(nominal, setting)
            differences = np.zeros_like(item.columns)
            for p, parameter in enumerate(item.parameters):
                h = 1e-5 / max(*(np.abs(r.values).max() for r in parameter.responses), 1e-3)
                gaps = []
                for sign in (1.0, -1.0):
                    values = sign * h * (np.arange(len(item.parameters)) == p)
                    change, instrument = displacement(nominal, [(setting, values)])
                    gaps.append(observe(campaign, frames, displacement=change, instrument=instrument).gap)
                differences[:, :, p] = -(gaps[0] - gaps[1]) / (2.0 * h)
            assert_columns_are(item.columns, differences, item.sizes, f"{setting}")


@pytest.mark.parametrize("arm", some(["awkward-from-base", "rv_m2", "ur10", "panda"], 4))
@every_effect
def test_every_setting_passes_the_gate_does_nothing_by_zeros_and_is_drawn_against_something(arm, name):
    campaign = campaign_of(arm, 1e-5, name)
    robot, frames = campaign.robot, a_place(False, campaign)
    nominal, effect = observe(campaign, frames), at_work(name, robot)
    links = {segment.parent_link for segment in robot.segments}
    places = {"joint": set(robot.joint_names), "link": links} | {k: {k} for k in ("base", "tool", "instrument")}
    lengths = {j for j, kind in zip(robot.joint_names, robot.joint_types, strict=True) if kind == "prismatic"}
    first = gate.checked(effect, nominal)
    assert first
    assert all(p.place in places[p.kind] and 0.0 < p.size < 0.1 for p in first)
    if name in ("joint_offset", "transmission_error", "backlash"):
        assert all(p.unit == ("m" if p.place in lengths else "rad") for p in first)
    for setting in settings(effect, nominal):
        parameters = gate.checked(setting, nominal)
        position, rotation = predicted(campaign, frames, setting, np.zeros(len(parameters)))
        np.testing.assert_array_equal(position, nominal.predicted_position)
        np.testing.assert_array_equal(rotation, frames.base[:3, :3] @ nominal.rotation)
        parts = [part for parameter in parameters for part in by_place(robot, parameter)]
        found = [gate.driver(setting, nominal, [part], np.linspace(-1e-3, 1e-3, ROWS)) for part in parts]
        # a frame that is off is off everywhere: nothing drives it
        assert any(found) == (name not in FRAMES)
        assert all(what[0] for what in found if what)


@pytest.mark.parametrize("arm", some(["rv_m2", "ur10", "panda"], 3))
@every_effect
def test_reads_names_exactly_what_changes_the_response(arm, name):
    sensors = name if name == "thermal_bending" else None
    for more in (None, "temperature", "torque"):
        assert_reads_what_it_follows(at_work(name, load_arm(arm)), *with_more(arm, sensors, more))


@cache
def with_more(arm, sensors, more):
    """A campaign where a link has a temperature of its own, or a joint its torque; with each column changed."""
    campaign = campaign_of(arm, name=sensors)
    robot = campaign.robot
    link = next(s.parent_link for s in robot.segments if s.length > 1e-9)
    added = {
        "temperature": {f"temperature.{link}": campaign.covariates["temperature"] + 1.0},
        "torque": {f"torque.{robot.joint_names[1]}": 5.0 + np.arange(ROWS)},
    }
    return changed(replace(campaign, covariates={**campaign.covariates, **added.get(more, {})}))


def changed(campaign):
    """Observations of a campaign, and of those in which one column is another."""
    nominal, others = observe(campaign, a_place(False, campaign)), {}
    for column, recorded in campaign.covariates.items():
        other = -recorded if column.startswith("approach.") else 1.3 * recorded[::-1] + 0.17
        here = replace(campaign, covariates={**campaign.covariates, column: other})
        others[column] = observe(here, nominal.frames)
    return nominal, others


def assert_reads_what_it_follows(effect, nominal, others):
    for setting in effect.variants(nominal):
        if getattr(setting, "lag", 0.0):
            continue  # within the campaign's time it goes by the campaign's record
        before, follows = gate.checked(setting, nominal), set()
        for column, other in others.items():
            pairs = zip(before, gate.checked(setting, other), strict=True)
            values = [(r.values, s.values) for p, q in pairs for r, s in zip(p.responses, q.responses, strict=True)]
            if not all(np.array_equal(*pair) for pair in values):
                follows.add(column)
        if getattr(setting, "held", 0.0):
            # a torque is read, but only one that crosses a limit changes anything
            assert set(setting.reads(nominal)) >= follows
        else:
            assert set(setting.reads(nominal)) == follows


def test_a_column_that_another_stands_in_for_is_not_read():
    campaign = campaign_of("rv_m2")
    robot, recorded = campaign.robot, campaign.covariates
    links = dict.fromkeys(s.parent_link for s in robot.segments if s.length > 1e-9)
    own = {f"temperature.{link}": 20.0 + k + np.arange(ROWS) for k, link in enumerate(links)}
    # no general temperature where every link has its own
    for general in ({"temperature": recorded["temperature"]}, {}):
        given = replace(campaign, covariates={**general, **own})
        assert_reads_what_it_follows(ThermalElongation(), *changed(given))
        assert set(ThermalElongation().reads(observe(given))) == set(own)
    # no payload where every joint reports its torque
    sensed = {f"torque.{joint}": 5.0 + k + np.arange(ROWS) for k, joint in enumerate(robot.joint_names)}
    given = replace(campaign, covariates={**recorded, **sensed})
    assert_reads_what_it_follows(library()["joint_compliance"], *changed(given))
    # the order only where there is no time
    untimed = campaign.drop_covariate("time")
    assert Drift().reads(observe(untimed)) == ("order",)
    assert_reads_what_it_follows(Drift(), *changed(untimed))


# what is read where it is there, and not asked for
OPTIONAL = {"tracking_lag": {"acceleration"}, "link_compliance": {"payload"}, "base_compliance": {"payload"}}


@every_effect
def test_an_effect_without_its_covariates_or_its_declared_frame_names_them(rv_m2, name):
    # without gravity no weight is missed
    campaign = campaign_of("rv_m2", name=name, robot=without_masses(rv_m2, gravity=np.zeros(3)))
    effect = at_work(name, rv_m2)
    columns = effect.reads(observe(campaign))
    covariates = {k: v for k, v in campaign.covariates.items() if not k.startswith("order")}
    absent = {k: v for k, v in covariates.items() if k not in columns}
    # a payload of zero puts no torque on any joint, however the arm moves
    constant = {
        k: (0.0 if k == "payload" else 1.0) * np.ones(ROWS) if k in columns else v for k, v in covariates.items()
    }
    for less in (absent, constant):
        missing = effect.missing(observe(replace(campaign, covariates=less)))
        named = {m.split(".")[0] for m in missing} | OPTIONAL.get(name, set())
        assert named >= {c.split(".")[0] for c in columns}
        assert columns or all(m.startswith("frames.") for m in missing)
    for base in (False, True):
        for tool in (False, True):
            declared = observe(campaign_of("rv_m2", name=name, base_known=base, tool_known=tool))
            assert bool(effect.missing(declared)) == {"base_frame": not base, "tool_frame": not tool}.get(name, False)


def test_a_diagnosis_says_what_would_make_an_effect_testable(rv_m2):
    # the shapes of gravity's torques need no masses, but they need gravity
    robot = without_masses(rv_m2, gravity=np.zeros(3))
    data = simulate(robot, samples=60, seed=4)[0]
    bent = dict.fromkeys(f"temperature.{s.parent_link}" for s in robot.segments if s.length > 1e-6)
    expected = {
        "base_frame": ('frames.base = "known"',),
        "tool_frame": ('frames.tool = "known"',),
        "backlash": tuple(f"approach.{joint}" for joint in robot.joint_names),
        "joint_compliance": ("torque.<joint>", "payload", "masses in the URDF"),
        "tracking_lag": tuple(f"velocity.{joint}" for joint in robot.joint_names),
        "link_compliance": ("masses in the URDF",),
        "base_compliance": ("tilt.x", "tilt.y", "masses in the URDF"),
        "thermal_bending": tuple(bent),
        "thermal_elongation": ("temperature",),
        "drift": ("time", "order"),
    }
    either = {
        **expected,
        "backlash": (*expected["backlash"], "order"),
    }  # where no direction is recorded, an order tells it
    for covariates, needs in (({}, either), ({k: np.zeros(60) for k in data.covariates}, expected)):
        found = diagnose(replace(data, covariates=covariates))
        untestable = {f.name: f.needs for f in found.effects if f.status == "not_testable"}
        assert {k: untestable.get(k) for k in needs} == needs
        for finding in found.effects:
            said = (finding.probability, finding.shrinkage, finding.parameters)
            assert (said == (None, None, ())) if finding.name in untestable else (finding.needs == ())


@every_effect
def test_arguments_make_the_same_effect_again(rv_m2, name):
    effect, campaign = at_work(name, rv_m2), campaign_of("rv_m2", name=name)
    special = {"transmission_error": TransmissionError((1, 3)), "drift": Drift(5.0, 60.0, 0.25)}
    bare = replace(campaign, robot=without_masses(rv_m2))
    every = {**settings(effect, observe(campaign)), **settings(effect, observe(bare))}
    for setting in (*every, special.get(name, effect)):
        plain = json.loads(json.dumps(setting.arguments()))
        again = type(setting)(**{k: tuple(v) if isinstance(v, list) else v for k, v in plain.items()})
        assert again == setting


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


@pytest.mark.parametrize("arm", ARMS)
@pytest.mark.parametrize("turning", [None, 1e-5], ids=["positions", "poses"])
@pytest.mark.parametrize(("name", "larger"), CONTAINED)
def test_what_a_larger_effect_contains_it_can_do_exactly(arm, turning, name, larger):
    data = measured(arm, turning, 60)
    scales = name == "instrument_scale" and "prismatic" in data.robot.joint_types
    for known in (False, True):
        left = outside(observe(replace(data, base_known=known, tool_known=known)), name, larger)
        # a slide's stroke is no link length: no geometry scales it
        assert (left > 0.01) if scales else (left < 1e-10)


def test_those_that_contain_are_there_and_are_not_contained_themselves():
    assert set(CONTAINED) == {(n, "geometric") for n in ("joint_offset", "base_frame", "instrument_scale")}
    for name in ("joint_gain", "transmission_error", "thermal_elongation", "drift"):
        assert outside(observe(measured("rv_m2", None, 60)), name, "geometric") > 0.01
    # a target on a link that turns is no part of that link's joint
    on_the_wrist = load_robot("example-robot-data:ur10", "wrist_3_link")
    known = replace(simulate(on_the_wrist, samples=60, seed=1)[0], base_known=True, tool_known=True)
    assert outside(observe(known), "tool_frame", "geometric") > 0.01
    titles = [effect.title for effect in library().values()]
    assert all(titles)
    assert len(set(titles)) == len(titles)
    assert not any("_" in title or title.endswith(".") for title in titles)
