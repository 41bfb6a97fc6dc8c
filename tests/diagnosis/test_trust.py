"""What is believed beside an unlisted cause: effects by size, scatter where there is some, laws that can be read."""

import pickle
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from helpers import NOISE, with_law
from simulate import simulate

from thermal_robot import diagnose
from thermal_robot.diagnosis.answer import _left
from thermal_robot.diagnosis.examine import Examined
from thermal_robot.diagnosis.parts import Unexplained
from thermal_robot.diagnosis.schemes import worse_elsewhere
from thermal_robot.diagnosis.stand_in import StandIn, trust
from thermal_robot.effects import choose
from thermal_robot.effects.law import Discovered
from thermal_robot.effects.quantities import quantities
from thermal_robot.errors import CampaignError
from thermal_robot.inference.fit import fit
from thermal_robot.inference.random_gap import random_gap
from thermal_robot.inference.rows import in_a_row
from thermal_robot.kinematics import Displacement
from thermal_robot.observations import Frames, observe


def test_an_effect_is_believed_by_its_size_beside_what_is_not_listed():
    shares = {"geometric": 0.9, "drift": 0.05, "discovered.1": 0.1}
    believed = trust(shares, {}, unlisted=0.0)
    assert believed == {"geometric": pytest.approx(0.9), "drift": 0.85}
    assert trust(shares, {}, unlisted=0.04)["geometric"] == pytest.approx(0.9 / 1.04)
    assert trust({"geometric": 0.6}, {}, unlisted=0.0) == {"geometric": 1.0}
    changing = trust({"geometric": 0.6}, {"geometric": StandIn(0.0, "time")}, unlisted=0.0)
    assert changing == {"geometric": 0.85}
    assert trust({"geometric": -0.1}, {}, unlisted=0.0) == {"geometric": 1.0}


def test_a_noise_that_is_not_stated_does_not_explain_a_remainder(rv_m2):
    """Without it the variance of anything would pass as noise."""
    data = replace(simulate(rv_m2, ["drift"], seed=4, ratio=(8.0, 9.0))[0], noise_position=None)
    left = fit(data, choose((), ("drift", "thermal_elongation", "thermal_bending", "instrument_scale"), ()))
    assert not random_gap(left).explains_size
    found = diagnose(data, without=["drift"])
    assert found.unexplained.flagged
    assert all(f.probability < 0.9 for f in found.effects if f.name in found.verdict and not f.describes)
    assert found.finding("discovered.1").locations[0].kind == "base"


@pytest.mark.parametrize("ratio", [101.0, 51.0])
def test_a_wheel_on_the_motor_is_found_where_its_effect_is_not_in_the_library(rv_m2, ratio):
    law = Discovered(kind="joint", place="joint_2", quantity="joint_2", shape="harmonic", marks=(ratio,))
    data, fresh, true = with_law(rv_m2, law, [0.0, 3e-4, 2e-4], seed=7)
    found = diagnose(replace(data, gears={"joint_2": ratio}), without=["transmission_error"])
    (own,) = [f for f in found.effects if f.describes]
    assert (own.locations[0].name, own.quantity, own.shape) == ("joint_2", "joint_2", "harmonic")
    assert f"of order {ratio:g}" in own.describes
    amplitude = np.hypot(*[p.value for p in own.parameters if p.name.startswith(("sine", "cosine"))])
    assert amplitude == pytest.approx(np.hypot(3e-4, 2e-4), rel=0.1)
    assert np.abs(found.model.predict(fresh)[0] - true).max() < 25e-6


def test_rows_set_aside_one_after_the_other_are_no_gross_errors(rv_m2):
    """A target that was knocked late leaves few rows, which look spoilt; spoilt rows do not follow each other."""
    plain = simulate(rv_m2, samples=100, seed=5)[0]
    rng = np.random.default_rng(5)
    late = np.arange(100) >= 85
    knocked = simulate(rv_m2, samples=100, seed=5)[0]
    order = {"time": np.arange(100.0)}
    target = np.array([0.0, 1e-3, 0.0])
    turned = observe(plain, Frames.declared(plain)).chain.tool_rotation @ target
    data = replace(knocked, position=knocked.position + np.where(late[:, None], turned, 0.0), covariates=order)
    found = diagnose(data)
    assert found.unexplained.flagged
    assert found.finding("discovered.1").quantity == "time"
    spoilt = np.where(np.isin(np.arange(100), rng.permutation(100)[:6])[:, None], 2e-3, 0.0)
    scattered = diagnose(replace(plain, position=plain.position + spoilt, covariates=order))
    assert not scattered.unexplained.flagged
    assert len(scattered.outliers) == 6


