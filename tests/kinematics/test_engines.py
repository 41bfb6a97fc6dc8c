"""Every engine against a loop over Pinocchio; what memory, threads and the place of a row do not change."""

import os
import subprocess
import sys
import threading
import tracemalloc
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import reference

from thermal_robot import compiling
from thermal_robot import kinematics as kin
from thermal_robot.errors import RobotError
from thermal_robot.kinematics import compiled, lanes, settings, thin

ROWS = 60
MANY = 5000
POINT = np.array([0.05, -0.1, 0.2])
LOADS = (0.0, 3.0, np.linspace(0.0, 8.0, ROWS))
CALLS = {
    "poses": (kin.tool_poses, lambda robot: (4, 4)),
    "jacobians": (lambda *a, **k: kin.frame_jacobians(*a, point=POINT, **k), lambda robot: (6, robot.n)),
    "placements": (kin.placement_sensitivities, lambda robot: (6, len(robot.segments), 6)),
    "gravity": (lambda *a, **k: kin.gravity_torques(*a, payload=2.0, **k), lambda robot: (robot.n,)),
}
each_call = pytest.mark.parametrize(("call", "shape"), CALLS.values(), ids=CALLS)
NO_NUMBA = "the compiled engine is in the extra fast: numba is not installed"
needs_numba = pytest.mark.skipif(not compiled.installed(), reason=NO_NUMBA)
ENGINES = {"thin": (10**9, 10**9), "lanes": (0, 10**9), "compiled": (0, 0)}
"""Most rows of the first, fewest of the last: so that any number is left to this engine."""


def use(engine, monkeypatch):
    if engine == "compiled" and not compiled.installed():
        pytest.skip(NO_NUMBA)
    for name, value in zip(("FEW", "MANY"), ENGINES[engine], strict=True):
        monkeypatch.setattr(settings, name, value)
    monkeypatch.setattr(settings, "MOST_PLACEMENTS", 10**9)


@pytest.fixture(params=ENGINES)
def engine(request, monkeypatch):
    use(request.param, monkeypatch)
    return request.param


@pytest.fixture(params=["lanes", pytest.param("compiled", marks=needs_numba)])
def fast(request, monkeypatch):
    use(request.param, monkeypatch)


def same(ours, theirs, within=1e-12):
    assert ours.shape == theirs.shape
    np.testing.assert_allclose(ours, theirs, rtol=0.0, atol=within * max(1.0, np.abs(theirs).max()))


def same_frames(ours, theirs):
    for field, other in zip(ours, theirs, strict=True):
        same(field, other, 1e-10)


@pytest.fixture(scope="module")
def oracle(arm, configurations):
    return oracle_of(arm, configurations)


def oracle_of(arm, configurations):
    """Configurations of an arm, those with all joints at zero and at a quarter turn among them, and what is right."""
    q = configurations(arm, ROWS)
    q[0], q[1] = 0.0, 0.5 * np.pi
    found = {"poses": reference.tool_poses(arm, q)}
    for point in (None, POINT):
        at = np.zeros(3) if point is None else point
        found["jacobians", point is None] = reference.frame_jacobians(arm, q, point=at)
        found["placements", point is None] = reference.placement_sensitivities(arm, q, point=at)
    found["gravity"] = [reference.gravity_torques(arm, q, payload=mass, payload_com=POINT) for mass in LOADS]
    moves = [np.ptp(kin.tool_poses(arm, q[7] + np.outer([0.0, 0.3], unit)), axis=0).any() for unit in np.eye(arm.n)]
    return q, found, moves


def test_all_is_pinocchios(engine, arm, oracle):
    q, right, _ = oracle
    frames = kin.chain_frames(arm, q)
    copied = kin.ChainFrames(*map(np.ascontiguousarray, frames))
    nothing = np.full(q.shape, np.nan)
    same(kin.tool_poses(arm, q), right["poses"])
    same(right["poses"][:, :3, :3], frames.tool_rotation)
    same(right["poses"][:, :3, 3], frames.tool_position)
    # frames at hand, in any layout, are not computed again
    for how in ({"q": q}, {"q": nothing, "frames": frames}, {"q": nothing, "frames": copied}):
        for point in (None, POINT):
            same(kin.frame_jacobians(arm, point=point, **how), right["jacobians", point is None])
            same(kin.placement_sensitivities(arm, point=point, **how), right["placements", point is None])
        for mass, torque in zip(LOADS, right["gravity"], strict=True):
            same(kin.gravity_torques(arm, payload=mass, payload_com=POINT, **how), torque)


