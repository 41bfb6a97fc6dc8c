"""Many discs at once: each by an integral that is exact for it, or not at all."""

import numpy as np
import pytest

from thermal_robot.assembly.probability.planar import TOLD, Principal, _graded, disc_chances


def cases(seed, ratio, segments, count=300):
    """Covariances of ratios up to one given, means, radii, segments: of all sizes beside each other."""
    rng = np.random.default_rng(seed)
    wide = np.exp(rng.uniform(-2.0, 2.0, count))
    narrow = wide / ratio ** rng.uniform(0.0, 1.0, count) if ratio else np.zeros(count)
    angle = rng.uniform(0.0, np.pi, count)
    turn = np.stack([np.cos(angle), -np.sin(angle), np.sin(angle), np.cos(angle)], axis=-1).reshape(-1, 2, 2)
    matrices = np.einsum("nij,nj,nkj->nik", turn, np.stack([wide, narrow], axis=-1) ** 2, turn)
    means = rng.normal(size=(count, 2)) * (wide * rng.uniform(0.0, 3.0, count))[:, None]
    means[rng.random(count) < 0.3] = 0.0
    ends = rng.normal(size=(count, 2)) * (wide * np.exp(rng.uniform(-4.0, 1.5, count)))[:, None]
    radii = wide * np.exp(rng.uniform(-3.0, 2.0, count))
    return 0.5 * (matrices + np.swapaxes(matrices, 1, 2)), means, radii, ends if segments else None


@pytest.mark.parametrize("segments", [False, True])
@pytest.mark.parametrize("ratio", [3.0, 100.0, 1e4, 1e8, 0.0])
def test_what_is_told_is_what_graded_panels_find(ratio, segments):
    matrices, means, radii, ends = cases(1, ratio, segments)
    principal = Principal.of(matrices)
    found = disc_chances(principal, means, radii, ends)
    inside, outside = (_graded(principal, means, 2.0 * radii[:, None], "circle", ends, out) for out in (False, True))
    told, digits = np.isfinite(found.inside), np.isfinite(found.outside)
    np.testing.assert_allclose(found.inside[told], inside[told], rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(found.outside[digits], outside[digits], rtol=1e-10)
    assert np.all(digits[told & (outside > 1.01 * TOLD)])
    assert told.all() or segments, "without a segment every disc is resolved"


def test_rows_do_not_see_each_other():
    matrices, means, radii, ends = cases(2, 1e3, True, count=40)
    together = disc_chances(Principal.of(matrices), means, radii, ends)
    for k in range(40):
        alone = disc_chances(Principal.of(matrices[[k]]), means[[k]], radii[[k]], ends[[k]])
        np.testing.assert_allclose(alone.inside[0], together.inside[k], rtol=0.0, atol=4e-16, equal_nan=True)


def test_turning_everything_changes_nothing():
    matrices, means, radii, ends = cases(3, 30.0, True)
    turn = np.array([[np.cos(1.1), -np.sin(1.1)], [np.sin(1.1), np.cos(1.1)]])
    plain = disc_chances(Principal.of(matrices), means, radii, ends)
    turned = disc_chances(Principal.of(turn @ matrices @ turn.T), means @ turn.T, radii, ends @ turn.T)
    np.testing.assert_allclose(turned.inside, plain.inside, rtol=0.0, atol=1e-12)


def test_more_of_a_disc_holds_more():
    matrices, means, radii, _ = cases(4, 30.0, False)
    principal = Principal.of(matrices)
    less, more = (disc_chances(principal, means, radii * factor).inside for factor in (1.0, 1.02))
    assert np.all(more >= less - 1e-15)


def test_a_vanishing_segment_is_none():
    matrices, means, radii, _ = cases(5, 30.0, False)
    principal = Principal.of(matrices)
    none, little = (disc_chances(principal, means, radii, e) for e in (None, np.full_like(means, 1e-12)))
    np.testing.assert_allclose(little.inside, none.inside, rtol=0.0, atol=1e-12)
