"""What is said of effects that scatter: joint, size, status; and nothing that the data do not say."""

from dataclasses import replace

import numpy as np
import pytest
from simulate import simulate

from thermal_robot.diagnosis.findings import random_findings
from thermal_robot.effects import choose, random_effects
from thermal_robot.inference import settings
from thermal_robot.inference.fit import fit
from thermal_robot.inference.scatter import random_gap
from thermal_robot.kinematics import Displacement
from thermal_robot.observations import Frames, observe

NOISE, SIGMA = 20e-6, 6e-4  # m, rad
JOINT = 1


def scattering(robot, *, repeats=1, poses=120, stepped=False, sigma=SIGMA, seed=2):
    """Frames fitted to a campaign in which one joint errs with a standard deviation of sigma, rad.

    ``stepped``: because its command is rounded; otherwise anew at each visit.
    """
    rng = np.random.default_rng([seed, 5])
    once = simulate(robot, samples=poses, seed=seed, noise=NOISE)[0]
    rows = np.tile(np.arange(poses), repeats)
    plain = replace(once.take(rows), rows=np.arange(2, len(rows) + 2), priors={})
    error, step = np.zeros_like(plain.q), np.sqrt(12.0) * sigma
    q = plain.q[:, JOINT]
    error[:, JOINT] = np.round(q / step) * step - q if stepped else sigma * rng.normal(size=len(rows))
    true = observe(plain, Frames.declared(once), displacement=Displacement(joint=error)).predicted_position
    noisy = replace(plain, position=true + NOISE * rng.normal(size=true.shape))
    time = np.linspace(0.0, 3600.0, len(rows))
    known = fit(replace(noisy, covariates={**noisy.covariates, "time": time}), choose(("joint_offset",), (), ()))
    return known, random_gap(known)


@pytest.fixture(scope="module")
def single(rv_m2):
    """Each pose once, where steps are too many to be looked for: what comes at each visit and with a pose are one."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(settings, "MOST_FREQUENCIES", 0)
        return scattering(rv_m2, poses=40, sigma=7e-5)


@pytest.fixture(scope="module")
def visits(rv_m2):
    """Each pose three times."""
    return scattering(rv_m2, repeats=3, poses=50)


@pytest.fixture(scope="module")
def steps(rv_m2):
    """Each pose twice; the encoder rounds."""
    return scattering(rv_m2, repeats=2, poses=60, stepped=True)


def test_scatter_anew_at_each_visit_is_named_with_its_joint_and_sigma(rv_m2, visits):
    encoder, wear = random_findings(*visits)
    assert (encoder.status, wear.status) == ("not_found", "found")
    assert [place.name for place in wear.locations] == [rv_m2.joint_names[JOINT]]
    (size,) = wear.parameters
    assert size.unit == "rad"
    assert rv_m2.joint_names[JOINT] in size.name
    factor = next(e.factor for e in random_effects() if e.name == wear.name)
    assert size.value / factor == pytest.approx(SIGMA, rel=0.15)
    assert abs(size.value / factor - SIGMA) < 3.0 * size.std / factor


def test_steps_are_named_with_their_height(rv_m2, steps):
    encoder, _ = random_findings(*steps)
    assert encoder.status == "found"
    assert encoder.locations[0].name == rv_m2.joint_names[JOINT]
    assert encoder.parameters[0].value == pytest.approx(np.sqrt(12.0) * SIGMA, rel=0.1)


def test_without_steps_or_repeats_the_two_kinds_are_one_and_an_encoder_is_one_of_three_causes(single):
    """Wear explains the scatter as well, and so does what nobody recorded."""
    encoder, wear = random_findings(*single)
    assert (encoder.status, encoder.confounded_with) == ("confounded", (wear.name,))
    assert (wear.status, wear.needs, wear.probability) == ("not_testable", ("pose",), None)
    assert single[1].scatter.probability["pose"] > 0.9
    assert 0.2 < encoder.probability < 0.5


def test_steps_that_should_show_and_do_not_refute_an_encoder(rv_m2):
    """Errors that are anew in every pose, large against the noise, and no multiple of any step."""
    known, seen = scattering(rv_m2, poses=200)
    assert seen.scatter.probability["pose"] > 0.9
    encoder, _ = random_findings(known, seen)
    assert (encoder.status, encoder.locations, encoder.parameters) == ("not_found", (), ())
    assert encoder.probability < 0.05
    assert not seen.explains_size


def test_scatter_never_shrinks_the_gap_its_places_share_it_out_and_not_found_is_never_probable(single, visits, steps):
    for known, seen in (single, visits, steps):
        for finding in random_findings(known, seen):
            if finding.status != "not_testable":
                assert (finding.shrinkage, finding.shrinkage_ci95) == (0.0, (0.0, 0.0))
            if finding.locations:
                assert sum(place.share for place in finding.locations) == pytest.approx(1.0)
            assert finding.status != "not_found" or finding.probability < 0.5