def test_frames_are_pinocchios_displaced_or_not(arm, oracle):
    q, rng = oracle[0], np.random.default_rng(1)
    same_frames(kin.chain_frames(arm, q), reference.chain_frames(arm, q))
    one = [rng.normal(0.0, 0.2, shape) for shape in (arm.n, (len(arm.segments), 6), 6, 6)]
    repeated = [np.tile(value, (ROWS, *[1] * np.ndim(value))) for value in one]
    each = [value + rng.normal(0.0, 0.2, value.shape) for value in repeated]
    for channels in (one, each):
        moved = kin.Displacement(*channels)
        same_frames(kin.chain_frames(arm, q, moved), reference.chain_frames(arm, q, moved))
        same(kin.tool_poses(arm, q, moved), reference.tool_poses(arm, q, moved), 1e-10)
    alike = kin.tool_poses(arm, q, kin.Displacement(*one))
    np.testing.assert_allclose(kin.tool_poses(arm, q, kin.Displacement(*repeated)), alike, rtol=0.0, atol=1e-13)
    few = [0.0 * value for value in repeated]
    few[1][4, -1, 3] = 1e-3  # one segment, in one row
    moved = kin.tool_poses(arm, q, kin.Displacement(*few)) - kin.tool_poses(arm, q)
    assert np.abs(np.delete(moved, 4, axis=0)).max() < 1e-13
    assert np.abs(moved[4]).max() > 1e-6


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_position_that_is_no_number_is_never_hidden(engine, arm, oracle, bad):
    q, _, moves = oracle
    for joint in range(arm.n):
        spoilt = q.copy()
        spoilt[7, joint] = bad
        with np.errstate(invalid="ignore"):
            found = kin.tool_poses(arm, spoilt).reshape(ROWS, -1)
        assert np.all(np.isfinite(found[7])) != moves[joint]
        assert np.all(np.isfinite(np.delete(found, 7, axis=0)))


def test_a_point_of_each_row(engine, awkward, configurations):
    q, points = configurations(awkward, ROWS), np.random.default_rng(1).normal(size=(ROWS, 3))
    jacobians = kin.frame_jacobians(awkward, q, point=points)
    placements = kin.placement_sensitivities(awkward, q, point=points)
    for i in range(0, ROWS, 12):
        same(jacobians[i], reference.frame_jacobians(awkward, q[i], point=points[i])[0])
        same(placements[i], reference.placement_sensitivities(awkward, q[i], point=points[i])[0])


@pytest.mark.slow
@each_call
def test_neither_neighbours_nor_places_of_rows_matter(fast, awkward, configurations, call, shape):
    q = configurations(awkward, MANY)
    clean = call(awkward, q)
    for some in (slice(17, 20), slice(3000, 4001), slice(1, MANY, 3), np.random.default_rng(0).permutation(MANY)):
        np.testing.assert_allclose(call(awkward, q[some]), clean[some], rtol=0.0, atol=1e-12)
    q[[3, 4000], 1] = np.nan
    spoilt, others = call(awkward, q), np.setdiff1d(np.arange(MANY), [3, 4000])
    assert np.all(np.isnan(spoilt[[3, 4000]].reshape(2, -1)).any(axis=1))
    np.testing.assert_array_equal(spoilt[others], clean[others])


@needs_numba
@each_call
def test_the_number_of_threads_does_not_show(awkward, configurations, monkeypatch, call, shape):
    use("compiled", monkeypatch)
    q, found = configurations(awkward, MANY), []
    for threads, piece in ((1, 16_384), (2, 700), (5, 1300), (16, 513)):
        monkeypatch.setattr(compiling, "THREADS", threads)
        monkeypatch.setattr(compiling, "PIECE", piece)
        found.append(call(awkward, q))
    for other in found[1:]:
        np.testing.assert_array_equal(other, found[0])


def layouts(rows, shape):
    """Arrays for results as a caller may have them: C order, N last, Fortran order, part of a larger one."""
    yield np.full((rows, *shape), np.nan)
    yield np.moveaxis(np.full((*shape, rows), np.nan), -1, 0)
    yield np.full((rows, *shape), np.nan, order="F")
    yield np.full((2 * rows, *shape, 2), np.nan)[::2, ..., 1]


@each_call
@pytest.mark.parametrize("rows", [1, settings.LANES - 1, settings.LANES, 3 * settings.LANES + 5])
def test_results_are_written_where_the_caller_says(engine, awkward, configurations, monkeypatch, call, shape, rows):
    monkeypatch.setattr(compiling, "PIECE", 600)
    q = configurations(awkward, rows)
    expected = call(awkward, q)
    spread = np.full((2 * rows, 2 * awkward.n), np.nan)
    spread[::2, ::2] = q  # configurations may lie in memory as they like, too
    for out in layouts(rows, shape(awkward)):
        assert call(awkward, spread[::2, ::2], out=out) is out
        np.testing.assert_allclose(out, expected, rtol=0.0, atol=1e-13)


