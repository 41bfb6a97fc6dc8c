"""B of a discrepancy, row by row, as written out, whatever the chunks."""

import numpy as np
import pytest

from thermal_robot.inference import settings
from thermal_robot.inference.kernels import Part

ROWS = 20


def part(same, count):
    """A part of 20 rows of which 18 are in use, three components and two moves; and B, a column a function and move."""
    rng = np.random.default_rng([2, count])
    moves = rng.normal(size=(3, 2) if same else (ROWS, 3, 2))
    used = np.delete(np.arange(ROWS), [3, 11])
    known = Part(rng.normal(size=(ROWS, count)), moves, used, rng.uniform(0.5, 1.0, len(used)))
    weighed = known.functions[used] * known.root[:, None]
    return known, np.einsum("nk,nmc->nmck", weighed, np.broadcast_to(moves, (ROWS, 3, 2))[used]).reshape(54, -1)


@pytest.fixture(params=[False, True], ids=["moves by row", "the same moves"])
def known(request):
    return part(request.param, 5)


def test_b_and_its_adjoint_are_those_written_out(known):
    own, written = known
    rng = np.random.default_rng(6)
    inner, stack = rng.normal(size=(10, 4)), rng.normal(size=(18, 3, 4))
    np.testing.assert_allclose(own.times(inner, slice(None)).reshape(54, 4), written @ inner, rtol=0, atol=1e-12)
    halves = [own.adjoint(stack[rows], rows) for rows in (slice(0, 7), slice(7, 18))]
    np.testing.assert_allclose(sum(halves), written.T @ stack.reshape(54, 4), rtol=0, atol=1e-12)


@pytest.mark.parametrize("same", [False, True])
@pytest.mark.parametrize("chunk", [5, 1024])
def test_its_own_matrix_is_the_smaller_one(same, chunk, monkeypatch):
    monkeypatch.setattr(settings, "CHUNK", chunk)
    narrow, written = part(same, 5)
    assert not narrow.wide
    np.testing.assert_allclose(narrow.own(), written.T @ written, rtol=0, atol=1e-11)
    wide, written = part(same, 40)
    assert wide.wide
    np.testing.assert_allclose(wide.own(), written @ written.T, rtol=0, atol=1e-11)
