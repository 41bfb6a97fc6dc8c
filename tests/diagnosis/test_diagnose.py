"""One effect at 2-6 times the noise, 3 % gross errors: which effect, which rows, how much, how sure, how far."""

import json
from dataclasses import dataclass, replace

import numpy as np
import pytest
from helpers import some
from several import FLAT, LONG, simulated, table_of
from simulate import simulate
from threadpoolctl import threadpool_info, threadpool_limits

from thermal_robot import CampaignError, EffectError, diagnose
from thermal_robot.campaign import campaign_from_table, read_campaign, write_campaign
from thermal_robot.effects import RANDOM, library
from thermal_robot.inference.columns import frame_columns, moved_by
from thermal_robot.inference.registration import register
from thermal_robot.kinematics import Displacement, rotation_to_quaternion
from thermal_robot.observations import observe

ALONE = [name for name in library() if name not in ("base_frame", "tool_frame", "joint_ripple")]
"""Ripple has no waves of its own to draw: tests/diagnosis/test_rippled.py."""
DOUBTED = ("ur10", "base_compliance")
"""Robot and effect whose probability is an expected failure of its own."""
COLUMNS = {"tracking_lag": {"moving": True}, "thermal_bending": {"links": True}}
NOISE = 25e-6
FEW = [ALONE.index(name) for name in ("joint_offset", "backlash", "geometric", "thermal_elongation")]
EVERY = range(len(ALONE))
two_arms = pytest.mark.parametrize("arm", ["rv_m2", pytest.param("ur10", marks=pytest.mark.slow)], indirect=True)
on_arms = pytest.mark.parametrize(
    ("arm", "seeds"),
    [("rv_m2", FEW), *(pytest.param(name, EVERY, marks=pytest.mark.slow) for name in ("rv_m2", "ur10", "panda"))],
    ids=["rv_m2-few", "rv_m2", "ur10", "panda"],
    indirect=True,
)


@dataclass(frozen=True)
class Case:
    """A simulated campaign, its answer, further samples with where the target really is there, and what was said."""

    campaign: object
    truth: dict
    fresh: object
    place: np.ndarray
    found: object

    @property
    def right(self):
        return self.found.verdict == tuple(self.truth["effects"]) and not self.found.unexplained.flagged

    @property
    def name(self):
        return self.truth["effects"][0]


def diagnosed(robot, effects, seed, **how):
    campaign, truth, (fresh, place) = simulate(robot, effects, seed=seed, outliers=0.03, fresh=200, **how)
    return Case(campaign, truth, fresh, place, diagnose(campaign))


@pytest.fixture(scope="module")
def seeds(request):
    return request.param


@pytest.fixture(scope="module")
def cases(arm, seeds):
    """Effects alone on one arm: a few of them, or each."""
    return [diagnosed(arm, [ALONE[seed]], seed, **COLUMNS.get(ALONE[seed], {})) for seed in seeds]


@on_arms
def test_the_verdict_is_the_effect_and_nothing_is_unexplained(cases):
    wrong = {c.name: (c.found.verdict, c.found.unexplained.reasons) for c in cases if not c.right}
    assert len(wrong) <= (len(cases) > len(FEW)), wrong


@on_arms
def test_the_rows_set_aside_are_the_spoilt_ones(cases):
    falsely = 0
    for case in cases:
        spoilt, listed = set(case.truth["outliers"]), set(case.found.outliers)
        falsely += len(listed - spoilt)
        missed = np.isin(case.campaign.rows, sorted(spoilt - listed))
        predicted, _ = case.found.model.prediction(case.campaign)[:2]
        distance = np.linalg.norm(case.campaign.position - predicted, axis=1)
        assert (distance[missed] < 10.0 * NOISE).all()
    assert sum(len(c.truth["outliers"]) for c in cases) >= 2 * len(cases)
    assert falsely <= 0.01 * sum(c.campaign.samples for c in cases)