@needs_numba
def test_results_may_overwrite_the_configurations(rv_m2, configurations, monkeypatch):
    use("compiled", monkeypatch)
    q = configurations(rv_m2, MANY)
    expected = kin.gravity_torques(rv_m2, q)
    kin.gravity_torques(rv_m2, q, out=q)
    np.testing.assert_array_equal(q, expected)


@needs_numba
def test_large_angles_are_reduced_as_the_library_does(rv_m2, configurations, monkeypatch):
    q = configurations(rv_m2, MANY) + 2.0 * np.pi * np.array([0, 1e3, 1e6, 1e9, 1e12])
    expected = kin.tool_poses(rv_m2, q)
    use("compiled", monkeypatch)
    np.testing.assert_allclose(kin.tool_poses(rv_m2, q), expected, rtol=0.0, atol=1e-13)


def test_the_engine_is_that_for_so_many_rows(rv_m2, monkeypatch):
    asked = []
    monkeypatch.setattr(thin, "poses", lambda *_: asked.append("thin"))
    monkeypatch.setattr(lanes, "poses", lambda *_: asked.append("lanes"))
    monkeypatch.setattr(compiled, "run", lambda *_: asked.append("compiled"))

    def engine(rows, numba=True):
        monkeypatch.setattr(compiled, "installed", lambda: numba)
        kin.tool_poses(rv_m2, np.zeros((rows, 5)))
        return asked.pop()

    few, many = settings.FEW, settings.MANY
    assert [engine(rows) for rows in (1, few, few + 1, many - 1, many)] == ["thin"] * 2 + ["lanes"] * 2 + ["compiled"]
    assert engine(many, numba=False) == "lanes"
    monkeypatch.setattr(settings, "MOST_PLACEMENTS", len(rv_m2.segments) - 1)
    assert engine(1) == "lanes"


def test_chunks_do_not_show(rv_m2, configurations, monkeypatch):
    q, rng = configurations(rv_m2, 1000), np.random.default_rng(3)
    moved = kin.Displacement(joint=rng.normal(size=(1000, 5)), base=rng.normal(size=6), tool=rng.normal(size=(1000, 6)))

    def everything():
        frames = kin.chain_frames(rv_m2, q, moved)
        return *frames, kin.frame_jacobians(rv_m2, q, frames=frames), kin.placement_sensitivities(rv_m2, q)

    at_once = everything()
    monkeypatch.setattr(settings, "CHUNK", 97)
    for whole, pieces in zip(at_once, everything(), strict=True):
        np.testing.assert_allclose(pieces, whole, rtol=0.0, atol=1e-14)


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


def test_what_is_kept_between_calls_does_not_show(rv_m2, configurations):
    q, other = configurations(rv_m2, 20), (0.3, 0.2, 0.1)
    before = kin.frame_jacobians(rv_m2, q), kin.placement_sensitivities(rv_m2, q), kin.tool_poses(rv_m2, q)
    copies = [array.copy() for array in before]
    kin.frame_jacobians(rv_m2, q, point=other)
    kin.placement_sensitivities(rv_m2, q, point=other)
    kin.gravity_torques(rv_m2, q, payload=2.0, payload_com=other)
    kin.tool_poses(rv_m2, q[1:])
    after = kin.frame_jacobians(rv_m2, q), kin.placement_sensitivities(rv_m2, q), kin.tool_poses(rv_m2, q)
    for old, copy, new in zip(before, copies, after, strict=True):
        np.testing.assert_array_equal(new, copy)
        np.testing.assert_array_equal(old, copy)
    # robots of one chain share the model; gravity is theirs
    down = kin.gravity_torques(rv_m2, q)
    assert np.all(kin.gravity_torques(replace(rv_m2, gravity=np.zeros(3)), q) == 0.0)
    on_the_wall = replace(rv_m2, gravity=np.array([9.81, 0.0, 0.0]))
    assert np.abs(kin.gravity_torques(on_the_wall, q) - down).max() > 1.0
    np.testing.assert_array_equal(kin.gravity_torques(rv_m2, q), down)


