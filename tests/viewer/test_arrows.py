"""Arrows: they begin and end where they should, are cut where they would leave the scene, and are seen at first."""

import numpy as np
import pytest

from thermal_robot.kinematics import quaternion_to_rotation
from thermal_robot.viewer.scene import arrows, longest, readable, turned_along, unit_arrow

SIZE = 2.0


def ends(drawn):
    """Where the tip of the unit arrow comes to lie."""
    tips = np.array([0.0, 0.0, 1.0]) * drawn.stretches
    return drawn.starts + np.einsum("nij,nj->ni", quaternion_to_rotation(drawn.turns), tips)


@pytest.fixture
def vectors():
    along_axes = np.vstack([np.eye(3), -np.eye(3), np.zeros((1, 3))])
    return 1e-4 * np.vstack([along_axes, np.random.default_rng(0).normal(size=(50, 3))])


def test_an_arrow_goes_from_its_start_to_the_magnified_displacement(vectors):
    starts = np.random.default_rng(1).normal(size=vectors.shape)
    for magnification in (1.0, 250.0):
        drawn = arrows(starts, vectors, magnification, SIZE)
        np.testing.assert_allclose(ends(drawn), starts + magnification * vectors, atol=1e-12)


def test_a_gross_error_is_cut_and_keeps_its_direction(vectors):
    drawn = arrows(np.zeros_like(vectors), np.vstack([vectors[:-1], [[3.0, 4.0, 0.0]]]), 100.0, SIZE)
    np.testing.assert_allclose(ends(drawn)[-1], longest(SIZE) * np.array([0.6, 0.8, 0.0]), atol=1e-12)
    np.testing.assert_allclose(ends(drawn)[:-1], 100.0 * vectors[:-1], atol=1e-12)


def test_no_arrow_is_wider_than_long_and_the_chosen_one_is_thicker(vectors):
    plain, thick = (arrows(np.zeros_like(vectors), vectors, 100.0, SIZE, by).stretches for by in (1.0, 3.0))
    assert (plain[:, 0] <= plain[:, 2]).all()
    assert (thick[:, 0] >= plain[:, 0]).all()
    assert (thick[:6, 0] > plain[:6, 0]).all()
    np.testing.assert_array_equal(thick[:, 2], plain[:, 2])


def test_the_unit_arrow_is_closed_and_points_along_z():
    import trimesh

    vertices, faces = unit_arrow()
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    assert mesh.is_watertight
    assert mesh.volume > 0.0  # seen from outside
    np.testing.assert_allclose(mesh.bounds[:, 2], [0.0, 1.0], atol=1e-12)
    assert mesh.center_mass[2] > 0.5  # the head is at the end


def test_turns_are_rotations_even_along_and_against_z(vectors):
    turns = turned_along(vectors)
    np.testing.assert_allclose(turns @ turns.transpose(0, 2, 1), np.broadcast_to(np.eye(3), turns.shape), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(turns), 1.0)


@pytest.mark.parametrize("scale", [1e-6, 3e-5, 1e-4, 7e-4, 1e-2])
def test_what_is_readable_is_a_round_number_that_fits(vectors, scale):
    magnification = readable(scale / 1e-4 * vectors, SIZE)
    leading = magnification / 10.0 ** np.floor(np.log10(magnification) + 1e-9)
    assert min(abs(leading - step) for step in (1, 2, 5)) < 1e-9
    lengths = np.linalg.norm(
        arrows(np.zeros_like(vectors), scale / 1e-4 * vectors, magnification, SIZE).stretches[:, 2:], axis=1
    )
    assert 0.02 * SIZE < np.quantile(lengths, 0.9) < 0.1 * SIZE


def test_no_gap_is_not_magnified():
    assert readable(np.zeros((4, 3)), SIZE) == 1.0
    assert readable(np.zeros((0, 3)), SIZE) == 1.0