def test_a_wider_explanation_must_not_go_astray_elsewhere(rv_m2):
    data = simulate(rv_m2, ["geometric"], seed=6)[0]
    wide, narrow = fit(data, choose(("geometric",), (), ())), fit(data, choose(("instrument_scale",), (), ()))
    assert not worse_elsewhere(narrow, wide)
    assert not worse_elsewhere(wide, wide)
    assert worse_elsewhere(wide, narrow)


def test_errors_cross_processes():
    error = CampaignError("a.csv", "no number", row=3, column="x", found="?", expected="m")
    again = pickle.loads(pickle.dumps(error))
    assert (type(again), str(again), again.__dict__) == (CampaignError, str(error), error.__dict__)


def test_what_a_law_follows_does_not_depend_on_the_law(rv_m2):
    """Gravity and reach are those of the command: else a law would be evaluated elsewhere than it was fitted."""
    data = simulate(rv_m2, samples=30, seed=2)[0]
    moved = Displacement(joint=np.full((30, rv_m2.n), 0.05))
    plain, bent = observe(data, Frames.declared(data)), observe(data, Frames.declared(data), displacement=moved)
    assert np.abs(plain.position - bent.position).max() > 1e-3
    for name, values in quantities(plain).items():
        np.testing.assert_array_equal(quantities(bent)[name], values, err_msg=name)


def test_one_eccentric_wheel_is_no_unlisted_cause(rv_m2):
    """Over part of a turn it is nearly a parabola: a law of few numbers, where the effect has four for every joint."""
    names = []
    for seed in range(8):
        plain = simulate(rv_m2, samples=130, seed=seed, noise=NOISE)[0]
        q, error = plain.q[:, 1], np.zeros_like(plain.q)
        error[:, 1] = 3e-3 * np.cos(q) - 1.4e-3 * np.sin(q) - 7e-4 * np.cos(2 * q) - 2e-4 * np.sin(2 * q)
        true = observe(plain, Frames.declared(plain), displacement=Displacement(joint=error)).predicted_position
        noise = NOISE * np.random.default_rng(seed).normal(size=true.shape)
        found = diagnose(replace(plain, position=true + noise))
        assert not found.unexplained.flagged
        assert np.sqrt(((found.model.predict(plain)[0] - true) ** 2).mean()) < 0.5 * NOISE
        names.append(found.verdict)
    # where the parabola is lost in the noise a zero and a gain say the same with fewer numbers
    assert names.count(("transmission_error",)) >= 6, names


def test_steps_of_an_encoder_feign_no_systematic_effect(rv_m2):
    step, names = 1.5e-3, []
    for seed in range(12):
        plain = simulate(rv_m2, samples=130, seed=seed, noise=20e-6)[0]
        error = np.zeros_like(plain.q)
        error[:, 1] = np.round(plain.q[:, 1] / step) * step - plain.q[:, 1]
        true = observe(plain, Frames.declared(plain), displacement=Displacement(joint=error)).predicted_position
        noise = 20e-6 * np.random.default_rng(seed).normal(size=true.shape)
        found = diagnose(replace(plain, position=true + noise, noise_position=None))
        assert found.gap.noise_source == "scatter"
        names.append(found.verdict)
    assert names.count(("encoder_resolution",)) >= 11, names


def test_rows_set_aside_in_a_row_count_as_unexplained(rv_m2):
    """Those of a change that the explanation cannot follow are no gross errors, which stay out of the sum."""
    drifted = diagnose(simulate(rv_m2, ["drift"], seed=3)[0])
    known, n = drifted.fit, drifted.samples
    before, after = np.ones((n, 3)), np.full((n, 3), 0.1)
    after[[4, 5, 6, 30]] = 1.0
    aside = np.isin(np.arange(n), [4, 5, 6, 30])
    assert in_a_row(known.campaign, aside).sum() == 3
    looked = SimpleNamespace(
        left=Examined(Unexplained(True, 0.2, 1e-9), 1.0, "stated"),
        fit=SimpleNamespace(
            campaign=known.campaign,
            explanation=SimpleNamespace(outliers=aside),
            nominal=SimpleNamespace(gap=before),
            corrected=SimpleNamespace(gap=after),
        ),
    )
    gap = SimpleNamespace(rms_before=1.0)
    assert _left(looked, gap) == pytest.approx(0.2**2 + 3 / (n - 1))
    calm = SimpleNamespace(left=Examined(Unexplained(False, 0.0, 1.0), 1.0, "stated"), fit=looked.fit)
    assert _left(calm, gap) == 0.0