def test_threads_do_not_disturb_each_other(awkward, configurations):
    q = [configurations(awkward, rows, seed=rows) for rows in (40, 50, 90, 100)]  # of two engines
    expected, wrong = [reference.frame_jacobians(awkward, rows) for rows in q], []

    def work(rows, right):
        for _ in range(50):
            wrong.append(np.abs(kin.frame_jacobians(awkward, rows) - right).max())

    threads = [threading.Thread(target=work, args=pair) for pair in zip(q, expected, strict=True)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(wrong) == 200
    assert max(wrong) < 1e-12


def test_four_attributes_of_a_robot_suffice(rv_m2):
    bare = SimpleNamespace(name=rv_m2.name, n=rv_m2.n, segments=rv_m2.segments, chain=rv_m2.chain)
    q = np.random.default_rng(5).uniform(-1.0, 1.0, (3, rv_m2.n))
    moved = kin.Displacement(joint=np.full(rv_m2.n, 1e-3), segment=np.full((len(rv_m2.segments), 6), 1e-3))
    np.testing.assert_array_equal(kin.tool_poses(bare, q, moved), kin.tool_poses(rv_m2, q, moved))
    for function in (kin.frame_jacobians, kin.placement_sensitivities):
        np.testing.assert_array_equal(function(bare, q), function(rv_m2, q))


def test_one_configuration_is_one_row_and_none_gives_none(rv_m2):
    q = np.array([0.1, 0.2, -0.3, 0.4, 0.5])
    np.testing.assert_array_equal(kin.tool_poses(rv_m2, q), kin.tool_poses(rv_m2, q[None]))
    for call, shape in CALLS.values():
        assert call(rv_m2, np.empty((0, 5))).shape == (0, *shape(rv_m2))
    assert kin.gravity_torques(rv_m2, np.empty((0, 5)), payload=np.empty(0)).shape == (0, 5)


def frozen(shape):
    array = np.empty(shape)
    array.setflags(write=False)
    return array


ZEROS = np.zeros((3, 5))
MISFITS = [
    (lambda r: kin.tool_poses(r, np.zeros((3, 4))), r"\(3, 4\) do not fit robot 'rv_m2' of 5 joints"),
    (lambda r: kin.tool_poses(r, np.zeros((2, 3, 5))), r"expected \(N, 5\)"),
    (
        lambda r: kin.tool_poses(r, ZEROS, kin.Displacement(base=np.zeros((2, 6)))),
        r"displacement 'base' of shape \(2, 6",
    ),
    (lambda r: kin.tool_poses(r, ZEROS, kin.Displacement(tool=np.zeros(7))), r"'tool' .*\(7,\) .*expected \(6,\) or"),
    (lambda r: kin.frame_jacobians(r, ZEROS, point=np.zeros(2)), r"a point of shape \(2,\)"),
    (lambda r: kin.gravity_torques(r, ZEROS, payload=np.zeros(2)), r"a payload of shape \(2,\)"),
    (lambda r: kin.gravity_torques(r, ZEROS, payload_com=[0, 0]), r"payload_com of shape \(2,\)"),
    (
        lambda r: kin.tool_poses(r, ZEROS, out=np.empty((3, 4))),
        r"out of shape \(3, 4\) .* float64 of shape \(3, 4, 4\)",
    ),
    (lambda r: kin.tool_poses(r, ZEROS, out=np.empty((3, 4, 4), dtype=np.float32)), "type float32"),
    (lambda r: kin.tool_poses(r, ZEROS, out=[[0.0]]), "type list"),
    (lambda r: kin.tool_poses(r, ZEROS, out=frozen((3, 4, 4))), "must not be written to"),
]


@pytest.mark.parametrize(("call", "words"), MISFITS)
def test_arrays_that_do_not_fit_are_said(rv_m2, call, words):
    with pytest.raises(RobotError, match=words):
        call(rv_m2)


SCRIPT = """
import numpy as np
import numba
from numba.core import caching
{spoil}
from thermal_robot import load_robot
from thermal_robot.kinematics import settings, tool_poses
robot = load_robot("builtin:rv_m2", "tool0")
q = np.random.default_rng(0).uniform(-2, 2, (3000, 5))
numpys, settings.MANY = tool_poses(robot, q), 1
assert np.abs(tool_poses(robot, q) - numpys).max() < 1e-13
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
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    subprocess.run([sys.executable, "-c", SCRIPT.format(spoil=spoil)], check=True, env=environment)
    assert not [path for path in tmp_path.rglob("*") if path.suffix == ".nbc"]


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
robot = load_robot("builtin:rv_m2", "tool0")
tool_poses(robot, np.zeros((1000, 5)))
assert "numba" not in sys.modules  # it is not loaded before it pays
with warnings.catch_warnings(record=True) as told:
    warnings.simplefilter("always")
    poses = tool_poses(robot, np.zeros((settings.MANY, 5)))
assert np.ptp(poses, axis=0).max() == 0.0
print(*[warning.message for warning in told])
"""


@pytest.mark.parametrize(
    ("block", "told"),
    [
        ("if name.split('.')[0] == 'numba': return None", ()),
        pytest.param(
            "if name == 'llvmlite': raise ImportError('no llvm')",
            ("cannot be loaded (no llvm)", "thermal-robot[fast]"),
            marks=needs_numba,
        ),
    ],
    ids=["none", "a broken one"],
)
def test_all_works_without_numba_and_a_broken_one_is_said(block, told):
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT.format(block=block)], check=True, capture_output=True, text=True
    )
    assert all(words in done.stdout for words in told)
    assert bool(done.stdout.strip()) == bool(told)
