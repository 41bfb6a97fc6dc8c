"""Memory that is kept, chunks that cover all rows, arrays of the caller's."""

import threading
import tracemalloc

import numpy as np
import pytest

from thermal_robot import kinematics as kin
from thermal_robot.errors import RobotError
from thermal_robot.kinematics import settings
from thermal_robot.kinematics.walk import chunks, result, scratch

CALLS = {
    "poses": (kin.tool_poses, lambda robot: (4, 4)),
    "jacobians": (kin.frame_jacobians, lambda robot: (6, robot.n)),
    "placements": (kin.placement_sensitivities, lambda robot: (6, len(robot.segments), 6)),
    "gravity": (kin.gravity_torques, lambda robot: (robot.n,)),
}
each_call = pytest.mark.parametrize(("call", "shape"), CALLS.values(), ids=CALLS)


def test_the_same_memory_comes_back_until_more_is_asked_for():
    first = scratch("a test", 3, 5)
    assert np.shares_memory(first, scratch("a test", 2, 2))
    assert not np.shares_memory(first, scratch("another test", 3, 5))
    larger = scratch("a test", 100)
    assert larger.shape == (100,)
    assert np.shares_memory(larger, scratch("a test", 3, 5))


def test_each_thread_has_memory_of_its_own():
    found = []
    thread = threading.Thread(target=lambda: found.append(scratch("a test", 3)))
    thread.start()
    thread.join()
    assert not np.shares_memory(found[0], scratch("a test", 3))


@pytest.mark.parametrize("rows", [0, 1, 63, 64, 2048, 2049, 10_000])
@pytest.mark.parametrize("frames", [1, 8, 100, 100_000])
def test_chunks_cover_every_row_once(rows, frames):
    parts = list(chunks(rows, frames))
    assert [i for part in parts for i in range(part.start, part.stop)] == list(range(rows))
    assert all(part.stop - part.start <= settings.CHUNK for part in parts)


def layouts(rows, shape):
    """Arrays for results as a caller may have them: C order, N last, Fortran order, part of a larger one."""
    yield np.full((rows, *shape), np.nan)
    yield np.moveaxis(np.full((*shape, rows), np.nan), -1, 0)
    yield np.full((rows, *shape), np.nan, order="F")
    yield np.full((2 * rows, *shape, 2), np.nan)[::2, ..., 1]


@each_call
@pytest.mark.parametrize("rows", [1, 7, 3000])
def test_results_are_written_where_the_caller_says(awkward, configurations, call, shape, rows):
    q = configurations(awkward, rows)
    expected = call(awkward, q)
    for out in layouts(rows, shape(awkward)):
        assert call(awkward, q, out=out) is out
        np.testing.assert_allclose(out, expected, rtol=0.0, atol=1e-13)


@each_call
def test_memory_does_not_grow_with_the_rows(rv_m2, configurations, call, shape):
    def peak(rows):
        q = configurations(rv_m2, rows)
        out = call(rv_m2, q)
        tracemalloc.start()
        call(rv_m2, q, out=out)
        highest = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return highest

    few, many = peak(3000), peak(12_000)
    assert many < few + 20_000  # bytes: no array with a number for each row


def frozen(shape):
    array = np.empty(shape)
    array.setflags(write=False)
    return array


@pytest.mark.parametrize(
    ("out", "words"),
    [
        (np.empty((3, 4)), r"out of shape \(3, 4\) .* expected an array of float64 of shape \(3, 4, 4\)"),
        (np.empty((3, 4, 4), dtype=np.float32), "type float32"),
        ([[0.0]], "type list"),
        (frozen((3, 4, 4)), "must not be written to"),
    ],
)
def test_an_array_that_does_not_fit_is_said(out, words):
    with pytest.raises(RobotError, match=words):
        result(out, 3, 4, 4)