def in_the_parameters_told(case):
    """True values of the parameters by which an effect is told, where these are not its own: by least squares."""
    true, effect, seen = case.truth["parts"][case.name]["values"], library()[case.name], case.found.fit.corrected
    if not effect.independent(seen):
        return true
    told = [f for f in case.found.effects if f.name == case.name or f.status == "contained"]
    own = [p for f in told for e in [library()[f.name]] for p in (*e.independent(seen), *e.parameters(seen))]
    names = [p.name for f in told for p in f.parameters]
    columns = moved_by(seen, [{p.name: p for p in own}[name] for name in names])
    whole = effect.parameters(seen)
    moved = moved_by(seen, whole) @ np.array([true.get(p.name, 0.0) for p in whole])
    stack = np.concatenate([columns, frame_columns(seen)[0]], axis=2).reshape(moved.size, -1)
    return dict(zip(names, np.linalg.lstsq(stack, moved.ravel(), rcond=1e-10)[0].tolist(), strict=False))


@pytest.mark.slow
@pytest.mark.parametrize(("arm", "seeds"), [(name, EVERY) for name in ("rv_m2", "ur10", "panda")], indirect=True)
def test_parameters_are_as_far_from_the_truth_as_they_say(cases):
    standard = []
    for case in (c for c in cases if c.right):
        true = in_the_parameters_told(case)
        known = [p for p in case.found.finding(case.name).parameters if p.identified]
        standard += [(p.value - true.get(p.name, 0.0)) / p.std for p in known]
    distance = np.abs(standard)
    assert len(distance) > 40
    assert np.mean(distance < 4.0) >= 0.95
    assert 0.80 <= np.mean(distance < 1.96) <= 0.995
    assert 0.50 <= np.mean(distance < 1.0) <= 0.85


@on_arms
def test_effects_of_many_joints_sit_where_they_were_put(cases):
    for case in cases:
        values = case.truth["parts"][case.name]["values"]
        if not case.right or case.name not in ("backlash", "joint_gain", "transmission_error"):
            continue
        faulty = {name.rsplit(", ", 1)[1] for name in values}
        first = case.found.finding(case.name).locations[0]
        assert first.kind == "joint"
        assert first.name in faulty
        assert case.found.where.joints[first.name] == pytest.approx(first.share)


@on_arms
def test_shrinkage_on_held_out_rows_is_that_on_fresh_samples(cases):
    """Measured anew with the same noise, before (frames fitted, nothing else) and after."""
    missed, inside, misses = [], [], []
    for case in cases:
        kept = ~np.isin(case.campaign.rows, case.found.outliers)
        nominal = replace(case.found.model, effects=(), needs=(), frames=register(case.campaign, kept))
        square = [
            ((model.prediction(case.fresh)[0] - case.place) ** 2).sum(axis=1).mean() + 3.0 * NOISE**2
            for model in (nominal, case.found.model)
        ]
        real = 1.0 - square[1] / square[0]
        held_out = case.found.gap.held_out
        missed.append(held_out.shrinkage - real)
        low, high = held_out.shrinkage_ci95
        assert low <= held_out.shrinkage <= high
        inside.append(low - 0.01 < real < high + 0.01)
        misses.append(np.sqrt((square[1] - 3.0 * NOISE**2) / 3.0) / NOISE)
    assert np.median(np.abs(missed)) <= 0.02
    assert np.max(np.abs(missed)) <= 0.1
    assert np.mean(inside) >= 7 / 9
    assert np.median(misses) < 0.35  # the corrected model is nearer to the truth than any one measurement
    assert np.max(misses) < 0.7


