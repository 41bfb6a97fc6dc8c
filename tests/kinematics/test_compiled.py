"""The compiled engine: threads, layouts, batches shorter than a block, folders that cannot be written to."""

import os
import subprocess
import sys

import numpy as np
import pytest

from thermal_robot import compiling
from thermal_robot import kinematics as kin
from thermal_robot.kinematics import compiled, lanes, settings

needs_numba = pytest.mark.skipif(
    not compiled.installed(), reason="the compiled engine is in the extra fast: numba is not installed"
)
ROWS = 5000
CALLS = {
    "poses": (compiled.poses, (), lambda robot: (4, 4)),
    "jacobians": (compiled.jacobians, (np.array([0.1, 0.2, 0.3]),), lambda robot: (6, robot.n)),
    "placements": (compiled.placements, (None,), lambda robot: (6, len(robot.segments), 6)),
    "gravity": (compiled.gravity, (np.asarray(2.0), np.array([0.1, 0.2, 0.3])), lambda robot: (robot.n,)),
}
each_call = pytest.mark.parametrize(("call", "arguments", "shape"), CALLS.values(), ids=CALLS)


def written(call, robot, q, arguments, shape):
    out = np.moveaxis(np.full((*shape(robot), len(q)), np.nan), -1, 0)
    call(robot, q, *arguments, out)
    return out


@needs_numba
@each_call
def test_the_number_of_threads_does_not_show(awkward, configurations, monkeypatch, call, arguments, shape):
    q, found = configurations(awkward, ROWS), []
    for threads, piece in ((1, 16_384), (2, 700), (5, 1300), (16, 513)):
        monkeypatch.setattr(compiling, "THREADS", threads)
        monkeypatch.setattr(compiling, "PIECE", piece)
        found.append(written(call, awkward, q, arguments, shape))
    for other in found[1:]:
        np.testing.assert_array_equal(other, found[0])


@needs_numba
@each_call
def test_nor_does_the_place_of_a_row(awkward, configurations, call, arguments, shape):
    q = configurations(awkward, ROWS)
    whole = written(call, awkward, q, arguments, shape)
    for some in (slice(17, 20), slice(3000, 4001), slice(1, ROWS, 3)):
        np.testing.assert_array_equal(written(call, awkward, q[some], arguments, shape), whole[some])


@needs_numba
@each_call
@pytest.mark.parametrize("rows", [1, settings.LANES - 1, settings.LANES, 3 * settings.LANES + 5])
def test_results_go_to_arrays_of_any_layout(awkward, configurations, monkeypatch, call, arguments, shape, rows):
    monkeypatch.setattr(compiling, "PIECE", 600)
    q = configurations(awkward, rows)
    expected = written(call, awkward, q, arguments, shape)
    for out in (
        np.full((rows, *shape(awkward)), np.nan),
        np.full((2 * rows, *shape(awkward), 2), np.nan)[::2, ..., 1],
    ):
        call(awkward, q, *arguments, out)
        np.testing.assert_array_equal(out, expected)


@needs_numba
def test_results_may_overwrite_the_configurations(rv_m2, configurations):
    q = configurations(rv_m2, ROWS)
    expected = written(*(compiled.gravity, rv_m2, q), *CALLS["gravity"][1:])
    compiled.gravity(rv_m2, q, *CALLS["gravity"][1], q)
    np.testing.assert_array_equal(q, expected)


@needs_numba
def test_large_angles_are_reduced_as_the_library_does(rv_m2, configurations):
    q = configurations(rv_m2, ROWS) + 2.0 * np.pi * np.array([0, 1e3, 1e6, 1e9, 1e12])
    ours, numpys = np.empty((ROWS, 4, 4)), np.empty((ROWS, 4, 4))
    compiled.poses(rv_m2, q, ours)
    lanes.poses(rv_m2, q, numpys)
    np.testing.assert_allclose(ours, numpys, rtol=0.0, atol=1e-13)


@needs_numba
def test_many_rows_are_compiled_and_the_same(ur5_or_rv_m2, configurations):
    q = configurations(ur5_or_rv_m2, settings.MANY)
    whole = kin.frame_jacobians(ur5_or_rv_m2, q)
    by_hand = np.empty(whole.shape)
    compiled.jacobians(ur5_or_rv_m2, q, None, by_hand)
    np.testing.assert_array_equal(whole, by_hand)
    np.testing.assert_allclose(whole[::50], kin.frame_jacobians(ur5_or_rv_m2, q[::50]), rtol=0.0, atol=1e-12)


@pytest.fixture
def ur5_or_rv_m2(rv_m2):
    pytest.importorskip("numba", reason="the compiled engine is in the extra fast: numba is not installed")
    return rv_m2


SCRIPT = """
import numpy as np
import numba
from numba.core import caching
{spoil}
from thermal_robot import load_robot
from thermal_robot.kinematics import compiled, lanes
robot = load_robot("builtin:rv_m2", "tool0")
q = np.random.default_rng(0).uniform(-2, 2, (3000, 5))
ours, numpys = np.empty((3000, 4, 4)), np.empty((3000, 4, 4))
compiled.poses(robot, q, ours)
lanes.poses(robot, q, numpys)
assert np.abs(ours - numpys).max() < 1e-13
"""
SPOILT = {
    "no folder": """
def none(*arguments, **options):
    raise RuntimeError("cannot cache function: no locator available")
caching.CacheImpl.__init__ = none
""",
    "a full disk": """
def full(*arguments, **options):
    raise OSError(28, "No space left on device")
caching.IndexDataCacheFile.save = full
""",
}


@needs_numba
@pytest.mark.slow
@pytest.mark.parametrize("spoil", SPOILT.values(), ids=SPOILT)
def test_kernels_work_where_they_cannot_be_kept(spoil, tmp_path):
    script = SCRIPT.format(spoil=spoil)
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    subprocess.run([sys.executable, "-c", script], check=True, env=environment)
    assert not [path for path in tmp_path.rglob("*") if path.suffix == ".nbc"]


def test_numba_is_not_loaded_before_it_pays():
    script = (
        "import sys, numpy as np; from thermal_robot import load_robot;"
        "from thermal_robot.kinematics import tool_poses;"
        "tool_poses(load_robot('builtin:rv_m2', 'tool0'), np.zeros((1000, 5))); assert 'numba' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", script], check=True)


WITHOUT = """
import sys
from importlib.machinery import PathFinder
found = PathFinder.find_spec
def find_spec(name, *arguments):
    {block}
    return found(name, *arguments)
PathFinder.find_spec = find_spec
import warnings
import numpy as np
from thermal_robot import load_robot
from thermal_robot.kinematics import settings, tool_poses
with warnings.catch_warnings(record=True) as told:
    warnings.simplefilter("always")
    poses = tool_poses(load_robot("builtin:rv_m2", "tool0"), np.zeros((settings.MANY, 5)))
assert np.ptp(poses, axis=0).max() == 0.0
print(*[warning.message for warning in told])
"""


def test_all_works_without_numba():
    block = "if name.split('.')[0] == 'numba': return None"
    script = WITHOUT.format(block=block)
    done = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True)
    assert done.stdout.strip() == ""


@needs_numba
def test_a_numba_that_cannot_be_loaded_is_said_and_done_without():
    block = "if name == 'llvmlite': raise ImportError('no llvm')"
    script = WITHOUT.format(block=block)
    done = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True)
    assert "cannot be loaded (no llvm)" in done.stdout
    assert "thermal-robot[fast]" in done.stdout