@on_arms
def test_figures_are_consistent(cases):
    for case in cases:
        found, gap = case.found, case.found.gap
        assert (gap.noise_floor, gap.noise_source) == (pytest.approx(np.sqrt(3.0) * NOISE), "stated")
        assert gap.noise_floor * 0.8 < gap.rms_after < gap.rms_before
        assert gap.held_out.folds == 20
        assert sum(found.where.axes.values()) == pytest.approx(1.0)
        assert 0.0 <= found.probability <= 1.0 + 1e-12
        assert {f.name for f in found.effects} == {*library(), *RANDOM}
        assert found.verdict == tuple(f.name for f in found.effects if f.parameters and f.status != "contained")
        assert found.unexplained.rms == 0.0 or found.unexplained.flagged
        own = found.finding(found.verdict[0])
        if (found.robot, case.name) != DOUBTED:
            assert own.probability > 0.9
        assert sum(p.share for p in own.locations) == pytest.approx(own.shrinkage, abs=1e-9)
        shares = [f.shrinkage for f in found.effects if f.name in found.verdict]
        assert sum(shares) == pytest.approx(gap.held_out.shrinkage, abs=0.03)
        kept = ~found.rows.outliers
        fitted = observe(case.campaign, register(case.campaign, kept)).gap[kept]
        assert gap.rms_before == pytest.approx(np.sqrt((fitted**2).sum(axis=1).mean()), rel=1e-9)
        assert gap.rms_after == pytest.approx(np.sqrt((found.rows.remainder[kept] ** 2).sum(axis=1).mean()))
        predicted, _ = found.model.prediction(case.campaign)[:2]
        apart = np.linalg.norm(case.campaign.position - predicted, axis=1)
        np.testing.assert_allclose(apart, np.linalg.norm(found.rows.remainder, axis=1), rtol=1e-6, atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize(("arm", "seeds"), [("ur10", EVERY)], indirect=True)
def test_a_soft_base_under_a_ur10_is_as_sure_as_all_others(cases):
    own = next(case.found.finding(case.name) for case in cases if case.name == DOUBTED[1])
    assert own.probability > 0.9


@on_arms
def test_what_is_not_identified_has_no_number(arm, cases):
    """As an offset of the first joint, where the base is unknown."""
    unknown = 0
    for case in cases:
        for finding in case.found.to_dict()["effects"]:
            for p in finding["parameters"]:
                assert (p["value"] is None) == (p["std"] is None) == (not p["identified"])
                unknown += not p["identified"]
    assert unknown > 0
    offsets = next(c for c in cases if c.name == "joint_offset").found.finding("joint_offset").parameters
    # where some joints alone are at fault, it is not among them
    first = [p for p in offsets if p.name.endswith(f", {arm.joint_names[0]}")]
    assert all((p.value, p.std, p.identified) == (None, None, False) for p in first)
    assert any(p.identified for p in offsets)


@pytest.mark.parametrize(
    ("arm", "seed"),
    [
        ("rv_m2", 1),
        *(pytest.param(arm, seed, marks=pytest.mark.slow) for arm, seed in (("rv_m2", 0), ("ur10", 0), ("ur10", 1))),
    ],
    indirect=["arm"],
)
def test_two_effects_share_the_gap_as_they_caused_it(arm, seed, diagnosed_once):
    """Shares add up to the whole; each is near its part of the mean square, noise included."""
    both = ["thermal_elongation", "backlash"]
    campaign, truth, _ = simulate(arm, both, seed=seed, outliers=0.03)
    found = diagnosed_once(campaign)
    assert set(found.verdict) == set(both)
    square = {name: truth["parts"][name]["rms"] ** 2 for name in both}
    share = {name: found.finding(name).shrinkage for name in both}
    assert sum(share.values()) == pytest.approx(found.gap.held_out.shrinkage, abs=0.03)
    assert list(found.verdict) == sorted(both, key=lambda n: -share[n])
    for name in both:
        assert share[name] == pytest.approx(square[name] / (sum(square.values()) + 3.0 * NOISE**2), abs=0.15)


# Withheld effects -----------------------------------------------------------------------------------------

CONDITIONS = {"backlash": "joint", "transmission_error": "joint", "drift": "base"}


WITHHELD = ("transmission_error", "backlash", "joint_compliance", "geometric", "thermal_elongation", "drift")


@pytest.mark.parametrize(
    ("arm", "alone"),
    [("rv_m2", ("drift",)), *(pytest.param(arm, WITHHELD, marks=pytest.mark.slow) for arm in ("rv_m2", "ur10"))],
    indirect=["arm"],
)
def test_a_withheld_effect_is_called_unexplained_with_its_place_and_quantity(arm, alone):
    flagged, placed, followed = [], [], []
    for name in alone:
        seed = WITHHELD.index(name)
        campaign, truth, _ = simulate(arm, [name], seed=seed, outliers=0.03)
        found = diagnose(campaign, without=[name])
        left = found.unexplained
        assert name not in {f.name for f in found.effects}
        flagged.append(left.flagged)
        if not left.flagged or name not in CONDITIONS:
            continue
        assert found.to_dict()["verdict"]["unexplained"] is True
        assert left.p_value < 1e-3
        assert left.reasons
        assert left.rms > NOISE / 2
        place, quantity = left.locations[0], left.depends_on[0].covariate
        faulty = {n.rsplit(", ", 1)[1] for n in truth["parts"][name]["values"]}
        placed.append(place.kind == CONDITIONS[name] and (name == "drift" or place.name in faulty))
        expected = {"drift": "time", "backlash": f"approach.{place.name}", "transmission_error": place.name}
        followed.append(quantity == expected[name])
    few = len(set(alone) & set(CONDITIONS))
    missed = len(alone) > 1
    assert sum(flagged) >= len(alone) - missed
    assert len(placed) == few
    assert sum(placed) + sum(followed) >= 2 * few - missed


@pytest.mark.parametrize("arm", ["ur10"], indirect=True)
@pytest.mark.parametrize(
    ("name", "stand_in"),
    some([("joint_gain", "transmission_error"), ("joint_offset", "geometric"), ("instrument_scale", "geometric")], 3),
)
def test_a_withheld_effect_that_another_contains_is_carried_by_that(arm, name, stand_in):
    found = diagnose(simulate(arm, [name], seed=0, outliers=0.03)[0], without=[name])
    assert stand_in in found.verdict
    assert not found.unexplained.flagged


@pytest.fixture(scope="module")
def campaign(rv_m2):
    """Two effects at work, a few rows spoilt."""
    return simulate(rv_m2, ["thermal_elongation", "backlash"], samples=60, seed=1, outliers=0.03)[0]


def test_each_stage_says_what_it_does_in_one_thread_and_leaves_nothing_to_chance(campaign, tmp_path):
    """Sums are rounded in the same order, to the last bit; nor do threads stay fewer once it has answered."""
    file, from_memory, from_file, seen = write_campaign(campaign, tmp_path), [], [], []

    def look(stage):
        from_file.append(stage)
        seen.append(max(pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"))

    found = diagnose(read_campaign(file), progress=from_memory.append)
    with threadpool_limits(4):
        again = diagnose(file, progress=look)
        assert {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"} == {4}
    assert from_file == ["reading the campaign", *from_memory]
    assert from_memory[0] == "unknown frames"
    assert "held out: 20 blocks, one at a time" in from_memory
    assert len(seen) > 5
    assert set(seen[1:]) == {1}  # a file is read before
    assert json.dumps(again.to_dict()) == json.dumps(found.to_dict())
    # the sentences belong to what was found
    assert all(found.title(name).split()[0] in found.summary for name in found.verdict[:1])
    assert bool(found.advice) == (found.wanted is not None)


def test_a_name_that_no_effect_has_is_named(campaign):
    with pytest.raises(CampaignError) as refused:
        diagnose(replace(campaign, priors={"gremlins": 1.0}))
    assert refused.value.column == "priors.gremlins"
    assert "backlash" in refused.value.expected
    for how in ({"only": ["gremlins"]}, {"without": ["gremlins"]}):
        with pytest.raises(EffectError, match="gremlins"):
            diagnose(campaign, **how)


@two_arms
@pytest.mark.parametrize(
    ("effects", "lost"), some([(["joint_offset"], 0.1), (["thermal_elongation"], 0.0), ([], 0.1)], 3)
)
def test_several_targets_of_each_pose_tell_the_effect(arm, effects, lost):
    """Nothing else, nothing unexplained, and what remains is the noise of their middle."""
    data, _ = simulated(arm, effects, LONG, 3, samples=80, lost=lost)
    found = diagnose(data).to_dict()
    assert found["verdict"]["effects"] == effects
    assert not found["verdict"]["unexplained"]
    assert found["campaign"]["measures"] == "pose"
    assert found["gap"]["rms_after"] == pytest.approx(found["gap"]["noise_floor"], rel=0.15)


@pytest.mark.slow
@two_arms
def test_several_targets_of_one_visit_are_no_visits(arm):
    """A joint that scatters anew at each visit moves all targets at once: it is found, and its size is right."""
    rng, sigma, joint = np.random.default_rng(4), 3e-4, 2
    poses = simulate(arm, samples=40, seed=4, noise=25e-9, turning=1e-12)[0]
    visits = poses.take(np.repeat(np.arange(40), 3))
    error = np.zeros_like(visits.q)
    error[:, joint] = sigma * rng.normal(size=120)
    moved = observe(visits, displacement=Displacement(joint=error))
    exact = replace(visits, position=moved.position, orientation=rotation_to_quaternion(moved.rotation))
    found = diagnose(campaign_from_table(arm, table_of(exact, FLAT, rng), noise_position=NOISE))
    (wear,) = [e for e in found.to_dict()["effects"] if e["status"] == "found"]
    assert wear["locations"][0]["name"] == arm.joint_names[joint]
    assert wear["parameters"][0]["value"] == pytest.approx(sigma, rel=0.25)
